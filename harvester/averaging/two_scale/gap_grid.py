"""Energies on both sides of grazing, for orbits that may miss a stop at a distance or preloaded.

The variable is z = 0 at grazing.  An orbit about the rest position c has the half-width b, and B =
b - c:

    b = g e^z below grazing,   b = |g| cosh z above,   g = gap + c

for period and averages have a square root in the energy there, which cosh z removes.  With a
preload, g < 0, all orbits are above.  Two panels of Gauss points, parted at grazing if that is
among the energies that matter, give integrals and slopes of functions that are smooth on either
side; functions that follow the energy slowly are found by finite elements on them, the sums of the
panels' Legendre polynomials that are continuous at their ends.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import KEPT, SEARCH, or_zero, where_the_mass_is
from harvester.averaging.two_scale.cycles import Cycles
from harvester.averaging.two_scale.energy_law import (
    diffusion,
    drift,
    log_mass,
    normalised,
    slope_on_grid,
)
from harvester.averaging.two_scale.gap_cycles import DistantOrbits
from harvester.equations.coefficients import Equations

_POINTS, _DEGREE = 32, 12  # of a panel
_NARROWEST, _WIDEST = 1e-8, 1e8  # half-widths b
_GRAZING = 1e-5  # the least z with a preload
# of the largest mass: below it the slow voltage is not determined by the orbits that are there
SELDOM = 1e-7
_STEEPEST = 10.0  # the slow voltage may slow the rise of the energy along z by this factor


@dataclass(frozen=True)
class Panels:
    """Two panels of n Gauss points, on (0, 1) and (1, 2).

    Arrays over points (2 n,) or basis functions (K,).
    """

    nodes: Floats
    weights: Floats
    slope: Floats  # (2 n, 2 n): the values -> their slopes
    integral: Floats  # (2 n, 2 n): the values -> int_0
    basis: Floats  # (K, 2 n): continuous functions
    basis_slopes: Floats


@cache
def panels() -> Panels:
    """The panels, made once."""
    y, weights = np.polynomial.legendre.leggauss(_POINTS)
    weights = 0.5 * weights
    none = np.zeros((_POINTS, _POINTS))
    powers = [np.polynomial.Legendre.basis(k) for k in range(_POINTS)]
    inverse = np.linalg.inv(np.array([p(y) for p in powers]).T)
    slope = 2.0 * np.array([p.deriv()(y) for p in powers]).T @ inverse
    integral = 0.5 * np.array([p.integ(lbnd=-1)(y) for p in powers]).T @ inverse
    rising = np.polynomial.Legendre([0.5, 0.5])
    # On either panel: a ramp from the seam down to the outer end, its complement, and functions
    # that end in 0.
    inner = [1.0 - rising, *(p.integ(lbnd=-1) for p in powers[1:_DEGREE])]
    first = [(rising, 1.0 - rising), *((f, 0.0 * f) for f in inner)]
    second = [(0.0 * f, f) for f in (rising, *inner[1:])]
    pairs = [*first, *second]
    return Panels(
        nodes=np.concatenate([0.5 * (y + 1.0), 0.5 * (y + 3.0)]),
        weights=np.concatenate([weights, weights]),
        slope=np.block([[slope, none], [none, slope]]),
        integral=np.block([[integral, none], [np.broadcast_to(weights, none.shape), integral]]),
        basis=np.array([np.concatenate([f(y), g(y)]) for f, g in pairs]),
        basis_slopes=np.array(
            [2.0 * np.concatenate([f.deriv()(y), g.deriv()(y)]) for f, g in pairs]
        ),
    )


def half_width(z: Floats, g: Floats) -> tuple[Floats, Floats]:
    """The half-width b(z) and its slope."""
    size = np.abs(g)
    below = np.abs(g) * np.exp(np.minimum(z, 0.0))
    return np.where(z > 0.0, size * np.cosh(z), below), np.where(z > 0.0, size * np.sinh(z), below)


def z_of(b: Floats, g: Floats) -> Floats:
    """The variable z of a half-width b."""
    ratio = b / np.abs(g)
    return np.where(ratio > 1.0, np.arccosh(np.maximum(ratio, 1.0)), np.log(np.minimum(ratio, 1.0)))


class Grid:
    """Energies between the half-widths ``low`` and ``high``, each of shape (scenes, 1), at the points of two panels.

    ``B``, ``weights`` (of integrals over z) and all values on the grid have the shape (scenes, 2
    n).
    """

    def __init__(self, low: Floats, high: Floats, rest: Floats, eqs: Equations) -> None:
        g = or_zero(eqs.gap) + rest
        first, last = z_of(low, g), z_of(high, g)
        seam = np.where((first < 0.0) & (last > 0.0), 0.0, 0.5 * (first + last))
        p = panels()
        self._eqs = eqs
        self._width = np.where(p.nodes < 1.0, seam - first, last - seam)
        z = np.where(
            p.nodes < 1.0, first + self._width * p.nodes, seam + self._width * (p.nodes - 1.0)
        )
        b, rise = half_width(z, g)
        self.B = b - rest
        self.weights = self._width * p.weights
        self._bare = rise * _force(b, eqs)

    def rising(self, energy: Floats) -> Floats:
        """Slope dE/dz, kept positive if the slow voltage would turn it around."""
        return np.maximum(energy @ panels().slope.T / self._width, self._bare / _STEEPEST)

    def mass(self, cycle: Cycles, slope: Floats, slow: Floats) -> Floats:
        """The probability of each point, from the averaged law p(E) ~ sigma^-2 exp(int 2 b/sigma^2 dE)."""
        s = diffusion(cycle, self._eqs)
        rate = 2.0 * drift(cycle, slow, self._eqs) / s * slope
        return normalised(
            np.log(slope / s * self.weights) + (rate * self._width) @ panels().integral.T
        )

    def slow_voltage(self, cycle: Cycles, slope: Floats, mass: Floats) -> tuple[Floats, Floats]:
        """Mean and mean square of the slow voltage V = xt - y at each energy, y' = mu (xt - y).

        (mu - L) E[y|E] = mu xt,    (2 mu - L) E[y^2|E] = 2 mu xt E[y|E]
        """
        xt = cycle.x - (mass * cycle.x).sum(axis=-1, keepdims=True)
        if self._eqs.mu is None:
            return xt, xt**2
        p = panels()
        mu = or_zero(self._eqs.mu)
        # else what is never there bends the law
        held = np.maximum(mass, SELDOM * mass.max(axis=-1, keepdims=True))
        current = 0.5 * diffusion(cycle, self._eqs) * held / (slope * self._width) ** 2
        memory = (p.basis * held[:, None]) @ p.basis.T
        exchange = (p.basis_slopes * current[:, None]) @ p.basis_slopes.T

        def resolvent(rate: Floats, right: Floats) -> Floats:
            parts = _solved(rate[..., None] * memory + exchange, (held * right) @ p.basis.T)
            return np.asarray(parts @ p.basis)

        y = resolvent(mu, mu * xt)
        y2 = resolvent(2.0 * mu, 2.0 * mu * xt * y)
        return xt - y, np.maximum(xt**2 - 2.0 * xt * y + y2, (xt - y) ** 2)


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions of positive symmetric systems (m, K, K), nan if one is not finite, scaled to a unit diagonal."""
    scale = 1.0 / np.sqrt(np.diagonal(matrix, axis1=1, axis2=2))
    matrix = matrix * scale[:, :, None] * scale[:, None, :]
    unit = np.eye(matrix.shape[-1])
    finite = np.asarray(np.isfinite(matrix).all(axis=(1, 2)))[:, None]
    matrix = np.where(finite[..., None], matrix, unit)
    right = np.where(finite, right * scale, np.nan)
    return np.asarray(np.linalg.solve(matrix + 1e-15 * unit, right[..., None])[..., 0] * scale)


