"""Recorded excitation from CSV files: which columns are the time, the acceleration, the frequency and the density.

The header names the columns with their units, in any order: ``time (s),acceleration (g)`` at equal
time steps, or ``frequency (Hz),psd (g^2/Hz)``, one-sided.  Other spellings are also read
(`harvester.records.csv_table`); an ambiguous or uneven file is refused, with the command that mends
it.
"""

import math
import shlex
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.machine import files
from harvester.quantities.kinds import ACCELERATION, ACCELERATION_PSD, FREQUENCY, TIME
from harvester.records.cleaning import Part, clean
from harvester.records.csv_table import (
    MOST_BYTES,
    CsvColumn,
    CsvTable,
    check_numbers,
    read_table,
    table_of_text,
)
from harvester.records.density_slopes import (
    RANGE,
    SLOPE,
    Row,
    breakpoints,
    marked,
    slopes,
    with_ranges,
)
from harvester.records.long_record import UNEVEN, long_record
from harvester.records.named_columns import (
    is_acceleration,
    is_frequency,
    is_time,
    no_column,
    numbers,
)
from harvester.records.plain_text import decoded
from harvester.records.read_once import read_once
from harvester.records.record_clock import times
from harvester.records.record_facts import AskedError, MendError, RecordFacts
from harvester.records.record_times import FEWEST
from harvester.records.records import Record, TabulatedDensity

UNKNOWN_VALUES = {"rate": "HZ", "unit": "UNIT"}  # names of values that only the user knows
_TRIES = 6  # options that a file may need


def remedy(path: str) -> str:
    """The command that cleans a file, with the options that it needs; empty if no options help."""
    try:
        if Path(path).stat().st_size > MOST_BYTES:
            return ""
    except (OSError, ValueError):
        return ""
    facts = RecordFacts()
    part = Part()
    options = dict[str, str]()
    for _ in range(_TRIES):
        try:
            clean(path, facts, part)
        except AskedError as asked:
            if asked.option == "longest":
                part = Part(longest=True)
                options["--longest"] = ""
                continue
            name = "--" + asked.option.replace("_", "-")
            if asked.value is None:
                options[name] = UNKNOWN_VALUES.get(asked.option, asked.option.upper())
                break
            chosen: dict[str, Any] = {asked.option: asked.value}
            facts = replace(facts, **chosen)
            options[name] = asked.value
            continue
        except InputError:
            return ""
        break
    every = [word for pair in options.items() for word in pair if word]
    words = ["harvester", "record", path, *every, "--out", "clean.csv"]
    typed = (word if word in UNKNOWN_VALUES.values() else shlex.quote(word) for word in words)
    return f"'{' '.join(typed)}'"


STEP = 1e-9  # of a frequency: the width of a density's step
RECORD = "excitation.acceleration_file"
_DENSITIES = frozenset(["psd", "asd", "density", "spectrum", "dichte", "apsd", "gxx", "spd"])


def _is_density(column: CsvColumn) -> bool:
    """Whether a column is named as a density, or has the unit of one of an acceleration, whatever its name."""
    named = bool(_DENSITIES & set(column.words)) or column.head.strip("[]() ").lower() in (
        "g2/hz",
        "g^2/hz",
    )
    return named or (column.stated != "" and column.in_si(ACCELERATION_PSD) is not None)


def _is_abscissa(column: CsvColumn) -> bool:
    """Whether a column holds the frequencies; the unit of a density also has Hz."""
    return is_frequency(column) and not _is_density(column)


def read_record(path: str) -> Record:
    """Read the record of a CSV file, in SI units, with its `bridge` if it is not a whole period.

    A long one in blocks.

    Raises InputError in one line, for a file that cannot be read or has no such columns, times that
    do not ascend in equal steps, values that are not finite numbers, or too few of them.
    """
    try:
        return read_once(_record, path)
    except InputError as error:
        command = remedy(path)
        plain = error.plain if isinstance(error, MendError) else str(error)
        raise InputError(f"{plain}: {command} mends it" if command else str(error)) from None


