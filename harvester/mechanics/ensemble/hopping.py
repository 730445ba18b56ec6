"""Transitions between unlike wells, counted; and the worth of a mean before they have made the start forgotten.

Trajectories begin in each of the wells in turn.  Let E_i[f] be the mean of f at some time over
those that began in well i, after all but inter-well transitions is forgotten, and p_i the share of
well i in the stationary law.  Then that law's mean is

    E[f] = sum_i p_i E_i[f],   p_i >= 0,   sum_i p_i = 1

at any time, as the law does not change with it: E[f] lies between the least and the largest E_i[f],
whatever the shares, however few transitions there were.  The two come together as inter-well
transitions are made.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harvester.arrays import Floats
from harvester.equations.bounds import barriers
from harvester.equations.coefficients import Equations
from harvester.uncertainty.value import Value, mean_and_error

NONE_SEEN = 3.0  # transitions at most, at 95 %, if none was seen


@dataclass(frozen=True)
class Hopping:
    """``hops`` trajectories of ``count`` were in another well than they ``began`` in, after a ``time`` in 1/w0.

    ``began``, shape (count,), numbers the wells from the left; ``rate`` is that at which shares of
    the wells come to theirs, in w0: the sum of those of leaving each, if none was seen the largest
    that it may be.
    """

    hops: int
    count: int
    time: float
    rate: float
    began: NDArray[np.intp]
    stayed: NDArray[np.bool_]

    def less_well_means(self, values: Floats) -> Floats:
        """The values of the trajectories that ``stayed`` in their well, each less the mean of its well."""
        well = self.began[self.stayed]
        kept = values[self.stayed]
        return np.asarray(kept - (np.bincount(well, kept) / np.maximum(np.bincount(well), 1))[well])

    def mean(self, entries: Floats, together: int = 1) -> Value:
        """The mean of one entry a trajectory: half-way between the wells, with half of their distance in its error.

        ``together`` consecutive ones are not independent: in each well their mean is one entry.
        """
        several = []
        for well in np.unique(self.began):
            here = np.resize(self.began == well, len(entries))
            counts, sums = (
                values.reshape(-1, together).sum(axis=1) for values in (here, here * entries)
            )
            several.append(mean_and_error(sums[counts > 0] / counts[counts > 0]))
        low, high = min(several), max(several)
        return Value(
            0.5 * (low[0] + high[0]),
            max(error for _, error in several),
            model=0.5 * (high[0] - low[0]),
        )


def hopping(eqs: Equations, start: Floats, x: Floats, time: float) -> Hopping:
    """How many trajectories have hopped that began at ``start``, one place or shape (count,), and are at ``x``, later.

    ``time`` is how much later, in 1/w0.
    """
    tops = barriers(eqs)
    began = np.digitize(np.broadcast_to(start, x.shape), tops)
    now = np.digitize(x, tops)
    gone = np.bincount(began, began != now)
    each = np.maximum(np.bincount(began), 1)
    gone = gone if gone.sum() else np.full(len(each), NONE_SEEN / len(each))
    rate = float((gone / each).sum() / time)
    return Hopping(int((began != now).sum()), len(began), time, rate, began, began == now)
