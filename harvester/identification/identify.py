"""The parameters of a device from measurements of one or several kinds, fitted jointly, with 95 % intervals.

Where the data do not determine a parameter the answer says so, and what would: an impedance alone gives theta^2/M.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from harvester.errors import InputError, invalid, names_arguments, unknown
from harvester.identification import bounce, quantities
from harvester.identification.doubts import misfits, residual_rms
from harvester.identification.fit import DeviceFit, channels, fit
from harvester.identification.identification_result import IdentificationResult, Parameter
from harvester.identification.measurement import SHORT, Decay, Impedance, Measurement, thinned
from harvester.identification.profile_intervals import ProfileInterval, Profiles
from harvester.identification.read import read_files
from harvester.identification.start import chosen, meets, second_starts, starts
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.scene.keys import full_key, key_kind, read_value
from harvester.scene.plausibility import unusual

NOT_DETERMINED = 0.7  # half-width of an interval of a logarithm: a factor of two
NOT_KNOWN = 0.5  # half-width of a restitution coefficient or a loss
EDGE = 1e-6  # from 0 and 1 a restitution coefficient is at the boundary of the fit
MODE = {"frequency", "quality", "beta"}  # parameters of the first mode
KNOWN = ("oscillator.mass", "oscillator.damping_ratio", "piezo.capacitance", "stop.restitution", "stop.gap")


@names_arguments
def identify(files: str | Sequence[str], known: Mapping[str, float | str] | None = None) -> IdentificationResult:
    """Fit one mode with its piezo to measurements in CSV files.

    Parameters
    ----------
    files
        the path of a CSV file, or several, each with its state behind an @ where it needs one, such as
        "ringdown.csv@open".
    known
        scene keys that are not fitted, such as {"mass": "40 g"}: numbers in SI units, or texts with their unit.

    Returns
    -------
    IdentificationResult
        the device's parameters with 95 % intervals, in SI units.

    Raises
    ------
    InputError
        for files that cannot be read, hold no measurement or too few points, and for keys that cannot be known.

    >>> import harvester as hv
    >>> hv.identify("nowhere.csv")
    Traceback (most recent call last):
    harvester.errors.InputError: FILE must be a readable file, but 'nowhere.csv' is not: No such file or directory
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
    known, remarks = dict(known or {}), list[Diagnostic]()
    measurements, alone = _alone(list(measurements))
    measurements = [_from_first_flight(one) for one in measurements]
    met = [one for one in measurements if isinstance(one, Decay) and one.of == "displacement"]
    bouncing = any(bounce.meets_stop(one.t, one.y) for one in met)
    best = _fit(measurements, known, bouncing)
    if bouncing:
        remarks.append(note("ring_down_meets_a_stop"))
    left = misfits(best)
    if (second := _second_resonance(measurements, best, known, left)) is not None:
        best, left = second, [note("two_resonances")]
    remarks += left
    if alone:
        remarks.append(note("one_state_alone", state=alone))
    return _answer(best, measurements, known, remarks, alone)


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
    beside = [one for one in measurements if not meets(one, bouncing)]
    if len(measurements) - len(beside) > 1:
        raise InputError("one FILE alone must be a ring-down against a stop, but several displacements are given")
    names = chosen(measurements, known, bouncing)
    if not names:
        raise InputError("FILE must hold what `known` leaves open, but nothing is left to fit")
    others = _fit(beside, known, False).values() if bouncing and chosen(beside, known, False) else {}
    few = channels([thinned(one, 50) for one in measurements], bouncing)
    begin = starts(measurements, names, known, bouncing, others)
    return fit(names, begin, known, channels(measurements, bouncing), few)


