"""Recorded shaking from CSV files: which columns are the time, the acceleration, the frequency and the density.

The header names the columns with their units, in any order: ``time (s),acceleration (g)`` at equal
steps of time, or ``frequency (Hz),psd (g^2/Hz)``, one-sided.  Other spellings are read too
(`harvester.records.csv_table`); what is ambiguous or uneven is refused, with the command that mends
it.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.quantities.kinds import ACCELERATION, ACCELERATION_PSD, FREQUENCY, TIME, Kind
from harvester.records.csv_table import CsvColumn, CsvTable, check_numbers, read_table
from harvester.records.long_record import MEND, UNEVEN, long_record
from harvester.records.records import Record, TabulatedDensity

_T = TypeVar("_T")
FEWEST = 16  # rows of a record
STEP = 1e-9  # of a frequency: the width of a density's step
RECORD = "excitation.acceleration_file"
AXES = ("x", "y", "z")
_TIMES = frozenset(
    ("time", "t", "timestamp", "timestamps", "datetime", "date", "elapsed", "seconds", "sec")
)
_TIMES |= {"zeit", "uhrzeit", "temps", "relative"}
_ACCELERATIONS = frozenset(
    ("a", "acc", "accel", "acceleration", "accelerometer", "vibration", "base", "shaker")
)
_ACCELERATIONS |= {"beschleunigung"}
_FREQUENCIES = frozenset(["frequency", "freq", "f", "hz", "frequenz", "frequencies"])
_DENSITIES = frozenset(["psd", "asd", "density", "spectrum", "dichte", "apsd", "gxx", "spd"])


def is_time(column: CsvColumn) -> bool:
    """Whether a column is named as a time, or holds dates or times of day."""
    return column.clock or (
        column.words[:1] != () and (column.words[0] in _TIMES or column.words[-1] in _TIMES)
    )


def is_frequency(column: CsvColumn) -> bool:
    """Whether a column is named as a frequency."""
    return bool(_FREQUENCIES & set(column.words))


def is_acceleration(column: CsvColumn) -> bool:
    """Whether a column is named as an acceleration, by an axis, or as a channel of a logger."""
    axes = {axis + letter for axis in ("a", "acc", "accel", "") for letter in AXES} | {
        "ch",
        "channel",
        "kanal",
    }
    return bool(set(column.words) & (_ACCELERATIONS | axes)) and not is_time(column)


def _is_density(column: CsvColumn) -> bool:
    """Whether a column is named as a density, or has the unit of one of an acceleration, whatever its name."""
    named = bool(_DENSITIES & set(column.words)) or column.head.strip("[]() ").lower() in (
        "g2/hz",
        "g^2/hz",
    )
    return named or (column.stated != "" and column.in_si(ACCELERATION_PSD) is not None)


def times(table: CsvTable, key: str) -> Floats | None:
    """The times of a table in seconds, from its first column of times; None if it has none.

    A column that is named as a time and has no unit is in seconds.  Raises InputError for a unit
    that is not one of time.
    """
    columns = table.find(is_time)
    if not columns:
        return None
    column = columns[0]
    if column.clock:
        return column.values
    values = column.in_si(TIME)
    if values is not None:
        return values
    if column.stated:
        raise invalid(f"{key} column {column.name!r}", "have a unit such as s", column.stated)
    return column.values


def read_record(path: str) -> Record:
    """Read the record of a CSV file, in SI units, with its `bridge` if it is not a whole period; a long one in blocks.

    Raises InputError in one line, for a file that cannot be read or has no such columns, times that
    do not ascend in equal steps, values that are not finite numbers, or too few of them.
    """
    return read_once(_record, path)


def _record(path: str) -> Record:
    return long_record(path, RECORD, _columns, partial(read_once, _whole, path)) or _whole(path)


def _columns(table: CsvTable) -> tuple[Floats, Floats]:
    """The times (s) and the accelerations (m/s^2) of a table."""
    key = RECORD
    time = times(table, key)
    if time is None:
        raise no_column(
            table, key, "time", TIME, ": or 'harvester record FILE --rate HZ' adds the times"
        )
    check_numbers(table, table.find(is_time)[0], time, key)
    columns = table.find(is_acceleration)
    if len(columns) > 1:
        names = ", ".join(column.name for column in columns)
        raise InputError(
            f"{key} must have one acceleration, but has {shown(names)}: "
            "'harvester record FILE --axis z --out clean.csv' takes one of them"
        )
    column, values = numbers(table, key, is_acceleration, "acceleration", ACCELERATION)
    check_numbers(table, column, values, key)
    return time, values


def _whole(path: str) -> Record:
    key = RECORD
    time, values = _columns(read_table(path, key))
    steps = np.diff(time)
    if len(time) < FEWEST:
        raise invalid(key, f"have at least {FEWEST} rows", len(time))
    if not (steps > 0.0).all():
        row = int(np.argmin(steps > 0.0)) + 2
        raise InputError(f"{key} must have ascending times, but row {row} does not: {MEND}")
    spacing = float(time[-1] - time[0]) / len(steps)
    off = np.abs(time - time[0] - spacing * np.arange(len(time)))
    if off.max() > UNEVEN * spacing:
        raise InputError(
            f"{key} must have equal steps of time, but row {int(off.argmax()) + 1} is off: {MEND}"
        )
    if not values.any():
        raise invalid(key, "have accelerations other than 0", 0.0)
    return Record.of(spacing, values)


def read_density(path: str) -> TabulatedDensity:
    """Read the density of a CSV file, in SI units; InputError as for `read_record`."""
    return read_once(_density, path)


def _density(path: str) -> TabulatedDensity:
    key = "excitation.acceleration_psd_file"
    table = read_table(path, key)
    frequency, f = numbers(table, key, is_frequency, "frequency", FREQUENCY)
    column, values = numbers(table, key, _is_density, "psd", ACCELERATION_PSD)
    check_numbers(table, frequency, f, key)
    check_numbers(table, column, values, key)
    f = _with_steps(f)
    if len(f) < 2 or not (f[0] > 0.0 and (np.diff(f) > 0.0).all()):
        raise InputError(f"{key} must have two ascending frequencies above 0 or more, but has not")
    if not (values >= 0.0).all() or not values.any():
        raise InputError(f"{key} must have densities of at least 0, and some above, but has not")
    return TabulatedDensity(f, values)


def _with_steps(f: Floats) -> Floats:
    """Frequencies of which two in a row may be equal, if a density steps: the second one is a little higher."""
    stepped = f.copy()
    stepped[1:][np.diff(f) == 0.0] *= 1.0 + STEP
    return stepped


def numbers(
    table: CsvTable, key: str, predicate: Callable[[CsvColumn], bool], name: str, kind: Kind
) -> tuple[CsvColumn, Floats]:
    """The first column for which ``predicate`` holds, and its numbers in SI units."""
    columns = table.find(predicate)
    if not columns:
        raise no_column(table, key, name, kind)
    column = columns[0]
    values = column.in_si(kind)
    if values is not None:
        return column, values
    if kind is FREQUENCY and not column.stated:  # a frequency has no other usual unit than Hz
        return column, column.values
    if not column.stated:
        raise InputError(
            f"{key} column {column.name!r} must have a unit, such as '{name} ({kind.unit})', but has none"
        )
    raise invalid(
        f"{key} column {column.name!r}", f"have a unit such as {kind.unit}", column.stated
    )


def no_column(table: CsvTable, key: str, name: str, kind: Kind, more: str = "") -> InputError:
    """The error of a file without a column."""
    has = (
        shown(table.heads) if any(column.stated for column in table.columns) else "none with a unit"
    )
    return InputError(f"{key} must have a column '{name} ({kind.unit})', but has {has}{more}")


def read_once(read: Callable[[str], _T], path: str) -> _T:
    """What a file holds; one that did not change is read once."""
    try:
        state = Path(path).stat()
    except (OSError, ValueError):  # the reader says why
        return read(path)
    content: _T = _kept(read, path, (state.st_mtime_ns, state.st_size))
    return content


@lru_cache(8)
def _kept(read: Callable[[str], Any], path: str, _state: tuple[int, int]) -> Any:
    return read(path)
