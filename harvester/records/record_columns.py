"""The acceleration in a logger's table: its column, its unit, and the rows of one sensor.

A fact that the file does not state is asked for with its likeliest value: gravity on a sensor at
rest is 9.81 m/s^2, 1 g or 1000 mg.
"""

import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.quantities.kinds import ACCELERATION, TIME
from harvester.quantities.units import split_unit
from harvester.records.csv_layout import MISSING
from harvester.records.csv_table import CsvColumn, CsvTable
from harvester.records.named_columns import AXES, is_acceleration, is_counter, is_time
from harvester.records.preamble import is_spectral
from harvester.records.record_facts import AskedError

GRAVITIES = {"m/s^2": 9.80665, "g": 1.0, "mg": 1000.0, "mm/s^2": 9806.65, "cm/s^2": 980.665}
_START = "x0"  # names of the start and the step of the times
_STEP = "dx"
_BOTH = "x0/dx"  # one column of both: the start, and the step below it
NEAR_GRAVITY = 0.06  # of gravity: how near the mean of a sensor at rest is to it
_RANGE = re.compile(r"[±+\-/ ]*(\d+(?:\.\d+)?)\s*([mµu]?[gG]|m/s\^?2|m/s²)")
INTERLEAVED = 0.05  # share of rows at which a word changes, from which on sensors alternate
MOST_WORDS = 8  # different words of such a column


def named(table: CsvTable, notes: list[Diagnostic]) -> CsvTable:
    """The table; without names its columns are a time, then one acceleration or x, y and z.

    A column that counts the samples may precede the times, or replace them if the rate is stated.

    Raises InputError for a spectrum, whose first axis is stated to be a frequency.
    """
    if is_spectral(table.facts.x_unit):
        raise InputError(
            "FILE must have accelerations over time, but the lines above its numbers state "
            f"{shown(table.facts.x_unit)} as the unit of the first axis, as of a spectrum: export "
            "the waveform"
        )
    if any(column.head for column in table.columns) or len(table.columns) < 2:
        return table
    first, *others = table.columns
    if not _ascends(first):
        return table
    numbers = [column for column in others if column.texts is None]
    names = _names_by_place(table, first, numbers)
    if not names:
        return table
    heads = dict(zip((column.index for column in (first, *numbers)), names, strict=True))
    notes.append(note("no_names", names=", ".join(names)))
    columns = tuple(replace(column, head=heads.get(column.index, "")) for column in table.columns)
    return replace(table, columns=columns)


def with_steps(table: CsvTable, notes: list[Diagnostic]) -> CsvTable:
    """The table without columns X0 and dX, whose first numbers are the start and the step of the times.

    Measurement systems such as those of imc write them, or one column X0/dX.  A step without a
    unit is a period whose unit is open.
    """
    starts = table.find(lambda column: column.name.lower() in (_START, _BOTH))
    steps = table.find(lambda column: column.name.lower() in (_STEP, _BOTH))
    if len(starts) != 1 or len(steps) != 1 or table.facts.is_sampled:
        return table
    written = steps[0].values[np.isfinite(steps[0].values)]
    if starts == steps:
        written = written[1:]
    if not written.size or not (written > 0.0).all() or (written != written[0]).any():
        return table
    seconds = steps[0].in_si(TIME)
    period = float(written[0])
    if seconds is None:
        facts = replace(table.facts, period=period)
    else:
        facts = replace(table.facts, rate=1.0 / float(seconds[np.isfinite(seconds)][-1]))
    notes.append(note("step_in_column", column=steps[0].name))
    left = tuple(c for c in table.columns if c is not starts[0] and c is not steps[0])
    return replace(table, columns=left, facts=facts)


def _names_by_place(table: CsvTable, first: CsvColumn, numbers: list[CsvColumn]) -> tuple[str, ...]:
    """The names of columns that have none, in order; empty if their number leaves them open."""
    counts = table.facts.is_sampled and bool((np.diff(first.values) == 1.0).all())
    rows = ["sample" if counts else "time"]
    if counts and len(numbers) > 1 and _ascends(numbers[0]):
        rows.append("time")
    left = len(numbers) + 1 - len(rows)
    axes = ("acceleration",) if left == 1 else AXES if left == len(AXES) else ()
    return (*rows, *axes) if axes else ()


def _ascends(column: CsvColumn) -> bool:
    """Whether a column may be the times: a clock, or numbers that mostly ascend."""
    steps = np.diff(column.values)
    return column.clock or bool(np.count_nonzero(steps > 0.0) > 0.9 * steps.size)


