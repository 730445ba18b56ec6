"""The rectifier's current at held voltages, measured: runs of the mass from rest up a ladder of voltages.

Under a harmonic drive one run of the compiled circuit does, whole periods long; noise asks for
many, of the circuit of ideal elements where the netlist is one, which is far cheaper.

`measured` gives it for a scene: under a drive with the time-step error, under noise with that of
sampling.
"""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_batch import MASS_ROWS
from harvester.circuits.circuit_path import CircuitPath
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.idealised import ideal_bridge, ideal_circuit
from harvester.equations.bounds import growth_near
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import (
    STORE,
    cut_behind_rectifier,
    held_rectifier,
    is_plain_store,
    with_store,
)
from harvester.uncertainty.value import mean_and_error

VOLTAGES = 12
# under noise, at each voltage; a run of a netlist's own elements costs ten to a hundred times more
RUNS, OF_ELEMENTS = 512, 64
JUDGE = 5e-3  # twice what compiled circuits differ by from ngspice at most (docs/compiled.md)
# of the largest current: more at the last voltage goes on beyond it, as that of a doubler
CUT_OFF = 0.01
HELD = 1e7  # of a store that is held, over the piezo's capacitance
# time constants of the mass after which its transients are forgotten; after a step of the ladder
FADED = 6.0
STEPPED = 3.0  # so many, under noise
MEASURED = 4.0  # under noise, at each voltage; under a drive 1
BEYOND_DRIVE, BEYOND_NOISE = 1.7, 4.0  # over the rms of the open piezo's voltage
LEAST_LEAK = 1e-12  # nondimensional conductance beside a held store that has none
Elements = IdealCircuit | CompiledCircuit  # of a rectifier
SHORTEST, LONGEST = 60.0, 4e3  # nondimensional: the first transients


def time_constant(eqs: Equations) -> float:
    """Nondimensional time in which motions about the first resting place fade by e, within limits."""
    rate = -growth_near(eqs, eqs.resting_places[0])
    return min(max(1.0 / rate if rate > 0.0 else math.inf, SHORTEST / FADED), LONGEST / FADED)


class Rectifier:
    """The rectifier of a problem's circuit, with a store of any ``farads`` behind it and nothing else.

    ``ideal`` is the circuit of ideal elements where the netlist is one, a hundredth as dear; None
    if it is not.
    """

    def __init__(self, problem: Problem) -> None:
        assert problem.circuit is not None, "what has a rectifier is a circuit"
        self.load, self.scales = problem.circuit, problem.scales
        self.held = HELD * self.scales.capacitance  # F of a store that is held
        self.parts = held_rectifier(self.load, self.held)

    @cached_property
    def ideal(self) -> IdealCircuit | None:
        """The circuit of ideal elements, also of a bridge of four diodes of a user's own, and with a chip behind it.

        Diodes that are not alike are taken as alike: what that changes is measured with all that
        ideal elements leave out.
        """
        if (
            is_plain_store(self.load)
            and (known := ideal_circuit(self.load, self.scales)) is not None
        ):
            return known._replace(mu=0.0)
        cut = cut_behind_rectifier(self.load)
        if cut is None or not cut.like[0] > 0.0:
            return None
        bridge = ideal_bridge(*cut.like, self.scales)
        if not is_plain_store(self.load):
            return bridge._replace(mu=0.0)
        # What is beside the store and the load stays there while the store is held.
        leak = cut.leak
        if leak is None:
            return None
        return bridge._replace(mu=leak / (self.scales.capacitance * self.scales.frequency))

    def compiled(self, farads: float) -> CompiledCircuit:
        """That of the netlist's own elements; raises as `CompiledCircuit`."""
        return CompiledCircuit(self.load, self.scales, with_store(self.parts, farads))

    def fast(self, farads: float) -> Elements:
        """The cheaper one."""
        if self.ideal is None:
            return self.compiled(farads)
        kappa = farads / self.scales.capacitance
        return self.ideal._replace(kappa=kappa, mu=max(self.ideal.mu, LEAST_LEAK))


