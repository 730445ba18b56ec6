"""The kernel of many trajectories of several modes, as `harvester.mechanics.kernels.trajectory_batch` of one.

A block's states have the rows y_1, v_1, V, y_2, v_2, y_3, ..., shape (1 + 2 n, BATCH); its sums are those of one mode, x
being the oscillator's displacement and the impact's energy that of the contact coordinate.

Controls as of `harvester.mechanics.kernels.control_variates`: sums over kicks of z_j xi {1, sqrt E} for each state z_j of
(y, v, V), and the change of z.P z with P of the Lyapunov equation for V^2, which together leave nothing of a linear
device's V^2.
"""

from typing import ClassVar

import numpy as np

from harvester.arrays import Floats
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import forced, kernel
from harvester.mechanics.kernels.intervals import drifts, interval, update_of
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.shaking import Filter, last_acceleration, shake, shaken
from harvester.mechanics.kernels.trajectory_batch import BATCH, SUMS, Batch, Schedule
from harvester.mechanics.modes.step import (
    along,
    drift_modes,
    energy_of_modes,
    kick_modes,
    modal_coefficients,
    taken_by_damping,
)


@kernel
def advance_modes(y, v, V, s0, s1, sums, controls, schedule, h, c, shaker, update):
    """Advance states of shape (n, BATCH), V of shape (BATCH,), by a `Schedule` of steps h, and add up the moments."""
    whole, half = drifts(h, c.own.mu, update)
    noise, accelerations = np.zeros((2, BATCH)), np.zeros((2, BATCH))
    y_mid, v_mid, V_mid = np.zeros_like(y), np.zeros_like(v), np.zeros_like(V)
    coarse, steps = schedule.doublings > 0, 1 if schedule.doublings > 0 else 2
    for _ in range(schedule.samples):
        for _first in range(0, schedule.stride, steps):
            if c.own.n1 is not None:
                draw_noise(noise, s0, s1, schedule.doublings)
            for k in range(steps):
                if shaker is not None:
                    shake(accelerations, coarse, shaker)
                for i in range(BATCH):
                    a, a1 = shaken(i, accelerations, shaker)
                    impacts = drift_modes(i, y, v, V, whole, c, a)
                    if c.contact is not None:
                        sums[10, i] += impacts.number
                        sums[11, i] += impacts.energy
                    if controls is not None:
                        _add_controls(i, y, v, V, noise[k, i], controls, c)
                    work = kick_modes(i, y, v, V, noise[k, i], h, c, a1)
                    if shaker is not None:
                        sums[12, i] += work
        for j in range(len(c.k)):
            for i in range(BATCH):
                y_mid[j, i], v_mid[j, i] = y[j, i], v[j, i]
        for i in range(BATCH):
            V_mid[i] = V[i]
            drift_modes(i, y_mid, v_mid, V_mid, half, c, last_acceleration(i, shaker))
            _add_sample(i, sums, along(c.e, y, i), V[i], y_mid, v_mid, V_mid[i], c)


@forced
def _add_sample(i, sums, x, V, y_mid, v_mid, V_mid, c):
    """Add up a sample: x and V at the kick, and all in mid-drift."""
    x_mid, speed = along(c.e, y_mid, i), along(c.e, v_mid, i)
    sums[0, i] += 0.5 * (V + V_mid)
    sums[1, i] += V * V
    sums[2, i] += V_mid * V_mid
    sums[3, i] += 0.5 * (x + x_mid)
    sums[4, i] += x * x
    sums[5, i] += x_mid * x_mid
    sums[6, i] += speed * speed
    sums[7, i] += 0.5 * (x * V + x_mid * V_mid)
    sums[8, i] += speed * V_mid
    sums[9, i] += taken_by_damping(i, y_mid, v_mid, c)


@forced
def _add_controls(i, y, v, V, xi, controls, c):
    """Add the noise of a kick to its martingales; the rows of V stay zero where it has no load."""
    root, n = np.sqrt(abs(energy_of_modes(i, y, v, c))), len(c.k)
    high = root * xi
    for j in range(n):
        controls[4 * j, i] += y[j, i] * xi
        controls[4 * j + 1, i] += v[j, i] * xi
        controls[4 * j + 2, i] += y[j, i] * high
        controls[4 * j + 3, i] += v[j, i] * high
    if c.own.mu is not None:
        controls[4 * n, i] += V[i] * xi
        controls[4 * n + 1, i] += V[i] * high


@kernel
def mid_drift_of_modes(y, v, V, out, h, c, shaker):
    """x, x' and V of copies of states half a step after their kick, shape (3, BATCH); the copies are changed."""
    half = interval(h, 0.5 * h, c.own.mu)
    for i in range(BATCH):
        drift_modes(i, y, v, V, half, c, last_acceleration(i, shaker))
        out[0, i], out[1, i], out[2, i] = along(c.e, y, i), along(c.e, v, i), V[i]


class ModalMotion:
    """What `harvester.mechanics.ensemble.trajectories` needs of several modes: rows of states and sums, and kernels."""

    sums: ClassVar[int] = len(SUMS)

    def __init__(self, eqs: Equations) -> None:
        assert eqs.modes is not None
        self.coefficients, self.count = modal_coefficients(eqs), eqs.modes.count
        self.rows, self.martingales = 1 + 2 * self.count, 2 * (2 * self.count + 1)
        self.mobility = eqs.modes.mobility

    def parts(self, state: Floats) -> tuple[Floats, Floats, Floats]:
        """Copies of y, v and V of a block's state."""
        first, others = state[:2], state[3:].reshape(-1, 2, state.shape[-1])
        both = np.concatenate([first[None], others])
        return np.ascontiguousarray(both[:, 0]), np.ascontiguousarray(both[:, 1]), state[2].copy()

    def advance(
        self, batch: Batch, state: Floats, schedule: Schedule, h: float, eqs: Equations, shaker: Filter | None
    ) -> None:
        """Advance a batch, whose states are all in ``state``, by a schedule of steps of h."""
        y, v, voltage = self.parts(state)
        update, words = update_of(eqs, h), (batch.s0, batch.s1)
        own = batch.sums, batch.controls, schedule, h, self.coefficients, shaker, update
        advance_modes(y, v, voltage, *words, *own)
        state[0], state[1], state[2] = y[0], v[0], voltage
        state[3::2], state[4::2] = y[1:], v[1:]

    def mid_drift(self, state: Floats, out: Floats, h: float, eqs: Equations, shaker: Filter | None) -> None:
        """Go from the states of a block after a kick to x, x' and V half a step later."""
        mid_drift_of_modes(*self.parts(state), out, h, self.coefficients, shaker)

    def boundary(self, states: Floats, eqs: Equations) -> Floats:
        """The function z.P z of states, shape (rows, count), whose change is a control; shape (1, count)."""
        from scipy.linalg import solve_continuous_lyapunov

        assert eqs.modes is not None
        y, v, voltage = self.parts(states)
        z = np.vstack([y, v, voltage[None]] if eqs.mu is not None else [y, v])
        weights = np.zeros(len(z))
        if eqs.mu is not None:
            weights[-1] = 1.0
        else:
            weights[: self.count] = eqs.modes.coupling
        form = solve_continuous_lyapunov(flow(eqs).T, -np.outer(weights, weights))
        return np.asarray(np.einsum("jn,jk,kn->n", z, form, z)[None])
