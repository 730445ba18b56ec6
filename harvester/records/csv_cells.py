"""The cells of rows with missing numbers, words, or dates and times in several columns."""

import itertools
import math
import re
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, shown
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.records.clock_times import CLOCK, DATE, TIME_OF_DAY, seconds, together, with_fraction
from harvester.records.csv_layout import (
    MISSING,
    Layout,
    cells,
    is_data,
    plain_lines,
    without_labels,
)

_PARTS_OF_SECOND = {
    "fractional": 1.0,
    "fraction": 1.0,
    "milliseconds": 1e-3,
    "millis": 1e-3,
    "msec": 1e-3,
    "ms": 1e-3,
    "microseconds": 1e-6,
    "micros": 1e-6,
    "usec": 1e-6,
    "us": 1e-6,
}


class Cells(NamedTuple):
    """A column: its numbers, nan for missing ones, other texts by row, and whether it is a clock.

    ``texts`` are the cells of a column of words, else None.
    """

    column: int
    values: Floats
    lost: tuple[tuple[int, str], ...] = ()
    clock: bool = False
    head: str = ""
    texts: tuple[str, ...] | None = None


def rows_of(form: Layout, text: str) -> tuple[list[str], list[Diagnostic]]:
    """The lines of data of a text; without repeated headers, and lines of one word such as END."""
    lines = list[str]()
    others = list[str]()
    again = 0
    for line in plain_lines(without_labels(text) if form.labelled else text):
        if line in form.header:
            again += 1
        elif not line[:1].isdigit() and _is_remark_alone(form, line):
            others.append(line.strip())
        else:
            lines.append(line)
    notes = [note("header_again", times=again)] if again else []
    below = _below(form, lines)
    if below:
        del lines[-len(below) :]
        notes.append(note("lines_below", lines=len(below), first=below[0][:40]))
    if others:
        notes.append(note("lines_without_numbers", lines=len(others), first=others[0][:40]))
    return lines, notes


def _below(form: Layout, lines: Sequence[str]) -> list[str]:
    """The lines below the last row of data that begin with a word, as `Mean,0.01` of a summary."""
    if 0 in form.words:
        return []
    return [*itertools.takewhile(partial(_is_summary, form), reversed(lines))][::-1]


def _is_summary(form: Layout, line: str) -> bool:
    """Whether a line begins with a word, and is neither a row of data nor one of missing values."""
    row = cells(line, form.delimiter)
    missing = all(cell.lower() in MISSING for cell in row)
    return line[:1].isalpha() and not missing and not is_data(row, form.decimal, form.words)


def _is_remark_alone(form: Layout, line: str) -> bool:
    """Whether a line is one cell without a number, in a table of several columns."""
    row = [cell for cell in cells(line, form.delimiter) if cell]
    return len(form.heads) > 1 and len(row) == 1 and not is_data(row, form.decimal)


def columns_of(form: Layout, frame: Any, argument: str) -> list[Cells]:
    """The columns of a frame of texts, which has a column for each raw cell of a row.

    Raises InputError as `harvester.records.clock_times.seconds`.
    """
    texts = _joined(form, frame)
    clocks = _clocks(form, texts, argument)
    if sum(cells.clock for cells, _ in clocks) == 1 and len(clocks[0][1]) == 1:
        clocks[0] = _with_fraction(form, texts, clocks[0][0])
    used = {index for clock in clocks for index in clock[1]}
    result = [clock[0] for clock in clocks]
    for index, column in enumerate(texts):
        if index in used:
            continue
        if index in form.words:
            result.append(Cells(index, np.full(len(column), math.nan), texts=tuple(column)))
        else:
            result.append(_numbers(index, column, form.decimal))
    return sorted(result, key=lambda cells: cells.column)


def _joined(form: Layout, frame: Any) -> list[Any]:
    """The texts of each column; those of two cells that a decimal comma made are one."""
    columns = []
    raw = 0
    for index in range(len(form.heads)):
        column = frame[raw].fillna("").str.strip()
        raw += 1
        if index in form.joined:
            column = column + "." + frame[raw].fillna("").str.strip()
            raw += 1
        columns.append(column)
    return columns


