"""The circuit behind a rectifier, over hours: the rest of the netlist as a compiled circuit, fed by the mean current.

    tau i' = I(u) - i + sqrt(S(u)) xi        u: the voltage between the rectifier's rails

The current follows I(u) with the lag that was measured, from 0 at rest; under noise it may
fluctuate, with the spectral density that was measured at frequency zero (xi: white noise with unit
density).  Steps are those of the slow circuit, many vibrations of the fast one may pass in each;
within a step the circuit chooses its own.

The separation of the time scales is measured by `direct_check`: mass and circuit together from
rest, next to the slow storage capacitor; under noise `noise_check` does, by many runs.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.clocks import Clocks
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.fed_circuit import feed
from harvester.circuits.substeps import ROOMS
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.netlists.load_circuit import LoadCircuit
from harvester.storage.held_stores import Elements, StoresOfMany, enough_runs
from harvester.storage.measured_current import RUNS, Rectifier, time_constant
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import Cut
from harvester.uncertainty.paired_difference import difference95, share95

# time constants of the mass, at most; of charges whose storage capacitors are held
DIRECT, COMPARED = 25.0, 10.0
# of the largest current: less does not bring a storage capacitor further in the time of the
# comparison
FAINT = 0.1
SLICES, JUDGED = 32, 64  # of the time under noise; runs of a compiled circuit there
EARLY, LATE = 0.5, 0.95  # of the voltage at the end of the direct run
POINTS = 2048  # of the table that the kernel reads
TOLERANCE = 3e-3  # of a charge's size: what the two orders of a step may differ by
INTERVALS = 4  # in which a clock's rate is read
SMALL = 50.0  # what is left between the rails of the piezo's capacitance: this part


@dataclass(frozen=True)
class SlowPath:
    """The slow circuit over time, shape (n,): s, V of the rails, the storage and the load, and integrals up to then.

    ``square`` is that of the load's squared voltage (V^2 s), ``piezo`` that of the piezo's mean
    square voltage; ``end`` is the circuit's last state.
    """

    t: Floats
    rails: Floats
    store: Floats
    load: Floats
    square: Floats
    piezo: Floats
    steps: int
    failed: int
    end: Floats


class SlowCircuit:
    """The circuit behind a cut, at steps of ``seconds``; ``scales`` are those of the device.

    Raises as `CompiledCircuit`.
    """

    def __init__(
        self, load: LoadCircuit, cut: Cut, scales: Scales, tolerance: float = TOLERANCE
    ) -> None:
        self.scales = replace(
            scales, coupling=scales.coupling / SMALL, capacitance=scales.capacitance / SMALL
        )
        self.circuit = CompiledCircuit(load, self.scales, cut.slow(), tolerance)
        self.clocks = Clocks(self.circuit)

    def run(
        self,
        current: RectifiedCurrent,
        duration: float,
        seconds: float,
        stride: int = 1,
        variates: Floats | None = None,
        start: Floats | None = None,
    ) -> SlowPath:
        """With the mass at rest at first for a ``duration`` in s, every ``stride`` of its steps of ``seconds``.

        The current fluctuates by normal ``variates``, one a step; None: it does not.  The circuit
        begins in the state ``start``; None: empty.

        Raises CircuitError if too many of the circuit's steps fail.
        """
        rows = math.ceil(duration / (seconds * stride) - 1e-9)
        top = float(current.voltages[-1])
        volts = np.linspace(0.0, top, POINTS)
        table = np.array(
            [
                current.at(volts),
                *(current.column_at(name, volts) for name in ("lag", "square", "density")),
            ]
        )
        out = np.empty((rows, 5))
        circuit = self.circuit.for_kernels(seconds * self.scales.frequency)
        state = self.circuit.rest if start is None else start.copy()
        room = np.empty((ROOMS, circuit.length))
        charge = self.scales.capacitance * self.scales.volts
        normal = np.empty(0) if variates is None else variates
        steps, failed = feed(
            circuit,
            state,
            room,
            table,
            top=top,
            h=seconds,
            delay=current.delay,
            charge=charge,
            stride=stride,
            variates=normal,
            out=out,
        )
        self.circuit.check(steps, failed, state)
        t = seconds * stride * np.arange(1.0, rows + 1.0)
        return SlowPath(
            t=t,
            rails=out[:, 0],
            store=out[:, 1],
            load=out[:, 2],
            square=out[:, 3],
            piezo=out[:, 4],
            steps=int(steps),
            failed=int(failed),
            end=state,
        )

    def slowest_clock(
        self, current: RectifiedCurrent, since: Floats, duration: float, seconds: float
    ) -> float:
        """The longest period (s) of a clock, in a ``duration`` after a state; 0 without one.

        Steps last ``seconds``.
        """
        if not self.clocks:
            return 0.0
        states = [since]
        each = duration / INTERVALS
        for _ in range(INTERVALS):
            states.append(self.run(current, each, seconds, start=states[-1]).end)
        return self.clocks.slowest(np.array(states), math.ceil(each / seconds - 1e-9) * seconds)


class DirectCheck(NamedTuple):
    """Extra time (s) of mass and circuit together over the slow storage, by the end and half-way, in ``seconds``."""

    late: float
    early: float
    seconds: float
    steps: int

    @property
    def error(self) -> float:
        """How much the difference still changed (s)."""
        return abs(self.late - self.early)


def direct_check(
    problem: Problem,
    circuit: CompiledCircuit,
    volts: Floats,
    times: Floats,
    longest: float,
    h: float | None = None,
) -> DirectCheck:
    """The check under a sinusoid, of a circuit whose storage the slow computation brings to ``volts`` at ``times``.

    Both are ascending and finite; the direct run is as ``longest`` at most.
    """
    eqs = problem.equations
    w0 = problem.scales.frequency
    seconds = min(float(times[-1]), DIRECT * time_constant(eqs) / w0, longest)
    step = whole_steps(step_from_rest(eqs) if h is None else h, eqs.shaking_period)
    n_steps = math.ceil(seconds * w0 / step / 16) * 16
    path = circuit.trace(eqs, np.zeros(n_steps), step, 16)
    t = np.append(0.0, step * 16.0 * np.arange(1, len(path.voltages) + 1) / w0)
    store = np.append(0.0, np.maximum.accumulate(path.voltages[:, 1]))
    levels = np.array([EARLY, LATE]) * min(
        float(np.interp(seconds, times, volts)), float(store[-1])
    )
    early, late = np.interp(levels, store, t) - np.interp(levels, volts, times)
    return DirectCheck(float(late), float(early), seconds, path.steps)


def change_at_95(other: Floats, base: Floats) -> float:
    """The difference of the mean of runs from that of others on the same noise, as a part of it, with its sampling."""
    return share95(difference95(other, base), max(abs(float(base.mean())), 1e-300))


def noise_check(
    problem: Problem,
    table: RectifiedCurrent,
    path: tuple[Floats, Floats],
    farads: float | None,
    seed: int,
    times_as_many: float = 1.0,
) -> tuple[float, float, int]:
    """The relative errors of a mean current, and the steps: by charges on the same noise, from rest.

    The ``path`` is voltages (V) with their ascending times (s).  A held storage capacitor that
    follows all of it in `COMPARED` time constants gains a charge, which is compared with that at
    twice the step and with that behind the netlist's own elements in place of ideal ones.  One that
    follows its first `DIRECT` time constants is compared with a storage capacitor of ``farads``
    that moves freely (two levels; None: not done).  Each difference counts as a whole, with its
    sampling at 95 %: those of step and elements together, and that of a storage capacitor that is
    not held.  Voltages at which the ``table`` has next to no current are left out, unless all are
    such ones.  Runs are ``times_as_many`` as usual.
    """
    rectifier = Rectifier(problem)
    scales = problem.scales
    eqs = problem.equations
    strong = table.at(path[0]) > FAINT * table.current.max()
    volts, times = (points[strong | ~strong.any()] for points in path)
    held = rectifier.held
    unit = time_constant(eqs)
    last = float(times[-1]) * scales.frequency
    root = np.random.SeedSequence([seed, 11])
    h = step_from_rest(eqs)
    steps = 0
    judged = enough_runs(eqs, round(times_as_many * JUDGED))
    fast = rectifier.fast(held)
    count = round(times_as_many * RUNS) if rectifier.ideal else 2 * judged

    def charges(
        circuit: Elements,
        count: int,
        span: tuple[float, float],
        free: float = 0.0,
        twice: bool = False,
    ) -> Floats:
        nonlocal steps
        part, duration = span
        runs = Trajectories(eqs, count, root, h, circuit=circuit)
        runs = runs.coarser() if twice else runs
        stores = StoresOfMany(runs, circuit, free or held, scales)
        at = np.interp((np.arange(SLICES) + 0.5) / SLICES * part * float(times[-1]), times, volts)
        gained = np.sum(
            [stores.advance(None if free else float(v), duration / SLICES).charges for v in at],
            axis=0,
        )
        steps += runs.steps
        return np.asarray(gained.reshape(-1, runs.together).mean(axis=1))

    whole = 1.0, min(COMPARED * unit, last)
    base = charges(fast, count, whole)
    elements = change_at_95(charges(fast, count, whole, twice=True), base)
    separation = 0.0
    if rectifier.ideal:
        elements += change_at_95(charges(rectifier.compiled(held), judged, whole), base)
    if farads is not None:
        first = min(DIRECT * unit / last, 1.0), min(DIRECT * unit, last)
        free = charges(rectifier.fast(farads), count, first, free=farads)
        separation = change_at_95(free, charges(fast, count, first))
    return elements, separation, steps
