"""The times of a logger's recording made even: the number of each row's sample, and gaps of a few samples filled.

A logger samples evenly and stamps when it gets to it: its times jitter, and are rounded.  If
samples are missing the times of all later rows are late, if a row was written twice they are
early; jitter leaves the later rows where they are.  So a row is missing if the median of (time -
row times spacing) over the rows behind is a whole spacing above that over the rows before, and the
spacing is the slope of the times over the samples' numbers.
"""

import itertools

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.records.record_facts import AskedError
from harvester.uncertainty.value import in_percent

FEWEST = 16  # rows of a record
SMOOTH_GAP = 2  # samples in a row up to which a spline goes through; a longer gap it may overshoot
BLOCK = 64  # rows, of which the median step is taken
CHANGED = 0.15  # change of that step which is another rate
LONGEST_GAP = 10  # samples that are filled in
MOST_FILLED = 0.02  # of all samples
COARSE = 0.2  # share of repeated times from which on the clock is coarse: whole seconds, say
# rows that the spacing, and the places before and behind a step, are the medians over
SPAN, WINDOW = 16, 32
# rows behind a step that tell; samples that jitter never makes, which need no such rows
SIDE = 8
SURE = 2.0
REPORTED_JITTER = 0.01  # of a spacing: jitter from which on it is reported

_Indices = np.ndarray[tuple[int], np.dtype[np.int_]]


def recordings(time: Floats) -> list[slice]:
    """The rows of each recording in a file of several that were appended to one another."""
    known = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[known])
    back = known[1:][steps < -max(float(np.median(steps)), 0.0)] if len(steps) else known[:0]
    ends = [0, *map(int, back), len(time)]
    return [slice(begin, end) for begin, end in itertools.pairwise(ends)]


def ascending(time: Floats, values: Floats, notes: list[Diagnostic]) -> tuple[Floats, Floats]:
    """Times that ascend but for jitter: those that are missing come from their neighbours, a coarse clock's are spread.

    A coarse clock determines the rate from the row of its first change to that of its last: at each
    of the
    two the clock may be up to one row late.  ``time`` in s and ``values`` have shape (n,);
    corrections are added to
    ``notes``.  Raises InputError for too few times, and a clock that hardly changes.
    """
    known = np.isfinite(time)
    if known.sum() < FEWEST:
        raise invalid("FILE", f"have at least {FEWEST} times", int(known.sum()))
    if not known.all():
        notes.append(note("rows_without_time", rows=int((~known).sum())))
        rows = np.flatnonzero(known)
        time = np.interp(np.arange(rows[0], rows[-1] + 1), rows, time[known])
        values = values[rows[0] : rows[-1] + 1]
    steps = np.diff(time)
    return (_spread(time, notes), values) if (steps == 0.0).mean() > COARSE else (time, values)


def _spread(time: Floats, notes: list[Diagnostic]) -> Floats:
    """The times of a coarse clock spread evenly over the rows."""
    changes = np.flatnonzero(np.diff(time) != 0.0) + 1
    if len(changes) < 2:
        raise InputError(
            "FILE must have times that change at least twice, but its clock is too coarse: "
            "leave its times out and give `rate`"
        )
    first = changes[0]
    count = changes[-1] - changes[0]
    spacing = (time[changes[-1]] - time[first]) / count
    repeated = len(time) - 1 - len(changes)
    notes.append(
        note("coarse_clock", times=repeated, rate=float(1.0 / spacing), error=float(1.0 / count))
    )
    return np.asarray(time[first] + spacing * (np.arange(len(time)) - first))


