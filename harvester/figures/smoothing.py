"""A smooth surface through scattered evaluations, to look at: the map of an optimum, and the guide line in one key."""

import numpy as np

from harvester.arrays import Floats

_CELLS = 24  # a side: evaluations of one cell count as one, their mean
_NEAR = 0.25  # of a range: farther from every evaluation nothing is drawn
FEWEST = 4  # evaluations


def smooth(places: Floats, values: Floats, errors: Floats, at: Floats) -> Floats:
    """Values at places ``at``, shape (m, keys), from those at ``places``, shape (n, keys) within 0 to 1; shape (m,).

    By a thin-plate spline (one key: a cubic one), smoothed as a regression by Gaussian processes would: the more, the
    larger the ``errors`` of sampling, shape (n,), are against the spread of the values.  nan where no evaluation is
    within a quarter of the range.
    """
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    cell = np.minimum((places * _CELLS).astype(int), _CELLS - 1)
    _, of, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    of = of.ravel()
    centres = np.stack([np.bincount(of, column) / count for column in places.T], axis=1)
    means = np.bincount(of, values) / count
    noise = np.bincount(of, errors**2) / count  # not over the count: evaluations with the same noise err alike
    spread = float(np.var(means)) or 1.0
    kernel = "cubic" if places.shape[1] == 1 else "thin_plate_spline"
    surface = RBFInterpolator(centres, means, smoothing=noise / spread, kernel=kernel, degree=1)
    found: Floats = surface(at)
    distance, _ = cKDTree(places).query(at)
    found[distance > _NEAR] = np.nan
    return found
