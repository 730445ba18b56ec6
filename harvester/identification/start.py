"""Which parameters measurements may determine, and values to begin their fit from."""

import dataclasses
import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, shown
from harvester.identification import bounce
from harvester.identification.fit import device
from harvester.identification.measurement import (
    OPEN,
    SHORT,
    BaseResponse,
    Decay,
    Impedance,
    Measurement,
)
from harvester.identification.models import Device, base_response, impedance

QUALITIES = (6.0, 20.0, 60.0, 200.0, 700.0)
USUAL_LOSS = 0.01  # to begin with, if no phase is known
BETAS = (0.003, 0.03, 0.2, 0.8)
SURELY = 0.5  # of `_turning`: what neither noise nor a weak resonance has
# parameters that only a ring-down against a stop has
BOUNCE = ("restitution", "gap", "x0", "v0", "zero")


def chosen(
    measurements: Sequence[Measurement], known: dict[str, float], bouncing: bool
) -> tuple[str, ...]:
    """The names of the parameters to fit; what is known is not among them."""
    linear = [data for data in measurements if not meets(data, bouncing)]
    impedances = [isinstance(data, Impedance) for data in measurements]
    impedance = any(impedances)
    coupled = any(map(_couples, linear))
    moving = coupled or not all(impedances)
    capacitance = impedance or (coupled and any(map(_has_resistor, measurements)))
    mass_gives_psi = "mass" in known and (capacitance or "capacitance" in known)  # psi = theta/C
    determined = {
        ("frequency", "quality"): moving,
        ("beta",): coupled,
        ("capacitance",): capacitance,
        ("loss",): impedance,
        ("psi",): any(map(_is_voltage_per_g, measurements)) and not mass_gives_psi,
        BOUNCE: bouncing,
    }
    return tuple(
        name for names, there in determined.items() if there for name in names if name not in known
    )


def _is_voltage_per_g(data: Measurement) -> bool:
    return isinstance(data, BaseResponse) and data.of == "voltage"


def _has_resistor(data: Measurement) -> bool:
    return not isinstance(data, Impedance) and data.load not in (SHORT, OPEN)


def _couples(data: Measurement) -> bool:
    """Whether the mass moves and the piezo has a voltage."""
    return not data.clamped if isinstance(data, Impedance) else data.load != SHORT


def meets(data: Measurement, bouncing: bool) -> bool:
    """Whether a measurement is the ring-down that meets the stop, of which ``bouncing`` states that there is one."""
    return bouncing and isinstance(data, Decay) and data.of == "displacement"


def starts(
    measurements: Sequence[Measurement],
    names: tuple[str, ...],
    known: dict[str, float],
    bouncing: bool,
    others: dict[str, float],
) -> list[dict[str, float]]:
    """Values to begin from: all combinations of what the curves' peaks, ratios and levels suggest.

    ``others`` are the parameters that the measurements next to a ring-down against a stop tell by
    themselves.
    """
    if bouncing:
        met = next(
            data for data in measurements if isinstance(data, Decay) and meets(data, bouncing)
        )
        flights = bounce.start(met.t, met.y, others.get("frequency"), others.get("quality"))
        of_bounce = {
            field.name: getattr(flights, field.name) for field in dataclasses.fields(flights)
        }
        if set(names) <= {*of_bounce, *others}:
            return [{name: {**of_bounce, **others}[name] for name in names}]
        linear = [data for data in measurements if not meets(data, bouncing)]
        return [
            {name: {**values, **of_bounce}[name] for name in names}
            for values in _combined(linear, names, known)
        ]
    return [
        {name: values[name] for name in names} for values in _combined(measurements, names, known)
    ]


