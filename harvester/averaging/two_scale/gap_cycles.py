"""Cycles of the conservative motion with a stop at x = -gap, with the true periodic voltage.

Two kinds of orbits share one form.  Those whose energy is below the stop's swing freely between two
turning points; those above run from the stop to the right turning point and back.  Either is
symmetric in time about the turning point x = A at t = 0, and all follows from the half cycle from
there to its left end, of the duration tau:

    x = c + a cos Phi,   x' = -a sin Phi nu,   0 <= Phi <= Phi_e,   a = (A + B)/2,   c = (A - B)/2

The mass turns at -B, or would turn there without a stop: Phi_e = pi for a free orbit, and
with an impact sin^2(Phi_e/2) = (A + gap)/(A + B).  B represents the orbit's energy, U(B) in the
potential U = x^2/2 + alpha x^4/4: it meets the stop with x'^2/2 = U(B) - U(gap).  A follows from
the work of the voltage between the ends,

    U(A) + beta int V dx = U(B),   (a sin Phi nu)^2/2 = U(A) - U(x) + beta int_x^A V dx

The voltage V' + mu V = x' of period 2 tau is V = a (p' - mu p), p odd in t and p' = dp/dt:

    p'' - mu^2 p = -sin Phi nu,   p(0) = p(tau) = 0

Galerkin's method in odd polynomials of Phi gives a P without a layer at the wall: its slope there
is that on a linear spring, P'(tau) = cos Phi_e nu^2/(nu^2 + mu^2).  The layer P(tau) sinh(mu
t)/sinh(mu tau) is subtracted exactly:

    <V^2> = a^2/tau [int sin Phi P dPhi + P'(tau) P(tau) - mu coth(mu tau) P(tau)^2]

With gap = 0 this is `harvester.averaging.two_scale.cycles` with a stop, and without impacts the
same without one.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import or_zero, or_zero_by_point
from harvester.averaging.two_scale.cycles import Cycles, from_the_left
from harvester.equations.coefficients import Equations

_NARROWEST = 0.1  # the slow voltage may take all but this share of an orbit's width
_SOFTEST = 1e-3  # the voltage may take all but this share of the linear spring


@dataclass(frozen=True)
class HalfCycle:
    """Gauss points xi = Phi/Phi_e on (0, 1), (N,), and odd Legendre polynomials there, (K, N): 1 at xi = 1."""

    xi: Floats
    weights: Floats
    integral: Floats  # (N, N): the values at the points -> int_0^xi
    last: Floats  # (N,): the values at the points -> at xi = 1
    polynomials: Floats
    slopes: Floats
    stiff: Floats  # (N, K K): int nu s_j' s_k' dxi = nu @ stiff
    mass: Floats  # (N, K K): int s_j s_k/nu dxi = 1/nu @ mass


@cache
def half_cycle(points: int, polynomials: int) -> HalfCycle:
    """The half cycle with this many Gauss points and odd polynomials."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    xi = 0.5 * (nodes + 1.0)
    weights = 0.5 * weights
    p, integrals = from_the_left(nodes)
    odd = [np.polynomial.Legendre.basis(2 * k + 1) for k in range(polynomials)]
    values = np.array([s(xi) for s in odd])
    slopes = np.array([s.deriv()(xi) for s in odd])
    square = polynomials * polynomials
    return HalfCycle(
        xi=xi,
        weights=weights,
        integral=0.5 * integrals,
        last=np.asarray(np.linalg.solve(p, np.ones(points)), dtype=np.float64),
        polynomials=values,
        slopes=slopes,
        stiff=(weights * slopes[:, None] * slopes).reshape(square, points).T.copy(),
        mass=(weights * values[:, None] * values).reshape(square, points).T.copy(),
    )


def potential(x: Floats, alpha: float | None) -> Floats:
    """Potential U(x) = x^2/2 + alpha x^4/4 of the spring."""
    return np.asarray(0.5 * x**2 * (1.0 + 0.5 * or_zero(alpha) * x**2))


