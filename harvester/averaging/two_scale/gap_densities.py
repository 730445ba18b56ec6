"""Stationary densities of our theory for a stop at a distance from rest, or preloaded.

An orbit of energy E passes x with the kinetic energy k(E, x) = x'^2/2.  The area between two orbits
of one potential is T dE, so that the law is p(E)/T in the plane; the voltage bends each orbit's own
potential, hence

    p(x, x') = p(E)/T dE/dk,   E from k(E, x) = x'^2/2
"""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from harvester.arrays import Floats
from harvester.averaging.two_scale.gap_cycles import half_cycle
from harvester.averaging.two_scale.gap_law import Spread
from harvester.errors import SimulationError

_MOST_CROSSING = 1e-3  # probability of orbits that cross others
_POINTS = 240  # of the integrals over displacement and velocity


def amplitude_density(A: Floats, spread: Spread, period: Floats) -> Floats:
    """Density p(A) = p(E) dE/dA at right turning points of any shape.

    0 outside those that matter.
    """
    up = _rising(spread.A, spread)
    rise = PchipInterpolator(spread.A[up], spread.energy[up], extrapolate=False)(A, 1)
    log_p = PchipInterpolator(spread.A[up], np.log(spread.level * period)[up], extrapolate=False)(A)
    return np.asarray(np.nan_to_num(np.exp(log_p) * rise))


def state_density(x: Floats, v: Floats, spread: Spread) -> Floats:
    """Density p(x, x') at displacements of shape (m,) and velocities of shape (k,) -> (m, k).

    0 behind the stop.

    Raises SimulationError if the voltage is so strong that orbits of neighbouring energies cross.
    """
    x = np.asarray(x, dtype=np.float64)
    half = 0.5 * np.asarray(v, dtype=np.float64) ** 2
    kinetic = _kinetic(x, spread)
    turning = _turning_there(x, spread)
    up = _rising(spread.energy, spread)
    # a cusp at rest on the stop
    level = CubicSpline(np.sqrt(spread.energy[up]), np.log(spread.level[up]))
    p = np.zeros((len(x), len(half)))
    for j in np.flatnonzero((x >= -spread.gap) & (kinetic[:, -1] > 0.0)):
        k = kinetic[j]
        first = int(np.argmax(kinetic[j] > 0.0))
        up = _rising(k, spread, first)
        nodes = k[up]
        energy = spread.energy[up]
        if first > 0:  # from the orbit that turns at x, without another that is almost the same
            near = int(len(nodes) > 1 and nodes[0] < 0.1 * nodes[1])
            nodes = np.append(0.0, nodes[near:])
            energy = np.append(turning[j], energy[near:])
        inside = half <= nodes[-1]
        at = np.maximum(half[inside], nodes[0])
        through = PchipInterpolator(nodes, energy)
        # inside the smallest orbit the law is flat
        p[j, inside] = np.exp(level(np.sqrt(through(at)))) * through(at, 1)
    return p


def _rising(values: Floats, spread: Spread, first: int = 0) -> Any:
    """Places from ``first`` on at which the values exceed all before: all but those of a few orbits next to grazing.

    Raises SimulationError if that leaves out more than a few.
    """
    rest = values[first:]
    kept = rest > np.append(-np.inf, np.maximum.accumulate(rest)[:-1])
    if spread.mass[first:][~kept].sum() > _MOST_CROSSING:
        raise SimulationError(
            "the voltage is so strong that averaged orbits cross: use engine 'ensemble'"
        )
    return np.asarray(first + np.flatnonzero(kept))


def _turning_there(x: Floats, spread: Spread) -> Floats:
    """Energy of the orbit that turns at x, shape (m,), if one does."""
    right = _rising(spread.A, spread)
    left = np.flatnonzero(spread.gap > spread.B)[::-1]
    ends = np.concatenate([-spread.B[left], spread.A[right]])
    energy = CubicSpline(ends, np.concatenate([spread.energy[left], spread.energy[right]]))
    return np.asarray(energy(np.clip(x, ends[0], ends[-1])))


def displacement_density(x: Floats, spread: Spread) -> Floats:
    """Density p(x) = int p(x, x') dx' at x of shape (m,)."""
    dv = np.sqrt(2.0 * _kinetic(_displacements(spread)[0], spread).max()) / _POINTS
    v = (np.arange(_POINTS) + 0.5) * dv
    return np.asarray(2.0 * dv * state_density(x, v, spread).sum(axis=1))


def velocity_density(v: Floats, spread: Spread) -> Floats:
    """Density p(x') = int p(x, x') dx at x' of shape (m,)."""
    x, weights = _displacements(spread)
    return np.asarray(weights @ state_density(x, np.abs(v), spread))


def _displacements(spread: Spread) -> tuple[Floats, Floats]:
    """Gauss points of all displacements, and their weights."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    size = 0.5 * (spread.A[-1] - spread.left.min())
    return np.asarray(spread.A[-1] + size * (nodes - 1.0), dtype=np.float64), np.asarray(
        size * weights
    )


def _kinetic(x: Floats, spread: Spread) -> Floats:
    """Kinetic energy at x, (m,), on each orbit, (m, n): (A - x) (x + B) nu^2/2.

    Below 0 beyond its ends.
    """
    q = half_cycle(spread.nu.shape[1], 1)
    width = spread.A + spread.B
    order = len(q.xi) - 1
    x = np.asarray(x)[:, None]
    end = 2.0 * np.arcsin(np.sqrt(np.minimum((spread.A - spread.left) / width, 1.0)))
    coefficients = np.linalg.solve(
        np.polynomial.legendre.legvander(2.0 * q.xi - 1.0, order), spread.nu.T**2
    )

    phi = 2.0 * np.arcsin(np.sqrt(np.clip((spread.A - x) / width, 0.0, 1.0)))
    powers = np.polynomial.legendre.legvander(2.0 * np.minimum(phi / end, 1.0) - 1.0, order)
    return np.asarray(
        0.5 * (spread.A - x) * (x + spread.B) * np.einsum("mnk,kn->mn", powers, coefficients)
    )