def axis_column(table: CsvTable, axis: str | None) -> CsvColumn:
    """The column of an axis, x, y or z, or of that name or number.

    The only acceleration by default.
    """
    if not table.find(lambda c: not is_time(c) and bool(np.isfinite(c.values).any())):
        raise InputError(
            f"FILE must have accelerations and times, but {shown(table.heads)} has numbers in its "
            "times alone: export its axes as well"
        )
    columns = table.find(is_acceleration)
    if axis is not None:
        return _named_column(table, columns, axis)
    if not columns:
        others = table.find(lambda c: not is_time(c) and not is_counter(c) and c.texts is None)
        columns = others if len(others) == 1 else []
    if len(columns) != 1:
        names = ", ".join(column.name for column in columns) or table.heads
        likely = [c.name for c in columns if _is_vertical(c)]
        raise AskedError(
            f"`axis` must be given if FILE has several columns, {shown(names)}, but is left out",
            "axis",
            next(iter((*likely, *(column.name for column in columns))), None),
        )
    return columns[0]


def _is_vertical(column: CsvColumn) -> bool:
    """Whether a column is named by the last axis, along which gravity mostly is."""
    z = AXES[-1]
    return z in column.words or "".join(column.words[-1:]).endswith(z)


def _named_column(table: CsvTable, columns: list[CsvColumn], axis: str) -> CsvColumn:
    """The column that ``axis`` names, by its head, name or number, or as one of x, y and z."""
    short = axis.strip().lower()
    matches = [c for c in table.columns if short in _names(c)]
    if short in AXES:
        axes = {short, "a" + short, "acc" + short, "accel" + short}
        matches += [c for c in columns if axes & set(c.words) and c not in matches]
    if not matches:
        raise InputError(
            f"`axis` must be one of the columns of FILE, {shown(table.heads)}, but is {shown(axis)}"
        )
    if len(matches) > 1 and matches[1].name == matches[0].name:
        numbers = [f"column {column.index + 1}" for column in matches]
        raise AskedError(
            f"`axis` must name one column of FILE, but {shown(axis)} is the name of "
            f"{len(matches)}: give `axis` {numbers[0]!r} or {numbers[1]!r}",
            "axis",
            numbers[0],
        )
    return matches[0]


def _names(column: CsvColumn) -> tuple[str, ...]:
    """The names of a column in small letters: its head, its name without the unit, its number."""
    return column.head.strip().lower(), column.name.lower(), f"column {column.index + 1}"


def accelerations(
    table: CsvTable, column: CsvColumn, unit: str | None, notes: list[Diagnostic]
) -> Floats:
    """The accelerations of a column (m/s^2), in its own, the preamble's, or a given unit.

    Raises InputError for a column without numbers, and one whose unit is neither stated nor given.
    """
    if not np.isfinite(column.values).any():
        raise InputError(
            f"FILE column {column.name!r} must have numbers, but all its rows are empty"
        )
    if unit is not None:
        scale = column.scale(ACCELERATION) or (_scale(table.facts.y_unit), 1)
        if scale[0] is not None and not math.isclose(scale[0], _factor(unit)):
            stated = column.stated or table.facts.y_unit or column.head
            notes.append(note("given_unit", given=unit, stated=stated))
        return column.values * _factor(unit)
    values = column.in_si(ACCELERATION)
    if values is not None:
        return values
    if not column.stated and table.facts.y_unit and _scale(table.facts.y_unit) is not None:
        notes.append(note("unit_of_preamble", unit=table.facts.y_unit))
        return column.values * _factor(table.facts.y_unit)
    span = _RANGE.fullmatch(column.stated)
    if span is not None and np.nanmax(np.abs(column.values)) <= float(span[1]):
        notes.append(note("range_in_brackets", range=column.stated, unit=span[2]))
        return column.values * _factor(span[2])
    raise _no_unit(table, column)


def unit_against_gravity(
    table: CsvTable, column: CsvColumn, unit: str | None
) -> Iterator[Diagnostic]:
    """A warning if the mean of a column, not one of volts, is gravity in another unit than the given one."""
    if unit is None or column.scale(ACCELERATION) is not None:
        return
    if _is_voltage(column.stated or table.facts.y_unit or ""):
        return
    likely = _by_gravity(table, column)
    # 1024 counts of 0.977 mg are gravity, and near that in mg
    if likely and not math.isclose(_factor(unit), _factor(likely), rel_tol=2.0 * NEAR_GRAVITY):
        yield warning("unit_against_gravity", given=unit, likely=likely)


