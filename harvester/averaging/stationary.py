"""Stationary density of the amplitude, mean square voltage and power (paper, Eqs. 26-31)."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_simpson

from harvester.arrays import Floats
from harvester.averaging.ito import diffusion, drift
from harvester.averaging.orbit import nu2
from harvester.averaging.voltage import K, omega2
from harvester.errors import SimulationError, UnboundedResponseError
from harvester.scaling import Equations

_PHI = (
    np.linspace(0.0, 0.5 * math.pi, 64, endpoint=False) + 0.25 * math.pi / 64
)  # a quarter of the orbit; the rest mirrors it
_WIDEST = (math.log(1e-20), math.log(1e10))  # of ln A
_UNBOUNDED = "the averaged amplitude grows without bound: add damping that bounds it"


@dataclass(frozen=True)
class Stationary:
    """p(A) on a grid: ``A`` and ``p`` of shape (n,), weights of the integral over ln A in ``mass``."""

    A: Floats
    p: Floats
    mass: Floats

    def mean(self, values: Floats) -> float:
        """E[values(A)]."""
        return float(self.mass @ values)


def density(eqs: Equations, points: int = 2001) -> Stationary:
    """p(A) = C sigma^-2 exp(int_A0^A 2 b/sigma^2 du), the law of the averaged FPK equation (paper, Eqs. 25, 26).

        0 = -d(b p)/dA + 1/2 d^2(sigma^2 p)/dA^2,   p finite at 0, p -> 0 at infinity

    The lower limit A0 must be above 0, where it is printed: near 0, 2 b/sigma^2 = 1/A.  Integrated
    in ln A and normalised in log space, so that no scene over- or underflows.  The grid spans the
    amplitudes where p A is above 1e-14 of its peak.

    Raises
    ------
    SimulationError
        without external noise, where no density exists.
    UnboundedResponseError
        where p does not fall off, or so slowly that E[A^2] is infinite.
    """
    if eqs.n1 is None:
        raise SimulationError(
            "the averaged density needs external noise (D11 or acceleration_psd): without it the stationary "
            "amplitude is zero or not unique"
        )
    low, high = _WIDEST
    for _ in range(6):  # zoom in on where the mass is
        u = np.linspace(low, high, points)
        log_mass = _log_mass(u, eqs)
        kept = np.flatnonzero(log_mass >= log_mass.max() - 32.0)
        if kept[-1] == points - 1 and high == _WIDEST[1]:
            raise UnboundedResponseError(_UNBOUNDED)
        low, high = float(u[max(kept[0] - 1, 0)]), float(u[min(kept[-1] + 1, points - 1)])
    u = np.linspace(low, high, points)
    log_mass = _log_mass(u, eqs)
    mass = np.exp(log_mass - log_mass.max())
    mass /= mass.sum()
    A = np.exp(u)
    return Stationary(A=A, p=mass / (A * (u[1] - u[0])), mass=mass)


def _log_mass(u: Floats, eqs: Equations) -> Floats:
    """ln(p A) at A = e^u, up to a constant."""
    A = np.exp(u)
    with np.errstate(over="ignore", invalid="ignore"):
        s = sum(diffusion(A, eqs))
        slope = 2.0 * drift(A, eqs) * A / s
        out = u - np.log(s) + cumulative_simpson(slope, x=u, initial=0.0)
    return np.where(np.isfinite(out), out, -np.inf)


def mean_square_voltage(eqs: Equations) -> float:
    """E[V^2] of Eq. 30: the decoupled V of Eq. 6 averaged over orbits and over p(A).

    The plane (x, x') is covered orbit by orbit: p(x, x') dx dx' = p(A) dA dt/T(A).  On an orbit the
    average is over time (weight 1/nu); <x x'> = 0, so that

        <V^2> = (omega^4 <x^2> + mu^2 <x'^2>)/(mu^2 + omega^2)^2

    With a stop the paper uses the same V with x = |y|, so the value does not depend on it
    other than through p(A): here lies its factor of about four.

    Raises
    ------
    SimulationError, UnboundedResponseError
        as `density`, and where E[V^2] is infinite though p(A) exists.
    """
    alpha, beta, mu = eqs.alpha or 0.0, eqs.beta or 0.0, eqs.mu or 0.0
    law = density(eqs)
    A = law.A
    w2 = omega2(A, alpha, beta, mu)
    x2, v2 = orbit_means(A, alpha, K(A, alpha, beta, mu))
    V2 = (w2**2 * x2 + mu**2 * v2) / (mu**2 + w2) ** 2
    if law.mass[-1] * V2[-1] > 1e-6 * (law.mass * V2).max():
        raise UnboundedResponseError(_UNBOUNDED)
    return law.mean(V2)


def mean_power(eqs: Equations) -> float:
    """E[P] = beta mu E[V^2], in units of M w0^3 l^2 (paper, Eq. 31)."""
    return (eqs.beta or 0.0) * (eqs.mu or 0.0) * mean_square_voltage(eqs)


def orbit_means(A: Floats, alpha: float, K: Floats) -> tuple[Floats, Floats]:
    """Time averages <x^2> and <x'^2> over the orbit of amplitude A: dt = dPhi/nu(A, Phi)."""
    n2 = nu2(A[:, None], _PHI, alpha, K[:, None])
    weight = 1.0 / np.sqrt(n2)
    weight /= weight.sum(axis=1, keepdims=True)
    x2 = (weight * np.cos(_PHI) ** 2).sum(axis=1) * A**2
    v2 = (weight * n2 * np.sin(_PHI) ** 2).sum(axis=1) * A**2
    return x2, v2
