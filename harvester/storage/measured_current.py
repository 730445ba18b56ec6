"""The rectifier's current at held voltages, measured: runs of the mass from rest up a ladder of voltages.

Under a harmonic drive one run of the compiled circuit does, whole periods long; noise asks for many, of the circuit of
ideal elements where the netlist is one, which is far cheaper.

`measured` gives it for a scene: under a drive with the error of its step, under noise with that of sampling.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_batch import OWN
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.parts import CircuitPart
from harvester.equations.bounds import growth_near
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import State, coefficients
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.netlists.load_circuit import LoadCircuit
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import STORE

VOLTAGES = 12
RUNS = 512  # under noise, at each voltage
JUDGE = 5e-3  # twice what compiled circuits differ by from ngspice at most (docs/compiled.md)
HELD = 1e7  # of a store that is held, over the piezo's capacitance
FADED = 6.0  # time constants of the mass after which its transients are forgotten; after a step of the ladder
STEPPED = 3.0  # so many, under noise
MEASURED = 4.0  # under noise, at each voltage; under a drive 1
BEYOND_DRIVE, BEYOND_NOISE = 1.7, 4.0  # over the rms of the open piezo's voltage
SHORTEST, LONGEST = 60.0, 4e3  # nondimensional: the first transients


def time_constant(eqs: Equations) -> float:
    """Nondimensional time in which motions about the first resting place fade by e, within limits."""
    rate = -growth_near(eqs, eqs.resting_places[0])
    return min(max(1.0 / rate if rate > 0.0 else math.inf, SHORTEST / FADED), LONGEST / FADED)


class Held(Protocol):
    """Runs of the mass with a rectifier whose output is held."""

    h: float
    scales: Scales

    def restart(self) -> None:
        """Go back to rest."""
        ...

    def advance(self, volts: float, duration: float) -> tuple[Floats, float, float]:
        """Go on for a nondimensional duration: charges (C) of the runs, mean square of the piezo's V (V^2), seconds."""
        ...


class HeldPath:
    """One run under a drive, of the compiled circuit of ``parts``, whose store has `HELD` times the capacitance.

    ``peak`` is the largest displacement so far, nondimensional.
    """

    def __init__(self, problem: Problem, load: LoadCircuit, parts: Sequence[CircuitPart], h: float) -> None:
        self.eqs, self.scales = problem.equations, problem.scales
        self.circuit = CompiledCircuit(load, problem.scales, parts)
        self.h, self.farads = whole_steps(h, self.eqs.shaking_period), HELD * self.scales.capacitance
        self.steps, self.peak = 0, 0.0
        self.restart()

    def restart(self) -> None:
        """Go back to rest."""
        self._start, self._state = (self.eqs.resting_places[0], 0.0), self.circuit.rest

    def advance(self, volts: float, duration: float) -> tuple[Floats, float, float]:
        """As `Held.advance`, for whole periods."""
        period = self.eqs.shaking_period
        assert period is not None, "a drive has one"
        kicks = round(period / self.h) * max(1, math.ceil(duration / period))
        held, at = self.farads * volts, self.circuit.charge_at(STORE)
        state, shaking = self._state.copy(), forcing(self.eqs, self.h, kicks)
        assert shaking is not None, "a drive"
        stride, state[at] = math.gcd(kicks, 4), held
        path = self.circuit.trace(self.eqs, np.zeros(kicks), self.h, stride, self._start, state, shaking)
        x, voltage, _, v, _ = map(float, path.samples[-1])  # v after the whole kick; the next begins before half of it
        now = State(x, v, voltage)
        self._start = now.x, float(kick_at_stops(now, 0.0, -0.5 * self.h, coefficients(self.eqs), shaking[-1]))
        self._state = path.state
        self.steps += path.steps
        self.peak = max(self.peak, float(np.abs(path.samples[:, 0]).max()))
        square = float(np.mean(path.told[:, 0] ** 2))
        return np.array([path.state[at] - held]), square, kicks * self.h / self.scales.frequency


