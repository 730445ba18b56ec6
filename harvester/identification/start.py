"""Which parameters measurements may determine, and values to begin their fit from."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, shown
from harvester.identification import bounce
from harvester.identification.fit import device
from harvester.identification.measurement import OPEN, SHORT, BaseResponse, Decay, Impedance, Measurement
from harvester.identification.models import Device, base_response

QUALITIES = (6.0, 20.0, 60.0, 200.0, 700.0)
BETAS = (0.003, 0.03, 0.2, 0.8)


def chosen(measurements: Sequence[Measurement], known: dict[str, float], bouncing: bool) -> tuple[str, ...]:
    """The names of the parameters to fit; what is known is not among them."""
    free = [one for one in measurements if not (isinstance(one, Impedance) and one.clamped)]
    impedances = [one for one in measurements if isinstance(one, Impedance)]
    circuits = [one for one in free if isinstance(one, Impedance) or (one.load != SHORT and not _meets(one, bouncing))]
    loads = [one for one in free if not isinstance(one, Impedance) and one.load not in (SHORT, OPEN)]
    volts = any(isinstance(one, BaseResponse) and one.of == "voltage" for one in measurements)
    names = ["frequency", "quality"] if free else []
    names += ["beta"] if circuits else []
    names += ["capacitance"] if impedances or (loads and circuits) else []
    names += ["loss"] if impedances else []
    told = "capacitance" in names or "capacitance" in known  # without it a known mass gives no psi = theta/C
    names += ["psi"] if volts and not ("mass" in known and told) else []
    names += ["restitution", "gap", "x0", "v0", "zero"] if bouncing else []
    return tuple(name for name in names if name not in known)


def _meets(one: Measurement, bouncing: bool) -> bool:
    return bouncing and isinstance(one, Decay) and one.of == "displacement"


def starts(
    measurements: Sequence[Measurement], names: tuple[str, ...], known: dict[str, float], bouncing: bool
) -> list[dict[str, float]]:
    """Values to begin from: all combinations of what the curves' peaks, ratios and levels suggest."""
    met = next((one for one in measurements if isinstance(one, Decay) and _meets(one, bouncing)), None)
    flights = None if met is None else bounce.start(met.t, met.y)
    found_peaks = sorted({f for one in measurements for f in _peaks(one, bouncing)}) or [1.0]
    peaks = sorted({found_peaks[0], found_peaks[len(found_peaks) // 2], found_peaks[-1]})
    if flights is not None:
        peaks = [flights.frequency]
    ratios = {round((b / a) ** 2 - 1.0, 6) for a, b in itertools.combinations(peaks, 2)}
    betas = sorted({*BETAS, *(r for r in ratios if 1e-4 < r < 5.0)}) if "beta" in names else [known.get("beta", 0.0)]
    qualities = QUALITIES if "quality" in names else (known.get("quality", 100.0),)
    if flights is not None:
        qualities = (flights.quality,)
    losses = [_loss(measurements)] if "loss" in names else [known.get("loss", 0.0)]
    found = []
    for f, q, beta, loss in itertools.product(peaks, qualities, betas, losses):
        for f0 in {f, f / math.sqrt(1.0 + beta)} if "beta" in names else {f}:
            for c in _capacitances(measurements, f0) if "capacitance" in names else [known.get("capacitance", 1.0)]:
                values = {"frequency": f0, "quality": q, "beta": beta, "capacitance": c, "loss": loss}
                values |= {name: v for name, v in known.items() if name != "mass"}
                if "psi" in names:
                    values["psi"] = _psi(measurements, device(values))
                if flights is not None:
                    for name in ("restitution", "gap", "x0", "v0", "zero"):
                        values[name] = getattr(flights, name)
                found.append({name: values[name] for name in names})
    return found


def _peaks(one: Measurement, bouncing: bool) -> list[float]:
    """Frequencies at which a curve has its resonances."""
    if isinstance(one, Impedance):
        if one.clamped:
            return []
        above = one.z.real * one.f  # without the slope of a lossy capacitance
        return [float(one.f[np.argmax((1.0 / one.z).real / one.f)]), float(one.f[np.argmax(above)])]
    if isinstance(one, BaseResponse):
        return [float(one.f[np.argmax(one.size)])]
    return [] if _meets(one, bouncing) else [_strongest(one.t, one.y)]


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
    for one in sorted((m for m in measurements if isinstance(m, Impedance)), key=lambda m: not m.clamped):
        middle = float(np.median((1.0 / one.z).imag / (2.0 * math.pi * one.f)))
        if not middle > 0.0:
            raise InputError(
                f"FILE {shown(one.name)} must have a reactance, or phase, that is negative away from resonance, as a "
                "capacitance has, but at most frequencies it is positive: turn its sign round"
            )
        return [middle]
    loads = [m.load for m in measurements if not isinstance(m, Impedance) and m.load not in (SHORT, OPEN)]
    middle = 1.0 / (2.0 * math.pi * f0 * math.exp(float(np.mean(np.log(loads)))))
    return [middle * factor for factor in (0.03, 0.2, 1.0, 5.0, 30.0)]


def _loss(measurements: Sequence[Measurement]) -> float:
    """The dielectric loss: what is left of the conductance where it is least."""
    found = [
        float(np.quantile((1.0 / m.z).real / np.abs((1.0 / m.z).imag), 0.1))
        for m in measurements
        if isinstance(m, Impedance)
    ]
    return min(max(min(found), 1e-4), 0.2)


def _psi(measurements: Sequence[Measurement], of: Device) -> float:
    """The voltage a metre that brings the responses' level to what was measured."""
    logs = [
        np.median(np.log(m.size) - np.log(np.abs(base_response(of, m.f, m.load, m.of))))
        for m in measurements
        if isinstance(m, BaseResponse) and m.of == "voltage" and m.load != SHORT
    ]
    return math.exp(float(np.mean(logs))) if logs else 1.0
