"""Cycles of the conservative motion with the true periodic voltage, for a row of amplitudes.

A cycle is symmetric in time about its turning point x = A at t = 0; all follows from the quarter 0
<= Phi <= pi/2 of x = A cos Phi, from there to x = 0, of the duration tau: half a cycle with a
stop, a quarter of one without.  Its speed is x' = -A sin Phi nu, nu = dPhi/dt from the energy.

The voltage V' + mu V = x', periodic, is V = A (p' - mu p) with p odd in t and p' = dp/dt:

    p'' - mu^2 p = -sin Phi nu,   p(0) = 0,   p(tau) = 0 with a stop, p'(tau) = 0 without

With P the solution without a stop, by Galerkin's method in sin Phi, sin 3 Phi, ..., the stop
subtracts P(tau) sinh(mu t)/sinh(mu tau), whose layer at the wall is kept exactly for every mu, and

    <V^2> = A^2/tau [int sin Phi P dPhi - (stop) mu coth(mu tau) P(tau)^2]

which is A^2 chi(m)/(2 (1 + m^2)) on a linear spring.  Galerkin's method makes the first
term's error second order in P's.  The even part A p' depends on x alone and bends the potential:

    nu^2 = 1 + alpha A^2 (1 + cos^2 Phi)/2 + 2 beta/sin^2 Phi int_0^Phi p' sin Phi dPhi
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import or_zero, or_zero_by_point
from harvester.equations.coefficients import Equations

_SOFTEST = 1e-3  # the voltage may take all but this share of the spring's potential


@dataclass(frozen=True)
class Cycles:
    """Time averages over one cycle, arrays of the shape of A, one entry an amplitude.

    Nondimensional.

    V2 is <V^2> of the periodic voltage, which has zero mean.  ``wall`` is x'^2/2 at the stop,
    ``energy`` the mean of x'^2/2 + x^2/2 + alpha x^4/4 + beta V^2/2, which only noise, friction,
    impacts and load change.
    """

    A: Floats
    period: Floats
    x: Floats
    x2: Floats
    v2: Floats
    damped: Floats  # <f x'^2>
    x2v2: Floats
    xv2: Floats
    V2: Floats
    wall: Floats
    energy: Floats


@dataclass(frozen=True)
class Quarter:
    """Gauss points Phi on (0, pi/2), and the odd harmonics there.

    Arrays over points (N,) or harmonics (K,).
    """

    phi: Floats
    weights: Floats
    integral: Floats  # (N, N): the values at the points -> int_0^Phi
    slopes: Floats  # (K, N): d sin((2k-1) Phi)/dPhi
    ends: Floats  # (K,): sin((2k-1) pi/2)
    stiff: Floats  # (N, K K): int nu s_j' s_k' dPhi = nu @ stiff
    mass: Floats  # (N, K K): int s_j s_k/nu dPhi = 1/nu @ mass


def from_the_left(nodes: Floats) -> tuple[Floats, Floats]:
    """The Legendre polynomials P_j at n Gauss nodes, and the weights of integrals from -1 to each.

    int_-1^x P_j = (P_(j+1) - P_(j-1))/(2j + 1), with P_-1 = -1; both have the shape (n, n).
    """
    n = len(nodes)
    p: Any = np.polynomial.legendre.legvander(nodes, n).T
    before = np.concatenate([[-np.ones(n)], p[: n - 1]])
    inner = (p[1:] - before) / (2.0 * np.arange(n)[:, None] + 1.0)
    return p[:n], np.linalg.solve(p[:n], inner)


@cache
def quarter(points: int, harmonics: int) -> Quarter:
    """The quarter with this many Gauss points and odd harmonics."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    phi = 0.25 * np.pi * (nodes + 1.0)
    weights = 0.25 * np.pi * weights
    integral = 0.25 * np.pi * from_the_left(nodes)[1]
    n = 2.0 * np.arange(harmonics) + 1.0
    sines = np.sin(n[:, None] * phi)
    slopes = n[:, None] * np.cos(n[:, None] * phi)
    square = harmonics * harmonics
    return Quarter(
        phi=phi,
        weights=weights,
        integral=integral,
        slopes=np.asarray(slopes, dtype=np.float64),
        ends=np.sin(0.5 * np.pi * n),
        stiff=(weights * slopes[:, None] * slopes).reshape(square, points).T.copy(),
        mass=(weights * sines[:, None] * sines).reshape(square, points).T.copy(),
    )


