"""The kernel of many trajectories of several modes, as `harvester.mechanics.kernels.trajectory_batch` of one.

A block's states have the rows y_1, v_1, V, y_2, ..., v_2, ..., shape (1 + 2 n, BATCH); its sums are
those of one mode, x being the oscillator's displacement and the impact's energy that of the contact
coordinate.

Controls as of `harvester.mechanics.kernels.control_variates`: sums over kicks of z_j xi {1, sqrt E}
for each state z_j of (y, v, V), and the change of z.P z with P of the Lyapunov equation for V^2,
which together leave nothing of a linear device's V^2 but the step's error.
"""

import math
from typing import Any

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.circuit_control_variates import boundary_functions
from harvester.mechanics.kernels.compiled import forced, kernel, version_of
from harvester.mechanics.kernels.equation_of_motion import friction, is_damped
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.intervals import drifts, interval, update_of
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.shaking import Filter, last_acceleration, shake
from harvester.mechanics.kernels.trajectory_batch import BATCH, IDEAL_SUMS, SUMS, Batch, Schedule
from harvester.mechanics.modes.modal_circuit import add_modal_features, drift_with_ideal
from harvester.mechanics.modes.modal_step import (
    dot,
    drift_modes,
    energy_of_modes,
    kick_modes,
    modal_coefficients,
)

RESISTOR_ROWS = 3  # rows of one mode with a resistor: x, x', V
BESIDE = 7  # rows of z after the states: two of noise, two of excitation; impacts, energy, work


@kernel
def advance_modes(
    z, s0, s1, sums, controls, schedule, h, c, shaker, update, store=None, circuit=None
):
    """Advance states z by a `Schedule` of steps h, and add up the moments; z has `BESIDE` rows more, and `controls`.

    With an ideal ``circuit`` its U and m are in ``store``, shape (2, BATCH), and controls are those
    of one mode.
    """
    whole, half = drifts(h, c.oscillator.mu, update)
    states = 2 * len(c.k) + 1
    noise = np.zeros((2, BATCH))
    accelerations = z[(states + 2) * BATCH : (states + 4) * BATCH].reshape(2, BATCH)
    mid = np.zeros(states * BATCH)
    coarse = schedule.doublings > 0
    steps = 1 if schedule.doublings > 0 else 2
    for _ in range(schedule.samples):
        for _first in range(0, schedule.stride, steps):
            if c.oscillator.n1 is not None:
                draw_noise(noise, s0, s1, schedule.doublings)
            for k in range(steps):
                if shaker is not None:
                    shake(accelerations, coarse, shaker)
                for i in range(BATCH):
                    z[states * BATCH + i] = noise[k, i]
                for i in range(BATCH):
                    _step(
                        i,
                        z,
                        z[states * BATCH + i],
                        h,
                        d=whole,
                        c=c,
                        shaker=shaker,
                        controls=controls,
                        store=store,
                        circuit=circuit,
                    )
        for i in range(states * BATCH):
            mid[i] = z[i]
        to_mid_drift(mid, store, sums, half, c, shaker=shaker, circuit=circuit)
        for i in range(BATCH):
            add_sample_of_modes(i, sums, z, mid, c)
    _give_sums(z, sums, controls if circuit is None else None, states)


def drift(i, z, store, d, c, a, circuit):
    """Drift lane i of z and of ``store``; the `Impacts` of it."""


def add_to_controls(i, z, store, xi, controls, c, circuit):
    """Add up the controls of lane i ahead of a kick."""


def to_mid_drift(mid, store, sums, half, c, shaker, circuit):
    """Take all lanes half a step on, and add up the power that an ideal circuit passes on."""


@version_of(drift, circuit=None)
def _drift_with_resistor(i, z, store, d, c, a, circuit):
    return drift_modes(i, z, d, c, a)


@version_of(drift, circuit=IdealCircuit)
def _drift_with_ideal(i, z, store, d, c, a, circuit):
    return drift_with_ideal(i, z, store, d, c=c, a=a, circuit=circuit)


@version_of(add_to_controls, circuit=None)
def _add_products(i, z, store, xi, controls, c, circuit):
    n = len(c.k)
    high = math.sqrt(abs(energy_of_modes(i, z, c))) * xi
    for j in range(2 * n + 1):
        z[(2 * n + 1 + BESIDE + j) * BATCH + i] += z[j * BATCH + i] * xi
        z[(4 * n + 2 + BESIDE + j) * BATCH + i] += z[j * BATCH + i] * high


