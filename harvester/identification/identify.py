"""The parameters of a device from measurements of one or several kinds, fitted jointly, with 95 % intervals.

Where the data do not determine a parameter the answer says so, and what would: an impedance alone gives theta^2/M.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, names_arguments, unknown
from harvester.identification import bounce, quantities
from harvester.identification.answer import IdentificationResult, Parameter
from harvester.identification.fit import DeviceFit, channels, fit
from harvester.identification.intervals import ProfileInterval, Profiles
from harvester.identification.measurement import SHORT, Decay, Impedance, Measurement, thinned
from harvester.identification.read import read_files
from harvester.identification.start import chosen, starts
from harvester.scene.keys import full_key, read_value

NOT_DETERMINED = 0.7  # half-width of an interval of a logarithm: a factor of two
NOT_KNOWN = 0.5  # half-width of a restitution coefficient or a loss
STRANGE = 0.05  # residual from which on the model is doubted
KNOWN = ("oscillator.mass", "oscillator.damping_ratio", "piezo.capacitance", "stop.restitution", "stop.gap")


@names_arguments
def identify(files: str | Sequence[str], known: Mapping[str, float | str] | None = None) -> IdentificationResult:
    """Fit one mode with its piezo to measurements in CSV files, each with its state behind an @ where it needs one.

    ``known`` are scene keys that are not fitted, such as ``{"mass": "40 g"}``.

    >>> import harvester as hv
    >>> hv.identify("nowhere.csv")
    Traceback (most recent call last):
    harvester.errors.InputError: FILE must be a readable file, but 'nowhere.csv' is not: No such file or directory

    Raises
    ------
    InputError
        for files that cannot be read, hold no measurement or too few points, and for keys that cannot be known.
    """
    names = (files,) if isinstance(files, str) else tuple(str(one) for one in files)
    return identified(read_files(names), known_values(known or {}))


def known_values(known: Mapping[str, float | str]) -> dict[str, float]:
    """The parameters that are known, by their names in the fit, from scene keys."""
    found = {}
    for key, text in known.items():
        whole = full_key(key)
        if whole not in KNOWN:
            raise unknown("key of `known`", key, KNOWN)
        value = read_value(whole, text) if isinstance(text, str) else float(text)
        if whole == "oscillator.damping_ratio":
            if not value > 0.0:
                raise invalid("oscillator.damping_ratio", "be above 0 where it is known", value)
            found["quality"] = 0.5 / value
        else:
            found[whole.partition(".")[2]] = value
    return found


def identified(measurements: Sequence[Measurement], known: dict[str, float] | None = None) -> IdentificationResult:
    """Fit measurements that are read; raises as `identify`."""
    known, notes = dict(known or {}), []
    measurements, alone = _alone(list(measurements))
    measurements = [_from_first_flight(one) for one in measurements]
    met = [one for one in measurements if isinstance(one, Decay) and one.of == "displacement"]
    bouncing = any(bounce.meets_stop(one.t, one.y) for one in met)
    best = _fit(measurements, known, bouncing)
    if bouncing:
        notes.append("note: the ring-down meets a stop: fitted as flights and impacts in short circuit")
    if _rms(best) > STRANGE:
        notes.append(
            f"warning: the fit is off by {100 * _rms(best):.2g} % rms: the device is not one linear mode there, "
            "or a load or unit is not as stated; the intervals hold only the scatter"
        )
    if alone:
        notes.append(
            f"note: one ring-down in {alone} gives the frequency and quality there; those in short circuit and the "
            "coupling take one in another state (FILE@short, FILE@open, FILE@470k) or an impedance"
        )
    return _answer(best, measurements, known, notes, alone)


def _from_first_flight(one: Measurement) -> Measurement:
    """A ring-down against a stop without the few samples before an impact that it may begin with."""
    if not (isinstance(one, Decay) and one.of == "displacement" and bounce.meets_stop(one.t, one.y)):
        return one
    first = bounce.first_sample(one.t, one.y)
    return dataclasses.replace(one, t=one.t[first:], y=one.y[first:])


def _alone(measurements: list[Measurement]) -> tuple[list[Measurement], str]:
    """Ring-downs in one state tell no coupling: they are fitted as if in short circuit; the state in words."""
    loads = {one.load for one in measurements if isinstance(one, Decay)}
    if len(loads) == 1 and loads != {SHORT} and all(isinstance(one, Decay) for one in measurements):
        state = measurements[0].state
        return [dataclasses.replace(one, load=SHORT) for one in measurements if isinstance(one, Decay)], state
    return measurements, ""


def _fit(measurements: list[Measurement], known: dict[str, float], bouncing: bool) -> DeviceFit:
    if bouncing and sum(isinstance(one, Decay) and one.of == "displacement" for one in measurements) > 1:
        raise InputError("one FILE alone must be a ring-down against a stop, but several displacements are given")
    names = chosen(measurements, known, bouncing)
    if not names:
        raise InputError("FILE must measure something that `known` leaves open, but nothing is left to fit")
    few = channels([thinned(one, 50) for one in measurements], bouncing)
    begin = starts(measurements, names, known, bouncing)
    return fit(names, begin, known, channels(measurements, bouncing), few)


def _relative(best: DeviceFit, channel: object, kept: Floats) -> float:
    """The rms residual of a channel: of a ring-down over its size, else as it is."""
    for one, noise in zip(best.channels, best.noise, strict=True):
        if one is channel:
            return noise / max(float(np.std(one.values)), 1e-300) if one.name == "ring-down" else noise
    return 0.0


def _rms(best: DeviceFit) -> float:
    """The residual of the whole fit, over all points that are kept."""
    total, count = 0.0, 0.0
    for channel, kept in zip(best.channels, best.kept, strict=True):
        total += float(kept.sum()) * _relative(best, channel, kept) ** 2
        count += float(kept.sum())
    return math.sqrt(total / max(count, 1.0))


def _answer(
    best: DeviceFit, measurements: Sequence[Measurement], known: dict[str, float], notes: list[str], alone: str
) -> IdentificationResult:
    profiles = Profiles(best)
    found, missing = [], []
    for one in quantities.answered(set(best.names) | set(known)):
        if one.key == "oscillator.mass" and "mass" in known:
            found.append(Parameter(one.key, known["mass"], known["mass"], known["mass"], one.unit, "known"))
            continue
        interval = profiles.interval(one.of, one.above_0)
        if _open(interval, one.above_0):
            missing.append((one.key, _remedy(one.key)))
            continue
        what = f"resonance in {alone}" if alone and one.key == "short_circuit_frequency" else one.what
        what = f"in {alone}" if alone and one.key in ("quality_factor", "oscillator.damping_ratio") else what
        key = one.key if not (alone and one.key == "short_circuit_frequency") else "resonance_frequency"
        found.append(Parameter(key, interval.value, interval.low, interval.high, one.unit, what))
    keys = {p.key for p in found} | {key for key, _ in missing}
    needed = ("oscillator.mass", "oscillator.stiffness", "piezo.coupling", "piezo.capacitance")
    missing += [(key, _remedy(key)) for key in needed if key not in keys]
    if any(isinstance(one, Impedance) and one.clamped for one in measurements) and len(measurements) == 1:
        missing.insert(0, ("short_circuit_frequency", "a clamped impedance has no resonance: measure it free too"))
    if alone:
        found = [dataclasses.replace(p, key=p.key.removeprefix("oscillator.")) for p in found]
    return IdentificationResult(
        tuple(found),
        tuple(missing),
        _rms(best),
        best.names,
        profiles.correlations(),
        sum(len(c.x) for c in best.channels),
        best.left_out,
        tuple(notes),
        best,
    )


def _open(interval: ProfileInterval, above_0: bool) -> bool:
    """Whether an interval is so wide that the number is not determined."""
    half = 0.5 * (interval.high - interval.low)
    if above_0:
        return not 0.5 * math.log(interval.high / interval.low) < NOT_DETERMINED if interval.low > 0.0 else True
    return not half < NOT_KNOWN


def _remedy(key: str) -> str:
    """What would determine a key."""
    if key in ("oscillator.mass", "oscillator.stiffness", "piezo.coupling"):
        return f"these data do not tell the mass: {quantities.MASS_REMEDY}"
    if key == "piezo.capacitance":
        return "measure an impedance, or responses over two loads or more about 1/(2 pi f C)"
    return "these data leave it open: measure in another electrical state too (another load, short, open)"