def numbered(
    time: Floats, notes: list[Diagnostic]
) -> "tuple[float, np.ndarray[tuple[int], np.dtype[np.int_]]]":
    """The spacing (s), and the number of each row's sample, shape (n,): those that are missing are left out.

    Raises InputError for steps that are nowhere about even.
    """
    steps = np.diff(time)
    span = min(SPAN, len(steps))
    spans = (time[span:] - time[:-span]) / span
    spacing = float(np.median(spans))
    if not spacing > 0.0 or (np.abs(steps / spacing - 1.0) < 0.5).mean() < 0.5:
        raise InputError(
            f"FILE must have times at about even steps, but they are between {steps.min():.4g} and {steps.max():.4g} s"
        )
    # without those that lack a sample
    spacing = float(spans[np.abs(spans / spacing - 1.0) < 1.0 / span].mean())
    numbers = np.arange(len(time))
    for _ in range(3):  # the first spacing is that of rows between which some may be missing
        numbers = np.append(0, np.cumsum(1 + _missing(time / spacing)))
        spacing, begin = np.polyfit(numbers, time - time[0], 1)
    off = float(np.sqrt(np.mean((time - time[0] - begin - spacing * numbers) ** 2))) / spacing
    if not (steps != 0.0).all():
        notes.append(note("times_repeat", times=int((steps == 0.0).sum())))
    if off > REPORTED_JITTER:
        notes.append(note("jitter", share=off))
    return float(spacing), numbers


def _missing(time: Floats) -> "np.ndarray[tuple[int], np.dtype[np.int_]]":
    """How many samples are missing at each step, shape (n - 1,), negative for rows too many.

    Times in spacings.
    """
    import pandas as pd

    late = time - np.arange(len(time))
    before = pd.Series(late).rolling(WINDOW, min_periods=1).median().to_numpy()[:-1]
    behind = pd.Series(late[::-1]).rolling(WINDOW, min_periods=1).median().to_numpy()[::-1][1:]
    steps = np.diff(time) - 1.0
    missing = np.zeros(len(steps), int)
    doubtful = np.flatnonzero((np.abs(steps) > 0.5) & (np.abs(behind - before) > 0.3))
    for n in doubtful[
        np.argsort(-np.abs(steps[doubtful]), kind="stable")
    ]:  # long gaps first: they hide short ones
        sides = late[max(n + 1 - WINDOW, 0) : n + 1], late[n + 1 : n + 1 + WINDOW]
        if min(map(len, sides)) < SIDE and abs(steps[n]) < SURE:
            continue
        missing[n] = round(float(np.median(sides[1]) - np.median(sides[0])))
        late[n + 1 :] -= missing[n]
    return missing


