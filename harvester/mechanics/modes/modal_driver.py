"""The answers of several modes to `harvester.mechanics.kernels.driver`.

Their state s is the number of the trajectory among those of z, which alone is changed
(`harvester.mechanics.modes.modal_step`).
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.circuit_control_variates import boundary_functions
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import version_of
from harvester.mechanics.kernels.driver import (
    add_sample,
    add_to_controls,
    beside,
    coordinates,
    drifted,
    kicked,
    load_aside,
    load_at,
    oscillator,
    put,
    put_load,
    read,
    speed,
    state_at,
)
from harvester.mechanics.kernels.equation_of_motion import friction, is_damped
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit, Store
from harvester.mechanics.kernels.one_mode import IdealLoad
from harvester.mechanics.modes.modal_circuit import add_modal_features, drift_with_ideal
from harvester.mechanics.modes.modal_step import (
    ModalCoefficients,
    dot,
    drift_modes,
    energy_of_modes,
    kick_modes,
    modal_coefficients,
)

RESISTOR_ROWS = 3  # rows of one mode with a resistor: x, x', V


@version_of(oscillator, c=ModalCoefficients)
def _oscillator(c):
    return c.oscillator


@version_of(coordinates, c=ModalCoefficients)
def _coordinates(c):
    return len(c.k)


@version_of(drifted, c=ModalCoefficients, load=None)
def _with_resistor(s, z, d, c, a, load):
    return s, load, drift_modes(s, z, d, c, a)


@version_of(drifted, c=ModalCoefficients, load=IdealLoad)
def _with_ideal(s, z, d, c, a, load):
    store, did = drift_with_ideal(s, z, load.store, d, c=c, a=a, circuit=load.circuit)
    return s, IdealLoad(load.circuit, store, load.charge), did


@version_of(kicked, c=ModalCoefficients)
def _kicked(s, z, xi, h, c, a, other=None):
    kick_modes(s, z, xi, h, c, a)
    return s


@version_of(beside, c=ModalCoefficients)
def _beside(s, z, room, c):
    for j in range(2 * len(c.k) + 1):
        room[j * BATCH + s] = z[j * BATCH + s]
    return s


@version_of(read, c=ModalCoefficients)
def _read(s, z, c):
    n = len(c.k)
    return dot(c.e, z, 0, s), dot(c.e, z, n, s), z[2 * n * BATCH + s]


@version_of(speed, c=ModalCoefficients)
def _speed(s, z, c):
    return dot(c.g, z, len(c.k), s)


@version_of(state_at, c=ModalCoefficients)
def _state_at(i, z, c):
    return i


@version_of(put, c=ModalCoefficients)
def _put(i, z, s, c):
    return None


@version_of(add_sample, c=ModalCoefficients)
def _add_sample(i, sums, s, z, mid, z_mid, c):
    n = len(c.k)
    x, _, V = read(s, z, c)
    x_mid, v_mid, V_mid = read(mid, z_mid, c)
    sums[0 * BATCH + i] += 0.5 * (V + V_mid)
    sums[1 * BATCH + i] += V * V
    sums[2 * BATCH + i] += V_mid * V_mid
    sums[3 * BATCH + i] += 0.5 * (x + x_mid)
    sums[4 * BATCH + i] += x * x
    sums[5 * BATCH + i] += x_mid * x_mid
    sums[6 * BATCH + i] += v_mid * v_mid
    sums[7 * BATCH + i] += 0.5 * (x * V + x_mid * V_mid)
    sums[8 * BATCH + i] += v_mid * V_mid
    # the power that damping dissipates
    total = friction(x_mid, v_mid, c.oscillator) * v_mid * v_mid if is_damped(c.oscillator) else 0.0
    for j in range(n):
        v = z_mid[(n + j) * BATCH + mid]
        total += c.d[j] * v * v
    sums[9 * BATCH + i] += total


@version_of(load_at, c=ModalCoefficients, load=IdealCircuit)
def _ideal_at(i, z, c, load, driven):
    row = (2 * len(c.k) + 1) * BATCH + i
    return IdealLoad(load, Store(z[row], z[row + BATCH]), None)


@version_of(load_aside, c=ModalCoefficients, load=IdealCircuit)
def _ideal_aside(i, z, mid, c, load):
    return load_at(i, z, c, load, None)


@version_of(put_load, c=ModalCoefficients, load=IdealCircuit)
def _put_ideal(i, z, sums, changed, c, load):
    row = (2 * len(c.k) + 1) * BATCH + i
    z[row] = changed.store.U
    z[row + BATCH] = changed.store.m


@version_of(add_to_controls, c=ModalCoefficients, load=None)
def _add_products(i, z, s, xi, other, kick_sums, controls, c, load):
    n = len(c.k)
    high = math.sqrt(abs(energy_of_modes(i, z, c))) * xi
    # below the states: between an array of their own and z, loads would wait for stores
    for j in range(2 * n + 1):
        z[(2 * n + 1 + j) * BATCH + i] += z[j * BATCH + i] * xi
        z[(4 * n + 2 + j) * BATCH + i] += z[j * BATCH + i] * high


@version_of(add_to_controls, c=ModalCoefficients)
def _add_features(i, z, s, xi, other, kick_sums, controls, c, load):
    add_modal_features(i, z, z[(2 * len(c.k) + 1) * BATCH + i], xi, controls, c)


class ModalMotion:
    """The coefficients of several modes for kernels, and their rows in the states of many trajectories.

    Controls are as of `harvester.mechanics.kernels.control_variates`: with a resistor the sums over
    kicks of z_j xi {1, sqrt E} for each state z_j of (y, v, V), and the change of z.P z with P of
    the Lyapunov equation for V^2, which together leave nothing of a linear device's V^2 but the
    step's error.
    """

    def __init__(self, eqs: Equations) -> None:
        assert eqs.modes is not None
        self.coefficients = modal_coefficients(eqs, eqs.modes)
        self.count = eqs.modes.count
        self.further_rows = 2 * (self.count - 1)  # below those of one mode with its load
        self.martingales = 2 * (2 * self.count + 1)
        self.modes = eqs.modes
        self.mobility = eqs.modes.mobility

    def order(self, first: int) -> list[int]:
        """The rows of a block's state in the order of the kernels, y, v and V.

        Those of y_2 begin at the ``first``.
        """
        n = self.count
        return [0, *range(first, first + n - 1), 1, *range(first + n - 1, first + 2 * n - 2), 2]

    def begin(self, state: Floats, first: int) -> None:
        """Place a ball, whose coordinate is the last one from the row ``first`` on, amid its box."""
        if self.count > self.modes.sprung:
            state[:, first + self.count - 2] = self.modes.at_rest(state[:, 0])[-1]

    def boundary(self, states: Floats, eqs: Equations) -> Floats:
        """The function z.P z of states, shape (rows, count), whose change is a control.

        Its shape is (1, count).
        """
        from scipy.linalg import solve_continuous_lyapunov

        z = states[self.order(RESISTOR_ROWS)][: None if eqs.mu is not None else -1]
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