def store_row(circuit: Elements, farads: float, scales: Scales) -> tuple[int, float]:
    """Where a batch of trajectories has the charge of a store of so many ``farads``, and in which unit (C)."""
    if isinstance(circuit, CompiledCircuit):
        return MASS_ROWS + circuit.charge_at(STORE), 1.0
    return 3, farads * scales.volts


class HeldPath:
    """One run, of a compiled ``circuit``, whose store is held where it has that of `Rectifier.held`.

    ``peak`` is the largest displacement so far, nondimensional; ``at`` is where the store's charge
    stands in ``state``.
    """

    together = 1

    def __init__(self, problem: Problem, circuit: CompiledCircuit, h: float) -> None:
        self.eqs = problem.equations
        self.scales = problem.scales
        self.circuit = circuit
        self.h, self.farads = (
            whole_steps(h, self.eqs.shaking_period),
            HELD * self.scales.capacitance,
        )
        self.at = self.circuit.charge_at(STORE)
        self.state = self.circuit.rest
        self.steps = 0
        self.peak = 0.0
        self._start: Floats = np.array([self.eqs.resting_places[0], 0.0])

    def go_on(self, noise: Floats, shaking: Floats | None, stride: int) -> CircuitPath:
        """Go on for as many steps as there are variates of ``noise``, as of `CompiledCircuit.trace`."""
        kicked = self.steps > 0
        path = self.circuit.trace(
            self.eqs,
            noise,
            h=self.h,
            stride=stride,
            start=self._start,
            state=self.state,
            shaking=shaking,
            kicked=kicked,
        )
        self._start = path.last[:-1]
        self.state = path.state
        self.steps += path.steps
        self.peak = max(self.peak, float(np.abs(path.samples[:, 0]).max()))
        return path

    def advance(self, volts: float, duration: float) -> tuple[Floats, Floats, float]:
        """Go on for whole periods: charge (C) and mean square of the piezo's V (V^2), shape (1,) each, and seconds."""
        period = self.eqs.shaking_period
        held = self.farads * volts
        assert period is not None, "a drive has one"
        n_steps = round(period / self.h) * max(1, math.ceil(duration / period))
        shaking = forcing(self.eqs, self.h, n_steps)
        self.state[self.at] = held
        assert shaking is not None, "a drive"
        path = self.go_on(np.zeros(n_steps), shaking, math.gcd(n_steps, 4))
        square = np.mean(path.voltages[:, :1] ** 2, axis=0)
        return (
            np.array([self.state[self.at] - held]),
            square,
            n_steps * self.h / self.scales.frequency,
        )


class HeldRuns:
    """Many ``runs`` under noise with a ``circuit`` whose store has so many ``farads``."""

    def __init__(
        self, runs: Trajectories, circuit: Elements, farads: float, scales: Scales
    ) -> None:
        self.runs = runs
        self.scales = scales
        self.farads = farads
        self.together = runs.together
        self._circuit = circuit
        (self._row, self._unit) = store_row(circuit, farads, scales)

    def advance(
        self, volts: Floats | float | None, duration: float
    ) -> tuple[Floats, Floats, float]:
        """Go on: charges (C) of the runs, as `HeldPath.advance`; the store has what it had if ``volts`` is None.

        Voltages of its own for each run have the shape (blocks, BATCH).
        """
        self.runs.put_behind(self._circuit)
        store = self.runs.state[:, self._row]
        begin = self.runs.time
        if volts is not None:
            store[:] = volts * self.farads / self._unit
        before = store.copy()
        moments = self.runs.run(duration)
        charges = ((store - before) * self._unit).ravel()
        seconds = (self.runs.time - begin) / self.scales.frequency
        return charges, moments.V2 * self.scales.volts**2, seconds


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


