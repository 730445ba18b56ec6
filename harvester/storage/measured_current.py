"""The rectifier's current at held voltages, measured: runs of the mass from rest up a ladder of voltages.

Under a harmonic excitation one run of the compiled circuit does, whole periods long; noise asks for
many, of the circuit of ideal elements if the netlist is one, which is far cheaper.

`measured` gives it for a scene: under a harmonic excitation with the time-step error, under noise
with that of sampling.
"""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.idealised import ideal_bridge, ideal_circuit
from harvester.equations.bounds import growth_near
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.machine.progress import report_share, stage
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_stores import (
    HELD,
    Elements,
    Gained,
    HeldStores,
    StoreOnPath,
    StoresOfMany,
    enough_runs,
)
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import (
    NO_LOAD,
    cut_behind_rectifier,
    held_rectifier,
    is_plain_store,
    with_store,
)
from harvester.storage.time_limit import check_time, working_seconds
from harvester.uncertainty.value import Value, mean_and_error

VOLTAGES = 12
# under noise, at each voltage; a run of a netlist's own elements costs ten to a hundred times more
RUNS, OF_ELEMENTS = 512, 64
JUDGE = 5e-3  # twice what compiled circuits differ by from ngspice at most (docs/compiled.md)
JUDGE_OF_RECTIFIERS = 1.5e-3  # the same of rectifiers
# of the largest current: more at the last voltage goes on beyond it, as that of a doubler
CUT_OFF = 0.01
# time constants of the mass after which its transients are forgotten; after a step of the ladder
FADED = 6.0
STEPPED = 3.0  # so many, under noise
MEASURED = 4.0  # under noise, at each voltage; under a harmonic excitation 1
BEYOND_DRIVE, BEYOND_NOISE = 1.7, 4.0  # over the rms of the open piezo's voltage
LEAST_LEAK = 1e-12  # nondimensional conductance beside a held storage capacitor that has none
SHORTEST, LONGEST = 60.0, 4e3  # nondimensional: the first transients


def time_constant(eqs: Equations) -> float:
    """Nondimensional time in which motions about the first resting place fade by e, within limits."""
    rate = -growth_near(eqs, eqs.resting_places[0])
    return min(max(1.0 / rate if rate > 0.0 else math.inf, SHORTEST / FADED), LONGEST / FADED)


class Rectifier:
    """The rectifier of a problem's circuit, with a storage capacitor of any ``farads`` behind it and nothing else.

    ``ideal`` is the circuit of ideal elements if the netlist is one, a hundredth as expensive; None
    if it is not.
    """

    def __init__(self, problem: Problem) -> None:
        self.load, self.scales = problem.load_circuit, problem.scales
        self.held = HELD * self.scales.capacitance  # F of a storage capacitor that is held
        self.parts = held_rectifier(self.load, self.held)

    @cached_property
    def ideal(self) -> IdealCircuit | None:
        """The circuit of ideal elements, also of a bridge of four diodes of a user's own, and with a chip behind it.

        Diodes that are not alike are treated as alike: the change by that is measured with all that
        ideal elements leave out.
        """
        if (
            is_plain_store(self.load)
            and (known := ideal_circuit(self.load, self.scales)) is not None
        ):
            return known._replace(mu=0.0)
        cut = cut_behind_rectifier(self.load)
        if cut is None:
            return None
        saturation, emission = cut.like
        if not saturation > 0.0:
            return None
        bridge = ideal_bridge(saturation, emission, self.scales)
        if not is_plain_store(self.load):
            return bridge._replace(mu=0.0)
        # What is beside the storage capacitor and the load stays there while the storage capacitor
        # is held.
        leak = cut.leak
        if leak is None:
            return None
        return bridge._replace(mu=leak / (self.scales.capacitance * self.scales.frequency))

    def compiled(self, farads: float, ohm: float = NO_LOAD) -> CompiledCircuit:
        """That of the netlist's own elements, with a load of ``ohm``.

        Raises as `CompiledCircuit`.
        """
        return CompiledCircuit(self.load, self.scales, with_store(self.parts, farads, ohm))

    def fast(self, farads: float, ohm: float = NO_LOAD) -> Elements:
        """The cheaper one."""
        if self.ideal is None:
            return self.compiled(farads, ohm)
        kappa = farads / self.scales.capacitance
        mu = self.ideal.mu + 1.0 / (ohm * self.scales.capacitance * self.scales.frequency)
        return self.ideal._replace(kappa=kappa, mu=max(mu, LEAST_LEAK))


