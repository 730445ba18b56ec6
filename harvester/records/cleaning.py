"""A logger's recording made clean: one axis at even times, without offset and drift.

The findings are reported.

Repaired: repeated times, times too coarse for the rate, jitter, gaps of a few samples (by a
cubic), the mean and a linear drift.  Anything that would be a guess is refused, with the remedy:
long gaps, times that run backwards, a clipped signal.

Long because each fault of a record is found, mended and reported in one place.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.records.csv_table import read_table
from harvester.records.named_columns import is_time
from harvester.records.record_clock import check_sizes, record_times, sampling_rate
from harvester.records.record_columns import (
    accelerations,
    axis_column,
    chosen_rows,
    named,
    refuse_words,
    unit_against_gravity,
    with_steps,
)
from harvester.records.record_facts import NO_FACTS, AskedError, RecordFacts
from harvester.records.record_times import FEWEST, ascending, even, joined, longest_part, recordings
from harvester.records.standstill import Standstill, standstill
from harvester.uncertainty.value import in_percent

MOST_CLIPPED = 0.01  # of all samples
CLIPPED_RUN = 3  # equal samples at an end of the range that are a clipped one
# of the resolution: a run that the signal comes to by less may be its own rounded crest
STEPS = 2.5
OUTSIDE = 0.1  # distance of zeros from all other samples, relative to the range of these
# from this share of half the rate on, this fraction of the power is much
NEAR_NYQUIST, LOUD = 0.8, 0.1


@dataclass(frozen=True, eq=False)
class CleanRecord:
    """Accelerations in m/s^2, shape (n,), every 1/``rate`` seconds.

    Their ``axis``, and the corrections.
    """

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
    """The used part of a record: ``begin`` and ``end`` in s from its beginning, or the ``longest`` without a gap.

    ``recording`` is the number of one of several recordings; ``join`` joins the parts between long
    gaps.  Raises InputError for an invalid part.
    """

    begin: float | None = None
    end: float | None = None
    longest: bool = False
    recording: int | None = None
    join: bool = False

    def __post_init__(self) -> None:
        if self.begin is not None and not self.begin >= 0.0:
            raise invalid("`from`", "be at least 0 s, the beginning of the record", self.begin)
        if self.end is not None and not self.end > (self.begin or 0.0):
            raise invalid("`to`", "be later than `from`", self.end)

    def of_recordings(self, time: Floats, notes: list[Diagnostic]) -> slice:
        """The rows of one of several recordings, each of which begins at an earlier time.

        All rows if it is one.
        """
        parts = recordings(time)
        if self.recording is not None and not 1 <= self.recording <= len(parts):
            raise invalid(
                "`recording`", f"be between 1 and {len(parts)} for this file", self.recording
            )
        if len(parts) == 1:
            return parts[0]
        longest = int(np.argmax([rows.stop - rows.start for rows in parts]))
        if parts[longest].stop - parts[longest].start < FEWEST:
            row = parts[1].start + 1
            raise InputError(f"FILE must have ascending times, but row {row} does not")
        if self.recording is None and not self.longest:
            raise AskedError(
                f"FILE must have ascending times, but row {parts[1].start + 1} does not: it has "
                f"{len(parts)} recordings, of which `recording` 1 selects the first, and `longest` the longest",
                "longest",
            )
        k = self.recording - 1 if self.recording else longest
        notes.append(
            note("one_recording", number=k + 1, of=len(parts), rows=parts[k].stop - parts[k].start)
        )
        return parts[k]

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


def clean(path: str, facts: RecordFacts = NO_FACTS, part: Part | None = None) -> CleanRecord:
    """Read a file and clean its record.

    Raises InputError in one line, with the remedy, for anything that cannot be read or must not be
    guessed.
    """
    table = read_table(path, "FILE")
    notes = [table.layout, *table.notes]
    warnings = list[Diagnostic]()
    table = chosen_rows(with_steps(named(table, notes), notes), facts.where)
    column = axis_column(table, facts.axis)
    values = accelerations(table, column, facts.unit, notes)
    warnings += unit_against_gravity(table, column, facts.unit)
    refuse_words(table, column)
    check_sizes(column, values)
    for stamps in table.find(is_time)[:1]:
        refuse_words(table, stamps)
    time = record_times(table, facts, notes, warnings)
    if time is None:
        rate = sampling_rate(table, facts.rate, notes)
        if rate is None:
            raise AskedError(
                "`rate` must be given for a file without times, but is left out, and FILE has "
                f"{shown(table.heads)}",
                "rate",
            )
        time = np.arange(len(values)) / rate
        notes.append(note("no_times", rate=rate))
    if len(values) < FEWEST:
        raise invalid("FILE", f"have at least {FEWEST} rows", len(values))
    part = part or Part()
    rows = part.of_recordings(time, notes)
    time, values = ascending(time[rows], values[rows], notes)
    rows = part.rows(time, values, notes)
    time, values = time[rows], values[rows]
    _warn_of_zeros(time, values, warnings)
    stood = standstill(values)
    if stood is not None:
        warnings.append(stands_still(stood, time))
    _refuse_clipped(values if stood is None else values[stood.mask()], warnings)
    spacing, values = (joined if part.join else even)(time, values, notes)
    values = _without_drift(values, spacing, notes)
    if not np.any(np.abs(values) > 0.0):
        raise invalid("FILE", "have accelerations that change", float(values[0]))
    _near_nyquist(values, 1.0 / spacing, warnings)
    rate = facts.rate
    if rate is not None and abs(rate * spacing - 1.0) > 1e-6:
        values = _resampled(values, 1.0 / spacing, rate, notes)
    return CleanRecord(rate or 1.0 / spacing, values, column.name, tuple(notes), tuple(warnings))


def stands_still(stood: Standstill, time: Floats) -> Diagnostic:
    """The warning of a constant sensor, with the longest part in which it changes; times in s."""
    begin, end = stood.longest
    at = {"begin": float(time[begin] - time[0]), "end": float(time[end - 1] - time[0])}
    living = stood.living
    part: dict[str, float] = {}
    if living is not None:
        part = {
            "low": float(time[living[0]] - time[0]),
            "high": float(time[living[1] - 1] - time[0]),
        }
    return warning("stands_still", samples=stood.samples, share=stood.share, **at, **part)


def _warn_of_zeros(time: Floats, values: Floats, warnings: list[Diagnostic]) -> None:
    """Warn of zeros before the first sample, which are far outside the range of all others."""
    others = np.flatnonzero(values != 0.0)
    count = int(others[0]) if len(others) else 0
    known = values[count:][np.isfinite(values[count:])]
    if not 0 < count < FEWEST or not len(known):
        return
    outside = max(float(known.min()), -float(known.max()))
    if outside > OUTSIDE * float(np.ptp(known)):
        begin = float(time[count] - time[0])
        warnings.append(warning("zeros_at_the_beginning", samples=count, begin=begin))


def _refuse_clipped(values: Floats, warnings: list[Diagnostic]) -> None:
    """Find samples that are constant at an end of the range, which the signal left."""
    known = values[np.isfinite(values)]
    if not len(known) or np.ptp(known) == 0.0:
        return
    clipped = crests = 0
    step = STEPS * float(np.diff(np.unique(known)).min())
    for end in (known.max(), known.min()):
        sudden_runs = smooth = 0
        edges = np.flatnonzero(np.diff(np.concatenate(([0], (known == end).astype(int), [0]))))
        for begin, behind in zip(edges[::2], edges[1::2], strict=True):
            if behind - begin >= CLIPPED_RUN:
                beside = known[[max(begin - 1, 0), min(behind, len(known) - 1)]]
                sudden = np.abs(beside - end).max() > step
                sudden_runs += int(sudden)
                smooth += (not sudden) * int(behind - begin)
        crests += smooth
        # an end that was clipped once is the end of the range: shorter runs there are clipped, too
        clipped += int((known == end).sum()) - smooth if sudden_runs else 0
    share = clipped / len(known)
    if crests > MOST_CLIPPED * len(known):
        warnings.append(warning("perhaps_clipped", samples=int(crests)))
    if share > MOST_CLIPPED:
        raise InputError(
            f"FILE must not be clipped, but {in_percent(share, '.1f')} of its samples are constant at the end of "
            f"the range, {np.abs(known).max():.4g} m/s^2: record it again with a wider range"
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
    if rms == 0.0 and rest.any():  # below 1e-162 a square is 0
        raise invalid("FILE", "have accelerations above 1e-150 m/s^2", float(np.abs(rest).max()))
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
    """The values at another rate, without those it cannot carry, by a polyphase filter before samples are dropped."""
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
