"""Stationary densities of the amplitude, with the mean square voltage, and of the state (paper, Eqs. 25-30).

Those of state, displacement and velocity follow from that of the amplitude.  Between orbits K =
K(A) changes, so that at a displacement y the energy rises with A as

    J(A, y) = g(A) + K'(A) (A^2 - y^2)/2

and the paper keeps its first term, g(A).  With J and the orbit's own period T each density
integrates to one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import cumulative_simpson

from harvester.arrays import Coefficient, Floats
from harvester.averaging.grids import noisy_stacks, or_zero, stacked, where_the_mass_is
from harvester.averaging.published.ito import diffusion, drift, stiffness
from harvester.averaging.published.orbit import (
    G,
    G_inverse,
    K,
    amplitude_through,
    dK_dA,
    frequency,
    nu2,
    omega2,
)
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError, UnboundedResponseError

# A quarter of the orbit; the rest mirrors it.
_PHI = np.asarray((np.arange(16) + 0.5) * (0.5 * math.pi / 16), dtype=np.float64)
_WIDEST = (math.log(1e-20), math.log(1e10))  # of ln A
_AMPLITUDES, _SEARCH = 2001, 321  # of a density that is looked at; in looking for it
_ENOUGH = 801  # amplitudes for E[V^2], to 2e-6
_KEPT = 32.0  # amplitudes less likely than e^-32 of the likeliest are left out
_TOGETHER = 16  # scenes in one go: their arrays stay in the processor's cache
_UNBOUNDED = "the averaged amplitude grows without bound: add damping that bounds it"
_NO_NOISE = (
    "the averaged density needs external noise (D11 or acceleration_psd): without it the stationary "
    "amplitude is zero or not unique"
)


@dataclass(frozen=True)
class Stationary:
    """The stationary density p(A) on a grid: ``A`` and ``p`` of shape (n,), and the probability ``mass`` of each point.

    A stack of scenes has them in rows, shape (scenes, n).
    """

    A: Floats
    p: Floats
    mass: Floats

    def mean(self, values: Floats) -> Floats:
        """The mean E[values(A)] over the stationary law."""
        return np.asarray((self.mass * values).sum(axis=-1))


def density(eqs: Equations) -> Stationary:
    """Stationary density p(A) = C sigma^-2 exp(int_A0^A 2 b/sigma^2 du) of the averaged FPK equation (Eqs. 25, 26).

        0 = -d(b p)/dA + 1/2 d^2(sigma^2 p)/dA^2,   p finite at 0, p -> 0 at infinity

    The lower limit A0 must be above 0, if it is printed: near 0, 2 b/sigma^2 = 1/A.  Integrated
    in ln A and normalised in log space, so that no scene over- or underflows.  The grid spans the
    amplitudes with p A above 1e-14 of its peak.

    Raises SimulationError without external noise, if no density exists; UnboundedResponseError
    if p does not fall off, or so slowly that E[A^2] is infinite.
    """
    if eqs.n1 is None:
        raise SimulationError(_NO_NOISE)
    with np.errstate(all="ignore"):  # amplitudes of no weight may overflow
        law, unbounded = _densities(stacked([eqs]), 1, _AMPLITUDES)
    if unbounded[0]:
        raise UnboundedResponseError(_UNBOUNDED)
    return Stationary(law.A[0], law.p[0], law.mass[0])


def _densities(eqs: Equations, scenes: int, points: int) -> tuple[Stationary, Any]:
    """Densities of a stack of scenes, and which of them do not fall off."""
    ends = np.full(scenes, _WIDEST[0]), np.full(scenes, _WIDEST[1])
    low, high, unbounded = where_the_mass_is(
        ends, 6 * [_SEARCH], lambda u: _log_mass(u, eqs), (_KEPT, _KEPT)
    )
    u = np.linspace(low, high, points, axis=-1)
    log_mass = _log_mass(u, eqs)
    mass = np.exp(log_mass - log_mass.max(axis=-1, keepdims=True))
    mass /= mass.sum(axis=-1, keepdims=True)
    A = np.exp(u)
    return Stationary(A=A, p=mass / (A * (u[:, 1:2] - u[:, :1])), mass=mass), unbounded


def _log_mass(u: Floats, eqs: Equations) -> Floats:
    """Logarithm of p A at A = e^u, up to a constant."""
    A = np.exp(u)
    s = sum(diffusion(A, eqs))
    slope = 2.0 * drift(A, eqs) * A / s
    out = u - np.log(s) + cumulative_simpson(slope, dx=(u[:, 1] - u[:, 0])[:, None], initial=0.0)
    return np.where(np.isfinite(out), out, -np.inf)


def mean_square_voltage(eqs: Equations) -> float:
    """The mean square voltage E[V^2]: the decoupled V of Eq. 6 averaged over orbits and over p(A) (Eq. 30).

    The plane (x, x') is covered orbit by orbit: p(x, x') dx dx' = p(A) dA dt/T(A).  On an orbit the
    average is over time (weight 1/nu); <x x'> = 0, so that

        <V^2> = (omega^4 <x^2> + mu^2 <x'^2>)/(mu^2 + omega^2)^2

    With a stop the paper uses the same V with x = |y|, so the value does not depend on it
    other than through p(A): here lies its factor of about four.

    Raises SimulationError, UnboundedResponseError as `density`, and if E[V^2] is infinite though
    p(A) exists.
    """
    answer = mean_square_voltages([eqs])[0]
    if isinstance(answer, SimulationError):
        raise answer
    return answer


def mean_square_voltages(scenes: Sequence[Equations]) -> list[float | SimulationError]:
    """Mean square voltages of many scenes at once.

    The error of a scene without an answer is in its place.
    """
    return noisy_stacks(scenes, _TOGETHER, _mean_square_voltages, _NO_NOISE)


def _mean_square_voltages(scenes: list[Equations]) -> list[float | SimulationError]:
    """Mean square voltages of a stack of scenes with the same effects."""
    eqs = stacked(scenes)
    law, unbounded = _densities(eqs, len(scenes), _ENOUGH)
    V2 = voltage_on_orbit(law.A, eqs)
    unbounded |= law.mass[:, -1] * V2[:, -1] > 1e-6 * (law.mass * V2).max(axis=-1)
    return [
        UnboundedResponseError(_UNBOUNDED) if lost or not math.isfinite(value) else float(value)
        for value, lost in zip(law.mean(V2), unbounded, strict=True)
    ]


def voltage_on_orbit(A: Floats, eqs: Equations) -> Floats:
    """Time average <V^2> of the decoupled V (Eq. 6) over the orbit of amplitude A."""
    alpha = or_zero(eqs.alpha)
    beta = or_zero(eqs.beta)
    mu = or_zero(eqs.mu)
    w2 = omega2(A, alpha, beta, mu)
    x2, v2 = orbit_means(A, alpha, K(A, alpha, beta, mu))
    return np.asarray((w2**2 * x2 + mu**2 * v2) / (mu**2 + w2) ** 2)


def orbit_means(A: Floats, alpha: Coefficient, K: Floats) -> tuple[Floats, Floats]:
    """Time averages <x^2> and <x'^2> over the orbit of amplitude A: dt = dPhi/nu(A, Phi)."""
    n2 = nu2(A[..., None], _PHI, np.asarray(alpha, dtype=np.float64)[..., None], K[..., None])
    weight = 1.0 / np.sqrt(n2)
    weight /= weight.sum(axis=-1, keepdims=True)
    return weight @ np.cos(_PHI) ** 2 * A**2, (weight * n2) @ np.sin(_PHI) ** 2 * A**2


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
    # where the orbit passes x, else 0
    v = np.sqrt(np.maximum(2.0 * (G(law.A, alpha, k) - G(y, alpha, k)), 0.0))
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
    return 2.0 * np.asarray(
        np.trapezoid(_on_orbit(np.maximum(law.A, slowest), y, law, eqs), y, axis=1)
    )


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
    """The coefficients alpha, beta and mu of the equations, 0 if absent."""
    return or_zero(eqs.alpha), or_zero(eqs.beta), or_zero(eqs.mu)