def even(time: Floats, values: Floats, notes: list[Diagnostic]) -> tuple[float, Floats]:
    """The spacing, and the values at even times.

    Rows written twice are one, gaps of a few samples get a cubic.

    Raises InputError as `numbered`, for too few accelerations, and for gaps too long to fill.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    _refuse_two_rates(time)
    spacing, numbers = numbered(time, notes)
    good = np.isfinite(values)
    if good.sum() < FEWEST:
        raise invalid("FILE", f"have at least {FEWEST} accelerations", int(good.sum()))
    indices, rows = np.unique(numbers[good], return_inverse=True)
    mean = np.bincount(rows, values[good]) / np.bincount(rows)
    if len(indices) < good.sum():
        notes.append(note("rows_written_twice", rows=int(good.sum() - len(indices))))
    gaps = np.diff(indices) - 1
    lost, longest = int(gaps.sum()), int(gaps.max())
    if longest > LONGEST_GAP or lost > MOST_FILLED * len(values):
        at = spacing * (indices[gaps.argmax()] - numbers[0])
        raise AskedError(
            f"FILE must have no gap of more than {LONGEST_GAP} samples and no more than "
            f"{in_percent(MOST_FILLED, '.0f')} missing, but {lost} are missing, {longest} at {at:.6g} s from "
            "the beginning: `longest` uses the longest part without such a gap, `from` and `to` "
            "another one, `join` all of them",
            "longest",
        )
    if not lost:
        return spacing, np.asarray(mean)
    notes.append(note("samples_filled_in", samples=lost, in_a_row=longest))
    if longest <= SMOOTH_GAP:
        return spacing, np.asarray(
            CubicSpline(indices, mean)(np.arange(indices[0], indices[-1] + 1))
        )
    return spacing, np.asarray(
        PchipInterpolator(indices, mean)(np.arange(indices[0], indices[-1] + 1))
    )


def _refuse_two_rates(time: Floats) -> None:
    """Refuse times whose sampling rate changes for good, as by a setting of the logger.

    The typical step changes, which gaps leave as it is, and the mean step, which a coarse clock
    leaves as it is.
    """
    count = len(time) // BLOCK
    if count < 2:
        return
    spacings = np.median(np.diff(time)[: BLOCK * (count - 1)].reshape(-1, BLOCK), axis=1)
    if not spacings[0] > 0.0:
        return
    other = np.abs(spacings / spacings[0] - 1.0) > CHANGED
    first = int(np.argmax(other))
    if other.any() and other[first:].all():
        # before the change: half of that block's steps, which have the first rate's median
        row = BLOCK * (first - 1) + BLOCK // 2
        mean = float(time[row] - time[0]) / row
        later = float(time[-1] - time[row + BLOCK]) / (len(time) - 1 - row - BLOCK)
        if not abs(later / mean - 1.0) > CHANGED:
            return
        at = float(time[row] - time[0])
        after = float(time[row + BLOCK] - time[0])
        raise InputError(
            f"FILE must have one sampling rate, but it changes from {1.0 / spacings[0]:.4g} to "
            f"{1.0 / spacings[-1]:.4g} Hz after {at:.6g} s: `to` {at:.6g} selects the first part, "
            f"`from` {after:.6g} the other"
        )


def _cuts(time: Floats, values: Floats) -> tuple[_Indices, _Indices, _Indices]:
    """The rows with a value, the numbers of all samples, and the gaps that are too long to fill."""
    good = np.flatnonzero(np.isfinite(values))
    _, numbers = numbered(time, [])
    return good, numbers, np.flatnonzero(np.diff(numbers[good]) - 1 > LONGEST_GAP)


def joined(time: Floats, values: Floats, notes: list[Diagnostic]) -> tuple[float, Floats]:
    """The spacing, and the values of the parts between long gaps one behind the other.

    Each is without its mean.  Raises InputError as `even` for each part; parts of few samples are
    left out.
    """
    good, _, cuts = _cuts(time, values)
    ends = [0, *map(int, cuts + 1), len(good)]
    parts = [
        slice(int(good[begin]), int(good[end - 1]) + 1) for begin, end in itertools.pairwise(ends)
    ]
    long = [part for part in parts if part.stop - part.start >= FEWEST]
    pieces = list[Floats]()
    seconds = 0.0
    for part in long:
        spacing, piece = even(time[part], values[part], [])
        pieces.append(piece - piece.mean())
        seconds += spacing * len(piece)
    if not pieces:
        raise invalid("FILE", f"have a part of at least {FEWEST} samples", len(parts))
    notes.append(note("parts_joined", parts=len(pieces), of=len(parts)))
    every = np.concatenate(pieces)
    return seconds / len(every), every


def longest_part(time: Floats, values: Floats, notes: list[Diagnostic]) -> slice:
    """The rows of the longest part without a gap that is too long to fill."""
    good, numbers, cuts = _cuts(time, values)
    begins = np.append(good[:1], good[cuts + 1])
    ends = np.append(good[cuts], good[-1:])
    best = int(np.argmax(numbers[ends] - numbers[begins]))
    if len(cuts):
        begin, end = (float(time[row] - time[0]) for row in (begins[best], ends[best]))
        notes.append(note("longest_part", parts=len(cuts) + 1, begin=begin, end=end))
    return slice(int(begins[best]), int(ends[best]) + 1)
