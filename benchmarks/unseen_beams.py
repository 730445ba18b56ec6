"""The predictions of benchmarks/unseen.py that need a beam of steps: a magnifier (D3), and eight beams of film (D4)."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Floats

TURN = 2.0 * math.pi


def stepped(
    lengths: Floats, bending: Floats, mass: Floats, tip: float
) -> tuple[float, float, Callable[[float], float]]:
    """First frequency (rad/s), sigma, and the slope along a cantilever of steps, for a mode of modal mass 1.

    ``bending`` (N m^2) and ``mass`` (kg/m) of each element; cubic elements, which are exact for a tip load.
    """
    from scipy.linalg import eigh

    count = len(lengths)
    stiffness, inertia = (np.zeros((2 * count + 2, 2 * count + 2)) for _ in range(2))
    moved = np.zeros(2 * count + 2)
    for at, (h, ei, m) in enumerate(zip(lengths, bending, mass, strict=True)):
        here = slice(2 * at, 2 * at + 4)
        stiffness[here, here] += ei / h**3 * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
        )  # fmt: skip
        inertia[here, here] += m * h / 420.0 * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
             [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
        )  # fmt: skip
    inertia[-2, -2] += tip
    moved[0::2] = 1.0
    w2, shapes = eigh(stiffness[2:, 2:], inertia[2:, 2:], subset_by_index=[0, 0])
    shape = np.concatenate([[0.0, 0.0], shapes[:, 0]])
    shape *= np.sign(shape[-2])
    sigma = float((inertia @ moved) @ shape)
    places = np.concatenate([[0.0], np.cumsum(lengths)])
    return math.sqrt(float(w2[0])), sigma, lambda x: float(np.interp(x, places, shape[1::2]))


@dataclass(frozen=True)
class Magnifier:
    """A beam on a mass and a spring of 5495 N/m, whose foot moves by 0.05 mm; SI units, ``w`` the frequencies."""

    w: Floats
    mass: float  # of the beam's mode
    coupling: float
    capacitance: float
    resonance: float  # of the beam (rad/s)
    ratio: float  # damping ratio of the beam
    primary_ratio: float
    heavy: float  # mass of primary and beam
    model: float  # factor of the voltage

    def voltages(self, ohm: float, magnified: bool) -> Floats:
        """Voltage amplitude over the frequencies, for the beam on the primary mass, or for the beam alone."""
        w, wb, base = self.w, self.resonance, 0.05e-3
        electric = (
            1j * w * self.coupling / (1.0 / ohm + 1j * w * self.capacitance)
        )  # V per displacement
        beam = self.mass * (wb**2 - w**2 + 2j * self.ratio * wb * w) + self.coupling * electric
        over = self.mass * w**2 / beam  # relative displacement of the beam over that of its base
        if not magnified:
            return np.asarray(np.abs(electric * over * base) * self.model)
        support = 5495.0 + 1j * w * 2.0 * self.primary_ratio * math.sqrt(5495.0 * 0.1923)
        # heavy X1'' + m q'' = -support (X1 - y) and m (q'' + X1'') + ... = 0
        primary = support * base / (support - w**2 * (self.heavy + self.mass * over))
        return np.asarray(np.abs(electric * over * primary) * self.model)


def d3(drawn: Any, row: Any, composite_e31: Any, sigma: Mapping[str, float]) -> Iterator[Any]:
    """A beam on a magnifier, doi 10.1515/teme-2020-0030.

    The beam's frequency is the measured one.  Open: its damping, the patch's capacitance (25 nF as in D2), and how much
    of the beam's mass the 0.1923 kg contain.  The two masses are solved as they are, since their damping has no modes.
    """
    e31, width = composite_e31(15.857 * 0.210)
    of = drawn(
        {"coupling": width, "capacitance": sigma["capacitance, data sheet"], "damping": sigma["damping, unknown"],
         "frequency": sigma["frequency, measured"], "primary": 0.15}
    )  # fmt: skip
    count, length, b, hs, hp = 40, 109.5e-3, 17.5e-3, 0.5e-3, 0.3e-3
    lengths = np.full(count, length / count)
    on = np.cumsum(lengths) <= 37e-3
    middle = 0.5 * (hs + hp)
    axis = 15.857e9 * hp * middle / (110e9 * hs + 15.857e9 * hp)
    bare = 110e9 * b * hs**3 / 12.0
    both = 110e9 * b * (hs**3 / 12.0 + hs * axis**2) + 15.857e9 * 18e-3 * (
        hp**3 / 12.0 + hp * (middle - axis) ** 2
    )
    mass = 8906.0 * b * hs + np.where(on, 5440.0 * 18e-3 * hp, 0.0)
    _, beam_sigma, slope = stepped(lengths, np.where(on, both, bare), mass, 0.58e-3)
    theta = e31 * 14e-3 * (middle - axis) * (slope(32.5e-3) - slope(4.5e-3)) * beam_sigma
    whole = float(mass @ lengths) + 0.58e-3
    f = np.arange(20.0, 36.0, 0.02)
    w = TURN * f
    found: dict[str, list[float]] = {name: [] for name in NAMES}
    for at in range(len(of["model"])):
        m, c = beam_sigma**2, 25e-9 * of["capacitance"][at]
        coupling, wb = theta * of["coupling"][at], TURN * 27.95 * of["frequency"][at]
        zb, zp, model = 0.010 * of["damping"][at], 0.026 * of["primary"][at], of["model"][at]
        heavy = 0.1923 + whole * of["uniform"][at]

        voltages = Magnifier(w, m, coupling, c, wb, zb, zp, heavy, model).voltages
        alone, powers = voltages(1e9, False), voltages(230e3, False) ** 2 / 2.0 / 230e3
        found["D3.alone_v_open"].append(float(alone.max()))
        found["D3.alone_p_230k"].append(1e3 * float(powers.max()))
        v = voltages(1e9, True)
        valley = 27.4
        left, right = f < valley, f >= valley
        i, j = int(np.argmax(np.where(left, v, 0.0))), int(np.argmax(np.where(right, v, 0.0)))
        found["D3.f1"].append(float(f[i]))
        found["D3.f2"].append(float(f[j]))
        found["D3.v1"].append(float(v[i]))
        found["D3.v2"].append(float(v[j]))
        found["D3.p1_210k"].append(
            1e3 * float((voltages(210e3, True)[left] ** 2).max()) / 2.0 / 210e3
        )
        found["D3.p2_252k"].append(
            1e3 * float((voltages(252e3, True)[right] ** 2).max()) / 2.0 / 252e3
        )
        between = voltages(230e3, True)[i : j + 1] ** 2 / 2.0 / 230e3
        found["D3.p_antiresonance"].append(1e3 * float(between.min()))
    for name, unit in NAMES.items():
        spread = np.exp(0.02 * np.linspace(-1.0, 1.0, len(found[name]))) if unit == "Hz" else 1.0
        yield row(name, unit, np.array(found[name]) * spread)


NAMES = {
    "D3.alone_v_open": "V", "D3.alone_p_230k": "mW", "D3.f1": "Hz", "D3.f2": "Hz", "D3.v1": "V", "D3.v2": "V",
    "D3.p1_210k": "mW", "D3.p2_252k": "mW", "D3.p_antiresonance": "mW",
}  # fmt: skip


def d4(drawn: Any, row: Any, sigma: Mapping[str, float]) -> Iterator[Any]:
    """Eight beams of steel, tape and PVDF on both sides, doi 10.3390/en14010211.

    The modulus of the tape is open: in its shear the film keeps 0.3 to 1 of its share of the stiffness, and a strip as
    wide as it is long is a plate, stiffer by up to 1/(1 - nu^2).  At 0.6 g air lowers the peak by about 1 %.
    """
    of = drawn({"frequency": sigma["frequency, bonded geometry"]})
    kept = 0.3 + 0.7 * of["uniform"]
    steel, film = (
        180e9 * 0.1e-3**3 / 12.0,
        2.0 * 2.8e9 * (0.064e-3**3 / 12.0 + 0.064e-3 * 0.182e-3**2),
    )
    mass = 7900.0 * 0.1e-3 + 2.0 * 1100.0 * 0.1e-3 + 2.0 * 2280.0 * 0.064e-3
    for at in range(8):
        length, wide = (78e-3, 155e-3)[at // 4], 22e-3 * (at % 4 + 1)
        plate = 1.0 + 0.10 * min(wide / length, 1.0)
        f = (
            1.8751**2
            / TURN
            / length**2
            * np.sqrt((steel * plate + kept * film) / mass)
            * of["frequency"]
        )
        for level, lower in ((0.2, 1.0), (0.6, 0.985)):
            yield row(f"D4.f_H{at + 1}_{level}g", "Hz", lower * f)