def _second_resonance(
    measurements: Sequence[Measurement], best: DeviceFit, known: dict[str, float], left: list[Diagnostic]
) -> DeviceFit | None:
    """The fit with a second mode, where impedances leave a pattern with one, and none with two; None elsewhere."""
    impedances = [one for one in measurements if isinstance(one, Impedance)]
    free = [one for one in impedances if not one.clamped]
    if not left or not free or len(impedances) < len(measurements) or not set(best.names) >= MODE:
        return None
    names = (*best.names, "frequency2", "quality2", "beta2")
    few = channels([thinned(one, 200) for one in impedances], False)
    try:
        found = fit(names, second_starts(free, best.values()), known, channels(impedances, False), few)
    except InputError:  # too few points
        return None
    values = found.values()
    low, high = (end([end(one.f) for one in free]) for end in (np.min, np.max))
    held = low < values["frequency"] < values["frequency2"] < high
    return found if held and not misfits(found) else None


def _answer(
    best: DeviceFit, measurements: Sequence[Measurement], known: dict[str, float], remarks: list[Diagnostic], alone: str
) -> IdentificationResult:
    profiles = Profiles(best)
    found, missing = [], []
    for one in quantities.answered(set(best.names) | set(known)):
        interval = profiles.interval(one.of, one.above_0)
        if why := _why_open(one, interval, best):
            missing.append((one.key, why))
        else:
            what = "known" if interval.low == interval.high else one.what
            found.append(Parameter(one.key, interval.value, interval.low, interval.high, one.unit, what))
    keys = {p.key for p in found} | {key for key, _ in missing}
    missing += [(key, _remedy(key)) for key in quantities.NEEDED if key not in keys]
    if len(measurements) == 1 and isinstance(measurements[0], Impedance) and measurements[0].clamped:
        missing.insert(0, ("short_circuit_frequency", str(note("clamped_impedance"))))
    return IdentificationResult(
        tuple(_of_one_state(one, alone) for one in found) if alone else tuple(found),
        tuple(missing),
        residual_rms(best),
        best.names,
        profiles.correlations(),
        sum(len(c.x) for c in best.channels),
        best.left_out,
        tuple(remarks),
        best,
    )


def _of_one_state(one: Parameter, state: str) -> Parameter:
    """A parameter as ring-downs in one state tell it, which are not known to be those of a short circuit."""
    if one.key == "short_circuit_frequency":
        return dataclasses.replace(one, key="resonance_frequency", what=f"resonance in {state}")
    in_state = one.key in ("quality_factor", "oscillator.damping_ratio")
    return dataclasses.replace(
        one, key=one.key.removeprefix("oscillator."), what=f"in {state}" if in_state else one.what
    )


def _why_open(one: quantities.Quantity, interval: ProfileInterval, best: DeviceFit) -> str:
    """Why a number is not determined: too wide, at a boundary of the fit, or none that a device has; "" where it is."""
    if one.key == "oscillator.mass" and "mass" in best.fixed:
        return ""
    at_its_end = interval.low == interval.high and not set(one.needs).isdisjoint(best.names)  # where nothing changes it
    if at_its_end or _open(interval, one.above_0):
        return _remedy(one.key)
    if one.key == "stop.restitution" and not EDGE < interval.value < 1.0 - EDGE:
        return str(note("fit_at_boundary"))
    if one.key in ("oscillator.mass", "oscillator.stiffness") and "mass" not in best.fixed:
        kind = key_kind(*one.key.split("."))
        if kind is not None and unusual(one.key, interval.value, kind):
            return str(note("no_such_device", value=interval.value, unit=one.unit))
    return ""


def _open(interval: ProfileInterval, above_0: bool) -> bool:
    """Whether an interval is so wide that the number is not determined."""
    half = 0.5 * (interval.high - interval.low)
    if above_0:
        return not 0.5 * math.log(interval.high / interval.low) < NOT_DETERMINED if interval.low > 0.0 else True
    return not half < NOT_KNOWN


def _remedy(key: str) -> str:
    """What would determine a key."""
    if key in ("oscillator.mass", "oscillator.stiffness", "piezo.coupling"):
        return str(note("mass_is_open"))
    if key == "piezo.capacitance":
        return str(note("capacitance_is_open"))
    return str(note("one_state_leaves_it_open"))