class Orbits:
    """The orbits of amplitudes A, of shape (..., n), whose voltage is refined at each call of `refine`.

    ``nu`` has the shape (..., n, N); ``x`` = A cos Phi and ``v`` = A sin Phi nu, the speed, are at
    the points.
    """

    def __init__(self, A: Floats, eqs: Equations, points: int = 16, harmonics: int = 4) -> None:
        self.eqs = eqs
        self.A = A
        self.q = quarter(points, harmonics)
        self._sin, self._cos = np.sin(self.q.phi), np.cos(self.q.phi)
        bend = 0.5 * or_zero(eqs.alpha) * A**2
        self._bare = 1.0 + bend[..., None] * (1.0 + self._cos**2)
        self._bare_end = 1.0 + bend
        self._even = np.zeros_like(self._bare)
        self.refine(np.zeros_like(A))

    def refine(self, offset: Floats) -> None:
        """Solve the orbit in its present potential, then the voltage on it: one fixed-point step.

        ``offset`` is the slow part of the voltage at each amplitude, constant over a cycle.
        """
        q, nu2 = self.q, self._bare
        self._offset = offset
        self._end = self._bare_end
        if self.eqs.beta is not None:
            pushed = (offset / self.A)[..., None]
            work = (self._even * self._sin) @ q.integral + pushed * (1.0 - self._cos)
            nu2 = np.maximum(
                nu2 + 2.0 * or_zero_by_point(self.eqs.beta) * work / self._sin**2, _SOFTEST * nu2
            )
            work_end = (self._even * self._sin) @ q.weights + pushed[..., 0]
            self._end = np.maximum(self._end + 2.0 * self.eqs.beta * work_end, _SOFTEST * self._end)
        self.nu = np.sqrt(nu2)
        self._dt = q.weights / self.nu
        self.tau = self._dt.sum(axis=-1)
        self._solve_voltage()

    def _solve_voltage(self) -> None:
        """P by Galerkin's method, then <V^2> and the even part of the voltage."""
        q = self.q
        stop = self.eqs.restitution is not None
        matrix = self.nu @ q.stiff
        if self.eqs.mu is not None:
            matrix = matrix + or_zero_by_point(self.eqs.mu) ** 2 * (self._dt / q.weights) @ q.mass
        a = _first_column(matrix, len(q.ends)) * (0.25 * np.pi)
        square = 0.25 * np.pi * a[..., 0]
        if self.eqs.beta is not None:
            self._even = (a @ q.slopes) * self.nu
        if stop:
            end = a @ q.ends
            square = square - _mu_coth(or_zero(self.eqs.mu), self.tau) * end**2
            if self.eqs.beta is not None:
                self._even = self._even - end[..., None] * self._layer()
        self._V2 = self.A**2 * square / self.tau

    def _layer(self) -> Floats:
        """The layer mu cosh(mu t)/sinh(mu tau) at the points."""
        if self.eqs.mu is None:
            return np.asarray((1.0 / self.tau)[..., None])
        mu = or_zero_by_point(self.eqs.mu)
        z = mu * ((1.0 / self.nu) @ self.q.integral)
        whole = mu * self.tau[..., None]
        return np.asarray(mu * (np.exp(z - whole) + np.exp(-z - whole)) / -np.expm1(-2.0 * whole))

    @property
    def period(self) -> Floats:
        """Time of a cycle: from impact to impact, or the whole orbit without a stop."""
        return np.asarray((4.0 if self.eqs.restitution is None else 2.0) * self.tau)

    def averages(self) -> Cycles:
        """The time averages over the present orbits."""
        eqs, A = self.eqs, self.A
        alpha, beta = or_zero(eqs.alpha), or_zero(eqs.beta)
        share = self._dt / self.tau[..., None]
        # x^2 and x'^2, over A^2
        c2 = self._cos**2
        s2 = (self._sin * self.nu) ** 2

        def mean(values: Floats) -> Floats:
            return np.asarray((share * values).sum(axis=-1))

        x2 = A**2 * (share @ c2)
        v2 = A**2 * mean(s2)
        x4 = A**4 * (share @ c2**2)
        x2v2 = A**4 * mean(c2 * s2)
        damped = -or_zero(eqs.c1) * v2 - or_zero(eqs.c2) * x2v2
        if eqs.c3 is not None:
            damped = damped + eqs.c3 * A**6 * mean(c2**2 * s2)
        stored = x2 + 0.5 * alpha * x4 + beta * (self._V2 + self._offset**2)
        none = np.zeros_like(A)
        return Cycles(
            A=A,
            period=self.period,
            x=none if eqs.restitution is None else A * (share @ self._cos),
            x2=x2,
            v2=v2,
            damped=damped,
            x2v2=x2v2,
            xv2=none if eqs.restitution is None else A**3 * mean(self._cos * s2),
            V2=self._V2,
            wall=0.5 * A**2 * self._end,
            energy=0.5 * (v2 + stored),
        )


def _first_column(matrix: Floats, size: int) -> Floats:
    """First column of the inverse of symmetric positive matrices, (..., size^2) -> (..., size).

    Elimination without pivots from the last row up, over all amplitudes at once.
    """
    rows = [[matrix[..., size * j + k] for k in range(size)] for j in range(size)]
    for k in range(size - 1, 0, -1):
        for j in range(k):
            factor = rows[j][k] / rows[k][k]
            for i in range(j + 1):
                rows[j][i] = rows[j][i] - factor * rows[k][i]
                rows[i][j] = rows[j][i]
    out = [1.0 / rows[0][0]]
    for k in range(1, size):
        out.append(-sum(rows[k][i] * out[i] for i in range(k)) / rows[k][k])
    return np.stack(out, axis=-1)


def _mu_coth(mu: Floats, tau: Floats) -> Floats:
    """The factor mu coth(mu tau); 1/tau for mu = 0."""
    z = np.maximum(mu * tau, 1e-8)
    return np.asarray(z / np.tanh(z) / tau)
