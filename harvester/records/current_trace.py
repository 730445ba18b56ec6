"""The current of a sensor node over time, as power profilers write it: a CSV file of time and current.

Each sample lasts until the next.  Neighbours that differ least are taken together, with the charge
that both have, until `STATES` are left: the sum of squares that a merger of i, j of lengths a, b
loses is (i - j)^2 a b/(a + b).
"""

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid
from harvester.quantities.kinds import CURRENT, TIME
from harvester.records.csv_table import CsvColumn, check_numbers, read_table
from harvester.records.record_files import is_time, no_column, numbers, read_once, times

STATES = 40
KEY = "node.trace"
_NAMES = frozenset(("current", "i", "amps", "amperes", "strom", "courant"))

Trace = tuple[tuple[float, float], ...]


def read_trace(path: str) -> Trace:
    """The currents (A) and durations (s) of a file's states.

    Raises InputError in one line for a file that cannot be read or has no such columns, times that
    do not ascend from 0 on, and currents below 0.
    """
    return read_once(_trace, path)


def is_current(column: CsvColumn) -> bool:
    """Whether a column is named as a current."""
    return bool(_NAMES & set(column.words)) and not is_time(column)


def _trace(path: str) -> Trace:
    table = read_table(path, KEY)
    t = times(table, KEY)
    if t is None:
        raise no_column(table, KEY, "time", TIME)
    column, current = numbers(table, KEY, is_current, "current", CURRENT)
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
    if (current < 0.0).any():
        row = int((current < 0.0).argmax())
        raise InputError(
            f"{KEY} must have currents of at least 0, but row {row + 1} has {current[row]:g} A"
        )
    lengths = np.diff(t)
    return merged(current, np.append(lengths, np.median(lengths)))


def merged(current: Floats, lengths: Floats) -> Trace:
    """The states of a trace, `STATES` at most, with its charge and duration."""
    lengths = lengths.copy()
    while len(current) > STATES:
        loss = np.diff(current) ** 2 * lengths[1:] * lengths[:-1] / (lengths[1:] + lengths[:-1])
        around = np.concatenate(([np.inf], loss, [np.inf]))
        # no two of them are neighbours
        least = np.flatnonzero((loss <= around[:-2]) & (loss < around[2:]))
        least = least[np.argsort(loss[least])][: len(current) - STATES]
        charge = current * lengths
        for sums in (charge, lengths):
            sums[least] += sums[least + 1]
        keep = np.delete(np.arange(len(current)), least + 1)
        current = (charge / lengths)[keep]
        lengths = lengths[keep]
    return tuple(zip(current.tolist(), lengths.tolist(), strict=True))
