"""The current of a sensor node over time, as power profilers write it in CSV files.

Each sample lasts until the next.  Neighbours that differ least are merged, with the charge
that both have, until `STATES` are left: the sum of squares that a merger of i, j of lengths a, b
loses is (i - j)^2 a b/(a + b).

A profiler's zero is off by a little, so that some samples may be slightly negative: they become 0.
"""

import re
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.quantities.kinds import CURRENT, TIME
from harvester.records.csv_table import CsvColumn, CsvTable, check_numbers, read_table
from harvester.records.named_columns import is_time, no_column, numbers, words_of
from harvester.records.read_once import read_once
from harvester.records.record_clock import times
from harvester.records.time_units import FASTEST_PROFILER

STATES = 40
KEY = "node.trace"
MOST_NEGATIVE = 0.01  # of the charge: negative samples up to it are those of a zero that is off
_NAMES = words_of("current i amps amperes strom courant")
_METERED = words_of("reading value measurement")
_AMPERES = re.compile(r"([munµp]?)A(?:mps?|mperes?)?(?:\s*[AD]C)?", re.IGNORECASE)
_JOULESCOPE = ("time", "current", "voltage", "power")

Trace = tuple[tuple[float, float], ...]


class ReadTrace(NamedTuple):
    """The currents (A) and durations (s) of a file's states, and notes on how the file was read."""

    states: Trace
    notes: tuple[Diagnostic, ...]


def read_trace(path: str) -> ReadTrace:
    """The states of a file, and notes.

    Raises InputError in one line for a file that cannot be read or has no such columns, times that
    do not ascend from 0 on, and currents below 0 by more than the zero of a profiler is off.
    """
    return read_once(_trace, path)


def is_current(column: CsvColumn) -> bool:
    """Whether a column is named as a current."""
    return bool(_NAMES & set(column.words)) and not is_time(column)


def _is_in_amperes(column: CsvColumn) -> bool:
    """Whether a column is of currents by its unit alone, such as a channel `Main (mA)`."""
    return bool(column.stated and column.scale(CURRENT)) and not is_time(column)


def _trace(path: str) -> ReadTrace:
    table = read_table(path, KEY)
    notes = list[Diagnostic](table.notes)
    t = times(table, KEY, FASTEST_PROFILER)
    if t is None:
        raise no_column(table, KEY, "time", TIME)
    column, current = _currents(table, notes)
    check_numbers(table, table.find(is_time)[0], t, KEY)
    check_numbers(table, column, current, KEY)
    if len(t) < 2:
        raise invalid(KEY, "have at least 2 rows", len(t))
    bad = (t < 0.0) | (np.diff(t, prepend=-np.inf) <= 0.0)
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"{KEY} must have times that ascend from 0 on, but row {row + 1} has {t[row]:g} s"
        )
    lengths = np.diff(t)
    lengths = np.append(lengths, np.median(lengths))
    current = _from_zero(current, lengths, notes)
    return ReadTrace(merged(current, lengths), tuple(notes))


def _currents(table: CsvTable, notes: list[Diagnostic]) -> tuple[CsvColumn, Floats]:
    """The column of currents, and its numbers in A.

    A meter states the unit in a column of words, and a Joulescope states none: its power is the
    product of current and voltage, all in SI units.
    """
    names = tuple(column.name.lower() for column in table.columns)
    if names == _JOULESCOPE and not any(column.stated for column in table.columns):
        _, current, voltage, power = (column.values for column in table.columns)
        if np.allclose(current * voltage, power, rtol=1e-3, atol=1e-3 * float(np.abs(power).max())):
            notes.append(note("trace_of_joulescope"))
            return table.columns[1], current
    named = is_current if table.find(is_current) else _is_in_amperes
    return _metered(table) or numbers(table, KEY, named, "current", CURRENT)


def _metered(table: CsvTable) -> tuple[CsvColumn, Floats] | None:
    """The column of a meter's currents, and its numbers in A; None if no column has their unit."""
    columns = table.find(lambda column: bool(_METERED & set(column.words)))
    units = {text for c in table.columns if "unit" in c.words for text in c.texts or ()}
    if table.find(is_current) or not columns or len(units) != 1:
        return None
    match = _AMPERES.fullmatch(units.pop())
    factor, _ = CURRENT.scale(f"{match[1]}A") if match else (None, 1)
    return None if factor is None else (columns[0], columns[0].values * factor)


def _from_zero(current: Floats, lengths: Floats, notes: list[Diagnostic]) -> Floats:
    """Currents of at least 0; InputError if those below are more than a profiler's zero is off."""
    below = current < 0.0
    if not below.any():
        return current
    least = float(current.min())
    if -(current * lengths)[below].sum() > MOST_NEGATIVE * (current * lengths)[~below].sum():
        row = int(below.argmax())
        raise InputError(
            f"{KEY} must have currents of at least 0, but row {row + 1} has {current[row]:g} A, "
            "and those below 0 have more than a hundredth of the charge"
        )
    notes.append(note("trace_below_zero", samples=int(below.sum()), least=least))
    return np.maximum(current, 0.0)


def merged(current: Floats, lengths: Floats) -> Trace:
    """The states of a trace, `STATES` at most, with its charge and duration."""
    edges = np.flatnonzero(np.diff(current, prepend=np.inf))  # equal neighbours are one state
    lengths = np.add.reduceat(lengths, edges)
    current = current[edges]
    rng = np.random.default_rng(0)
    while len(current) > STATES:
        loss = np.diff(current) ** 2 * lengths[1:] * lengths[:-1] / (lengths[1:] + lengths[:-1])
        # ranks differ where losses are equal, in an order by chance: a third of them is below both
        # neighbours, so that the passes are few
        rank = np.empty(len(loss))
        rank[np.lexsort((rng.permutation(len(loss)), loss))] = np.arange(len(loss))
        around = np.concatenate(([np.inf], rank, [np.inf]))
        least = np.flatnonzero((rank < around[:-2]) & (rank < around[2:]))
        least = least[np.argsort(loss[least])][: len(current) - STATES]
        charge = current * lengths
        for sums in (charge, lengths):
            sums[least] += sums[least + 1]
        keep = np.delete(np.arange(len(current)), least + 1)
        current = (charge / lengths)[keep]
        lengths = lengths[keep]
    return tuple(zip(current.tolist(), lengths.tolist(), strict=True))