class HeldRuns:
    """Many runs under noise, of ideal elements or of a compiled circuit, whose store is as large."""

    def __init__(
        self, problem: Problem, circuit: IdealCircuit | CompiledCircuit, count: int, seed: int, h: float
    ) -> None:
        self.scales, self.farads = problem.scales, HELD * problem.scales.capacitance
        if isinstance(circuit, IdealCircuit):
            circuit = circuit._replace(kappa=HELD, mu=1e-12)
            self._row, self._unit = 3, self.farads * self.scales.volts
        else:
            self._row, self._unit = OWN + circuit.charge_at(STORE), 1.0
        root = np.random.SeedSequence([seed, 11])
        self.runs = Trajectories(problem.equations, count, root, h, circuit=circuit)
        self.h = self.runs.h

    def restart(self) -> None:
        """Go back to rest."""
        self.runs.restart(self.h)

    def advance(self, volts: float, duration: float) -> tuple[Floats, float, float]:
        """As `Held.advance`."""
        held = volts * self.farads
        self.runs.state[:, self._row] = held / self._unit
        begin = self.runs.time
        moments = self.runs.run(duration)
        charges = self.runs.state[:, self._row].ravel() * self._unit - held
        seconds = (self.runs.time - begin) / self.scales.frequency
        return charges, float(moments.V2.mean()) * self.scales.volts**2, seconds


def open_voltage(problem: Problem, h: float, seed: int = 0) -> float:
    """A voltage (V) that a rectifier hardly reaches: some times the rms of the open piezo's, from rest."""
    eqs, duration = problem.equations, FADED * time_constant(problem.equations)
    runs = Trajectories(eqs, 1, np.random.SeedSequence([seed, 11]), h)
    runs.run(duration)
    square = float(runs.run(max(duration / FADED, eqs.shaking_period or 0.0)).V2.mean())
    return math.sqrt(square) * problem.scales.volts * (BEYOND_DRIVE if eqs.is_steady else BEYOND_NOISE)


def measured_current(held: Held, eqs: Equations, voltages: Floats, together: int = 1) -> RectifiedCurrent:
    """The table at a ladder of ascending ``voltages``, the first of which is 0; ``together`` as of `Trajectories`."""
    held.restart()
    unit, rows = time_constant(eqs), []
    for k, volts in enumerate(voltages):
        settle = FADED if k == 0 or eqs.is_steady else STEPPED
        settled, _, first = held.advance(float(volts), settle * unit)
        charges, square, seconds = held.advance(float(volts), (1.0 if eqs.is_steady else MEASURED) * unit)
        charges = charges.reshape(-1, together).mean(axis=1)
        current = charges.mean() / seconds
        count = len(charges)
        spread = float(charges.var(ddof=1)) if count > 1 else 0.0
        stderr = math.sqrt(spread / count) / seconds
        rows.append([current, stderr, spread * together / seconds, square, settled.mean() - current * first])
    current, stderr, density, square, excess = np.array(rows).T
    lag = np.zeros(len(voltages))
    if eqs.is_steady:
        steps = current[:-1] - current[1:]
        lag[1:] = np.divide(excess[1:], steps, out=np.zeros(len(steps)), where=np.abs(steps) > 0.01 * current.max())
        lag[0] = lag[1]
    return RectifiedCurrent(
        np.asarray(voltages), current, None if eqs.is_steady else stderr, density, square, lag, -float(excess[0])
    )


class Currents(NamedTuple):
    """I(V), the same of the scene's step where its own error is known, and how many steps they took.

    ``displacement`` is the largest (m) on the way up under a drive; None under noise.
    """

    best: RectifiedCurrent
    rough: RectifiedCurrent
    steps: int
    displacement: float | None = None


def measured(
    problem: Problem,
    elements: Sequence[CircuitPart],
    ideal: IdealCircuit | None = None,
    top: float | None = None,
    h: float | None = None,
    seed: int = 0,
    count: int = VOLTAGES,
) -> Currents:
    """I(V) of ``elements`` whose store is held, at ``count`` voltages from 0 to ``top``, or to the open circuit's.

    Under a drive it is extrapolated from two steps of the compiled circuit.  Under noise it is that of the ``ideal``
    circuit where there is one, and of the scene's step alone.
    """
    assert problem.circuit is not None, "what has a rectifier is a circuit"
    eqs, h = problem.equations, step_from_rest(problem.equations) if h is None else h
    volts = np.linspace(0.0, open_voltage(problem, h, seed) if top is None else top, count)
    if not eqs.is_steady:
        fast = ideal or CompiledCircuit(problem.circuit, problem.scales, elements)
        held = HeldRuns(problem, fast, RUNS, seed, h)
        table = measured_current(held, eqs, volts, held.runs.together)
        return Currents(table, table, held.runs.steps)
    paths = [HeldPath(problem, problem.circuit, elements, factor * h) for factor in (1.0, 2.0)]
    fine, coarse = (measured_current(one, eqs, volts) for one in paths)
    steps, peak = sum(one.steps for one in paths), max(one.peak for one in paths) * problem.scales.length
    return Currents(fine.extrapolated(coarse), fine, steps, peak)
