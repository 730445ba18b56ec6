"""A mean of independent entries with controls: quantities beside them whose own means are known to be zero.

    mean of y - a.X,   with a from the entries of the other half, by least squares

Half of the entries takes the coefficients that the other half asks for, so that they are
independent of what they weigh: whatever X is worth, there is no bias; what it is worth decides the
variance.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.value import mean_and_error

# that a half has at least: from fewer a fit is worth little, and its stated error less
ENTRIES_A_COLUMN = 4
# eigenvalues of the columns' covariance, over the largest: below it they say nothing of their own
SMALLEST = 1e-12


def controlled_mean(
    values: Floats, controls: Floats | None, together: int = 1
) -> tuple[float, float]:
    """Mean of ``values``, shape (n,), and its standard error, with the rest as of `controlled_entries`."""
    return mean_and_error(controlled_entries(values, controls, together))


def controlled_entries(values: Floats, controls: Floats | None, together: int = 1) -> Floats:
    """Entries, shape (n,), with the mean of ``values`` less that of their weighted ``controls``, shape (n, columns).

    ``together`` consecutive ones are of one trajectory, or of one record: they are in the same half, and come as their
    mean, so that entries are independent, shape (n/together,).  The ``values`` themselves if there are no controls,
    too few entries to fit one, or no gain.
    """
    plain = np.asarray(values.reshape(-1, together).mean(axis=1))
    if controls is None:
        return plain
    rest = cross_fitted(values, controls, together)[0].reshape(-1, together).mean(axis=1)
    return np.asarray(rest) if rest.std() < plain.std() else plain


def cross_fitted(values: Floats, controls: Floats, together: int = 1) -> tuple[Floats, Floats]:
    """``values`` less their weighted ``controls``, and the weights of both halves, shape (2, columns).

    The first columns are fitted if the entries do not suffice for all of them; the others have a
    weight of 0. The spread is that which the mean's error asks for: each half's mean has a part in
    the other's weights, so that degrees of freedom fall by the number of columns.
    """
    # Pairs of neighbours, because trajectories may begin in two places in turn.
    halves = np.arange(len(values)) // (2 * together) % 2
    weights = np.zeros((2, controls.shape[1]))
    spread = controls.std(axis=0)
    entries_a_half = int(min(halves.sum(), len(values) - halves.sum()))
    used = np.flatnonzero(spread > 0.0)[: entries_a_half // ENTRIES_A_COLUMN]
    if not len(used):
        return values, weights
    columns = controls[:, used] / spread[used]
    for k in (0, 1):
        weights[k, used] = least_squares(values[halves != k], columns[halves != k]) / spread[used]
    rest = values - (weights[halves] * controls).sum(axis=1)
    return rest.mean() + (rest - rest.mean()) / math.sqrt(1.0 - len(used) / entries_a_half), weights


def least_squares(values: Floats, columns: Floats) -> Floats:
    """The weights of columns, shape (n, columns), that leave the least of the variance of ``values``."""
    off = columns - columns.mean(axis=0)
    return np.asarray(
        np.linalg.lstsq(off.T @ off, off.T @ (values - values.mean()), rcond=SMALLEST)[0]
    )


def scaled_least_squares(values: Floats, columns: Floats) -> Floats:
    """`least_squares` of columns of any size, each fitted in units of its spread; a constant one has the weight 0."""
    spread = columns.std(axis=0)
    spread[spread == 0.0] = 1.0
    return np.asarray(least_squares(values, columns / spread) / spread)
