"""The transfer of impacts at a rigid stop from one velocity to another, as a matrix on the nodes in v."""

import numpy as np

from harvester.arrays import Floats
from harvester.density.elements import evaluated


def impact_flux(breaks: Floats, degree: int, restitution: float, way: float) -> Floats:
    """The matrix of int_{w > 0} w p(way w) f(-way r w) dw, with a row for each f and a column for each p.

    ``way`` is the sign of the velocity with which the mass meets the stop.  Both p and f are polynomials between the
    breaks of either, so that Gauss points between all of them integrate the flux exactly; nothing
    is assumed to be smooth across a break.
    """
    before = way * breaks[way * breaks >= 0.0]
    after = -way * breaks[-way * breaks >= 0.0]
    top = before.max()
    ends = before if restitution == 0.0 else np.concatenate([before, after / restitution])
    ends = np.unique(ends[ends <= top])
    ends = ends[np.concatenate([[True], np.diff(ends) > 1e-13 * top])]
    on_unit, weights = np.polynomial.legendre.leggauss(degree + 2)
    half = 0.5 * np.diff(ends)
    w = (ends[:-1, None] + half[:, None] * (1.0 + on_unit)).ravel()
    weight = (half[:, None] * weights).ravel() * w
    hit = evaluated(breaks, degree, way * w)
    return np.asarray(evaluated(breaks, degree, -way * restitution * w).T @ (weight[:, None] * hit))
