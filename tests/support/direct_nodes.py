"""Many nodes under noise without mean currents: mass, rectifier and storage together, with the node that empties it.

The work of `harvester.storage.direct_node` for one node is done here for a batch, each on a noise
of its own, by the rectifier of ideal elements if the netlist is one.  In each slice of a vibration
the storage capacitor gives the node its current at its voltage then.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_stores import StoresOfMany
from harvester.storage.measured_current import Rectifier
from harvester.storage.node_run import NodeRun

SLICES = 8  # of a vibration
# of what each node does
STATE, LEFT, PACKETS, RAN, BROWN_OUTS, GIVEN, CLAMPED, FIRST, ROWS = range(9)


@kernel
def take_slices(
    volts: Floats,
    records: Floats,
    drawn: Floats,
    leak: float,
    durations: Floats,
    stops: Floats,
    levels: Floats,
    now: float,
) -> None:
    """Let nodes draw their charge of a slice from their storage capacitors at ``volts``, which is changed, shape (n,).

    ``records``, shape (`ROWS`, n), is their activity, with the number of a state or -1, and the
    seconds of it that are left; ``drawn`` are currents (A) at even voltages up to the top, the last
    of a node that waits, which the last of the ``stops`` is below.  ``levels`` are the wake
    voltage, the top, the capacitance, and the length of a slice (s), which begins ``now``.
    """
    wake, top, farads, slice_ = levels
    finest = drawn.shape[1] - 1
    last = len(durations) - 1
    for j in range(len(volts)):
        rest = slice_
        v = volts[j]
        while rest > 0.0:
            state = int(records[STATE, j])
            if state < 0 and v >= wake:
                state = 0
                records[LEFT, j] = durations[0]
            step = min(rest, records[LEFT, j] if state >= 0 else rest)
            position = min(max(v / top, 0.0), 1.0) * finest
            k = min(int(position), finest - 1)
            row = drawn[state]
            amperes = row[k] + (position - k) * (row[k + 1] - row[k]) + v * leak
            new = v - step * amperes / farads
            if v > stops[state] > new:  # it stops there
                step *= (v - stops[state]) / (v - new)
                new = stops[state]
            v = new
            rest = rest - step
            if v > top:
                records[CLAMPED, j] += farads * (v - top) * top
                v = top
            v = max(v, 0.0)
            if state >= 0:
                records[LEFT, j] -= step
                records[RAN, j] += step
                if v <= stops[state]:
                    state = -1
                    records[BROWN_OUTS, j] += 1.0
                elif records[LEFT, j] <= 1e-12:
                    if state == last - 1:
                        records[PACKETS, j] += 1.0
                        if records[FIRST, j] == 0.0:
                            records[FIRST, j] = now + slice_ - rest
                    state = 0 if state == last else state + 1
                    records[LEFT, j] = durations[state]
            records[STATE, j] = state
        volts[j] = v


class DirectNodes(NamedTuple):
    """The activity of each of some nodes from rest in so many ``seconds``, shape (n,); ``first`` is 0 if none was sent.

    ``given`` and ``clamped`` are energies (J) that came into the storage capacitor, and that the
    clamp removed.
    """

    packets: Floats
    ran: Floats
    brown_outs: Floats
    given: Floats
    clamped: Floats
    first: Floats
    volts: Floats
    seconds: float
    steps: int


def direct_nodes(
    problem: Problem,
    run: NodeRun,
    seconds: float,
    count: int,
    seed: int = 0,
    compiled: bool = False,
) -> DirectNodes:
    """The activity of ``count`` nodes of a run from rest on, under noise, with a capacitor that a rectifier charges.

    A chip is one whose storage capacitor is at its input.  ``compiled``: with the netlist's own
    elements in any case.

    Raises as `CompiledCircuit`.
    """
    rectifier = Rectifier(problem)
    eqs = problem.equations
    storage, chip = run.storage, run.chip
    circuit = rectifier.compiled(storage.farads) if compiled else rectifier.fast(storage.farads)
    runs = Trajectories(
        eqs, count, np.random.SeedSequence([seed, 17]), step_from_rest(eqs), circuit=circuit
    )
    stores = StoresOfMany(runs, circuit, storage.farads, problem.scales)
    chip_current = 0.0 if chip is None else chip.quiescent
    volts = np.full(runs.count, storage.initial_voltage or 0.0)
    records = np.zeros((ROWS, runs.count))
    records[STATE] = -1.0
    drawn = np.array([*run.drawn, run.waiting])
    durations = np.array([duration for _, duration in run.states])
    stops = np.array([*(run.stop_of(amperes) for amperes in run.drawn), -math.inf])
    leak = 1.0 / (storage.leakage_resistance or math.inf)
    now = 0.0
    while now < seconds:
        gained = stores.advance(volts.reshape(runs.blocks, -1), 2.0 * math.pi / SLICES)
        slice_ = gained.seconds
        before = volts
        volts = stores.volts - chip_current * slice_ / storage.farads
        records[GIVEN] += storage.farads * (volts - before) * 0.5 * (volts + before)
        levels = np.array([run.node.wake_voltage, run.top, storage.farads, slice_])
        take_slices(
            volts, records, drawn, leak, durations=durations, stops=stops, levels=levels, now=now
        )
        now += slice_
    packets, ran, brown_outs, given, clamped, first = records[PACKETS:]
    return DirectNodes(
        packets=packets,
        ran=ran,
        brown_outs=brown_outs,
        given=given,
        clamped=clamped,
        first=first,
        volts=volts,
        seconds=now,
        steps=runs.steps,
    )
