"""The kernel of many trajectories with a compiled circuit, one after the other in each step.

As `harvester.mechanics.kernels.trajectory_batch`, with the sums of the same moments; one kernel is
for each mechanics, by the questions of `harvester.mechanics.kernels.driver` about each lane.
"""

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.circuits.circuit_path import load_of
from harvester.circuits.substeps import CHATTERS, MOST, KernelCircuit
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.circuit_control_variates import add_circuit_features
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import inlined, kernel, version_of
from harvester.mechanics.kernels.driver import aside, beside, drifted, kicked, read
from harvester.mechanics.kernels.intervals import EXACT, drifts
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.shaken_control_variates import shake_and_add
from harvester.mechanics.kernels.shaking import Filter, last_acceleration, shaken
from harvester.mechanics.kernels.trajectory_batch import (
    BATCH,
    MASS_ROWS,
    SUMS,
    Batch,
    Schedule,
    add_sample,
)
from harvester.mechanics.modes.modal_batch import add_sample_of_modes
from harvester.mechanics.modes.modal_circuit import add_modal_features
from harvester.mechanics.modes.modal_step import ModalCoefficients, dot
from harvester.mechanics.trace import mechanics_of

SURELY = 10.0 * MOST  # share of failed steps from which on a batch ends
STEPS_AHEAD = 64.0  # circuit steps that are expected in each step of the mass to come
MORE_SUMS = (*SUMS, "load", "substeps", "failed")


def lane(i, z, c):
    """The state of lane i of z, as the driver's questions know it."""


def put(i, z, s, c):
    """Write a state to lane i of z."""


def speed(s, c):
    """The speed along which the base shakes."""


def add_features(i, s, U, xi, controls, c):
    """Add the noise of a kick to the controls of lane i."""


def add_sample_of(i, sums, s, mid, c):
    """Add a sample to the sums of lane i: the states at the kick and in mid-drift."""


@version_of(lane, c=Coefficients)
def _lane(i, z, c):
    return State(z[i], z[BATCH + i], z[2 * BATCH + i])


@version_of(lane, c=ModalCoefficients)
def _lane_of_modes(i, z, c):
    return z[i:]  # whose lane 0 is that one


@version_of(put, c=Coefficients)
def _put(i, z, s, c):
    z[i] = s.x
    z[BATCH + i] = s.v
    z[2 * BATCH + i] = s.V


@version_of(put, c=ModalCoefficients)
def _put_modes(i, z, s, c):
    return None


@version_of(speed, c=Coefficients)
def _speed(s, c):
    return s.v


@version_of(speed, c=ModalCoefficients)
def _speed_of_modes(s, c):
    return dot(c.g, s, len(c.k), 0)


@version_of(add_features, c=Coefficients)
def _add_features(i, s, U, xi, controls, c):
    add_circuit_features(i, s, U, xi, controls, c)


@version_of(add_features, c=ModalCoefficients)
def _add_features_of_modes(i, s, U, xi, controls, c):
    add_modal_features(0, s, U, xi, controls[:, i:], c)


@version_of(add_sample_of, c=Coefficients)
def _add_sample(i, sums, s, mid, c):
    add_sample(i, sums, s, mid, c)


@version_of(add_sample_of, c=ModalCoefficients)
def _add_sample_of_modes(i, sums, s, mid, c):
    add_sample_of_modes(0, sums[:, i:], s, mid, c)


@inlined
def _fetched(i, state, load):
    for j in range(len(load.state)):
        load.state[j] = state[j, i]


@inlined
def chatters(sums, returned, ahead):
    """Whether switches of a batch chatter so much that its steps ``ahead``, of the mass, cannot make up for it.

    ``returned`` are the solver's return values of all lanes, or `CHATTERS`.
    """
    steps = 0.0
    failed = 0.0
    for i in range(BATCH):
        steps += sums[14, i]
        if returned[i] >= CHATTERS:
            failed += sums[15, i]
    return failed > SURELY * (steps + STEPS_AHEAD * ahead)