@version_of(add_to_controls, circuit=IdealCircuit)
def _add_features(i, z, store, xi, controls, c, circuit):
    add_modal_features(i, z, store[0, i], xi, controls, c)


@version_of(to_mid_drift, circuit=None)
def _resistor_to_mid_drift(mid, store, sums, half, c, shaker, circuit):
    for i in range(BATCH):
        drift_modes(i, mid, half, c, last_acceleration(i, shaker))


@version_of(to_mid_drift, circuit=IdealCircuit)
def _ideal_to_mid_drift(mid, store, sums, half, c, shaker, circuit):
    held = store.copy()
    for i in range(BATCH):
        drift_with_ideal(i, mid, held, half, c=c, a=last_acceleration(i, shaker), circuit=circuit)
        sums[13, i] += 0.5 * circuit.mu * (store[0, i] * store[0, i] + held[0, i] * held[0, i])


@forced
def _give_sums(z, sums, controls, states):
    """Write the sums next to the states, to their places."""
    for i in range(BATCH):
        for row in range(3):
            sums[10 + row, i] = z[(states + 4 + row) * BATCH + i]
    if controls is not None:
        for j in range(len(controls)):
            for i in range(BATCH):
                controls[j, i] = z[(states + BESIDE + j) * BATCH + i]


@forced
def _step(i, z, xi, h, d, c, shaker, controls, store, circuit):
    """Make one step of lane i, and add up impacts, work and controls."""
    n = len(c.k)
    a, a1 = _shaken(i, z, n, shaker)
    impacts = drift(i, z, store, d, c=c, a=a, circuit=circuit)
    if c.contact is not None:
        z[(2 * n + 5) * BATCH + i] += impacts.number
        z[(2 * n + 6) * BATCH + i] += impacts.energy
    if controls is not None:
        add_to_controls(i, z, store, xi, controls=controls, c=c, circuit=circuit)
    work = kick_modes(i, z, xi, h, c, a1)
    if shaker is not None:
        z[(2 * n + 7) * BATCH + i] += work


@forced
def _shaken(i, z, n, shaker):
    """The means of the excitation over the drift, and at the kick; None without."""
    if shaker is None:
        return None, None
    return z[(2 * n + 3) * BATCH + i], z[(2 * n + 4) * BATCH + i]


@forced
def add_sample_of_modes(i, sums, z, mid, c):
    """Add up a sample: x and V at the kick, and all in mid-drift."""
    n = len(c.k)
    x = dot(c.e, z, 0, i)
    V = z[2 * n * BATCH + i]
    V_mid = mid[2 * n * BATCH + i]
    x_mid = dot(c.e, mid, 0, i)
    speed = dot(c.e, mid, n, i)
    sums[0, i] += 0.5 * (V + V_mid)
    sums[1, i] += V * V
    sums[2, i] += V_mid * V_mid
    sums[3, i] += 0.5 * (x + x_mid)
    sums[4, i] += x * x
    sums[5, i] += x_mid * x_mid
    sums[6, i] += speed * speed
    sums[7, i] += 0.5 * (x * V + x_mid * V_mid)
    sums[8, i] += speed * V_mid
    sums[9, i] += taken_by_damping(i, mid, c)


@forced
def taken_by_damping(i, z, c):
    """The power that damping dissipates."""
    speeds = len(c.k) * BATCH + i
    x = dot(c.e, z, 0, i)
    speed = dot(c.e, z, len(c.k), i)
    total = friction(x, speed, c.oscillator) * speed * speed if is_damped(c.oscillator) else 0.0
    for j in range(len(c.d)):
        total += c.d[j] * z[speeds + j * BATCH] * z[speeds + j * BATCH]
    return total


@kernel
def mid_drift_of_modes(z, out, h, c, shaker, store=None, circuit=None):
    """Go from a copy of states, which is changed, to x, x' and V half a step after their kick, shape (3, BATCH)."""
    half = interval(h, 0.5 * h, c.oscillator.mu)
    n = len(c.k)
    for i in range(BATCH):
        drift(i, z, store, half, c=c, a=last_acceleration(i, shaker), circuit=circuit)
        out[0, i] = dot(c.e, z, 0, i)
        out[1, i] = dot(c.e, z, n, i)
        out[2, i] = z[2 * n * BATCH + i]


