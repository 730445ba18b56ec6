"""The times of a file's rows in s, from its clock, its times, or its counter of samples.

The one reader of columns of times, for records, traces and ring-downs.  A time unit that is not
stated is decided by the possible sampling rates (`harvester.records.time_units`), or by the rate
above the numbers, and reported; a counter that rolls over is continued; seconds and a fraction in
another column are added.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.quantities.units import LARGEST, SMALLEST
from harvester.records.clock_times import with_fraction
from harvester.records.csv_table import CsvColumn, CsvTable
from harvester.records.named_columns import is_counter, is_time, unit_of_time
from harvester.records.record_facts import AskedError, RecordFacts
from harvester.records.time_units import (
    FASTEST,
    SLOWEST,
    UNITS,
    decided,
    possible,
    repeated,
    typical_step,
    unrolled,
)

CONTRADICTS = 0.05  # of the rate above the numbers: how far that of the times may be off
COARSE = 0.2  # share of repeated times from which on another column of times is looked for


class RowTimes(NamedTuple):
    """The times of rows (s), the column that they are from, and the decisions and doubts."""

    values: Floats
    column: CsvColumn
    decisions: tuple[Diagnostic, ...]


class _Reader(NamedTuple):
    """How a table's times are read: errors begin with ``key``; the rest as of `read_times`."""

    table: CsvTable
    key: str
    unit: str | None
    fastest: float
    decisions: list[Diagnostic]

    def seconds(self, column: CsvColumn, values: Floats) -> float:
        """The seconds of one of a column's numbers."""
        factor, known = (None, "") if column.clock else unit_of_time(column)
        unit = self.unit
        if unit is not None:
            if unit not in UNITS or column.clock:
                units = ", ".join(UNITS)
                must = "be left out for a clock" if column.clock else f"be one of {units}"
                raise invalid("`time_unit`", must, unit)
            if factor is not None and factor != UNITS[unit]:
                self.decisions.append(note("given_unit", given=unit, stated=known or column.stated))
            return UNITS[unit]
        if column.clock:
            return 1.0
        if factor is not None:
            self._note_stated(column, values, factor, known)
            return factor
        if column.stated:
            argument = f"{self.key} column {column.name!r}"
            raise invalid(argument, "have a unit such as s", column.stated)
        return self._without_unit(column, values)

    def _note_stated(self, column: CsvColumn, values: Floats, factor: float, known: str) -> None:
        """Report a unit that is in the name, and warn of one that makes a rate too slow."""
        if not column.stated:
            self.decisions.append(note("unit_of_times", unit=known, column=column.name))
            return
        step = typical_step(values) * factor
        others = possible(values, self.fastest) if step * SLOWEST > 1.0 else []
        if others:
            best = others[0]
            slow = warning("slow_times", rate=1.0 / step, unit=best.unit, other=best.rate)
            self.decisions.append(slow)

    def _without_unit(self, column: CsvColumn, values: Floats) -> float:
        """The seconds of one of a column's numbers, which have no unit."""
        stated = self.table.facts.rate
        sizes = UNITS.items() if stated is not None else ()
        units = [unit for unit, size in sizes if not _contradicts(values * size, stated)]
        if len(units) == 1 and units[0] != "s":
            self.decisions.append(note("unit_by_stated_rate", unit=units[0], rate=stated))
            return UNITS[units[0]]
        reading = decided(values, self.fastest)
        ways = possible(values, self.fastest)
        if not units and reading is None and len(ways) > 1:
            remedies = ", ".join(f"`time_unit` {w.unit} for {w.rate:.4g} per second" for w in ways)
            text = f"{self.key} column {column.name!r} must have a unit, but has none"
            raise AskedError(f"{text}: give {remedies}", "time_unit", ways[0].unit)
        if units or reading is None or reading.unit == "s":
            self.decisions.append(note("unit_of_times", unit="", column=column.name))
            return 1.0
        slow = 1.0 / typical_step(values)
        by_rate = note("unit_by_rate", unit=reading.unit, rate=reading.rate, slow=slow)
        self.decisions.append(by_rate)
        return reading.seconds


def read_times(
    table: CsvTable, key: str = "FILE", unit: str | None = None, fastest: float = FASTEST
) -> RowTimes | None:
    """The times of the rows from the first column of times; None if the file has none.

    ``unit`` is one of `UNITS` that the user gives, ``fastest`` the highest possible rate (Hz).
    Raises InputError for a unit of another quantity, and AskedError for several possible units;
    both begin with ``key``.
    """
    columns = [column for column in table.find(is_time) if np.isfinite(column.values).any()]
    if not columns:
        return None
    reader = _Reader(table, key, unit, fastest, [])
    column, raw = _finest(columns, unit, reader.decisions)
    values, turns, modulus = unrolled(raw)
    if turns:
        reader.decisions.append(note("rolled_over", times=turns, by=modulus))
    values = values * reader.seconds(column, values)
    stated = table.facts.rate
    if stated is not None and _contradicts(values, stated):
        rate = 1.0 / typical_step(values)
        reader.decisions.append(warning("rate_contradicts", rate=rate, stated=stated))
    return RowTimes(values, column, tuple(reader.decisions))