def _combined(
    measurements: Sequence[Measurement], names: tuple[str, ...], known: dict[str, float]
) -> Iterator[dict[str, float]]:
    """The combinations for measurements without a stop."""
    resonances = sorted({f for data in measurements for f in _peaks(data)}) or [1.0]
    peaks = sorted({resonances[0], resonances[len(resonances) // 2], resonances[-1]})
    qualities = QUALITIES if "quality" in names else (known.get("quality", 100.0),)
    loss = _loss(measurements) if "loss" in names else known.get("loss", 0.0)
    for f, q, beta in itertools.product(
        peaks, qualities, _betas(peaks) if "beta" in names else [0.0]
    ):
        for f0 in {f, f / math.sqrt(1.0 + beta)}:
            for c in (
                _capacitances(measurements, f0)
                if "capacitance" in names
                else [known.get("capacitance", 1.0)]
            ):
                values = {
                    "frequency": f0,
                    "quality": q,
                    "beta": beta,
                    "capacitance": c,
                    "loss": loss,
                }
                values |= {name: v for name, v in known.items() if name != "mass"}
                yield values | {"psi": _psi(measurements, device(values))}


def _betas(peaks: Sequence[float]) -> list[float]:
    """Couplings theta^2/(K C): usual ones, and those that two peaks as resonances in short and open circuit have."""
    ratios = ((b / a) ** 2 - 1.0 for a, b in itertools.combinations(peaks, 2))
    return sorted({*BETAS, *(round(beta, 6) for beta in ratios if 1e-4 < beta < 5.0)})


def _peaks(data: Measurement) -> list[float]:
    """Frequencies at which a curve has its resonances."""
    if isinstance(data, Impedance):
        if data.clamped:
            return []
        above = data.z.real * data.f  # without the slope of a lossy capacitance
        return [
            float(data.f[np.argmax((1.0 / data.z).real / data.f)]),
            float(data.f[np.argmax(above)]),
        ]
    if isinstance(data, BaseResponse):
        return [float(data.f[np.argmax(data.size)])]
    return [_strongest(data.t, data.y)]


def second_starts(
    impedances: Sequence[Impedance], single: dict[str, float]
) -> list[dict[str, float]]:
    """Values to begin the fit of two modes from, with the ``single`` mode's fit: pairs of its frequency and of peaks.

    Peaks are those of the conductance over the frequency, and of what the one mode leaves of it.
    """
    resonances = {single["frequency"]}
    for file in impedances:
        conductance = (1.0 / file.z).real / file.f
        for curve in (
            conductance,
            conductance - (1.0 / impedance(device(single), file.f, False)).real / file.f,
        ):
            smooth = np.convolve(curve, np.full(3, 1.0 / 3.0), "same")
            tops = np.flatnonzero((smooth[1:-1] > smooth[:-2]) & (smooth[1:-1] >= smooth[2:])) + 1
            resonances |= {float(file.f[at]) for at in tops[np.argsort(-smooth[tops])][:3]}
    begins = []
    for low, high in itertools.combinations(sorted(resonances), 2):
        for first, second in itertools.product(QUALITIES[1:4], repeat=2):
            for beta, share in itertools.product((single["beta"], 0.03, 0.2), (0.03, 0.3, 1.0)):
                new = {"frequency": low, "quality": first, "beta": beta}
                new |= {"frequency2": high, "quality2": second, "beta2": share * beta}
                begins.append({**single, **new})
    return begins


def _strongest(t: Floats, y: Floats) -> float:
    """The frequency of a ring-down: the highest line of its spectrum, between lines by interpolation."""
    count = min(max(len(t), 256), 65536)
    even = np.linspace(t[0], t[-1], count)
    signal = np.interp(even, t, y - y.mean()) * np.hanning(count)
    power = np.abs(np.fft.rfft(signal, 4 * count))
    power[:4] = 0.0
    return float(np.argmax(power) / (4 * count * (even[1] - even[0])))


def _capacitances(measurements: Sequence[Measurement], f0: float) -> list[float]:
    """Capacitances: of the impedance away from resonance, else such as loads tell apart."""
    for data in sorted(
        (m for m in measurements if isinstance(m, Impedance)), key=lambda m: not m.clamped
    ):
        if not data.phase_known:
            return [float(np.median(1.0 / (2.0 * math.pi * data.f * np.abs(data.z))))]
        admittance = 1.0 / data.z
        apparent = admittance.imag / (2.0 * math.pi * data.f)
        middle = float(np.median(apparent))
        turning = _turning(admittance)
        if (
            not middle > 0.0 and turning < 0.0 and (apparent > 0.0).any()
        ):  # mostly between two far resonances
            middle = float(np.median(apparent[apparent > 0.0]))
        if not middle > 0.0 or turning > SURELY:
            raise InputError(
                f"FILE {shown(data.name)} must have a reactance, or phase, that is negative away from resonance, as a "
                "capacitance has, but at most frequencies it is positive: turn its sign round"
            )
        return [middle]
    loads = [
        m.load for m in measurements if not isinstance(m, Impedance) and m.load not in (SHORT, OPEN)
    ]
    middle = 1.0 / (2.0 * math.pi * f0 * math.exp(float(np.mean(np.log(loads)))))
    return [middle * factor for factor in (0.03, 0.2, 1.0, 5.0, 30.0)]


def _turning(admittance: Complexes) -> float:
    """How an admittance, shape (n,), goes round as the frequency rises: from -1, clockwise, to 1.

    That of a resonance goes round clockwise in the plane of conductance and susceptance, whatever
    it is next to, and with a susceptance of the wrong sign the other way: the area that it
    encloses, over all that it is the sum of.
    """
    areas = (admittance.conj() * np.roll(admittance, -1)).imag
    return float(areas.sum() / max(np.abs(areas).sum(), 1e-300))


def _loss(measurements: Sequence[Measurement]) -> float:
    """The dielectric loss: the remainder of the conductance if it is least."""
    losses = [
        float(np.quantile((1.0 / m.z).real / np.abs((1.0 / m.z).imag), 0.1))
        for m in measurements
        if isinstance(m, Impedance) and m.phase_known
    ]
    return min(max(min(losses), 1e-4), 0.2) if losses else USUAL_LOSS


def _psi(measurements: Sequence[Measurement], of: Device) -> float:
    """The voltage a metre that brings the responses' level to what was measured."""
    logs = [
        np.median(np.log(m.size) - np.log(np.abs(base_response(of, m.f, m.load, m.of))))
        for m in measurements
        if isinstance(m, BaseResponse) and m.of == "voltage" and m.load != SHORT
    ]
    return math.exp(float(np.mean(logs))) if logs else 1.0