def open_voltage(problem: Problem, h: float, seed: int = 0) -> float:
    """A voltage (V) that a rectifier hardly reaches: some times the rms of the open piezo's, from rest."""
    eqs = problem.equations
    duration = FADED * time_constant(problem.equations)
    runs = Trajectories(eqs, 1, np.random.SeedSequence([seed, 11]), h)
    runs.run(duration)
    square = float(runs.run(max(duration / FADED, eqs.shaking_period or 0.0)).V2.mean())
    return (
        math.sqrt(square) * problem.scales.volts * (BEYOND_DRIVE if eqs.is_steady else BEYOND_NOISE)
    )


class Rung(NamedTuple):
    """A voltage of the ladder: charges (C) while it ``settles``, and those that count."""

    settles: Floats
    seconds: float
    counted: Gained


def measured_current(
    held: HeldStores, eqs: Equations, voltages: Floats, rough: float | None = None
) -> RectifiedCurrent:
    """The table at a ladder of ascending ``voltages``, the first of which is 0.

    ``rough``: under a harmonic excitation each is held until the current changes by less than this
    part of the largest in a time constant, and that of the last one counts.
    """
    unit = time_constant(eqs)
    counts = (1.0 if eqs.is_steady else MEASURED) * unit
    largest = 0.0
    rungs = list[Rung]()
    begin = working_seconds()
    for volts in map(float, voltages):
        settles = (STEPPED if rungs and not eqs.is_steady else FADED) * unit
        if rough is None:
            settling = held.advance(volts, settles)
            rung = Rung(settling.charges, settling.seconds, held.advance(volts, counts))
        else:
            rung, largest = _soon_settled(held, volts, (unit, settles), rough, largest)
        rungs.append(rung)
        check_time(begin, len(rungs) / len(voltages))
        report_share(len(rungs) / len(voltages))
    return table_of(np.asarray(voltages), rungs, eqs.is_steady, held.together)


def _soon_settled(
    held: HeldStores, volts: float, times: tuple[float, float], rough: float, largest: float
) -> tuple[Rung, float]:
    """A voltage held by units of time until the current changes by ``rough`` of the largest.

    ``times`` are the unit and the longest time, nondimensional.  The second answer is the
    ``largest`` current (A) of all so far.
    """
    unit, longest = times
    before = held.advance(volts, unit)
    counted = held.advance(volts, unit)
    settling, seconds = before.charges, before.seconds
    largest = max(largest, counted.current)
    while (
        seconds < longest / held.scales.frequency
        and abs(counted.current - before.current) > rough * largest
    ):
        settling = settling + counted.charges
        seconds = seconds + counted.seconds
        before = counted
        counted = held.advance(volts, unit)
        largest = max(largest, counted.current)
    return Rung(settling, seconds, counted), largest


def table_of(
    voltages: Floats, rungs: list[Rung], is_steady: bool, together: int
) -> RectifiedCurrent:
    """I(V) of a ladder, with the sampling error under noise, and with the lag under a harmonic excitation."""
    seconds = np.array([rung.counted.seconds for rung in rungs])
    charges = [rung.counted.charges for rung in rungs]
    charge, error = _over_runs(charges, together)
    square, square_error = _over_runs([rung.counted.squares for rung in rungs], together)
    current = charge / seconds
    settled = np.array([rung.settles.mean() for rung in rungs])
    excess = settled - current * np.array([rung.seconds for rung in rungs])
    # the variance of a record's mean, whatever the quantile of its error
    variances = [
        _of_records(row, together).var(ddof=1) if row.size > together else 0.0 for row in charges
    ]
    return RectifiedCurrent(
        voltages=voltages,
        current=current,
        stderr=None if is_steady else error / seconds,
        density=together * np.array(variances) / seconds,
        square=square,
        lag=_lag(current, excess) if is_steady else np.zeros(len(voltages)),
        ring_up=-float(excess[0]),
        square_error=square_error,
    )


