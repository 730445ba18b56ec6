"""The mesh of a density in displacement x and velocity v: the ends of its elements, and their degrees.

The mesh is a grid of rectangles on a box.  Breaks lie at v = 0, at the edge of a compliant stop,
and, if impacts dissipate energy, ever closer to the corner (stop, v = 0).  There the density is
singular, p ~ |v|^k on the scale x ~ v^3, because noise of intensity N spreads the velocity by
sqrt(N t) while the mass moves by v t.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.density.elements import Quadrature, quadrature
from harvester.equations.coefficients import Equations

SHORT = 20.0  # tail of a box for which a resolution is meant
NEARER_X, NEARER_V = 0.1, 0.3  # lengths of one element in that after it, towards a corner
ALMOST_ELASTIC = 0.9  # restitution above which the corner needs little grading
IN_CONTACT = 3  # least number of elements in a compliant stop


@dataclass(frozen=True)
class Box:
    """The rectangle outside of which the density is left out.

    ``low``, ``high`` are the ends of x and ``speed`` the largest one; ``reach`` is the larger
    distance from an end to the outermost resting place on its side; both ends lie at an energy
    ``tail`` times that of the motion.
    """

    low: float
    high: float
    speed: float
    reach: float
    tail: float


@dataclass(frozen=True)
class Resolution:
    """How fine a mesh is.

    So many ``elements`` lie in the reach of a box of a `SHORT` tail, and between v = 0 and its
    speed, with polynomials of one ``degree``; ``levels`` of ever smaller ones follow towards a
    corner.
    """

    elements: int
    degree: int
    levels: int


RESOLUTIONS = tuple(Resolution(4 + step, 4 + step, 2 + step) for step in range(6))


@dataclass(frozen=True)
class Mesh:
    """Breaks in x and v, and the degree of the polynomials between them."""

    x_breaks: Floats
    v_breaks: Floats
    degree: int

    @property
    def in_x(self) -> Quadrature:
        """The Gauss points in x, exact for products of two shapes with a polynomial of degree 5."""
        return quadrature(self.x_breaks, self.degree, self.degree + 3)

    @property
    def in_v(self) -> Quadrature:
        """As many Gauss points in v."""
        return quadrature(self.v_breaks, self.degree, self.degree + 3)

    def memory(self, modes: int) -> float:
        """The bytes that the factors of so many modes need: a dense matrix for each x-element.

        With n modes of coloured noise each matrix has n^2 times as many numbers.
        """
        block = (self.degree + 1) * ((len(self.v_breaks) - 1) * self.degree + 1)
        return 8.0 * modes * (len(self.x_breaks) - 1) * block**2

    def widened(self, eqs: Equations, reach: float, share: float) -> "Mesh":
        """The mesh with more elements beyond each end without a stop, for a box longer by a share."""
        low, high = eqs.rigid_stops
        x, v = self.x_breaks, self.v_breaks
        compliant = eqs.stop_stiffness is not None
        left = (
            0.0 if np.isfinite(low) else share * (-(eqs.gap or 0.0) - x[0] if compliant else reach)
        )
        right = 0.0 if np.isfinite(high) else share * reach
        return replace(
            self,
            x_breaks=_extended(x, left, right),
            v_breaks=_extended(v, share * -v[0], share * v[-1]),
        )


def _extended(breaks: Floats, left: float, right: float) -> Floats:
    """Breaks with a length more at either end, in elements no longer than those there."""
    before = _even(breaks[0] - left, breaks[0], breaks[1] - breaks[0])[:-1] if left else breaks[:0]
    after = (
        _even(breaks[-1], breaks[-1] + right, breaks[-1] - breaks[-2])[1:] if right else breaks[:0]
    )
    return np.concatenate([before, breaks, after])


def _even(low: float, high: float, longest: float) -> Floats:
    return np.linspace(low, high, max(1, int(np.ceil((high - low) / longest - 1e-9))) + 1)


def mesh(eqs: Equations, box: Box, resolution: Resolution) -> Mesh:
    """The mesh of a box."""
    n = math.ceil(resolution.elements * math.sqrt(box.tail / SHORT))
    stops = (box.low, eqs.restitution), (box.high, eqs.opposite_restitution)
    restitutions = [r for _, r in stops if r is not None and r < 1.0]
    longest = box.reach / n
    edges = [box.low, box.high]
    if eqs.stop_stiffness is not None:
        edges.insert(1, -(eqs.gap or 0.0))
        depth = edges[1] - edges[0]
        parts = [
            _even(edges[0], edges[1], depth / max(IN_CONTACT, n - 2)),
            _even(edges[1], edges[2], longest),
        ]
        x = np.concatenate([parts[0], parts[1][1:]])
    else:
        x = _even(box.low, box.high, longest)
    (low, r_low), (high, r_high) = stops
    if r_low is not None and r_low < 1.0:
        x = np.concatenate(
            [[low], low + _levels(x[1] - low, _depth(resolution, r_low), NEARER_X), x[1:]]
        )
    if r_high is not None and r_high < 1.0:
        x = np.concatenate(
            [
                x[:-1],
                high - _levels(high - x[-2], _depth(resolution, r_high), NEARER_X)[::-1],
                [high],
            ]
        )
    v = _even(0.0, box.speed, box.speed / n)
    if restitutions:
        depth = (_depth(resolution, min(restitutions)) + 1) // 2
        v = np.concatenate([[0.0], _levels(v[1], depth, NEARER_V), v[1:]])
    return Mesh(x, np.concatenate([-v[:0:-1], v]), resolution.degree)


def _depth(resolution: Resolution, restitution: float) -> int:
    return resolution.levels // 2 if restitution > ALMOST_ELASTIC else resolution.levels


def _levels(first: float, levels: int, ratio: float) -> Floats:
    """Breaks between 0 and ``first``, each ``ratio`` times as far as the next."""
    return first * ratio ** np.arange(levels, 0.0, -1.0)
