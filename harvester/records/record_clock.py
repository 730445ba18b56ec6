"""The times of a logger's rows in s, from its clock, its times, or its counter of samples.

A time unit that is not stated is decided by the sampling rates of accelerometers
(`harvester.records.time_units`), and reported; a counter that rolls over is continued.
"""

import numpy as np

from harvester.arrays import Floats
from harvester.errors import invalid
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.quantities.units import LARGEST
from harvester.records.csv_table import CsvColumn, CsvTable
from harvester.records.named_columns import is_counter, is_time, unit_of_time
from harvester.records.record_facts import AskedError
from harvester.records.time_units import SLOWEST, UNITS, decided, possible, typical_step, unrolled


def record_times(
    table: CsvTable,
    rate: float | None,
    unit: str | None,
    notes: list[Diagnostic],
    warnings: list[Diagnostic],
) -> Floats | None:
    """The times of the rows in s; None if the file has neither times nor a counter of samples.

    Raises InputError for a unit of another quantity, and for times with several possible units.
    """
    columns = [column for column in table.find(is_time) if np.isfinite(column.values).any()]
    if columns:
        time = _clocked(columns[0], unit, notes, warnings)
        check_sizes(columns[0], time)
        return time
    counters = [column for column in table.find(is_counter) if _counts(column.values)]
    rate = rate if rate is not None else table.facts.rate
    if not counters or rate is None:
        return None
    values, times, modulus = unrolled(counters[0].values)
    if times:
        notes.append(note("rolled_over", times=times, by=modulus))
    if float(np.nanmedian(np.diff(values))) != 1.0:
        return None
    lost = int(np.nanmax(values) - np.nanmin(values)) + 1 - len(values)
    notes.append(note("counted_rows", column=counters[0].name, lost=lost))
    return values / rate


def _counts(values: Floats) -> bool:
    """Whether numbers are whole, and mostly rise by one."""
    known = values[np.isfinite(values)]
    return len(known) == len(values) > 1 and bool(
        (known == np.round(known)).all() and np.median(np.diff(known)) == 1.0
    )


def _clocked(
    column: CsvColumn, unit: str | None, notes: list[Diagnostic], warnings: list[Diagnostic]
) -> Floats:
    """The times of a column in s."""
    raw = column.values - (np.nanmin(column.values) if column.clock else 0.0)
    values, times, modulus = unrolled(raw)
    if times:
        notes.append(note("rolled_over", times=times, by=modulus))
    if column.clock and unit is None:
        return values
    if unit is not None:
        if unit not in UNITS or column.clock:
            must = "be left out for a clock" if column.clock else f"be one of {', '.join(UNITS)}"
            raise invalid("`time_unit`", must, unit)
        return values * UNITS[unit]
    factor, known = unit_of_time(column)
    if factor is not None:
        if not column.stated:
            notes.append(note("unit_of_times", unit=known, column=column.name))
        elif (step := typical_step(values) * factor) * SLOWEST > 1.0 and possible(values):
            other = possible(values)[0]
            warnings.append(
                warning("slow_times", rate=1.0 / step, unit=other.unit, other=other.rate)
            )
        return values * factor
    if column.stated:
        raise invalid(f"FILE column {column.name!r}", "have a unit such as s", column.stated)
    return values * _read_as(column, values, notes)


def _read_as(column: CsvColumn, values: Floats, notes: list[Diagnostic]) -> float:
    """The seconds of one of a column's numbers, which have no unit."""
    reading = decided(values)
    ways = possible(values)
    if reading is None and len(ways) > 1:
        remedies = ", ".join(f"`time_unit` {w.unit} for {w.rate:.4g} per second" for w in ways)
        text = f"FILE column {column.name!r} must have a unit, but has none: give {remedies}"
        raise AskedError(text, "time_unit", ways[0].unit)
    if reading is None or reading.unit == "s":
        notes.append(note("unit_of_times", unit="", column=column.name))
        return 1.0
    step = typical_step(values)
    notes.append(note("unit_by_rate", unit=reading.unit, rate=reading.rate, slow=1.0 / step))
    return reading.seconds


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