class ModalMotion:
    """The parts of several modes for `harvester.mechanics.ensemble.trajectories`: rows of states and sums, and kernels.

    The load is a resistor.  Rows of further modes begin below those ``before``.
    """

    circuit: IdealCircuit | None = None
    sums = len(SUMS)
    before = RESISTOR_ROWS

    def __init__(self, eqs: Equations) -> None:
        assert eqs.modes is not None
        self.coefficients = modal_coefficients(eqs, eqs.modes)
        self.count = eqs.modes.count
        self.rows = self.before - 2 + 2 * self.count
        self.martingales = 2 * (2 * self.count + 1)
        self.modes = eqs.modes
        self.mobility = eqs.modes.mobility

    def order(self, first: int | None = None) -> list[int]:
        """The rows of a block's state in the order of the kernels, y, v and V; those of y_2 begin at the ``first``."""
        first = self.before if first is None else first
        n = self.count
        return [0, *range(first, first + n - 1), 1, *range(first + n - 1, first + 2 * n - 2), 2]

    def begin(self, state: Floats, first: int) -> None:
        """Place a ball, whose coordinate is the last one from the row ``first`` on, amid its box."""
        if self.count > self.modes.sprung:
            state[:, first + self.count - 2] = self.modes.at_rest(state[:, 0])[-1]

    def advance(
        self,
        batch: Batch,
        state: Floats,
        schedule: Schedule,
        h: float,
        eqs: Equations,
        shaker: Filter | None,
    ) -> None:
        """Advance a batch, whose states are all in ``state``, by a schedule of steps of h."""
        order = self.order()
        store = self._store(state)
        rows = len(order)
        z = aligned((rows + BESIDE + (0 if batch.controls is None else self.martingales), BATCH))
        z[:rows] = state[order]
        advance_modes(
            z.reshape(-1),
            s0=batch.s0,
            s1=batch.s1,
            sums=batch.sums,
            controls=batch.controls,
            schedule=schedule,
            h=h,
            c=self.coefficients,
            shaker=shaker,
            update=update_of(eqs, h),
            store=store,
            circuit=self.circuit,
        )
        state[order] = z[:rows]

    def mid_drift(
        self, state: Floats, out: Floats, h: float, eqs: Equations, shaker: Filter | None
    ) -> None:
        """Go from the states of a block after a kick to x, x' and V half a step later."""
        mid_drift_of_modes(
            state[self.order()].reshape(-1),
            out,
            h,
            self.coefficients,
            shaker=shaker,
            store=self._store(state.copy()),
            circuit=self.circuit,
        )

    def _store(self, state: Floats) -> Any:
        """The rows of an ideal circuit in ``state``; None without one."""
        return None

    def boundary(self, states: Floats, eqs: Equations) -> Floats:
        """The function z.P z of states, shape (rows, count), whose change is a control.

        Its shape is (1, count).
        """
        from scipy.linalg import solve_continuous_lyapunov

        z = states[self.order()][: None if eqs.mu is not None else -1]
        weights = np.zeros(len(z))
        if eqs.mu is not None:
            weights[-1] = 1.0
        else:
            weights[: self.count] = self.modes.coupling
        bound = [
            j for j in range(len(z)) if j % self.count < self.modes.sprung or j == 2 * self.count
        ]
        z = z[bound]
        weights = weights[bound]
        matrix = flow(eqs)[np.ix_(bound, bound)]
        form = solve_continuous_lyapunov(matrix.T, -np.outer(weights, weights))
        return np.asarray(np.einsum("jn,jk,kn->n", z, form, z)[None])

    def circuit_boundary(self, states: Floats, eqs: Equations, first: int) -> Floats:
        """`boundary_functions` of states with a circuit, which end before the row ``first``."""
        z = states[self.order(first)]
        U = states[RESISTOR_ROWS]
        modes = self.modes
        n = self.count
        V = z[-1]
        y = z[:n]
        v = z[n : 2 * n]
        x = modes.direction @ z[:n]
        energy = eqs.spring[0] * x * x + (v * v).sum(axis=0) + np.array(modes.stiffness) @ (y * y)
        W = 0.5 * np.abs(energy) + 0.5 * (eqs.beta or 0.0) * V * V
        return boundary_functions(np.array(modes.coupling) @ y, np.array(modes.base) @ v, V, U, W)


class ModalMotionWithIdeal(ModalMotion):
    """Several modes with an ideal circuit, whose U and m are in the rows below x, x' and V."""

    sums = len(IDEAL_SUMS)
    before = RESISTOR_ROWS + 2

    def __init__(self, eqs: Equations, circuit: IdealCircuit) -> None:
        super().__init__(eqs)
        self.circuit = circuit

    def _store(self, state: Floats) -> Any:
        """The rows of the circuit in ``state``."""
        return state[RESISTOR_ROWS : self.before]
