"""Stationary densities of energy, state, displacement and velocity from that of the amplitude (paper, Eqs. 27-29).

Between orbits K = K(A) changes, so that at a displacement y the energy rises with A as

    J(A, y) = g(A) + K'(A) (A^2 - y^2)/2

of which the paper keeps g(A).  With J and the orbit's own period T each density integrates to one.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import or_zero
from harvester.averaging.published.ito import stiffness
from harvester.averaging.published.orbit import G, G_inverse, frequency
from harvester.averaging.published.stationary import Stationary
from harvester.averaging.published.voltage import K, amplitude_through, dK_dA
from harvester.equations.coefficients import Equations


def transformed_density(y: Floats, v: Floats, law: Stationary, eqs: Equations) -> Floats:
    """Density p(y, y') = p(H)/T(H) at the orbit through (y, y') (Eq. 28); arguments broadcast."""
    return _on_orbit(amplitude_through(y, v, *_symbols(eqs)), y, law, eqs)


def state_density(x: Floats, v: Floats, law: Stationary, eqs: Equations) -> Floats:
    """Density p(x, x') = 2 p(y, y') for x >= 0, else 0 (Eq. 29); without a stop p(y, y') itself."""
    p = transformed_density(x, v, law, eqs)
    return p if eqs.restitution is None else np.where(np.asarray(x) < 0.0, 0.0, 2.0 * p)


def displacement_density(x: Floats, law: Stationary, eqs: Equations) -> Floats:
    """Density p(x) = int p(x, x') dx' at x, shape (m,), by trapezoids from orbit to orbit (paper, Figs. 1b, 2b)."""
    y = np.abs(x)[:, None]
    alpha, beta, mu = _symbols(eqs)
    k = K(law.A, alpha, beta, mu)
    v = np.sqrt(np.maximum(2.0 * (G(law.A, alpha, k) - G(y, alpha, k)), 0.0))  # where the orbit passes x, else 0
    p = 2.0 * np.asarray(np.trapezoid(_on_orbit(np.maximum(law.A, y), y, law, eqs), v, axis=1))
    return p if eqs.restitution is None else np.where(x < 0.0, 0.0, 2.0 * p)


def velocity_density(v: Floats, law: Stationary, eqs: Equations) -> Floats:
    """Density p(x') = int p(x, x') dx at x', shape (m,), by trapezoids from orbit to orbit (paper, Figs. 1c, 2c).

    The same with and without a stop: int_0^inf 2 p(y, y') dy.
    """
    alpha, beta, mu = _symbols(eqs)
    k = K(law.A, alpha, beta, mu)
    y = G_inverse(np.maximum(G(law.A, alpha, k) - 0.5 * v[:, None] ** 2, 0.0), alpha, k)
    slowest = amplitude_through(np.zeros_like(v), v, alpha, beta, mu)[:, None]
    return 2.0 * np.asarray(np.trapezoid(_on_orbit(np.maximum(law.A, slowest), y, law, eqs), y, axis=1))


def _on_orbit(A: Floats, y: Floats, law: Stationary, eqs: Equations) -> Floats:
    """Density p(A)/(T J) at y on the orbit of amplitude A; p/A, interpolated in ln A, is flat towards 0."""
    A = np.maximum(A, law.A[0])
    per_A = np.exp(np.interp(np.log(A), np.log(law.A), np.log(law.p / law.A), right=-np.inf))
    alpha, beta, mu = _symbols(eqs)
    return per_A * frequency(A, alpha, K(A, alpha, beta, mu)) / (2.0 * math.pi * _rise(A, y, eqs))


def _rise(A: Floats, y: Floats, eqs: Equations) -> Floats:
    """The ratio J(A, y)/A, of which Q = 1 + K + alpha A^2 is the most."""
    return stiffness(A, eqs)[1] + 0.5 * dK_dA(A, *_symbols(eqs)) * (A - y**2 / A)


def _symbols(eqs: Equations) -> tuple[Floats, Floats, Floats]:
    """The coefficients alpha, beta and mu of the equations, 0 where absent."""
    return or_zero(eqs.alpha), or_zero(eqs.beta), or_zero(eqs.mu)
