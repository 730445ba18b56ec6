"""After the first passage: how much of the time a quantity is at or above the target, and how often it rises to it.

A chip's output switches on and off as its storage capacitor fills and empties; its first passage is
the first time that it wakes.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.value import mean_and_error, student95


class Afterwards(NamedTuple):
    """One run after its first passage through the target.

    ``share`` is the part of the time for which it is at or above the target, not a number if it
    never gets there; ``error`` is half of its 95 % interval over the run's cycles; ``rises`` counts
    the passages from below, the first of them included.
    """

    share: float
    error: float
    rises: int


def afterwards(t: Floats, u: Floats, level: float) -> Afterwards:
    """The share of a path u(t), shape (n,) both, above a level after its first passage.

    Straight between its points.

    If it rises again in the second half of that time, the share is that of whole cycles, from the
    first rise to the last one, a ratio of two means; its error is that of the ratio over the
    cycles, and for a single cycle the change with all the time to the end.  Else the share is that
    of all the time to the end, without an error.
    """
    above = u >= level
    change = np.flatnonzero(above[1:] != above[:-1])
    crossed = t[change] + (level - u[change]) / (u[change + 1] - u[change]) * (
        t[change + 1] - t[change]
    )
    if above[0]:
        crossed = np.append(t[0], crossed)
    rises = crossed[::2]
    falls = crossed[1::2]
    if len(rises) == 0 or t[-1] <= rises[0]:
        return Afterwards(math.nan, math.nan, len(rises))
    whole = t[-1] - rises[0]
    on = np.append(falls, t[-1])[: len(rises)] - rises
    share = float(on.sum() / whole)
    last = rises[-1] - rises[0]
    if last < 0.5 * whole:
        return Afterwards(share, 0.0, len(rises))
    periods = np.diff(rises)
    cycles = float(on[:-1].sum() / last)
    if len(periods) == 1:
        return Afterwards(cycles, abs(cycles - share), 2)
    _, error = mean_and_error((on[:-1] - cycles * periods) / periods.mean())
    return Afterwards(cycles, error * student95(len(periods) - 1), len(rises))