def _lag(current: Floats, excess: Floats) -> Floats:
    """The delay (s) of the current behind a step, from the ``excess`` charge after it (C)."""
    steps = current[:-1] - current[1:]
    known = np.abs(steps) > 0.01 * current.max()
    lag = np.divide(excess[1:], steps, out=np.zeros(len(steps)), where=known)
    return np.append(lag[0], lag)


def _over_runs(rows: list[Floats], together: int) -> tuple[Floats, Floats]:
    """Means over runs and their standard errors, 0 for one; ``together`` runs are on one record."""
    entries = np.array([_of_records(row, together) for row in rows])
    means = entries.mean(axis=1)
    count = entries.shape[1]
    if count == 1:
        return means, np.zeros(len(rows))
    moments = [Value(*mean_and_error(row), dof=count - 1.0) for row in entries]
    return means, np.array(
        [value.stderr if together == 1 else value.normal_stderr for value in moments]
    )


def _of_records(row: Floats, together: int) -> Floats:
    """The means of ``together`` consecutive runs each."""
    return np.asarray(row.reshape(-1, together).mean(axis=1))


class Currents(NamedTuple):
    """I(V), the same of the scene's step if its own error is known, and their number of steps.

    ``displacement`` is the largest (m) on the way up under a harmonic excitation; None under noise.
    """

    best: RectifiedCurrent
    rough: RectifiedCurrent
    steps: int
    displacement: float | None = None


def measured(
    problem: Problem,
    top: float | None = None,
    h: float | None = None,
    seed: int = 0,
    count: int = VOLTAGES,
    runs: int | None = None,
    power: float = 1.0,
) -> Currents:
    """I(V) of a rectifier with the storage held, at ``count`` voltages from 0 to ``top`` or the open circuit's.

    They are closer to each other at the bottom with a ``power`` above 1.  Under a drive it is
    extrapolated from two steps of the compiled circuit.  Under noise it is that of the circuit of
    ideal elements if there is one, and of the scene's step alone, by so many ``runs``: `RUNS` of
    ideal elements, and `OF_ELEMENTS` of the netlist's own.  The ladder ends at twice the open
    circuit's voltage if that still gets a current.
    """
    eqs = problem.equations
    h = step_from_rest(eqs) if h is None else h
    highest = open_voltage(problem, h, seed) if top is None else top
    while True:
        volts = np.linspace(0.0, 1.0, count) ** power * highest
        currents = (
            _under_a_drive(problem, volts, h)
            if eqs.is_steady
            else _under_noise(problem, volts, h, seed, runs)
        )
        last = float(currents.best.current[-1])
        if top is not None or last < CUT_OFF * float(currents.best.current.max()):
            return currents
        top = highest = 2.0 * float(volts[-1])


def _under_a_drive(problem: Problem, volts: Floats, h: float) -> Currents:
    """By one trajectory of the compiled circuit, extrapolated from two steps."""
    rectifier = Rectifier(problem)
    eqs = problem.equations
    paths = [
        StoreOnPath(problem, rectifier.compiled(rectifier.held), rectifier.held, factor * h)
        for factor in (1.0, 2.0)
    ]
    with stage(0.0, 2.0 / 3.0):
        fine = measured_current(paths[0], eqs, volts)
    with stage(2.0 / 3.0, 1.0):
        coarse = measured_current(paths[1], eqs, volts)
    steps = sum(path.steps for path in paths)
    peak = max(path.peak for path in paths) * problem.scales.length
    return Currents(fine.extrapolated(coarse), fine, steps, peak)


def _under_noise(
    problem: Problem, volts: Floats, h: float, seed: int, count: int | None
) -> Currents:
    """By many runs of the fast circuit."""
    rectifier = Rectifier(problem)
    eqs = problem.equations
    circuit = rectifier.fast(rectifier.held)
    count = count or (RUNS if rectifier.ideal else OF_ELEMENTS)
    count = enough_runs(eqs, count)
    many = Trajectories(eqs, count, np.random.SeedSequence([seed, 11]), h, circuit=circuit)
    stores = StoresOfMany(many, circuit, rectifier.held, problem.scales)
    table = measured_current(stores, eqs, volts)
    return Currents(table, table, many.steps)
