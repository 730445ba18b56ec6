"""Cycles of the conservative motion with the true periodic voltage, for a row of amplitudes.

With a stop a cycle runs from impact to impact over the half-orbit x > 0, tau from -pi/2 to pi/2;
without, over the whole orbit.  x = A cos Phi parametrises the cycle; its speed follows from the
energy, v^2/2 = G(A) - G(x), so that time averages have the exact shape of the orbit.  The voltage
solves V' + mu V = x' periodically; its even part about the turning point depends on x alone and
belongs to the potential, its odd part takes the power:

    G(x) = x^2/2 + alpha x^4/4 + beta int V_even dx
"""

from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.scaling import Equations

_LARGEST_EXPONENT = 600.0  # exp() beyond it overflows


@dataclass(frozen=True)
class Cycles:
    """Time averages over one cycle, arrays of shape (n,), one entry an amplitude; nondimensional.

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


class Orbits:
    """A row of amplitudes, whose voltage is refined at each call of `refine`."""

    def __init__(self, A: Floats, eqs: Equations, points: int) -> None:
        self.eqs, self.A = eqs, A
        half = 0.5 * np.pi if eqs.restitution is not None else np.pi
        phi = np.linspace(-half, half, points + 1)
        middle = 0.5 * (phi[1:] + phi[:-1])
        column = A[:, None]
        self._x, self._xm = column * np.cos(phi), column * np.cos(middle)
        self._dx = np.diff(self._x, axis=1)
        self._outward = np.where(middle < 0.0, 1.0, -1.0)  # sign of x': towards the turning point, then back
        self._arc = column * np.abs(np.sin(middle)) * (phi[1] - phi[0])  # |dx|, as dPhi at mid-step
        alpha = eqs.alpha or 0.0
        self._bare = 0.5 * (column**2 - self._xm**2) + 0.25 * alpha * (column**4 - self._xm**4)
        self._even = np.zeros_like(self._x)
        self.refine(np.zeros_like(A))

    def refine(self, offset: Floats) -> None:
        """Solve the orbit in its present potential, then the voltage on it: one fixed-point step.

        ``offset`` is the slow part of the voltage at each amplitude, constant over a cycle.
        """
        beta, mu = self.eqs.beta or 0.0, self.eqs.mu or 0.0
        kinetic = self._bare
        if beta:
            mean = 0.5 * (self._even[:, 1:] + self._even[:, :-1])
            work = np.zeros_like(self._x)
            np.cumsum(mean * self._dx, axis=1, out=work[:, 1:])
            work -= work[:, self._x.shape[1] // 2, None]  # zero at the turning point
            at_middle = work[:, :-1] + 0.5 * (self._even[:, :-1] + mean) * (self._xm - self._x[:, :-1])
            kinetic = np.maximum(kinetic - beta * at_middle, 1e-3 * kinetic)
            self._work = work[:, 0]
        self._speed = np.sqrt(2.0 * kinetic)
        self._dt = self._arc / self._speed
        self._V = _periodic_voltage(self._dx, self._dt, mu)
        if beta:
            even = 0.5 * (self._V + self._V[:, ::-1])
            if self.eqs.restitution is None:  # odd in x, kept so: a tilt would feed on itself
                quarter = even[:, even.shape[1] // 2 :]
                quarter = 0.5 * (quarter - quarter[:, ::-1])
                even = np.concatenate([quarter[:, :0:-1], quarter], axis=1)
            self._even = even + offset[:, None]
        self._offset = offset

    def averages(self) -> Cycles:
        """The time averages over the present orbits."""
        eqs, x, v, dt = self.eqs, self._xm, self._speed, self._dt
        alpha, beta, mu = eqs.alpha or 0.0, eqs.beta or 0.0, eqs.mu or 0.0
        period = dt.sum(axis=1)

        def mean(values: Floats) -> Floats:
            return np.asarray((dt * values).sum(axis=1) / period)

        x2, v2, stop = x * x, v * v, eqs.restitution is not None
        friction = (eqs.c3 or 0.0) * x2 * x2 - (eqs.c2 or 0.0) * x2 - (eqs.c1 or 0.0)
        V2 = self._mean_square_voltage(period, mu)
        mean_x2, mean_v2 = mean(x2), mean(v2)
        wall = 0.5 * self.A**2 + 0.25 * alpha * self.A**4
        if beta:
            wall = np.maximum(wall - beta * self._work, 1e-3 * wall)
        stored = mean_x2 + 0.5 * alpha * mean(x2 * x2) + beta * (V2 + self._offset**2)
        return Cycles(
            A=self.A,
            period=period,
            x=mean(x) if stop else np.zeros_like(self.A),
            x2=mean_x2,
            v2=mean_v2,
            damped=mean(friction * v2),
            x2v2=mean(x2 * v2),
            xv2=mean(x * v2) if stop else np.zeros_like(self.A),
            V2=V2,
            wall=wall,
            energy=0.5 * (mean_v2 + stored),
        )

    def at(self, A: Floats) -> tuple[Floats, Floats, Floats]:
        """x, x' and shares of the time on the orbits of other amplitudes, each (m, points), between our rows."""
        place = np.interp(np.log(A), np.log(self.A), np.arange(len(self.A)))
        row = np.minimum(place.astype(int), len(self.A) - 2)
        part = (place - row)[:, None]

        def between(values: Floats) -> Floats:
            return np.asarray((1.0 - part) * values[row] + part * values[row + 1])

        shares = self._dt / self._dt.sum(axis=1, keepdims=True)
        x, speed = A[:, None] * between(self._xm / self.A[:, None]), A[:, None] * between(self._speed / self.A[:, None])
        return x, self._outward * speed, between(shares)

    def _mean_square_voltage(self, period: Floats, mu: float) -> Floats:
        """<V^2> by the identity that keeps its precision: <V x> for slow loads, <V x'>/mu for fast ones."""
        product = self._V * self._x
        slow = (0.5 * (product[:, 1:] + product[:, :-1]) * self._dt).sum(axis=1) / period
        if mu == 0.0:
            return np.asarray(slow)
        # Along a step x' is dx/dt, and int V dt = (dx - dV)/mu exactly.
        fast = (self._dx / self._dt * (self._dx - np.diff(self._V, axis=1))).sum(axis=1) / (mu**2 * period)
        cycle = np.pi if self.eqs.restitution is not None else 2.0 * np.pi
        return np.asarray(np.where(mu * period > 0.5 * cycle, fast, slow))


