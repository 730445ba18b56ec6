"""The parameters of a device, with 95 % intervals, by one fit of all its measurements."""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from harvester.errors import InputError, invalid, names_arguments, unknown
from harvester.identification import bounce, data_sheet, quantities, sheet_answers
from harvester.identification.data_sheet import WIDE, DataSheet, read_sheet
from harvester.identification.doubts import left_out, misfits, residual_rms
from harvester.identification.fit import DeviceFit, channels, fit
from harvester.identification.identification_result import IdentificationResult, Parameter
from harvester.identification.measurement import SHORT, Decay, Impedance, Measurement, thinned
from harvester.identification.profile_intervals import ProfileInterval, Profiles, hull
from harvester.identification.read import read_files
from harvester.identification.start import chosen, meets, second_starts, starts
from harvester.machine.automatic import reporting
from harvester.machine.progress import ProgressCallback, listening, report_share
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.scene.keys import full_key, key_kind, read_value
from harvester.scene.plausibility import unusual
from harvester.studies.prediction.priors import DEFAULT_CLASS, check_class

NOT_DETERMINED = 0.7  # half-width of an interval of a logarithm: a factor of two
NOT_KNOWN = 0.5  # half-width of a restitution coefficient or a loss
EDGE = 1e-6  # from 0 and 1 a restitution coefficient is at the boundary of the fit
MODE = {"frequency", "quality", "beta"}  # parameters of the first mode
KNOWN = (
    "oscillator.mass",
    "oscillator.damping_ratio",
    "piezo.capacitance",
    "stop.restitution",
    "stop.gap",
)


@names_arguments
def identify(
    files: str | Sequence[str] = (),
    known: Mapping[str, float | str] | None = None,
    points: Mapping[str, str] | None = None,
    prior: str = DEFAULT_CLASS,
    progress: ProgressCallback | bool | None = None,
) -> IdentificationResult:
    """Fit one mode with its piezo to measurements in CSV files and to the numbers of a datasheet.

    Parameters
    ----------
    files : str or list of str, optional
        the path of a CSV file, or several, each with its state behind an @ if it needs one, such
        as "ringdown.csv@open".
    known : mapping, optional
        scene keys that are not fitted, such as {"mass": "40 g"}: numbers in SI units, or texts with
        their unit.
    points : mapping, optional
        single numbers of a datasheet, such as ``{"frequency": "60 Hz", "open_circuit_frequency":
        "62 Hz", "capacitance": "30 nF", "q": "60", "open_circuit_voltage": "21 V at 0.25 g",
        "power_at_load": "1.2 mW at 15 kohm and 0.25 g"}``, each with the error of a meter, of the
        linear model, or of a datasheet.
    prior : str, default "bulk"
        the class of the device, whose prior the damping has if neither files nor points determine
        it: "bulk", "composite", "film" or "polymer".
    progress : callable or bool, optional
        called with the fraction that is done.  Default: a bar, as of `hv.charge`; False: none.

    Returns
    -------
    IdentificationResult
        the device's parameters with 95 % intervals, in SI units.

    Raises
    ------
    InputError
        for files that cannot be read, hold no measurement or too few points, for keys that
        cannot be known, and for points of another form or too few of them.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.identify("nowhere.csv")
    Traceback (most recent call last):
    harvester.errors.InputError: FILE must be a readable file, but 'nowhere.csv' is not: No such file or directory
    """
    names = (files,) if isinstance(files, str) else tuple(str(path) for path in files)
    check_class(prior)
    fixed = known_values(known or {})
    sheet = read_sheet(points, prior) if points else None
    with reporting(progress, "identify") as report, listening(report):
        return identified(read_files(names) if names or sheet is None else (), fixed, sheet)


def known_values(known: Mapping[str, float | str]) -> dict[str, float]:
    """The parameters that are known, by their names in the fit, from scene keys."""
    values = {}
    for key, text in known.items():
        whole = full_key(key)
        if whole not in KNOWN:
            raise unknown("key of `known`", key, KNOWN)
        value = read_value(whole, text) if isinstance(text, str) else float(text)
        if whole == "oscillator.damping_ratio":
            if not value > 0.0:
                raise invalid("oscillator.damping_ratio", "be above 0 if it is known", value)
            values["quality"] = 0.5 / value
        else:
            values[whole.partition(".")[2]] = value
    return values


