"""The mean power of a chip's load under noise: from the rectifier's mean current, and from how that fluctuates.

The current is measured behind ideal diodes where those of the rectifier are alike, at `VOLTAGES` up to where the slow
circuit goes.  That runs until its mean power changes no more, and again in `PAIRS` of runs whose current fluctuates,
the second as the mirror image of the first, with the measured spectral density and the correlation time of the mass's
energy.  What they differ by from the run without is added, and counts as an error.

The time scales are taken apart as far as a direct run agrees: mass and circuit together go on for `DIRECT` time
constants of the mass from where the fluctuating runs end, as the slow circuit does.  What load and store gain differs
by a part, which corrects the current (two levels); its size and its sampling are errors of the current.  Runs with a
held store on the same noise, whose mean is known from many more, take most of the sampling away.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_batch import MASS_ROWS
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.measured_current import JUDGE, RUNS, HeldRuns, Rectifier, measured, time_constant
from harvester.storage.rectified_current import RectifiedCurrent, reached
from harvester.storage.rectifier_cut import STORE, Cut
from harvester.storage.slow_circuit import JUDGED, TOLERANCE, SlowCircuit, SlowPath, noise_check
from harvester.storage.steady_power import (
    FINER,
    FIRST,
    LARGEST_SEPARATION,
    SlowPower,
    first_duration,
    mean_rate,
    of_load,
    settled_path,
)
from harvester.uncertainty.control_variate import controlled
from harvester.uncertainty.value import Value, mean_and_error

VOLTAGES, WIDER = 48, 1.25  # of the second measurement of the current; times the highest voltage of the slow run
PAIRS, ROUGHER = 6, 4.0  # of fluctuating runs; times the slow step and the tolerance there
DIRECT = 50.0  # time constants of the mass of the direct run
MANY = 8 * RUNS  # of the runs with a held store
LEAST = 0.1  # of the rectifier's energy: what a chip passes on at least, for the part that it differs by


@dataclass(frozen=True)
class NoisyCurrent:
    """The current into a chip under noise, corrected, with what was run to find it.

    ``path`` has the mean current, ``paths`` the fluctuating one, consecutive two as mirror images.  ``elements`` and
    ``separation`` are relative errors of the current at 95 %, of which ``gain`` is the correction; ``direct`` is how
    long (s) mass and circuit ran together.
    """

    table: RectifiedCurrent
    rough: SlowCircuit
    path: SlowPath
    paths: list[SlowPath]
    duration: float
    changed: float
    slow_step: float
    elements: float
    separation: float
    gain: float
    direct: float
    steps: int

    def sampling(self, errors: Floats, values: Floats, weights: Floats) -> float:
        """The relative standard error of a mean along the path, of independent ``errors`` at the table's voltages."""
        late = self.path.t > 0.25 * self.path.t[-1]
        volts = self.table.voltages
        knots = np.array([np.interp(self.path.rails[late], volts, unit) for unit in np.eye(len(volts))])
        shares = knots @ weights[late]
        return float(math.sqrt(np.sum((shares * errors) ** 2)) / max(abs(np.dot(shares, values)), 1e-300))