def half_widths_that_matter(eqs: Equations, scenes: int) -> tuple[Floats, Floats, Any]:
    """The ends of the grid of b, shape (scenes, 1), and which scenes have no end to it.

    With a preload the search is in ln sinh z: how little the mass leaves the stop is not known
    beforehand.
    """
    g = or_zero(eqs.gap)
    pressed = g < 0.0
    high = z_of(np.full((scenes, 1), _WIDEST), g)
    low = np.where(pressed, math.log(_GRAZING), z_of(np.minimum(_NARROWEST, np.abs(g)), g))[:, 0]
    high = np.where(pressed, np.log(np.sinh(np.maximum(high, 1.0))), high)[:, 0]

    def law(s: Floats) -> Floats:
        z = _unfolded(s, pressed)
        b, rise = half_width(z, g)
        rise = rise * np.where(pressed, np.tanh(z), 1.0)  # db/ds
        orbits = DistantOrbits(b, eqs, 8, 3)
        orbits.refine(b, np.zeros_like(g), np.zeros_like(b))
        cycle = orbits.averages()
        slope = np.maximum(slope_on_grid(s, cycle.energy), rise * _force(b, eqs) / _STEEPEST)
        return log_mass(s, cycle, slope, np.zeros_like(s), eqs)

    low, high, unbounded = where_the_mass_is((low, high), SEARCH, law, KEPT)
    low, high = (half_width(_unfolded(end[:, None], pressed), g)[0] for end in (low, high))
    return low, high, unbounded


def _unfolded(s: Floats, pressed: Any) -> Floats:
    """The variable z of the search's s."""
    return np.where(pressed, np.arcsinh(np.exp(s)), s)


def _force(x: Floats, eqs: Equations) -> Floats:
    """The spring's force at x, towards rest."""
    return np.asarray(x * (1.0 + or_zero(eqs.alpha) * x**2))