@kernel
def _advance(z, room, state, b, noisy, schedule, h, load, c, shaker):
    """Advance lanes z and their circuits' states by a `Schedule`, and add up the moments; True: it `chatters`."""
    whole, half = drifts(h, None, EXACT)
    sums = b.sums
    coarse = schedule.doublings > 0
    steps = 1 if coarse else 2
    noise = np.zeros((2, BATCH))
    accelerations = np.zeros((2, BATCH))
    filtered = np.zeros((2, BATCH))
    at = load.circuit.voltages_at
    volts = load.circuit.volts
    unit = load.circuit.unit / (schedule.stride * load.circuit.record[0].seconds)
    moving = schedule.moving
    ahead = schedule.samples * schedule.stride * moving
    for _ in range(schedule.samples):
        for k in range(schedule.stride):
            if noisy and k % steps == 0:
                draw_noise(noise, b.s0, b.s1, schedule.doublings)
            shake_and_add(b, filtered, accelerations, coarse, shaker, 1.0)
            for i in range(moving):
                a, a1 = shaken(i, accelerations, shaker)
                _fetched(i, state, load)
                for j in range(len(load.counts)):
                    load.counts[j] = 0.0
                s, load, did = drifted(lane(i, z, c), whole, c, a, load)
                for j in range(len(load.state)):
                    state[j, i] = load.state[j]
                b.U[i] = load.state[at + 1] / volts
                xi = noise[k % steps, i]
                if b.controls is not None:
                    add_features(i, s, b.U[i], xi, b.controls, c)
                before = speed(s, c)
                s = kicked(s, xi, h, c, a1)
                put(i, z, s, c)
                sums[10, i] += did.number
                sums[11, i] += did.energy
                if shaker is not None:
                    sums[12, i] += 0.5 * h * a1 * (before + speed(s, c))
                sums[13, i] += load.counts[0] * unit
                sums[14, i] += load.counts[1]
                sums[15, i] += load.counts[2]
            ahead -= moving
            if chatters(sums, state[len(load.state) - 1], ahead):
                return True
        for i in range(moving):
            _fetched(i, state, load)
            s = lane(i, z, c)
            a = last_acceleration(i, shaker)
            mid, _, _ = drifted(beside(s, room, c), half, c, a, aside(load))
            add_sample_of(i, sums, s, mid, c)
    return False


@kernel
def _mid_drift(z, room, state, out, h, load, c, shaker):
    """Go from the states of a batch after a kick to x, x' and V half a step later: (3, BATCH)."""
    _, half = drifts(h, None, EXACT)
    for i in range(BATCH):
        _fetched(i, state, load)
        s = beside(lane(i, z, c), room, c)
        mid, _, _ = drifted(s, half, c, last_acceleration(i, shaker), aside(load))
        out[0, i], out[1, i], out[2, i] = read(mid, c)


def advance_circuit(
    batch: Batch,
    state: Floats,
    schedule: Schedule,
    h: float,
    circuit: KernelCircuit,
    rows: int,
    eqs: Equations,
    shaker: Filter | None,
) -> bool:
    """Advance a batch by a schedule of steps of h: whether it ended early, as it `chatters`.

    The first ``rows`` of ``state`` are x, x', V, U and the circuit's; below are y_2, ... and
    y_2', ... for several modes.
    """
    mechanics = mechanics_of(eqs)
    order = mechanics.order(rows)
    z = aligned((len(order), BATCH))
    z[:] = state[order]
    batch = batch._replace(x=z[0], v=z[len(order) // 2], V=z[-1])
    ended: bool = _advance(
        z.reshape(-1),
        np.empty(z.size),
        state[MASS_ROWS:rows],
        batch,
        noisy=eqs.n1 is not None or eqs.n2 is not None,
        schedule=schedule,
        h=h,
        load=load_of(circuit, np.empty(rows - MASS_ROWS), 0),
        c=mechanics.coefficients,
        shaker=shaker,
    )
    state[order] = z
    return ended


def circuit_mid_drift(
    state: Floats,
    out: Floats,
    h: float,
    circuit: KernelCircuit,
    rows: int,
    eqs: Equations,
    shaker: Filter | None,
) -> None:
    """Go from the states of a block after a kick to x, x' and V half a step later."""
    mechanics = mechanics_of(eqs)
    z = np.ascontiguousarray(state[mechanics.order(rows)]).reshape(-1)
    load = load_of(circuit, np.empty(rows - MASS_ROWS), 0)
    c = mechanics.coefficients
    _mid_drift(z, np.empty(z.size), state[MASS_ROWS:rows], out, h=h, load=load, c=c, shaker=shaker)