def noisy_current(problem: Problem, cut: Cut, seed: int) -> NoisyCurrent:
    """The current of a problem under noise, and the slow circuit's course with it.

    Raises as `harvester.storage.steady_power.slow_power`.
    """
    assert problem.circuit is not None
    unit = time_constant(problem.equations) / problem.scales.frequency
    circuit, rough = (
        SlowCircuit(problem.circuit, cut, problem.scales, factor * TOLERANCE) for factor in (1.0, ROUGHER)
    )
    h = unit / FINER
    table, _, steps, _ = measured(problem, seed=seed)
    top = WIDER * float(rough.run(table, first_duration(rough, table, unit), ROUGHER * h).rails.max())
    if Rectifier(problem).ideal and top < table.voltages[-1]:
        table, _, more, _ = measured(problem, top, seed=seed, count=VOLTAGES)
        steps += more
    table = replace(table, lag=np.full(len(table.voltages), 0.5 * unit))
    path, duration, changed = settled_path(circuit, table, unit)
    paths = fluctuating(rough, table, min(duration, FIRST * unit), ROUGHER * h, seed)
    farads = sum(1.0 / volts for name, _, _, volts in circuit.circuit.system.charges if name == STORE)
    charge = reached(table, float(path.rails.max()), farads)
    elements, _, more = noise_check(problem, table, charge, None, seed)
    beside = _Beside(problem, rough, table, DIRECT * unit, seed)
    gain, unsure, direct = beside.gain(paths, farads)
    return NoisyCurrent(
        table=table,
        rough=rough,
        path=path,
        paths=paths,
        duration=duration,
        changed=changed,
        slow_step=h,
        elements=elements,
        separation=abs(gain) + unsure,
        gain=gain,
        direct=DIRECT * unit,
        steps=steps + more + direct,
    )


