"""A mean of independent entries with controls: quantities beside them whose own means are known to be zero.

    mean of y - a.X,   with a from the entries of the other half, by least squares

Half of the entries takes the coefficients that the other half asks for, so that they are independent of what they
weigh: whatever X is worth, there is no bias; what it is worth decides the variance.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.value import mean_and_error

ENTRIES_A_COLUMN = 4  # that a half has at least: from fewer a fit is worth little, and its stated error less
SMALLEST = 1e-12  # eigenvalues of the columns' covariance, over the largest: below it they say nothing of their own


def controlled_mean(values: Floats, controls: Floats | None) -> tuple[float, float]:
    """Mean of ``values``, shape (n,), and its standard error, with ``controls`` as of `controlled_entries`."""
    return mean_and_error(controlled_entries(values, controls))


def controlled_entries(values: Floats, controls: Floats | None) -> Floats:
    """Entries, shape (n,), with the mean of ``values`` less that of their weighted ``controls``, shape (n, columns).

    Their spread is that which the mean's error asks for: each half's mean has a part in the other's weights, so that
    degrees of freedom fall by the number of columns.  The ``values`` themselves where there are no controls, too few
    entries to fit them, or no gain.
    """
    if controls is None:
        return values
    spread = controls.std(axis=0)
    columns = controls[:, spread > 0.0] / spread[spread > 0.0]
    # Pairs of neighbours, because trajectories may begin in two places in turn.
    halves = np.arange(len(values)) // 2 % 2
    entries_a_half, number = min(halves.sum(), len(values) - halves.sum()), columns.shape[1]
    if entries_a_half <= ENTRIES_A_COLUMN * number:
        return values
    weights = np.array([_weights(values[halves != k], columns[halves != k]) for k in (0, 1)])
    rest = values - (weights[halves] * columns).sum(axis=1)
    rest = rest.mean() + (rest - rest.mean()) / math.sqrt(1.0 - number / entries_a_half)
    return np.asarray(rest) if rest.std() < values.std() else values


def _weights(values: Floats, columns: Floats) -> Floats:
    """The weights of columns, shape (n, columns), that leave the least of the variance of ``values``."""
    off = columns - columns.mean(axis=0)
    return np.asarray(np.linalg.lstsq(off.T @ off, off.T @ (values - values.mean()), rcond=SMALLEST)[0])
