"""The times of a logger's record made even: missing, repeated, coarse and uneven ones, and gaps of a few samples."""

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.records.record_files import FEWEST

LONGEST_GAP = 10  # samples that are filled in
MOST_FILLED = 0.02  # of all samples


def ascending(time: Floats, values: Floats, found: list[str]) -> tuple[Floats, Floats]:
    """Times that ascend: those that are missing come from their neighbours, repeated ones are spread or merged.

    A coarse clock tells the rate from the row where its stamp first changes to that where it last does: at each of the
    two the clock may be up to one row late.  ``time`` in s and ``values`` have shape (n,); what was mended is told in
    ``found``.  Raises InputError for too few times, times that go back, and a clock that hardly changes.
    """
    known = np.isfinite(time)
    if known.sum() < FEWEST:
        raise invalid("FILE", f"have at least {FEWEST} times", int(known.sum()))
    if not known.all():
        found.append(f"{(~known).sum()} rows without a time: taken as evenly between the rows with one")
        rows = np.flatnonzero(known)
        time = np.interp(np.arange(rows[0], rows[-1] + 1), rows, time[known])
        values = values[rows[0] : rows[-1] + 1]
    steps = np.diff(time)
    if (steps < 0.0).any():
        row = int(np.argmax(steps < 0.0)) + 2
        raise InputError(
            f"FILE must have times that do not go back, but row {row} does: cut the file into its recordings"
        )
    same = steps == 0.0
    if not same.any():
        return time, values
    if same.mean() > 0.2:  # a clock of whole seconds, say: the rows are at even times between the first and the last
        changes = np.flatnonzero(~same) + 1
        if len(changes) < 2:
            raise InputError(
                "FILE must have times that change at least twice, but its clock is too coarse: leave its times out and "
                "give `rate`"
            )
        first, count = changes[0], changes[-1] - changes[0]
        spacing = (time[changes[-1]] - time[first]) / count
        found.append(
            f"{same.sum()} times repeat, for the clock is coarse: the rows are spread evenly, {1.0 / spacing:.6g} a "
            f"second, which may be off by {1.0 / count:.2g} of it"
        )
        return time[first] + spacing * (np.arange(len(time)) - first), values
    groups = np.append(0, np.cumsum(~same))
    good = np.isfinite(values)
    counts = np.bincount(groups, good)
    with np.errstate(invalid="ignore", divide="ignore"):
        merged = np.bincount(groups, np.where(good, values, 0.0)) / counts
    found.append(f"{same.sum()} repeated times: the mean of their rows is taken")
    return time[np.append(True, ~same)], merged


def even(time: Floats, values: Floats, found: list[str]) -> tuple[float, Floats]:
    """The spacing, and the values at even times; gaps of a few samples are filled by a cubic.

    Raises InputError for steps that are nowhere about even, too few accelerations, and gaps too long to fill.
    """
    from scipy.interpolate import PchipInterpolator

    steps = np.diff(time)
    spacing = float(np.median(steps))
    places = np.rint((time - time[0]) / spacing)
    jitter = steps[np.abs(steps / spacing - 1.0) < 0.5]
    if not len(jitter):
        raise InputError(
            f"FILE must have times at about even steps, but they are between {steps.min():.4g} and {steps.max():.4g} s"
        )
    spacing = float(jitter.mean())
    good = np.isfinite(values)
    if good.sum() < FEWEST:
        raise invalid("FILE", f"have at least {FEWEST} accelerations", int(good.sum()))
    gaps = np.rint(np.diff(time[good]) / spacing) - 1.0
    lost, longest = int(gaps[gaps > 0.0].sum()), int(max(gaps.max(), 0.0))
    if longest > LONGEST_GAP or lost > MOST_FILLED * len(values):
        k = int(gaps.argmax())
        raise InputError(
            f"FILE must have no gap of more than {LONGEST_GAP} samples and no more than {MOST_FILLED:.0%} missing, but "
            f"{lost} are missing, {longest} at {time[good][k]:.6g} s: cut the file there and take the longer part"
        )
    if lost:
        found.append(f"{lost} missing samples filled in, {longest} in a row at most")
    off = float(np.abs(steps - spacing)[np.abs(steps / spacing - 1.0) < 0.5].max()) / spacing
    if off > 0.01:
        found.append(f"uneven times, off by up to {off:.1%} of a step: interpolated to even ones")
    count = int(np.floor((time[good][-1] - time[good][0]) / spacing + 1e-6)) + 1
    if count > 40 * len(places):
        raise InputError(
            "FILE must have times of one recording, but they spread over far more samples than it has rows"
        )
    grid = time[good][0] + spacing * np.arange(count)
    if not lost and off <= 0.01 and len(grid) == len(values):
        return spacing, values
    return spacing, np.asarray(PchipInterpolator(time[good], values[good], extrapolate=True)(grid))