def fluctuating(
    circuit: SlowCircuit,
    table: RectifiedCurrent,
    duration: float,
    seconds: float,
    seed: int,
    starts: Sequence[Floats | None] = PAIRS * (None,),
) -> list[SlowPath]:
    """A pair of fluctuating runs from each of the ``starts``, mirror images of each other."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 16]))
    paths = []
    for start in starts:
        normal = rng.standard_normal(math.ceil(duration / seconds))
        paths += [circuit.run(table, duration, seconds, 1, sign * normal, start) for sign in (1.0, -1.0)]
    return paths


class _Beside:
    """Mass and circuit together for so many ``seconds``, beside the slow circuit with a ``table``."""

    def __init__(self, problem: Problem, slow: SlowCircuit, table: RectifiedCurrent, seconds: float, seed: int) -> None:
        assert problem.circuit is not None
        self.problem, self.slow, self.table, self.seconds, self.seed = problem, slow, table, seconds, seed
        self.whole, self.h = compiled_circuit(problem.circuit, problem.scales), step_from_rest(problem.equations)
        self.root = np.random.SeedSequence([seed, 11])

    def gain(self, paths: list[SlowPath], farads: float) -> tuple[float, float, int]:
        """By what part more load and store gain than from the slow circuit, its sampling at 95 %, and the steps.

        Both begin with the mass at rest and the circuit as at the end of the ``paths``.
        """
        step = paths[0].t[0]
        slow = fluctuating(self.slow, self.table, self.seconds, step, self.seed, [path.end for path in paths])
        before = np.repeat([path.store[-1] for path in paths], 2)
        load = np.array([path.square[-1] for path in slow]) / self.whole.resistance
        ends = np.array([path.store[-1] for path in slow])
        gained = (load + 0.5 * farads * (ends**2 - before**2)).reshape(-1, 2).mean(axis=1)
        passed = [float(np.mean(path.rails * self.table.at(path.rails))) * self.seconds for path in slow]
        which = np.arange(JUDGED) % len(paths)
        direct, steps = self._directly([paths[k] for k in which], farads)
        held, more = self._held(float(np.mean([path.rails.mean() for path in slow])))
        low, (mean, error) = held[:JUDGED], mean_and_error(held[JUDGED:])
        off = controlled(direct - gained[which], low, Value(mean, error)).value
        scale = max(float(gained.mean()), LEAST * float(np.mean(passed)), 1e-300)
        return off.value / scale, off.sampling95 / scale, steps + more

    def _directly(self, paths: list[SlowPath], farads: float) -> tuple[Floats, int]:
        """What load and store gain (J) in each of the direct runs, which begin where the ``paths`` end."""
        eqs, scales = self.problem.equations, self.problem.scales
        runs = Trajectories(eqs, len(paths), self.root, self.h, circuit=self.whole)
        rows, ends = runs.state[0, MASS_ROWS:], np.array([path.end for path in paths]).T
        for k, (name, *_) in enumerate(self.slow.circuit.system.charges):
            if name != "piezo":
                rows[self.whole.charge_at(name)] = ends[k]
        (ns, n, switches, _), (its_ns, its_n, *_) = self.whole.sizes, self.slow.circuit.sizes
        rows[ns + n : ns + n + switches] = ends[its_ns + its_n : its_ns + its_n + switches]
        moments = runs.run(self.seconds * scales.frequency)
        load = (eqs.beta or 0.0) * moments.load * scales.watts * runs.time / scales.frequency
        before, store = np.array([path.store[-1] for path in paths]), rows[self.whole.voltages_at + 1]
        return load + 0.5 * farads * (store**2 - before**2), runs.steps

    def _held(self, volts: float) -> tuple[Floats, int]:
        """The charges (C) that a store gains which is held, the first of them on the noise of the direct runs."""
        rectifier = Rectifier(self.problem)
        circuit, count = rectifier.fast(rectifier.held), MANY if rectifier.ideal else 3 * JUDGED
        runs = Trajectories(self.problem.equations, count, self.root, self.h, circuit=circuit)
        stores = HeldRuns(runs, circuit, rectifier.held, self.problem.scales)
        return stores.advance(volts, self.seconds * self.problem.scales.frequency)[0], runs.steps


def noisy_power(problem: Problem, cut: Cut, seed: int) -> SlowPower:
    """The stationary mean power of the load behind a cut, under noise; see `SlowPower`.

    Where the time scales are not apart its ``scales_apart`` is False, and it has no direct run in its place.
    """
    known = noisy_current(problem, cut, seed)
    circuit, table, path = known.rough, known.table, known.path
    ends, shorter = ((end / 4.0, end) for end in (known.duration, float(known.paths[0].t[-1])))
    less = JUDGE + known.elements + known.separation
    base, halved, lower = (
        circuit.run(current, known.duration, ROUGHER * known.slow_step)
        for current in (table, table.halved(), table.scaled(1.0 - less))
    )
    assert table.stderr is not None and table.square_error is not None, "of noise"
    current_error = known.sampling(table.stderr, table.current, path.rails)
    square_error = known.sampling(table.square_error, table.square, np.ones(len(path.t)))

    def value(name: str, own: float) -> tuple[Value, float]:
        """The mean of an integral of the path, with the relative standard error of its ``own``, and its fluctuation."""
        mean, before, by_voltages, by_less = (
            mean_rate(run.t, getattr(run, name), *ends) for run in (path, base, halved, lower)
        )
        slope, short = (by_less - before) / less, mean_rate(base.t, getattr(base, name), *shorter)
        changes = np.array([mean_rate(run.t, getattr(run, name), *shorter) - short for run in known.paths])
        change, spread = mean_and_error(changes.reshape(-1, 2).mean(axis=1))
        stderr = math.hypot(spread, slope * current_error, own * mean)
        model = abs(by_voltages - before) + abs(slope) * less + JUDGE * mean + abs(change)
        return Value(mean + change - slope * known.gain, stderr, abs(before - mean), model), abs(change)

    (power, fluctuates), (square, _) = value("square", 0.0), value("piezo", square_error)
    apart = max(abs(known.gain), fluctuates / max(power.value, 1e-300))
    return SlowPower(
        power=replace(power, model=(power.model or 0.0) + known.changed).scaled(1.0 / circuit.circuit.resistance),
        square=square,
        changed=known.changed / max(power.value, 1e-300),
        separation=max(known.separation, apart),
        scales_apart=apart <= LARGEST_SEPARATION,
        direct=known.direct,
        duration=known.duration,
        slow_step=known.slow_step,
        steps=known.steps + sum(run.steps for run in (path, base, halved, lower, *known.paths)),
        current=table,
        load=of_load(path),
    )
