"""The answers that a datasheet leaves: the limits of its fit, points that are far off, and rival couplings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from harvester.errors import InputError
from harvester.identification import quantities
from harvester.identification.data_sheet import NAMES, DataSheet, has_prior, written
from harvester.identification.fit import RANGES, DeviceFit, Limits, bounds, logs
from harvester.linear.single_points import COUPLED, QS
from harvester.presentation.diagnostic import Diagnostic, note, warning

# of parameters that no file has: no device is beyond them
LIMITS = {"beta": COUPLED, "quality": QS}
AT_END = 0.05  # of a limit's logarithm, from which a fit ends at the limit
FAR = 3.0  # standard deviations from which a point is doubted
IMPOSSIBLE = 5.0  # and from which no device has it
AS_GOOD = 4.0  # a sum of squares so much above the least is a second answer
ANOTHER = 0.2  # between the logarithms of the couplings of two answers
ENDS = {"beta": "coupling theta^2/(K Cp)", "quality": "quality factor"}


def limits(sheet: DataSheet, of_files: Sequence[str]) -> Limits:
    """The limits of a fit: those of parameters that neither files nor the sheet state."""
    stated = {*of_files, *(["quality"] if "q" in sheet.names else [])}
    return {name: ends for name, ends in LIMITS.items() if name not in stated}


def remarks(
    sheet: DataSheet, best: DeviceFit, rivals: Sequence[DeviceFit], of_files: Sequence[str]
) -> list[Diagnostic]:
    """The prior that was used, points that are far off, and another coupling with the same points.

    Raises InputError for points that no device has.
    """
    _refuse_an_end(sheet, best, of_files)
    notes = []
    if has_prior(sheet, of_files, best.fixed):
        prior = sheet.prior
        notes.append(note("damping_has_a_prior", quality=prior.value, spread=prior.sigma))
    values = best.values()
    for channel in best.channels:
        if channel.given_noise is None:
            continue
        name = channel.source.name
        off = abs(float(channel.residuals(values, np.ones(1))[0])) / channel.given_noise
        if off > IMPOSSIBLE:
            raise InputError(_impossible(sheet, name, values, off))
        if off > FAR:
            notes.append(warning("point_is_far_off", point=name, deviations=off))
    for rival in rivals:
        coupling = quantities.coupling(rival.values())
        notes.append(warning("points_have_two_answers", value=coupling, unit="N/V"))
    return notes


def _refuse_an_end(sheet: DataSheet, best: DeviceFit, of_files: Sequence[str]) -> None:
    """InputError if a fit ends at a limit, as then no device has the numbers."""
    values = best.values()
    for name, (low, high) in limits(sheet, of_files).items():
        if name not in best.names or not _at_end(values, name):
            continue
        if values[name] < math.sqrt(low * high):
            remedy = (
                "check the units, peak or RMS, and the acceleration, or give another point"
                if "mass" in best.fixed
                else "give the mass in `known`, or another point"
            )
            raise InputError(
                f"{written(sheet.names)} must determine the {ENDS[name]}, but the fit ends at its "
                f"least, {low:g}: {remedy}"
            )
        raise InputError(
            f"{written(sheet.names)} must be possible for one linear device, but the nearest one "
            f"ends at the largest {ENDS[name]}, {high:g}: check peak or RMS, the acceleration, "
            "and the mass"
        )


def _at_end(values: Mapping[str, float], name: str) -> bool:
    """Whether a parameter is at one of its limits."""
    return any(abs(math.log(values[name] / end)) < AT_END for end in LIMITS[name])


def _impossible(sheet: DataSheet, name: str, values: Mapping[str, float], off: float) -> str:
    """The line on numbers that no device has, of which one is ``off`` by so many standard deviations."""
    if name not in NAMES:
        return (
            f"{written(sheet.names)} must be possible for one linear device, but the nearest one "
            f"has a quality factor of {values['quality']:.3g} in place of about "
            f"{sheet.prior.value:.3g}, as is usual: check peak or RMS, and the acceleration, or give `q`"
        )
    return (
        f"`{name}` must be possible for one linear device with all these numbers, but the "
        f"nearest one misses the {name.replace('_', ' ')} by {off:.2g} standard "
        "deviations: check peak or RMS, and the acceleration"
    )


def rivals(best: DeviceFit, begins: Sequence[dict[str, float]], within: Limits) -> list[DeviceFit]:
    """Second minima ``within`` the limits, nearly as good, each with another coupling."""
    from scipy.optimize import least_squares

    lower, upper = bounds(best.names, {**RANGES, **within})
    least = float(np.sum(best.weighted(best.p) ** 2))
    couplings = [math.log(quantities.coupling(best.values()))]
    answers = []
    for begin in begins:
        end = least_squares(
            best.weighted,
            np.clip(logs(best.names, begin), lower + 1e-9, upper - 1e-9),
            bounds=(lower, upper),
            x_scale="jac",
            max_nfev=60,
        )
        values = best.values(end.x)
        if 2.0 * end.cost > least + AS_GOOD or _at_end(values, "beta"):
            continue
        coupling = math.log(quantities.coupling(values))
        if all(abs(coupling - known) > ANOTHER for known in couplings):
            couplings.append(coupling)
            answers.append(replace(best, p=end.x, jacobian=end.jac, residual=end.fun))
    return answers
