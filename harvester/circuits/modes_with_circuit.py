"""Several modes with a compiled circuit: many trajectories, as `harvester.circuits.circuit_batch` of one mode.

Modes drift and are kicked as with a resistor (`harvester.mechanics.modes.modal_step`), and the
circuit follows the charge of all of them, which is sum s_j y_j in units of theta l.  A block's
states have the rows x, x', V, U and those of the circuit, as with one mode, and below them y_2, ...
and y_2', ...
"""

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.circuits.circuit_batch import MASS_ROWS
from harvester.circuits.pointers import advance
from harvester.circuits.substeps import DID, ROOMS, KernelCircuit
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import inlined, kernel
from harvester.mechanics.kernels.intervals import EXACT, drifts, interval
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.shaking import Filter, last_acceleration, shake, shaken
from harvester.mechanics.kernels.trajectory_batch import BATCH, Batch, Schedule
from harvester.mechanics.modes.modal_batch import ModalMotion, add_sample_of_modes
from harvester.mechanics.modes.modal_circuit import add_modal_features, drift_with_course
from harvester.mechanics.modes.modal_step import dot, kick_modes


@inlined
def fly_with_modes(i, z, its_state, circuit, room, d, c, a, whole):
    """Drift lane i of modes, and advance its circuit, whose state is ``its_state``; returns the `Impacts`."""
    did, course = drift_with_course(i, z, d, c, a)
    wall, first = (course.wall, course.first) if did.number > 0.0 else (course.end, d.t)
    advance(
        circuit.address,
        circuit.record,
        its_state,
        room,
        course.begin,
        course.end,
        wall,
        first,
        d.t,
        whole,
    )
    z[2 * len(c.k) * BATCH + i] = its_state[circuit.voltages_at] / circuit.volts
    return did


@kernel
def _advance(z, state, b, schedule, h, circuit, c, shaker):
    """Advance modes z, as of `modal_step`, and the circuits' states by a `Schedule`, and add up the moments."""
    whole, half = drifts(h, None, EXACT)
    n = len(c.k)
    length = len(state)
    room = np.empty((ROOMS, circuit.length))
    its_state = np.empty(length)
    mid = np.zeros(len(z))
    noise, accelerations = np.zeros((2, BATCH)), np.zeros((2, BATCH))
    last = length - DID
    sums = b.sums
    steps = 1 if schedule.doublings > 0 else 2
    unit = circuit.unit / (schedule.stride * circuit.record[0].seconds)
    for _ in range(schedule.samples):
        for k in range(schedule.stride):
            if c.oscillator.n1 is not None and k % steps == 0:
                draw_noise(noise, b.s0, b.s1, schedule.doublings)
            if shaker is not None:
                shake(accelerations, schedule.doublings > 0, shaker)
            for i in range(BATCH):
                a, a1 = shaken(i, accelerations, shaker)
                for j in range(length):
                    its_state[j] = state[j, i]
                did = fly_with_modes(i, z, its_state, circuit, room, whole, c, a, 1)
                for j in range(length):
                    state[j, i] = its_state[j]
                b.U[i], xi = its_state[circuit.voltages_at + 1] / circuit.volts, noise[k % steps, i]
                if b.controls is not None:
                    add_modal_features(i, z, b.U[i], xi, b.controls, c)
                work = kick_modes(i, z, xi, h, c, a1)
                sums[10, i] += did.number
                sums[11, i] += did.energy
                sums[12, i] += work
                sums[13, i] += its_state[last] * unit
                sums[14, i] += its_state[last + 1]
                sums[15, i] += its_state[last + 2]
        for i in range(BATCH):
            _to_mid_drift(
                i, z, mid, state, its_state, circuit, room, half, c, last_acceleration(i, shaker)
            )
            add_sample_of_modes(i, sums, z, mid, c)
    for i in range(BATCH):
        b.V[i] = z[2 * n * BATCH + i]


@inlined
def _to_mid_drift(i, z, mid, state, its_state, circuit, room, half, c, a):
    """Fill lane i of ``mid`` with the modes half a step after their kick."""
    for j in range(2 * len(c.k) + 1):
        mid[j * BATCH + i] = z[j * BATCH + i]
    for j in range(len(its_state)):
        its_state[j] = state[j, i]
    fly_with_modes(i, mid, its_state, circuit, room, half, c, a, 0)


@kernel
def _mid_drift(z, state, out, h, circuit, c, shaker):
    """Go from the states of a batch after a kick to x, x' and V half a step later, shape (3, BATCH)."""
    half = interval(h, 0.5 * h, None)
    n = len(c.k)
    room = np.empty((ROOMS, circuit.length))
    its_state = np.empty(len(state))
    mid = np.zeros(len(z))
    for i in range(BATCH):
        _to_mid_drift(
            i, z, mid, state, its_state, circuit, room, half, c, last_acceleration(i, shaker)
        )
        out[0, i], out[1, i], out[2, i] = (
            dot(c.e, mid, 0, i),
            dot(c.e, mid, n, i),
            mid[2 * n * BATCH + i],
        )


def advance_modal_circuit(
    batch: Batch,
    state: Floats,
    schedule: Schedule,
    h: float,
    circuit: KernelCircuit,
    rows: int,
    eqs: Equations,
    shaker: Filter | None,
) -> None:
    """Advance a batch with a circuit, whose states and those of one mode are the first ``rows`` of ``state``."""
    motion = ModalMotion(eqs)
    order = motion.order(rows)
    z = aligned((len(order), BATCH))
    z[:] = state[order]
    _advance(
        z.reshape(-1),
        state[MASS_ROWS:rows],
        batch,
        schedule,
        h,
        circuit,
        motion.coefficients,
        shaker,
    )
    state[order] = z


def modal_circuit_mid_drift(
    state: Floats,
    out: Floats,
    h: float,
    circuit: KernelCircuit,
    rows: int,
    eqs: Equations,
    shaker: Filter | None,
) -> None:
    """Go from the states of a block after a kick to x, x' and V half a step later."""
    motion = ModalMotion(eqs)
    z = np.ascontiguousarray(state[motion.order(rows)]).reshape(-1)
    _mid_drift(z, state[MASS_ROWS:rows], out, h, circuit, motion.coefficients, shaker)
