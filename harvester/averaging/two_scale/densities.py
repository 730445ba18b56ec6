"""Stationary densities of our theory for amplitude, state, displacement and velocity.

An orbit of amplitude A has the kinetic energy k(A, x) = x'^2/2 at the displacement x, and spends
dx/x' of its period T there, so that p(A) dA spreads over the plane as

    p(x, x') = p(A)/(T dk/dA),   A from k(A, x) = x'^2/2

Each orbit has its own potential, bent by its own voltage: k is not an energy less a potential of x.
With a stop at a distance `harvester.averaging.two_scale.gap_densities` does the work.
"""

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from harvester.arrays import Floats
from harvester.averaging.two_scale import gap_densities
from harvester.averaging.two_scale.cycles import quarter
from harvester.averaging.two_scale.energy_law import slope_on_grid
from harvester.averaging.two_scale.law import TwoScale
from harvester.errors import SimulationError

_MOST_CROSSING = 1e-3  # probability of orbits that cross others
_POINTS = 240  # of the integrals over displacement and velocity


def amplitude_density(A: Floats, law: TwoScale) -> Floats:
    """Density p(A) at amplitudes of any shape (right turning points).

    0 outside those that matter.
    """
    if law.spread is not None:
        return gap_densities.amplitude_density(A, law.spread, law.period)
    u = np.log(law.A)
    at = np.log(A)
    log_p = CubicSpline(u, np.log(law.mass / (u[1] - u[0])))(at) - at
    return np.asarray(np.where((at < u[0]) | (at > u[-1]), 0.0, np.exp(log_p)))


def state_density(x: Floats, v: Floats, law: TwoScale, stop: bool) -> Floats:
    """Density p(x, x') at displacements of shape (m,) and velocities of shape (k,) -> (m, k).

    0 behind the stop.

    Raises SimulationError if the voltage is so strong that orbits of neighbouring amplitudes cross.
    """
    if law.spread is not None:
        return gap_densities.state_density(x, v, law.spread)
    u = np.log(law.A)
    du = u[1] - u[0]
    kinetic = _kinetic(np.abs(x), law)
    rise = slope_on_grid(np.broadcast_to(u, kinetic.shape), kinetic)
    if (law.mass * ((rise <= 0.0) & (kinetic > 0.0))).sum(axis=1).max() > _MOST_CROSSING:
        raise SimulationError(
            "the voltage is so strong that averaged orbits cross: use engine 'ensemble'"
        )
    rise = np.maximum(rise, 1e-3 * law.A**2)
    half = 0.5 * np.asarray(v, dtype=np.float64) ** 2
    p = np.zeros((len(x), len(half)))
    for j, (k, dk) in enumerate(zip(kinetic, rise, strict=True)):
        # From the last orbit that does not pass x, if there is one; below the smallest, the law is
        # flat.
        rows = slice(max(int(np.searchsorted(k, 0.0)) - 1, 0), None)
        at = np.maximum.accumulate(k[rows] + 1e-12 * law.A[rows] ** 2)
        inside = half <= at[-1]
        if len(at) > 1 and inside.any():
            log_p = np.log(law.mass[rows] / (du * law.period[rows] * dk[rows]))
            p[j, inside] = np.exp(PchipInterpolator(at, log_p)(np.maximum(half[inside], at[0])))
    if stop:
        p[np.asarray(x) < 0.0] = 0.0
    return p


def displacement_density(x: Floats, law: TwoScale, stop: bool) -> Floats:
    """Density p(x) = int p(x, x') dx' at x of shape (m,)."""
    if law.spread is not None:
        return gap_densities.displacement_density(x, law.spread)
    v, dv = _velocities(law)
    return np.asarray(2.0 * dv * (state_density(x, v, law, stop).sum(axis=1)))


def velocity_density(v: Floats, law: TwoScale, stop: bool) -> Floats:
    """Density p(x') = int p(x, x') dx at x' of shape (m,)."""
    if law.spread is not None:
        return gap_densities.velocity_density(v, law.spread)
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    x = 0.5 * law.A[-1] * (nodes + 1.0)
    weights = 0.5 * law.A[-1] * weights
    p = weights @ state_density(x, np.abs(v), law, stop)
    return np.asarray(p if stop else 2.0 * p)


def _velocities(law: TwoScale) -> tuple[Floats, float]:
    """Midpoints of steps from 0 to the fastest speed: an even function's integral, to the precision of its values."""
    dv = float(np.sqrt(2.0 * _kinetic(np.zeros(1), law)[0, -1])) / _POINTS
    return np.asarray((np.arange(_POINTS) + 0.5) * dv, dtype=np.float64), dv


def _kinetic(x: Floats, law: TwoScale) -> Floats:
    """Kinetic energy k(A, x) = A^2 sin^2 Phi nu^2/2, (m, n).

    Negative, smooth in A, if an orbit ends before x.
    """
    q = quarter(law.nu.shape[1], 1)
    points = np.concatenate([[0.0], q.phi, [0.5 * np.pi]])
    even = ((1, np.zeros(len(law.A))), "not-a-knot")  # nu^2 is even about the turning point
    nu2 = CubicSpline(points, _with_ends(law.nu**2, q.phi), axis=1, bc_type=even)
    relative = np.asarray(x)[:, None] / law.A
    phi = np.arccos(np.minimum(relative, 1.0))
    at = np.stack([nu2(phi[:, i])[i] for i in range(len(law.A))], axis=1)
    # sin^2 Phi of a place that the orbit does not reach
    beyond = np.minimum(1.0 - relative**2, 0.0)
    return np.asarray(0.5 * law.A**2 * (1.0 - relative**2) * (at + 0.5 * nu2(0.0, 2) * beyond))


def _with_ends(values: Floats, phi: Floats) -> Floats:
    """The values at the Gauss points and, by the polynomial through them, at 0 and pi/2: shape (n, N + 2)."""
    basis = [
        np.polynomial.legendre.Legendre.basis(j, domain=[0.0, 0.5 * np.pi]) for j in range(len(phi))
    ]
    inside = np.array([b(phi) for b in basis])
    ends = np.array([b(np.array([0.0, 0.5 * np.pi])) for b in basis])
    both = values @ np.linalg.solve(inside, ends)
    return np.concatenate([both[:, :1], values, both[:, 1:]], axis=1)
