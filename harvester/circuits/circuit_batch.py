"""The kernel of many trajectories of the mass with a compiled circuit, one after the other in each step.

As `harvester.mechanics.kernels.trajectory_batch`, with the sums of the same moments.
"""

import numpy as np

from harvester.circuits.mass import drifted
from harvester.circuits.pointers import advance
from harvester.circuits.substeps import DID, ROOMS
from harvester.mechanics.kernels.circuit_control_variates import add_circuit_features
from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined, kernel
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.kernels.shaken_control_variates import shake_and_add
from harvester.mechanics.kernels.shaking import last_acceleration, shaken
from harvester.mechanics.kernels.trajectory_batch import BATCH, SUMS, add_sample

# rows of the mass: x, x', V, and the voltage of the store; a circuit's state is below them
MASS_ROWS = 4
MORE_SUMS = (*SUMS, "load", "substeps", "failed")


@inlined
def fly(i, state, its_state, circuit, room, x1, wall, first, t, whole):
    """Advance the circuit of trajectory i, whose state is copied to ``its_state``, by a drift; see `follow`."""
    for k in range(len(its_state)):
        its_state[k] = state[MASS_ROWS + k, i]
    advance(
        circuit.address, circuit.record, its_state, room, state[0, i], x1, wall, first, t, whole
    )


@kernel
def advance_circuit(b, state, schedule, h, circuit, c, shaker):
    """Advance a `Batch` by a `Schedule` of steps of h and add up its moments.

    ``state``, shape (MASS_ROWS + length of a circuit's state, BATCH), holds all states, of which those of the mass and
    U are the batch's; the sums have the shape (len(MORE_SUMS), BATCH).  ``circuit`` is compiled, c the coefficients.
    """
    room = np.empty((ROOMS, circuit.length))
    its_state = np.empty(state.shape[0] - MASS_ROWS)
    last = len(its_state) - DID
    volts = circuit.volts
    sums = b.sums
    steps = 1 if schedule.doublings > 0 else 2
    noise = np.zeros((2, BATCH))
    accelerations = np.zeros((2, BATCH))
    filtered = np.zeros((2, BATCH))
    at = circuit.voltages_at
    unit = circuit.unit / (schedule.stride * circuit.record[0].seconds)
    for _ in range(schedule.samples):
        for k in range(schedule.stride):
            if (c.n1 is not None or c.n2 is not None) and k % steps == 0:
                draw_noise(noise, b.s0, b.s1, schedule.doublings)
            shake_and_add(b, filtered, accelerations, schedule.doublings > 0, shaker, 1.0)
            for i in range(BATCH):
                a, a1 = shaken(i, accelerations, shaker)
                s, wall, first, did = drifted(State(b.x[i], b.v[i], b.V[i]), h, h, c, a)
                fly(i, state, its_state, circuit, room, s.x, wall, first, h, 1)
                for j in range(len(its_state)):
                    state[MASS_ROWS + j, i] = its_state[j]
                s = State(s.x, s.v, its_state[at] / volts)
                U = its_state[at + 1] / volts
                xi = noise[k % steps, i]
                if b.controls is not None:
                    add_circuit_features(i, s, U, xi, b.controls, c)
                v1 = kick_at_stops(s, xi, h, c, a1)
                b.x[i] = s.x
                b.v[i] = v1
                b.V[i] = s.V
                b.U[i] = U
                sums[10, i] += did.number
                sums[11, i] += did.energy
                if shaker is not None:
                    sums[12, i] += 0.5 * h * a1 * (s.v + v1)
                sums[13, i] += its_state[last] * unit
                sums[14, i] += its_state[last + 1]
                sums[15, i] += its_state[last + 2]
        for i in range(BATCH):
            s = State(b.x[i], b.v[i], b.V[i])
            mid, wall, first, _ = drifted(s, h, 0.5 * h, c, last_acceleration(i, shaker))
            fly(i, state, its_state, circuit, room, mid.x, wall, first, 0.5 * h, 0)
            add_sample(i, sums, s, State(mid.x, mid.v, its_state[at] / volts), c)


@kernel
def circuit_mid_drift(state, out, h, circuit, c, shaker):
    """Go from the states of a batch after a kick to x, v, V half a step later: shape (3, BATCH)."""
    room = np.empty((ROOMS, circuit.length))
    its_state = np.empty(state.shape[0] - MASS_ROWS)
    for i in range(BATCH):
        s = State(state[0, i], state[1, i], state[2, i])
        mid, wall, first, _ = drifted(s, h, 0.5 * h, c, last_acceleration(i, shaker))
        fly(i, state, its_state, circuit, room, mid.x, wall, first, 0.5 * h, 0)
        out[0, i] = mid.x
        out[1, i] = mid.v
        out[2, i] = its_state[circuit.voltages_at] / circuit.volts
