"""Columns by their names: times, counters, accelerations and frequencies, in SI units."""

from collections.abc import Callable

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.quantities.kinds import FREQUENCY, TIME, Kind
from harvester.records.csv_table import CsvColumn, CsvTable, refuse_summary
from harvester.records.time_units import UNITS

AXES = ("x", "y", "z")


def words_of(text: str) -> frozenset[str]:
    """The words of a text, as of names of columns."""
    return frozenset(text.split())


_TIMES = words_of(
    "time t ts timestamp timestamps datetime date elapsed seconds sec zeit uhrzeit temps tijd "
    "tiempo tempo relative epoch clock millis micros milliseconds microseconds msec usec nsec uptime"
)
_STAMPS = words_of("timestamp timestamps datetime")  # times, at any place in a name
_ABSCISSAS = (("x", "value"), ("x", "0", "d", "x"))  # LabVIEW's X_Value, and X0/dX of times
_COUNTERS = words_of("sample samples index idx count counter n nr no number row seq")
_ACCELERATIONS = words_of(
    "a acc accel acceleration accelerometer vibration base shaker beschleunigung ch channel kanal"
)
_TIME_WORDS = {"millis": "ms", "milliseconds": "ms", "msec": "ms"}
_TIME_WORDS |= {"micros": "us", "microseconds": "us", "usec": "us", "nsec": "ns"}
_HERTZ = ("hz", "khz", "mhz", "ghz")
_FREQUENCIES = words_of("frequency freq f hz frequenz frequencies")


def is_time(column: CsvColumn) -> bool:
    """Whether a column is named as a time, or holds dates or times of day."""
    if column.texts is not None:
        return False
    if column.words in _ABSCISSAS:
        return True
    return column.clock or (
        column.words[:1] != ()
        and (
            column.words[0] in _TIMES
            or column.words[-1] in _TIMES
            or bool(_STAMPS & set(column.words))
        )
    )


def is_counter(column: CsvColumn) -> bool:
    """Whether a column is named as the number of a sample."""
    return bool(_COUNTERS & set(column.words)) and not is_time(column)


def is_frequency(column: CsvColumn) -> bool:
    """Whether a column is named as a frequency."""
    return bool(_FREQUENCIES & set(column.words)) or column.stated.lower() in _HERTZ


def is_acceleration(column: CsvColumn) -> bool:
    """Whether a column is named as an acceleration, by an axis, or as a channel of a logger."""
    axes = {axis + letter for axis in ("a", "acc", "accel", "") for letter in AXES}
    return (
        bool(set(column.words) & (_ACCELERATIONS | axes))
        and not is_time(column)
        and column.texts is None
    )


def unit_of_time(column: CsvColumn) -> tuple[float | None, str]:
    """The seconds of one of a column's numbers, by its unit or its name, and the text that has it.

    None if neither.
    """
    factor, _ = column.scale(TIME) or (None, 1)
    if factor is not None:
        return factor, next((u for u in column.candidates() if TIME.scale(u)[0] == factor), "")
    words = _TIME_WORDS.items()
    known = "" if column.stated else next((u for word, u in words if word in column.words), "")
    return UNITS.get(known), known


def numbers(
    table: CsvTable, key: str, predicate: Callable[[CsvColumn], bool], name: str, kind: Kind
) -> tuple[CsvColumn, Floats]:
    """The column for which ``predicate`` holds, and its numbers in SI units.

    Raises InputError, which begins with ``key``, if there is none, if there are several, and for a
    unit of another kind.
    """
    refuse_summary(table, key)
    columns = table.find(predicate)
    if not columns:
        raise no_column(table, key, name, kind)
    if len(columns) > 1:
        names = ", ".join(column.name for column in columns)
        raise InputError(
            f"{key} must have one column '{name} ({kind.unit})', but has {shown(names)}"
        )
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