def measured_current(
    held: HeldPath | HeldRuns, eqs: Equations, voltages: Floats, rough: float | None = None
) -> RectifiedCurrent:
    """The table at a ladder of ascending ``voltages``, the first of which is 0.

    ``rough``: under a drive each is held until the current changes by less than this part of the
    largest in a time constant, and that of the last one counts.
    """
    unit = time_constant(eqs)
    rows = []
    largest = 0.0
    for k, volts in enumerate(voltages):
        settling = FADED if k == 0 or eqs.is_steady else STEPPED
        settled, _, first = held.advance(float(volts), (settling if rough is None else 1.0) * unit)
        charges, squares, seconds = held.advance(
            float(volts), (1.0 if eqs.is_steady else MEASURED) * unit
        )
        largest = max(largest, charges[0] / seconds)
        before = settled[0] / first
        held_for = settling * unit / held.scales.frequency
        while (
            rough is not None
            and first < held_for
            and abs(charges[0] / seconds - before) > rough * largest
        ):
            settled = settled + charges
            first = first + seconds
            before = charges[0] / seconds
            charges, squares, seconds = held.advance(float(volts), unit)
            largest = max(largest, charges[0] / seconds)
        (charge, error), (square, unsure) = (
            _over_runs(entries, held.together) for entries in (charges, squares)
        )
        density = len(charges) * error**2 / seconds
        rows.append(
            [
                charge / seconds,
                error / seconds,
                density,
                square,
                settled.mean() - charge / seconds * first,
                unsure,
            ]
        )
    current, stderr, density, square, excess, square_error = np.array(rows).T
    lag = np.zeros(len(voltages))
    if eqs.is_steady:
        steps = current[:-1] - current[1:]
        lag[1:] = np.divide(
            excess[1:], steps, out=np.zeros(len(steps)), where=np.abs(steps) > 0.01 * current.max()
        )
        lag[0] = lag[1]
    sampling = None if eqs.is_steady else stderr
    ring_up = -float(excess[0])
    return RectifiedCurrent(
        np.asarray(voltages), current, sampling, density, square, lag, ring_up, square_error
    )


def _over_runs(values: Floats, together: int) -> tuple[float, float]:
    """The mean over runs, ``together`` of which are on one record, and its standard error; 0 of one run."""
    mean, error = mean_and_error(values.reshape(-1, together).mean(axis=1))
    return mean, error if math.isfinite(error) else 0.0


class Currents(NamedTuple):
    """I(V), the same of the scene's step if its own error is known, and how many steps they took.

    ``displacement`` is the largest (m) on the way up under a drive; None under noise.
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
    """I(V) of a problem's rectifier with a held store, at ``count`` voltages from 0 to ``top`` or the open circuit's.

    They are closer to each other at the bottom with a ``power`` above 1.  Under a drive it is
    extrapolated from two steps of the compiled circuit.  Under noise it is that of the circuit of ideal elements where
    there is one, and of the scene's step alone, by so many ``runs``: `RUNS` of ideal elements, and `OF_ELEMENTS` of
    the netlist's own.
    """
    rectifier = Rectifier(problem)
    eqs = problem.equations
    scales = problem.scales
    h = step_from_rest(eqs) if h is None else h
    volts = np.linspace(0.0, 1.0, count) ** power * (
        open_voltage(problem, h, seed) if top is None else top
    )

    def wider(currents: Currents) -> Currents:
        """The same, or up to twice the voltage if the open circuit's is one that still gets a current."""
        last = float(currents.best.current[-1])
        ends = top is not None or last < CUT_OFF * float(currents.best.current.max())
        return (
            currents
            if ends
            else measured(
                problem, 2.0 * float(volts[-1]), h=h, seed=seed, count=count, runs=runs, power=power
            )
        )

    if not eqs.is_steady:
        circuit = rectifier.fast(rectifier.held)
        if runs is None:
            runs = RUNS if rectifier.ideal else OF_ELEMENTS
        many = Trajectories(eqs, runs, np.random.SeedSequence([seed, 11]), h, circuit=circuit)
        table = measured_current(HeldRuns(many, circuit, rectifier.held, scales), eqs, volts)
        return wider(Currents(table, table, many.steps))
    paths = [
        HeldPath(problem, rectifier.compiled(rectifier.held), factor * h) for factor in (1.0, 2.0)
    ]
    fine, coarse = (measured_current(path, eqs, volts) for path in paths)
    steps = sum(path.steps for path in paths)
    peak = max(path.peak for path in paths) * scales.length
    return wider(Currents(fine.extrapolated(coarse), fine, steps, peak))