def identified(
    measurements: Sequence[Measurement],
    known: dict[str, float] | None = None,
    sheet: DataSheet | None = None,
) -> IdentificationResult:
    """Fit measurements and a datasheet that are read; raises as `identify`."""
    known = dict(known or {})
    remarks = list[Diagnostic]()
    measurements, alone = _alone(list(measurements), sheet)
    measurements = [_from_first_flight(data) for data in measurements]
    met = [data for data in measurements if isinstance(data, Decay) and data.of == "displacement"]
    bouncing = any(bounce.meets_stop(data.t, data.y) for data in met)
    best, rivals, about = _with_sheet(sheet, measurements, known, bouncing)
    remarks += about
    if bouncing:
        remarks.append(note("ring_down_meets_a_stop"))
    left = misfits(best)
    alike = measurements if sheet is None else ()  # points are of a single mode
    if (second := _second_resonance(alike, best, known, left)) is not None:
        best = second
        left = [note("two_resonances")]
    remarks += left
    if alone:
        remarks.append(note("one_state_alone", state=alone))
    if any(isinstance(data, Impedance) and not data.phase_known for data in measurements):
        remarks.append(note("magnitude_alone"))
    remarks += left_out(measurements)
    return _answer(
        best=best,
        rivals=rivals,
        measurements=measurements,
        known=known,
        remarks=remarks,
        alone=alone,
        widest=NOT_DETERMINED if sheet is None else WIDE,
    )


def _from_first_flight(data: Measurement) -> Measurement:
    """A ring-down against a stop without the few samples before an impact that it may begin with."""
    if not (
        isinstance(data, Decay) and data.of == "displacement" and bounce.meets_stop(data.t, data.y)
    ):
        return data
    first = bounce.first_sample(data.t, data.y)
    return dataclasses.replace(data, t=data.t[first:], y=data.y[first:])


def _alone(
    measurements: list[Measurement], sheet: DataSheet | None
) -> tuple[list[Measurement], str]:
    """Ring-downs in one state do not show the coupling: they are fitted as if in short circuit; the state in words."""
    loads = {data.load for data in measurements if isinstance(data, Decay)}
    if (
        sheet is None
        and len(loads) == 1
        and loads != {SHORT}
        and all(isinstance(data, Decay) for data in measurements)
    ):
        state = measurements[0].state
        return [
            dataclasses.replace(data, load=SHORT)
            for data in measurements
            if isinstance(data, Decay)
        ], state
    return measurements, ""


def _fit(measurements: list[Measurement], known: dict[str, float], bouncing: bool) -> DeviceFit:
    beside = [data for data in measurements if not meets(data, bouncing)]
    if len(measurements) - len(beside) > 1:
        raise InputError(
            "one FILE alone must be a ring-down against a stop, but several displacements are given"
        )
    names = chosen(measurements, known, bouncing)
    if not names:
        raise InputError(
            "nothing is left to fit: `known` already gives every parameter that FILE could determine"
        )
    others = (
        _fit(beside, known, False).values() if bouncing and chosen(beside, known, False) else {}
    )
    few = channels([thinned(data, 50) for data in measurements], bouncing)
    begin = starts(measurements, names, known, bouncing, others)
    return fit(names, begin, known, channels(measurements, bouncing), few)


def _with_sheet(
    sheet: DataSheet | None,
    measurements: list[Measurement],
    known: dict[str, float],
    bouncing: bool,
) -> tuple[DeviceFit, list[DeviceFit], list[Diagnostic]]:
    """The fit of files and datasheet together, others that are nearly as good, and the remarks on the latter."""
    if sheet is None:
        return _fit(measurements, known, bouncing), [], []
    of_files = chosen(measurements, known, bouncing) if measurements else ()
    names = data_sheet.fitted_names(sheet, of_files, known)
    begins = list[dict[str, float]]()
    if of_files:
        beside = [data for data in measurements if not meets(data, bouncing)]
        alone = bouncing and chosen(beside, known, False)
        others = _fit(beside, known, False).values() if alone else {}
        begins = starts(measurements, of_files, known, bouncing, others)
    begins = data_sheet.starts(sheet, names, begins, known)
    stated = data_sheet.channels(sheet, of_files, known)
    few = channels([thinned(data, 50) for data in measurements], bouncing)
    whole = channels(measurements, bouncing)
    limits = sheet_answers.limits(sheet, of_files)
    best = fit(names, begins, known, (*whole, *stated), (*few, *stated), limits)
    rivals = [] if "beta" in of_files else sheet_answers.rivals(best, begins, limits)
    return best, rivals, sheet_answers.remarks(sheet, best, rivals, of_files)