def times(table: CsvTable, key: str, fastest: float = FASTEST) -> Floats | None:
    """The times of a table that states their unit, in s; None if it has no times.

    Raises InputError, which begins with ``key``, as `read_times`, for a unit that the rate alone
    decides, for a rate above the numbers that contradicts the times, and a counter that rolls over.
    """
    try:
        read = read_times(table, key, None, fastest)
    except AskedError:
        raise _open_unit(table.find(is_time)[0], key, fastest) from None
    if read is None:
        return None
    for line in read.decisions:
        if line.code == "unit_by_rate":
            raise _open_unit(read.column, key, fastest)
        if line.code == "rolled_over":
            raise InputError(f"{key} must have ascending times, but their counter rolls over")
        if line.code == "rate_contradicts":
            raise InputError(
                f"{key} must state one sampling rate, but has {line.numbers['stated']:g} Hz above "
                f"its numbers and {line.numbers['rate']:.6g} Hz in its times: correct one of them"
            )
    return read.values


def _open_unit(column: CsvColumn, key: str, fastest: float) -> InputError:
    """The error of times whose unit the file must state."""
    ways = possible(column.values, fastest)
    rates = ", ".join(f"'{column.name} ({way.unit})' for {way.rate:.4g} Hz" for way in ways)
    slow = 1.0 / typical_step(column.values)
    return InputError(
        f"{key} column {column.name!r} must have a unit, for its steps are hardly seconds: "
        f"name it {rates}, or '{column.name} (s)' for {slow:.4g} Hz"
    )


def record_times(
    table: CsvTable, facts: RecordFacts, notes: list[Diagnostic], warnings: list[Diagnostic]
) -> Floats | None:
    """The times of the rows in s; None if the file has neither times nor a counter of samples.

    Raises InputError as `read_times`.
    """
    read = read_times(table, unit=facts.time_unit)
    if read is not None:
        for line in read.decisions:
            (warnings if line.severity == "warning" else notes).append(line)
        check_sizes(read.column, read.values)
        return read.values
    counters = [column for column in table.find(is_counter) if _counts(column.values)]
    rate = sampling_rate(table, facts.rate, notes) if counters else None
    if rate is None:
        return None
    values, times, modulus = unrolled(counters[0].values)
    if times:
        notes.append(note("rolled_over", times=times, by=modulus))
    if float(np.nanmedian(np.diff(values))) != 1.0:
        return None
    lost = int(np.nanmax(values) - np.nanmin(values)) + 1 - len(values)
    notes.append(note("counted_rows", column=counters[0].name, lost=lost))
    return values / rate


def sampling_rate(table: CsvTable, given: float | None, notes: list[Diagnostic]) -> float | None:
    """The sampling rate (Hz) of rows without times, ``given`` or from above the numbers.

    None if neither has it.  Raises AskedError for a period without a unit that leaves several.
    """
    stated = table.facts.rate
    if given is not None:
        if stated is not None and abs(given / stated - 1.0) > CONTRADICTS:
            notes.append(note("given_rate", given=given, stated=stated))
        return given
    period = table.facts.period
    if stated is not None or period is None:
        return stated
    ways = possible(np.array([0.0, period, 2.0 * period]))
    if len(ways) == 1:
        notes.append(note("unit_of_period", period=period, unit=ways[0].unit))
        return ways[0].rate
    offers = ", ".join(f"`rate` {way.rate:.6g} if it is in {way.unit}" for way in ways)
    text = f"FILE must state the unit of its sampling period, {period:g}, but has none"
    raise AskedError(f"{text}: give {offers or '`rate`'}", "rate")


def _counts(values: Floats) -> bool:
    """Whether numbers are whole, and mostly rise by one."""
    known = values[np.isfinite(values)]
    return len(known) == len(values) > 1 and bool(
        (known == np.round(known)).all() and np.median(np.diff(known)) == 1.0
    )


def _contradicts(values: Floats, stated: float | None) -> bool:
    """Whether neither the typical step nor the mean one is that of a stated rate."""
    known = values[np.isfinite(values)]
    if stated is None or len(known) < 2:
        return False
    mean = float(known[-1] - known[0]) / (len(known) - 1)
    return all(
        step > 0.0 and abs(stated * step - 1.0) > CONTRADICTS
        for step in (typical_step(values), mean)
    )


def _finest(
    columns: Sequence[CsvColumn], unit: str | None, decisions: list[Diagnostic]
) -> tuple[CsvColumn, Floats]:
    """The column of times, and its numbers.

    If the first one repeats its times, as whole seconds do, the one that continues between, or the
    first with the fractions of a second that another one has.
    """
    first = columns[0]
    raw = first.values - (np.nanmin(first.values) if first.clock else 0.0)
    if unit is not None or len(columns) == 1 or repeated(raw) <= COARSE:
        return first, raw
    size = 1.0 if first.clock else unit_of_time(first)[0]
    for other in columns[1:]:
        factor, _ = unit_of_time(other)
        if size is not None and factor is not None and not other.clock:
            whole = with_fraction(raw * size, other.values * factor)
            if whole is not None:
                decisions.append(note("fraction_column", column=other.name))
                return first, whole / size
        if repeated(other.values) < 0.5 * repeated(raw):
            decisions.append(note("finer_times", column=other.name, coarse=first.name))
            return other, other.values
    return first, raw


def check_sizes(column: CsvColumn, values: Floats) -> None:
    """Refuse numbers so large, or all so small, that their squares or quotients overflow."""
    sizes = np.abs(values)
    large = sizes > LARGEST
    if large.any():
        row = int(large.argmax()) + 1
        raise invalid(
            f"FILE column {column.name!r} row {row}",
            f"be at most {LARGEST:g} in size",
            float(column.values[row - 1]),
        )
    top = float(np.nanmax(sizes, initial=0.0))
    if 0.0 < top < SMALLEST:
        raise invalid(
            f"FILE column {column.name!r}",
            f"have a number of at least {SMALLEST:g} in size or only zeros",
            top,
        )
