"""The answers of many compiled circuits to `harvester.mechanics.kernels.driver`.

They are advanced one after the other in each step.
"""

from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_path import NetlistLoad, load_of
from harvester.circuits.substeps import CHATTERS, MOST, KernelCircuit
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import inlined, version_of
from harvester.mechanics.kernels.driver import (
    aside,
    coordinates,
    is_given_up,
    load_aside,
    load_at,
    moving,
    put_load,
)
from harvester.mechanics.kernels.intervals import EXACT
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.kernels.trajectory_batch import (
    MASS_ROWS,
    SUMS,
    Batch,
    Schedule,
    advance,
    mid_drift,
)
from harvester.mechanics.trace import mechanics_of

SURELY = 10.0 * MOST  # share of failed steps from which on a batch ends
STEPS_AHEAD = 64.0  # circuit steps that are expected in each step of the mass to come
MORE_SUMS = (*SUMS, "load", "substeps", "failed")


class NetlistLoads(NamedTuple):
    """The compiled circuits of a batch, at ``states`` of shape (m, BATCH).

    Each in turn is the ``load``.

    A sample's integral of the load's squared voltage counts in ``units``.
    """

    load: NetlistLoad
    states: Floats
    unit: float


@version_of(load_at, load=NetlistLoads)
def _load_at(i, z, c, load, driven):
    state = load.load.state
    counts = load.load.counts
    for j in range(len(state)):
        state[j] = load.states[j, i]
    for j in range(len(counts)):
        counts[j] = 0.0
    return load.load


@version_of(load_aside, load=NetlistLoads)
def _load_aside(i, z, mid, c, load):
    return aside(load_at(i, z, c, load, None))


@version_of(put_load, load=NetlistLoads)
def _put_load(i, z, sums, changed, c, load):
    circuit = changed.circuit
    for j in range(len(changed.state)):
        load.states[j, i] = changed.state[j]
    stored = changed.state[circuit.voltages_at + 1] / circuit.volts
    z[(2 * coordinates(c) + 1) * BATCH + i] = stored
    sums[13 * BATCH + i] += changed.counts[0] * load.unit
    sums[14 * BATCH + i] += changed.counts[1]
    sums[15 * BATCH + i] += changed.counts[2]


@version_of(moving, load=NetlistLoads)
def _moving(schedule, load):
    return schedule.moving


@version_of(is_given_up, load=NetlistLoads)
def _is_given_up(sums, load, ahead):
    return chatters(sums, load.states[len(load.states) - 1], ahead)


@inlined
def chatters(sums, returned, ahead):
    """Whether switches of a batch chatter so much that its steps ``ahead``, of the mass, cannot make up for it.

    ``returned`` are the solver's return values of all lanes, or `CHATTERS`.
    """
    steps = 0.0
    failed = 0.0
    for i in range(BATCH):
        steps += sums[14 * BATCH + i]
        if returned[i] >= CHATTERS:
            failed += sums[15 * BATCH + i]
    return failed > SURELY * (steps + STEPS_AHEAD * ahead)


def loads_of(circuit: KernelCircuit, states: Floats, stride: int) -> NetlistLoads:
    """The circuits of a batch at their ``states``, shape (m, BATCH), with samples of so many steps."""
    unit = circuit.unit / (stride * float(circuit.record[0]["seconds"]))
    return NetlistLoads(load_of(circuit, np.empty(len(states)), 0), states, unit)


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
    order = [*mechanics.order(rows), MASS_ROWS - 1]
    part = batch._replace(state=state[order])
    ended: bool = advance(
        part,
        schedule,
        h,
        loads_of(circuit, state[MASS_ROWS:rows], schedule.stride),
        c=mechanics.coefficients,
        shaker=shaker,
        update=EXACT,
    )
    state[order] = part.state
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
    words = np.empty(0, np.uint64)
    batch = Batch(state[[*mechanics.order(rows), MASS_ROWS - 1]], words, words)
    load = loads_of(circuit, state[MASS_ROWS:rows], 1)
    mid_drift(batch, out, h, mechanics.coefficients, load, shaker)