def _no_unit(table: CsvTable, column: CsvColumn) -> AskedError:
    """The error of a column without a unit, with the unit that gravity on it suggests."""
    likely = _by_gravity(table, column)
    stated = column.stated or table.facts.y_unit
    if stated and _is_voltage(stated):
        return AskedError(
            f"FILE column {column.name!r} must be an acceleration, but is in {stated}: "
            f"give `unit` '10 g' if 1 {stated} is 10 g, by the sensitivity of the sensor",
            "unit",
        )
    was = f"is {shown(stated)}" if stated else "has none"
    hint = (
        f"give `unit` {likely}, for its mean is gravity in that"
        if likely
        else "give `unit` g, mg or m/s^2"
    )
    return AskedError(
        f"FILE column {column.name!r} must have a unit such as g, mg or m/s^2 behind its name, but {was}: {hint}"
        + ("" if likely else ", or for counts the size of one count, such as '0.488 mg'"),
        "unit",
        likely or None,
    )


def _is_voltage(unit: str) -> bool:
    from harvester.quantities.kinds import VOLTAGE

    return VOLTAGE.scale(unit)[0] is not None


def _by_gravity(table: CsvTable, column: CsvColumn) -> str:
    """The unit in which the mean of the axes, or of this one, is gravity; empty if none."""
    axes = [
        c for c in table.find(is_acceleration) if c.texts is None and np.isfinite(c.values).any()
    ]
    means = [float(np.nanmean(c.values)) for c in axes]
    sizes = [abs(float(np.nanmean(column.values)))]
    if len(axes) == len(AXES):
        sizes.append(math.sqrt(sum(mean * mean for mean in means)))
    return next(
        (
            unit
            for unit, gravity in GRAVITIES.items()
            for size in sizes
            if abs(size / gravity - 1.0) < NEAR_GRAVITY
        ),
        "",
    )


def _scale(unit: str) -> float | None:
    """The size in m/s^2 of one g, one mg, or one '0.488 mg'.

    None if that is not an acceleration.
    """
    parts = split_unit(unit)
    number, name = parts if parts is not None else (1.0, unit.strip())
    factor, power = ACCELERATION.scale(name)
    return number * factor if factor is not None and power == 1 and number > 0.0 else None


def _factor(unit: str) -> float:
    factor = _scale(unit)
    if factor is None:
        raise invalid(
            "`unit`",
            "be a unit of acceleration such as g, or the size of one count, such as '0.488 mg'",
            unit,
        )
    return factor


def chosen_rows(table: CsvTable, where: str | None) -> CsvTable:
    """The rows of one sensor: those with a word in a column, by ``where`` such as 'sensor=A'.

    Raises InputError for a condition that no row meets, and without one for a column whose words
    alternate.
    """
    words = table.find(lambda column: column.texts is not None)
    if where is None:
        for column in words:
            _refuse_interleaved(column)
        return table
    name, equals, word = where.partition("=")
    matches = [column for column in words if name.strip().lower() in _names(column)]
    if not equals or not matches:
        has = ", ".join(column.name for column in words) or "FILE has none"
        raise invalid("`where`", f"be COLUMN=WORD, of a column of words ({has})", where)
    texts = np.array(matches[0].texts, object)
    keep = texts == word.strip()
    if not keep.any():
        has = ", ".join(sorted(set(map(str, texts)))[:MOST_WORDS])
        must = f"name a word of column {matches[0].name!r}, which has {has}"
        raise invalid("`where`", must, where)
    return _kept(table, keep)


def _kept(table: CsvTable, keep: Any) -> CsvTable:
    """The rows of a table for which ``keep`` is true."""
    number = {int(row): k for k, row in enumerate(np.flatnonzero(keep), 1)}
    columns = []
    for column in table.columns:
        texts = column.texts and tuple(np.array(column.texts, object)[keep])
        columns.append(replace(column, values=column.values[keep], texts=texts))
    bad = tuple((number[row - 1], k, text) for row, k, text in table.bad if row - 1 in number)
    return replace(table, columns=tuple(columns), bad=bad)


def _refuse_interleaved(column: CsvColumn) -> None:
    texts = column.texts or ()
    different = sorted(set(texts) - MISSING)
    changes = sum(a != b for a, b in itertools.pairwise(texts))
    if 2 <= len(different) <= MOST_WORDS and changes > INTERLEAVED * len(texts):
        raise AskedError(
            f"FILE must hold one sensor, but its column {column.name!r} changes between "
            f"{', '.join(map(shown, different))}: "
            f"give `where` {shown(f'{column.name}={different[0]}')}",
            "where",
            f"{column.name}={different[0]}",
        )


def refuse_words(table: CsvTable, column: CsvColumn) -> None:
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