def _record(path: str) -> Record:
    return long_record(path, RECORD, _columns, partial(read_once, _whole, path)) or _whole(path)


def _columns(table: CsvTable) -> tuple[Floats, Floats]:
    """The times (s) and the accelerations (m/s^2) of a table."""
    key = RECORD
    if table.notes:
        raise MendError(f"{key} must have numbers in each row, but {table.notes[0]}")
    time = times(table, key)
    if time is None:
        raise no_column(table, key, "time", TIME)
    check_numbers(table, table.find(is_time)[0], time, key)
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
        raise MendError(f"{key} must have ascending times, but row {row} does not")
    spacing = float(time[-1] - time[0]) / len(steps)
    off = np.abs(time - time[0] - spacing * np.arange(len(time)))
    if off.max() > UNEVEN * spacing:
        raise MendError(f"{key} must have equal time steps, but row {int(off.argmax()) + 1} is off")
    if not values.any():
        raise invalid(key, "have accelerations other than 0", 0.0)
    return Record.of(spacing, values)


def read_density(path: str) -> TabulatedDensity:
    """Read the density of a CSV file, in SI units; InputError as for `read_record`."""
    return read_once(_density, path)


def _density(path: str) -> TabulatedDensity:
    key = "excitation.acceleration_psd_file"
    text = decoded(files.read(path, key, MOST_BYTES), path, key)
    if SLOPE.search(text) or RANGE.search(text):
        return _with_slopes(text, path, key)
    table = read_table(path, key)
    frequency, f = numbers(table, key, _is_abscissa, "frequency", FREQUENCY)
    column, values = numbers(table, key, _is_density, "psd", ACCELERATION_PSD)
    check_numbers(table, frequency, f, key)
    check_numbers(table, column, values, key)
    return _checked(f, values, key)


def _checked(f: Floats, values: Floats, key: str) -> TabulatedDensity:
    """The density of breakpoints.

    InputError for such as do not ascend, and for densities below 0.
    """
    f = _with_steps(f)
    if len(f) < 2 or not (f[0] > 0.0 and (np.diff(f) > 0.0).all()):
        raise InputError(f"{key} must have two ascending frequencies above 0 or more, but has not")
    if not (values >= 0.0).all() or not values.any():
        raise InputError(f"{key} must have densities of at least 0, and some above, but has not")
    return TabulatedDensity(f, values)


def _with_slopes(text: str, path: str, key: str) -> TabulatedDensity:
    """The PSD of a table with slopes or ranges."""
    plain, ends = with_ranges(marked(text))
    table = table_of_text(plain, path, key)
    frequency, f = numbers(table, key, _is_abscissa, "frequency", FREQUENCY)
    check_numbers(table, frequency, f, key)
    values, steep = slopes(next(iter(table.find(_is_density)), frequency).values)
    columns = tuple(replace(c, values=values) if _is_density(c) else c for c in table.columns)
    _, densities = numbers(
        replace(table, columns=columns), key, _is_density, "psd", ACCELERATION_PSD
    )
    known = int(np.argmax(frequency.values != 0.0))  # 0 Hz has no scale
    scale = float(f[known] / frequency.values[known])
    highs = np.array(ends[len(ends) - len(f) :]) * scale
    rows = [
        Row(float(low), float(low if math.isnan(high) else high), float(value), float(slope))
        for low, high, value, slope in zip(f, highs, densities, steep, strict=True)
    ]
    return _checked(*breakpoints(rows, key), key)


def _with_steps(f: Floats) -> Floats:
    """Frequencies of which two in a row may be equal, if a density steps: the second one is a little higher."""
    stepped = f.copy()
    stepped[1:][np.diff(f) == 0.0] *= 1.0 + STEP
    return stepped
