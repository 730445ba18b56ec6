"""Guides for the eye through scattered evaluations: the map of an optimum over two keys, and a local fit over one."""

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.value import half95

_CELLS = 24  # a side: evaluations of one cell count as one, their mean
_NEAR = 0.25  # of a range: farther from every evaluation nothing is drawn
FEWEST = 6  # evaluations of a local fit
_ENOUGH = 12  # evaluations that a local fit looks for
_REACH = (0.1, 0.35)  # of the range: how far a local fit goes at least and at most


def local_fit(
    positions: Floats, values: Floats, errors: Floats, near: float
) -> tuple[Floats, Floats, Floats] | None:
    """A parabola through the values at places (n,) about ``near``, and the half-width of its 95 % band.

    Least squares with the weights of the ``errors`` of sampling (n,), if there are any.  The covariance of the
    coefficients is (X' W X)^-1, larger by the misfit chi^2/(n - 3) if that is above 1.  Returns places, values and
    half-widths, each of shape (m,); None if there are too few values.
    """
    distance = np.abs(positions - near)
    reach = float(np.clip(np.sort(distance)[:_ENOUGH][-1], *_REACH)) * (1.0 + 1e-9)
    taken = distance <= reach
    if len(np.unique(positions[taken])) < FEWEST:
        return None
    noise = errors[taken] if (errors[taken] > 0.0).all() else np.ones(taken.sum())
    rows = np.vander((positions[taken] - near) / reach, 3)
    weighted = rows / noise[:, None]
    coefficients, *_ = np.linalg.lstsq(weighted, values[taken] / noise, rcond=None)
    misfit = np.sum(((values[taken] - rows @ coefficients) / noise) ** 2) / max(taken.sum() - 3, 1)
    floor = 1.0 if (errors[taken] > 0.0).all() else 0.0
    covariance = np.linalg.pinv(weighted.T @ weighted) * max(misfit, floor)
    at = np.linspace(positions[taken].min(), positions[taken].max(), 200)
    here = np.vander((at - near) / reach, 3)
    return (
        at,
        here @ coefficients,
        half95(np.sqrt(np.einsum("ij,jk,ik->i", here, covariance, here))),
    )


def smooth(positions: Floats, values: Floats, errors: Floats, at: Floats) -> Floats:
    """Values at places ``at``, shape (m, keys), from those at ``places``, shape (n, keys) within 0 to 1; shape (m,).

    By a thin-plate spline, smoothed as a regression by Gaussian processes would: the more, the
    larger the ``errors`` of sampling, shape (n,), are against the spread of the values.  nan if no evaluation is
    within a quarter of the range.
    """
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    cell = np.minimum((positions * _CELLS).astype(int), _CELLS - 1)
    _, of, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    of = of.ravel()
    centres = np.stack([np.bincount(of, column) / count for column in positions.T], axis=1)
    means = np.bincount(of, values) / count
    # not over the count: evaluations with the same noise err alike
    noise = np.bincount(of, errors**2) / count
    spread = float(np.var(means)) or 1.0
    surface = RBFInterpolator(
        centres, means, smoothing=noise / spread, kernel="thin_plate_spline", degree=1
    )
    smoothed: Floats = surface(at)
    distance, _ = cKDTree(positions).query(at)
    smoothed[distance > _NEAR] = np.nan
    return smoothed