def _periodic_voltage(dx: Floats, dt: Floats, mu: float) -> Floats:
    """V at the nodes with V' + mu V = x', periodic and of zero mean; x' constant along each step.

    dx, dt: shape (n, points) -> shape (n, points + 1).
    """
    n, points = dx.shape
    V = np.zeros((n, points + 1))
    if mu == 0.0:
        np.cumsum(dx, axis=1, out=V[:, 1:])
        mean = (0.5 * (V[:, 1:] + V[:, :-1]) * dt).sum(axis=1) / dt.sum(axis=1)
        return np.asarray(V - mean[:, None])
    z = mu * dt
    gain = -np.expm1(-z) / z * dx
    phase = np.zeros((n, points + 1))
    np.cumsum(z, axis=1, out=phase[:, 1:])
    if phase[:, -1].max() < _LARGEST_EXPONENT:
        grown = np.exp(phase)
        np.cumsum(gain * grown[:, 1:], axis=1, out=V[:, 1:])
        V /= grown
    else:
        decay = np.exp(-z)
        for j in range(points):
            V[:, j + 1] = decay[:, j] * V[:, j] + gain[:, j]
    start = V[:, -1] / -np.expm1(-phase[:, -1])
    return np.asarray(V + start[:, None] * np.exp(-phase))