def _second_resonance(
    measurements: Sequence[Measurement],
    best: DeviceFit,
    known: dict[str, float],
    left: list[Diagnostic],
) -> DeviceFit | None:
    """The fit with a second mode, if impedances leave a pattern with one, and none with two; None elsewhere."""
    impedances = [z for z in measurements if isinstance(z, Impedance)]
    free = [z for z in impedances if not z.clamped]
    if not left or not free or len(impedances) < len(measurements) or not set(best.names) >= MODE:
        return None
    names = (*best.names, "frequency2", "quality2", "beta2")
    few = channels([thinned(z, 200) for z in impedances], False)
    try:
        result = fit(
            names, second_starts(free, best.values()), known, channels(impedances, False), few
        )
    except InputError:  # too few points
        return None
    values = result.values()
    low, high = (extreme([extreme(z.f) for z in free]) for extreme in (np.min, np.max))
    held = low < values["frequency"] < values["frequency2"] < high
    return result if held and not misfits(result) else None


def _answer(
    best: DeviceFit,
    rivals: Sequence[DeviceFit],
    measurements: Sequence[Measurement],
    known: dict[str, float],
    remarks: list[Diagnostic],
    alone: str,
    widest: float,
) -> IdentificationResult:
    profiles = Profiles(best)
    several = [profiles, *map(Profiles, rivals)]
    parameters, missing = [], []
    report_share(0.4)  # by its time the fit is that part, and the intervals the rest
    for quantity in quantities.answered(set(best.names) | set(known)):
        interval = hull([profile.interval(quantity.of, quantity.above_0) for profile in several])
        if why := _why_open(quantity, interval, best, widest):
            missing.append((quantity.key, why))
        else:
            what = "known" if interval.low == interval.high else quantity.what
            parameters.append(
                Parameter(
                    quantity.key, interval.value, interval.low, interval.high, quantity.unit, what
                )
            )
    keys = {p.key for p in parameters} | {key for key, _ in missing}
    missing += [(key, _remedy(key, best)) for key in quantities.NEEDED if key not in keys]
    if (
        len(measurements) == 1
        and isinstance(measurements[0], Impedance)
        and measurements[0].clamped
    ):
        missing.insert(0, ("short_circuit_frequency", str(note("clamped_impedance"))))
    return IdentificationResult(
        parameters=tuple(_of_one_state(p, alone) for p in parameters)
        if alone
        else tuple(parameters),
        missing=tuple(missing),
        residual_rms=residual_rms(best),
        names=best.names,
        correlations=profiles.correlations(),
        points=sum(len(c.x) for c in best.channels),
        left_out=best.left_out,
        diagnostics=tuple(remarks),
        fit=best,
    )


def _of_one_state(parameter: Parameter, state: str) -> Parameter:
    """A parameter from ring-downs in one state, which are not known to be those of a short circuit."""
    if parameter.key == "short_circuit_frequency":
        return dataclasses.replace(
            parameter, key="resonance_frequency", what=f"resonance in {state}"
        )
    in_state = parameter.key in ("quality_factor", "oscillator.damping_ratio")
    return dataclasses.replace(
        parameter,
        key=parameter.key.removeprefix("oscillator."),
        what=f"in {state}" if in_state else parameter.what,
    )


def _why_open(
    quantity: quantities.Quantity, interval: ProfileInterval, best: DeviceFit, widest: float
) -> str:
    """Why a number is not determined: too wide, at a boundary of the fit, or none that a device has; "" if it is."""
    if quantity.key == "oscillator.mass" and "mass" in best.fixed:
        return ""
    # of no width though its parameters are fitted: nothing changes it
    at_its_end = interval.low == interval.high and not set(quantity.needs).isdisjoint(best.names)
    if at_its_end or _open(interval, quantity.above_0, widest):
        return _remedy(quantity.key, best)
    if quantity.key == "stop.restitution" and not EDGE < interval.value < 1.0 - EDGE:
        return str(note("fit_at_boundary"))
    if quantity.key in ("oscillator.mass", "oscillator.stiffness") and "mass" not in best.fixed:
        kind = key_kind(*quantity.key.split("."))
        if kind is not None and unusual(quantity.key, interval.value, kind):
            return str(note("no_such_device", value=interval.value, unit=quantity.unit))
    return ""


def _open(interval: ProfileInterval, above_0: bool, widest: float) -> bool:
    """Whether an interval is wider, in its logarithm by ``widest``, than that of a known number."""
    half = 0.5 * (interval.high - interval.low)
    if above_0:
        return (
            not 0.5 * math.log(interval.high / interval.low) < widest
            if interval.low > 0.0
            else True
        )
    return not half < NOT_KNOWN


def _remedy(key: str, best: DeviceFit) -> str:
    """The measurement that would determine a key."""
    of_mass = key in ("oscillator.mass", "oscillator.stiffness", "piezo.coupling")
    if of_mass and "mass" not in best.fixed:
        return str(note("mass_is_open"))
    if key == "piezo.capacitance":
        return str(note("capacitance_is_open"))
    return str(note("one_state_leaves_it_open"))
