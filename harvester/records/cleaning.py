"""A logger's record made clean: one axis at even times, without offset and drift; what was found is reported.

What is mended: repeated times, times too coarse for the rate, jitter, gaps of a few samples (by a
cubic), the mean and a linear drift.  What would be guessed is refused, with the remedy: long gaps,
times that go back, a clipped signal.

Long because each fault of a record is found, mended and told in one place.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.quantities.kinds import ACCELERATION, TIME
from harvester.quantities.units import LARGEST
from harvester.records.csv_layout import MISSING
from harvester.records.csv_table import CsvColumn, CsvTable, read_table
from harvester.records.record_files import AXES, FEWEST, is_acceleration, is_time, times
from harvester.records.record_times import ascending, even, longest_part

MOST_CLIPPED = 0.01  # of all samples
CLIPPED_RUN = 3  # equal samples at an end of the range that are a clipped one
# of the resolution: a run that the signal comes to by less may be its own rounded crest
STEPS = 2.5
# from this share of half the rate on, this share of the power is much
NEAR_NYQUIST, LOUD = 0.8, 0.1


@dataclass(frozen=True, eq=False)
class CleanRecord:
    """Accelerations in m/s^2, shape (n,), every 1/``rate`` seconds; ``axis`` they are of, and what was done."""

    rate: float
    values: Floats
    axis: str
    notes: tuple[Diagnostic, ...]
    warnings: tuple[Diagnostic, ...]

    @property
    def times(self) -> Floats:
        """The times of the samples in s, from 0."""
        return np.arange(len(self.values)) / self.rate

    @property
    def rms(self) -> float:
        """The root mean square in m/s^2."""
        return float(np.sqrt(np.mean(self.values**2)))


@dataclass(frozen=True)
class Part:
    """Which part of a record is taken: ``begin`` and ``end`` in s from its beginning, or the ``longest`` without a gap.

    Raises InputError for an invalid part.
    """

    begin: float | None = None
    end: float | None = None
    longest: bool = False

    def __post_init__(self) -> None:
        if self.begin is not None and not self.begin >= 0.0:
            raise invalid("`from`", "be at least 0 s, the beginning of the record", self.begin)
        if self.end is not None and not self.end > (self.begin or 0.0):
            raise invalid("`to`", "be later than `from`", self.end)

    def rows(self, time: Floats, values: Floats, notes: list[Diagnostic]) -> slice:
        """The rows of the part, at times that ascend but for jitter."""
        rows = slice(0, len(time))
        if self.begin is not None or self.end is not None:
            end = time[-1] - time[0] if self.end is None else self.end
            rounding = 1e-3 * np.ptp(time) / len(time)
            ends = [(self.begin or 0.0) - rounding, end + rounding]
            rows = slice(*(int(at) for at in np.searchsorted(time - time[0], ends)))
            if rows.stop - rows.start < FEWEST:
                whole = f"{time[-1] - time[0]:.6g}"
                raise InputError(
                    f"`from` and `to` must leave at least {FEWEST} samples of the {whole} s, but leave "
                    f"{rows.stop - rows.start}"
                )
            first, final = (float(time[row] - time[0]) for row in (rows.start, rows.stop - 1))
            notes.append(note("part_taken", begin=first, end=final))
        if not self.longest:
            return rows
        inner = longest_part(time[rows], values[rows], notes)
        return slice(rows.start + inner.start, rows.start + inner.stop)


def clean(path: str, axis: str | None, rate: float | None, part: Part | None = None) -> CleanRecord:
    """Read a file and make its record clean; ``rate`` (Hz) as the command's.

    Raises InputError in one line, with the remedy, for anything that cannot be read or must not be
    guessed.
    """
    table = read_table(path, "FILE")
    notes = [table.layout]
    warnings = list[Diagnostic]()
    column = _axis(table, axis)
    values = _in_si(table, column)
    time = times(table, "FILE")
    _refuse_words(table, column)
    check_sizes(column, values)
    if time is None:
        if rate is None:
            raise InputError(
                f"`rate` must be given for a file without times, but is left out, and FILE has {shown(table.heads)}"
            )
        time = np.arange(len(values)) / rate
        notes.append(note("no_times", rate=rate))
    else:
        notes += _unit_of(table.find(is_time)[0])
        check_sizes(table.find(is_time)[0], time)
    if len(values) < FEWEST:
        raise invalid("FILE", f"have at least {FEWEST} rows", len(values))
    time, values = ascending(time, values, notes)
    rows = (part or Part()).rows(time, values, notes)
    time, values = time[rows], values[rows]
    _refuse_clipped(values, warnings)
    spacing, values = even(time, values, notes)
    values = _without_drift(values, spacing, notes)
    if not np.any(np.abs(values) > 0.0):
        raise invalid("FILE", "have accelerations that change", float(values[0]))
    _near_nyquist(values, 1.0 / spacing, warnings)
    if rate is not None and abs(rate * spacing - 1.0) > 1e-6:
        values = _resampled(values, 1.0 / spacing, rate, notes)
    return CleanRecord(rate or 1.0 / spacing, values, column.name, tuple(notes), tuple(warnings))


def _unit_of(column: CsvColumn) -> list[Diagnostic]:
    """What to tell of the unit that times are read in, if it does not stand in brackets."""
    if column.stated or column.clock:
        return []
    factor, _ = column.scale(TIME) or (None, 1)
    unit = next(
        (
            unit
            for unit in column.candidates()
            if factor is not None and TIME.scale(unit)[0] == factor
        ),
        "",
    )
    return [note("unit_of_times", unit=unit, column=column.name)]


def check_sizes(column: CsvColumn, values: Floats) -> None:
    """Refuse a number so large that no sum or square of it is one."""
    large = np.abs(values) > LARGEST
    if large.any():
        row = int(large.argmax()) + 1
        raise invalid(
            f"FILE column {column.name!r} row {row}",
            f"be at most {LARGEST:g} in size",
            float(column.values[row - 1]),
        )


def _axis(table: CsvTable, axis: str | None) -> CsvColumn:
    """The column of an axis, x, y or z, or of that name; the only acceleration if none is asked for."""
    columns = table.find(is_acceleration)
    if axis is not None:
        short = axis.strip().lower()
        named = [
            column
            for column in table.columns
            if short in (column.head.strip().lower(), column.name.lower())
        ]
        named += [
            c
            for c in columns
            if short in AXES and {short, "a" + short, "acc" + short, "accel" + short} & set(c.words)
        ]
        if not named:
            raise InputError(
                f"`axis` must be one of the columns of FILE, {shown(table.heads)}, but is {shown(axis)}"
            )
        return named[0]
    if not columns:
        others = [column for column in table.columns if not is_time(column)]
        columns = others if len(others) == 1 else []
    if len(columns) != 1:
        names = ", ".join(column.name for column in columns) or table.heads
        raise InputError(
            f"`axis` must be given where FILE has several columns, {shown(names)}, but is left out"
        )
    return columns[0]


def _in_si(table: CsvTable, column: CsvColumn) -> Floats:
    values = column.in_si(ACCELERATION)
    if values is None:
        was = column.stated or "none"
        raise invalid(
            f"FILE column {column.name!r}",
            "have a unit such as g, mg or m/s^2 behind its name: 'z (g)'",
            was,
        )
    return values


def _refuse_words(table: CsvTable, column: CsvColumn) -> None:
    """Refuse cells that are neither a number nor a sign of a missing one."""
    wrong = [
        (row, text)
        for row, index, text in table.bad
        if index == column.index and text.lower() not in MISSING
    ]
    if wrong:
        raise invalid(
            f"FILE column {column.name!r} row {wrong[0][0]}", "be a number or empty", wrong[0][1]
        )


def _refuse_clipped(values: Floats, warnings: list[Diagnostic]) -> None:
    """Find samples that stand still at an end of the range, which the signal left."""
    known = values[np.isfinite(values)]
    if not len(known) or np.ptp(known) == 0.0:
        return
    clipped = crests = 0
    step = STEPS * float(np.diff(np.unique(known)).min())
    for end in (known.max(), known.min()):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], (known == end).astype(int), [0]))))
        for begin, behind in zip(edges[::2], edges[1::2], strict=True):
            if behind - begin >= CLIPPED_RUN:
                beside = known[[max(begin - 1, 0), min(behind, len(known) - 1)]]
                sudden = np.abs(beside - end).max() > step
                clipped = clipped + sudden * (behind - begin)
                crests = crests + (not sudden) * (behind - begin)
    share = clipped / len(known)
    if crests > MOST_CLIPPED * len(known):
        warnings.append(warning("perhaps_clipped", samples=int(crests)))
    if share > MOST_CLIPPED:
        raise InputError(
            f"FILE must not be clipped, but {share:.1%} of its samples stand still at the end of the range, "
            f"{np.abs(known).max():.4g} m/s^2: record it again with a wider range"
        )
    if clipped:
        warnings.append(warning("clipped", samples=int(clipped)))


def _without_drift(values: Floats, spacing: float, notes: list[Diagnostic]) -> Floats:
    """The values without their mean and a straight line; each is noted if it is large."""
    t = spacing * (np.arange(len(values)) - 0.5 * (len(values) - 1))
    offset = float(values.mean())
    slope = float(t @ values / (t @ t))
    rest = values - offset - slope * t
    rms = float(np.sqrt(np.mean(rest**2)))
    if abs(offset) > 0.01 * rms:
        notes.append(note("offset_removed", offset=offset, of_gravity=offset / 9.80665))
    drift = slope * spacing * len(values)
    if abs(drift) > 0.05 * rms:
        notes.append(note("drift_removed", drift=drift))
    return np.asarray(rest)


def _near_nyquist(values: Floats, rate: float, warnings: list[Diagnostic]) -> None:
    """Warn if much of the power is just below half the rate: more may have been folded down from above."""
    power = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
    power[0] *= 0.5  # of the two-sided spectrum, this line and that at half the rate are there once
    power[-1] *= 0.5 if len(values) % 2 == 0 else 1.0
    share = float(power[round(NEAR_NYQUIST * len(power)) :].sum() / power.sum())
    if share > LOUD:
        warnings.append(warning("rate_too_low", share=share, frequency=NEAR_NYQUIST * rate / 2))


def _resampled(values: Floats, rate: float, target: float, notes: list[Diagnostic]) -> Floats:
    """The values at another rate, without what that cannot carry: a polyphase filter before samples are dropped."""
    from fractions import Fraction

    from scipy.signal import resample_poly

    ratio = Fraction(target / rate).limit_denominator(2000)
    if not (1e-3 <= float(ratio) <= 100.0) or abs(float(ratio) * rate / target - 1.0) > 1e-4:
        raise invalid(
            "`rate`", f"be between {1e-3 * rate:.3g} and {100 * rate:.3g} Hz for this file", target
        )
    new = np.asarray(resample_poly(values, ratio.numerator, ratio.denominator))
    if len(new) < FEWEST:
        raise invalid("`rate`", f"leave at least {FEWEST} samples", len(new))
    kept = math.sqrt(float(np.mean(new**2)) / float(np.mean(values**2)))
    notes.append(note("resampled", before=rate, after=target, share=kept))
    return new
