"""The type of an excitation profile, and those that test standards prescribe as densities, each with its document.

A curve is here only if its document is public and its points give the rms acceleration that the
document states next to them, which a test computes.  Between the points it is straight in log-log,
and 0 outside of them.
"""

from dataclasses import dataclass

import numpy as np

from harvester.records.records import TabulatedDensity


@dataclass(frozen=True)
class Profile:
    """An excitation by name: ``what`` in a line, the ``source`` of its numbers, and its keys of [excitation].

    Those of ``needs`` must be given, those of ``takes`` may be; all others must be left out.
    ``random`` profiles are noise with that PSD, the others a record that repeats itself.
    """

    name: str
    what: str
    source: str
    needs: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    random: bool = False


G = 9.80665  # m/s^2


@dataclass(frozen=True)
class Curve(Profile):
    """A one-sided density through ``points`` of (Hz, g^2/Hz), and the rms (g) that its document states."""

    points: tuple[tuple[float, float], ...] = ()
    rms: float = 0.0


def _curve(name: str, what: str, source: str, rms: float, *points: tuple[float, float]) -> Curve:
    return Curve(
        name,
        f"{what}, {rms:g} g rms",
        source,
        takes=("level",),
        random=True,
        points=points,
        rms=rms,
    )


_TRUCK = "MIL-STD-810F and G, method 514, annex C, figure 1"
_GEVS = "NASA GSFC-STD-7000, generalized random vibration, components of 22.7 kg or less"
CURVES = {
    curve.name: curve
    for curve in (
        _curve(
            "mil-std-810-minimum-integrity",
            "general minimum integrity test, 20 to 2000 Hz",
            "MIL-STD-810F and G, method 514, category 24",
            7.7,
            *((20.0, 0.04), (1000.0, 0.04), (2000.0, 0.01)),
        ),
        _curve(
            "mil-std-810-truck-vertical",
            "cargo on a truck, US highways, vertical, 10 to 500 Hz",
            _TRUCK,
            1.04,
            *((10.0, 0.015), (40.0, 0.015), (500.0, 0.00015)),
        ),
        _curve(
            "mil-std-810-truck-transverse",
            "cargo on a truck, US highways, transverse, 10 to 500 Hz",
            _TRUCK,
            0.204,
            *((10.0, 0.00013), (20.0, 0.00065), (30.0, 0.00065), (78.0, 0.00002)),
            *((79.0, 0.00019), (120.0, 0.00019), (500.0, 0.00001)),
        ),
        _curve(
            "mil-std-810-truck-longitudinal",
            "cargo on a truck, US highways, longitudinal, 10 to 500 Hz",
            _TRUCK,
            0.74,
            *((10.0, 0.0065), (20.0, 0.0065), (120.0, 0.0002), (121.0, 0.003)),
            *((200.0, 0.003), (240.0, 0.0015), (340.0, 0.00003), (500.0, 0.00015)),
        ),
        _curve(
            "gevs-qualification",
            "spacecraft components at launch, qualification, 20 to 2000 Hz",
            _GEVS,
            14.1,
            *((20.0, 0.026), (50.0, 0.16), (800.0, 0.16), (2000.0, 0.026)),
        ),
        _curve(
            "gevs-acceptance",
            "spacecraft components at launch, acceptance, 20 to 2000 Hz",
            _GEVS,
            10.0,
            *((20.0, 0.013), (50.0, 0.08), (800.0, 0.08), (2000.0, 0.013)),
        ),
        _curve(
            "navmat-p-9492",
            "screening of electronics for faulty workmanship, 20 to 2000 Hz",
            "NAVMAT P-9492, Navy manufacturing screening program, 1979",
            6.06,
            *((20.0, 0.01), (80.0, 0.04), (350.0, 0.04), (2000.0, 0.007)),
        ),
    )
}


def density(name: str, level: float) -> TabulatedDensity:
    """The density of a curve in SI units, with its accelerations times ``level``."""
    f, g = np.array(CURVES[name].points).T
    return TabulatedDensity(f, g * (level * G) ** 2)