def _numbers(index: int, column: Any, decimal: str) -> Cells:
    import pandas as pd

    plain = column.str.replace(",", ".", regex=False) if decimal == "," else column
    values = np.asarray(pd.to_numeric(plain, errors="coerce"), float)
    values = np.where(np.isfinite(values), values, math.nan)
    lost = tuple(
        (int(row), column.iloc[row]) for row in np.flatnonzero(np.isnan(values)) if column.iloc[row]
    )
    return Cells(index, values, lost)


_Clock = tuple[Cells, tuple[int, ...]]  # a column, and those that it is made of


def _clocks(form: Layout, texts: list[Any], argument: str) -> list[_Clock]:
    """The columns of dates and times, each with the columns that it is made of."""
    dates = list[int]()
    times = list[int]()
    clocks = list[_Clock]()
    for index, column in enumerate(texts):
        first = next((cell for cell in column if cell), "")
        if DATE.fullmatch(first):
            dates.append(index)
        elif TIME_OF_DAY.fullmatch(first):
            times.append(index)
        elif CLOCK.fullmatch(first):
            clocks.append((_clock(form, index, column, argument), (index,)))
    for index in times:
        if len(times) == len(dates) == 1 and not clocks:
            clocks.append(_of_columns(form, texts, (dates[0], index), argument))
        else:
            clocks.append((_clock(form, index, texts[index], argument), (index,)))
    used = {index for clock in clocks for index in clock[1]}
    alone = [
        k for k in dates if k not in used
    ]  # a date without a time of day is a word beside the times
    return clocks + [
        (Cells(k, np.full(len(texts[k]), math.nan), texts=tuple(texts[k])), (k,)) for k in alone
    ]


def _clock(form: Layout, index: int, column: Any, argument: str) -> Cells:
    values = seconds(column, f"{argument} column {form.heads[index] or index + 1!r}")
    lost = tuple(
        (int(row), column.iloc[row])
        for row in np.flatnonzero(~np.isfinite(values))
        if column.iloc[row]
    )
    return Cells(index, np.where(np.isfinite(values), values, math.nan), lost, True)


def _of_columns(
    form: Layout, texts: list[Any], both: tuple[int, int], argument: str
) -> tuple[Cells, tuple[int, ...]]:
    """The seconds of columns of dates, times of day and, if any, fractions of a second."""
    date, time = both
    part, fraction = _fraction(form, texts)
    values = together(texts[date], texts[time], fraction, f"{argument} column {form.heads[date]!r}")
    lost = tuple((int(row), texts[time].iloc[row]) for row in np.flatnonzero(~np.isfinite(values)))
    head = " ".join(form.heads[k] for k in both)
    clock = Cells(min(both), np.where(np.isfinite(values), values, math.nan), lost, True, head)
    return clock, (*both, *part)


def _with_fraction(form: Layout, texts: list[Any], clock: Cells) -> _Clock:
    """A clock of whole seconds with the fractions of another column, if there is one."""
    part, fraction = _fraction(form, texts)
    whole = None if fraction is None else with_fraction(clock.values, fraction)
    if whole is None or clock.column in part:
        return clock, (clock.column,)
    return clock._replace(values=whole), (clock.column, *part)


def _fraction(form: Layout, texts: list[Any]) -> tuple[tuple[int, ...], Floats | None]:
    for index, head in enumerate(form.heads):
        for word in re.findall(r"[a-z]+", head.lower()):
            if word in _PARTS_OF_SECOND:
                values = _numbers(index, texts[index], form.decimal).values * _PARTS_OF_SECOND[word]
                if np.nanmin(values) >= 0.0 and np.nanmax(values) < 1.0:
                    return (index,), values
    return (), None


def refuse_ragged(form: Layout, lines: Sequence[str], path: object, argument: str) -> InputError:
    """The error of a row with more cells than there are columns, or with an open quotation mark."""
    counts = (len(cells(line, form.delimiter)) for line in lines)
    wide = next(((row, n) for row, n in enumerate(counts, 1) if n > form.raw_cells), None)
    must = f"{argument} must be a table of {form.raw_cells} columns, but {shown(str(path))}"
    if wide is None:
        return InputError(f"{must} has a quotation mark that is not closed: delete it")
    row, count = wide
    line = shown(lines[row - 1])
    return InputError(f"{must} has {count} cells in row {row}, {line}: correct or delete the row")