class DistantOrbits:
    """The orbits of energies U(B), of shape (..., n), whose voltage is refined at each call of `refine`.

    ``A``, ``a``, ``c``, ``left`` (the left end) and ``end`` (Phi there) have the shape of B; ``x``,
    ``v`` (the speed) and ``nu`` are at the points, shape (..., n, N).
    """

    def __init__(self, B: Floats, eqs: Equations, points: int = 24, polynomials: int = 12) -> None:
        self.eqs = eqs
        self.q = half_cycle(points, polynomials)
        self._even = np.zeros((*B.shape, points))  # even part of the voltage over a, at the points
        self._mean_even = np.zeros_like(B)  # and its mean along the way
        self.refine(B, np.zeros_like(B), np.zeros_like(B))

    def refine(self, B: Floats, rest: Floats, offset: Floats) -> None:
        """Solve the orbit in its present potential, then the voltage on it: one fixed-point step.

        ``offset`` is the slow part of the voltage on each orbit, constant over a cycle, and
        ``rest`` the rest position that it gives free orbits: A is about B + 2 rest.
        """
        q = self.q
        alpha = or_zero(self.eqs.alpha)
        beta = or_zero(self.eqs.beta)
        self.B = B
        self._offset = offset
        self.left = -np.minimum(B, or_zero(self.eqs.gap))
        push = beta * (offset + self._mean_even)
        energy = potential(B, self.eqs.alpha)
        # not below the solution, to which Newton's steps go down from there
        A = B + 2.0 * np.maximum(-push, 0.0)
        for _ in range(5 if self.eqs.beta is not None else 0):
            excess = potential(A, self.eqs.alpha) - energy + push * (A - self.left)
            A = A - excess / (A * (1.0 + alpha * A**2) + push)
        A = np.maximum(A, self.left + _NARROWEST * (B + 2.0 * rest - self.left))
        self.A = A
        self.a = 0.5 * (A + B)
        self.c = 0.5 * (A - B)
        self.end = 2.0 * np.arcsin(np.sqrt(np.minimum((A - self.left) / (A + B), 1.0)))
        phi = self.end[..., None] * q.xi
        self._sin = np.sin(phi)
        a = self.a[..., None]
        right = A[..., None]
        self.x = self.c[..., None] + a * np.cos(phi)
        # 2 [U(A) - U(x)]/(a sin Phi)^2 = pull/(1 + cos Phi): no difference of large numbers at
        # either end
        pull = (
            (right + self.x)
            / a
            * (1.0 + 0.5 * or_zero_by_point(self.eqs.alpha) * (right**2 + self.x**2))
        )
        if self.eqs.beta is not None:
            pulse = self._even * self._sin
            whole = 2.0 * np.sin(0.5 * self.end) ** 2
            work = self.end * (pulse @ q.weights) + offset / self.a * whole
            # What is still amiss in this fixed point must not keep the mass from its left end.
            mismatch = (potential(A, self.eqs.alpha) - energy) / self.a**2 + beta * work
            pull = pull + 2.0 * (beta * offset / self.a - mismatch / whole)[..., None]
        nu2 = pull / (2.0 * np.cos(0.5 * phi) ** 2)
        if self.eqs.beta is not None:
            so_far = self.end[..., None] * (pulse @ q.integral)
            nu2 = np.maximum(
                nu2 + 2.0 * or_zero_by_point(self.eqs.beta) * so_far / self._sin**2, _SOFTEST
            )
        self.nu = np.sqrt(nu2)
        self.v = a * self._sin * self.nu
        self._dt = self.end[..., None] * q.weights / self.nu
        self.tau = self._dt.sum(axis=-1)
        self._solve_voltage()

    def _solve_voltage(self) -> None:
        """P by Galerkin's method, then <V^2> and the even part of the voltage."""
        q = self.q
        mu = or_zero(self.eqs.mu)
        end = self.end[..., None]
        matrix = self.nu @ q.stiff / end
        if self.eqs.mu is not None:
            matrix = matrix + or_zero_by_point(self.eqs.mu) ** 2 * end * ((1.0 / self.nu) @ q.mass)
        nu2 = (self.nu @ q.last) ** 2
        slope = np.cos(self.end) * nu2 / (nu2 + mu**2)
        load = end * ((q.weights * self._sin) @ q.polynomials.T) + slope[..., None]
        size = len(q.polynomials)
        parts = np.linalg.solve(matrix.reshape(*self.end.shape, size, size), load[..., None])[
            ..., 0
        ]
        at_wall = parts.sum(axis=-1)
        z = np.maximum(mu * self.tau, 1e-8)
        self.V2 = (
            self.a**2
            / self.tau
            * ((parts * load).sum(axis=-1) - z / np.tanh(z) / self.tau * at_wall**2)
        )
        if self.eqs.beta is not None:
            self._even = (parts @ q.slopes) * self.nu / end - at_wall[..., None] * self._layer(
                z[..., None]
            )
            total = self.a**2 * self.end * ((self._even * self._sin) @ q.weights)
            self._mean_even = total / (self.A - self.left)

    def _layer(self, whole: Floats) -> Floats:
        """The layer mu cosh(mu t)/sinh(mu tau) at the points, ``whole`` = mu tau."""
        tau = self.tau[..., None]
        t = whole / tau * self.end[..., None] * ((1.0 / self.nu) @ self.q.integral)
        return np.asarray(
            whole / tau * (np.exp(t - whole) + np.exp(-t - whole)) / -np.expm1(-2.0 * whole)
        )

    @property
    def period(self) -> Floats:
        """Time of a cycle."""
        return np.asarray(2.0 * self.tau)

    def averages(self) -> Cycles:
        """The time averages over the present orbits; ``wall`` is 0 on free ones."""
        eqs = self.eqs
        gap = or_zero(self.eqs.gap)
        share = self._dt / self.tau[..., None]
        x2, v2 = self.x**2, self.v**2

        def mean(values: Floats) -> Floats:
            return np.asarray((share * values).sum(axis=-1))

        damped = -or_zero(eqs.c1) * mean(v2) - or_zero(eqs.c2) * mean(x2 * v2)
        if eqs.c3 is not None:
            damped = damped + eqs.c3 * mean(x2**2 * v2)
        stored = (
            mean(x2)
            + 0.5 * or_zero(eqs.alpha) * mean(x2**2)
            + or_zero(eqs.beta) * (self.V2 + self._offset**2)
        )
        meeting = potential(self.B, eqs.alpha) - potential(gap, eqs.alpha)
        return Cycles(
            A=self.A,
            period=self.period,
            x=mean(self.x),
            x2=mean(x2),
            v2=mean(v2),
            damped=damped,
            x2v2=mean(x2 * v2),
            xv2=mean(self.x * v2),
            V2=self.V2,
            wall=np.where(gap < self.B, np.maximum(meeting, 0.0), 0.0),
            energy=0.5 * (mean(v2) + stored),
        )
