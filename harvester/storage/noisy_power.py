"""The mean power of a chip's load under noise: from the rectifier's mean current, and from how that fluctuates.

The current is measured behind ideal diodes if those of the rectifier are alike, up to the voltage
at which the slow circuit ends. That runs until its mean power changes no more, and again in `PAIRS`
of runs whose current fluctuates, the second as the mirror image of the first, with the measured
spectral density and the correlation time of the mass's energy.  Their difference from the run
without is added, and counts as an error.

The time scales are separated as far as a direct run agrees: mass and circuit together continue
for `DIRECT` time constants of the mass from where the fluctuating runs end, as the slow circuit
does. The gains of load and store differ by a part, which corrects the current (two levels); its
size and its sampling are current errors.  Runs with a held store on the same noise, whose mean is
known from many more, remove most of the sampling error.
"""

import math
import time

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_batch import MASS_ROWS
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_in_ngspice import error_of_circuit
from harvester.storage.held_stores import StoresOfMany
from harvester.storage.measured_current import RUNS, Rectifier, measured, time_constant
from harvester.storage.rectified_current import RectifiedCurrent, reached
from harvester.storage.rectifier_cut import Cut
from harvester.storage.slow_circuit import JUDGED, TOLERANCE, SlowCircuit, SlowPath, noise_check
from harvester.storage.steady_power import (
    FINER,
    FIRST,
    LARGEST_SEPARATION,
    SlowPower,
    first_duration,
    mean_rate,
    of_load,
    settled_part,
    settled_path,
)
from harvester.uncertainty.control_variate import controlled
from harvester.uncertainty.value import Value, mean_and_error

# runs with a held store; times the highest voltage of the slow run
MANY = 8 * RUNS
WIDER = 1.25
# of fluctuating runs; times the slow step and the tolerance there
PAIRS = 6
ROUGHER = 4.0
DIRECT = 50.0  # time constants of the mass of the direct run
# duration of the whole over that of the first measurement; least fraction of runs and direct time
# in a short budget
WHOLE, LEAST_SHARE = 50.0, 0.2
# of the rectifier's energy: what a chip passes on at least, for the part that it differs by
LEAST = 0.1


def noisy_power(
    problem: Problem, cut: Cut, seed: int, deadline: float | None = None
) -> SlowPower | None:
    """The load's stationary mean power behind a cut, under noise; see `SlowPower`.

    If the time scales are not apart its ``scales_apart`` is False, and it has no direct run in
    its place.  A ``deadline`` of `time.perf_counter` makes runs fewer and the direct run shorter;
    None if it would leave less than `LEAST_SHARE` of them.

    Raises as `harvester.storage.steady_power.slow_power`.
    """
    assert problem.circuit is not None
    unit = time_constant(problem.equations) / problem.scales.frequency
    circuit, rough = (
        SlowCircuit(problem.circuit, cut, problem.scales, factor * TOLERANCE)
        for factor in (1.0, ROUGHER)
    )
    step = ROUGHER * unit / FINER
    count = MANY if Rectifier(problem).ideal else RUNS
    begin = time.perf_counter()
    first = measured(problem, seed=seed).best
    share = 1.0
    if deadline is not None:
        now = time.perf_counter()
        share = min((deadline - now) / (WHOLE * (now - begin)), 1.0)
        if share < LEAST_SHARE:
            return None
        count = round(share * count)
    top = WIDER * float(rough.run(first, first_duration(rough, first, unit), step).rails.max())
    table, _, steps, _ = measured(
        problem, min(top, float(first.voltages[-1])), seed=seed, runs=count
    )
    table = table.lagging(0.5 * unit)
    path, duration, changed = settled_path(circuit, table, unit / FINER, unit)
    paths = _fluctuating(
        rough, table, min(duration, FIRST * unit), step, seed, PAIRS * [rough.circuit.rest]
    )
    charge = reached(table, float(path.rails.max()), problem.circuit.smoothing or 0.0)
    elements, _, more = noise_check(problem, table, charge, None, seed)
    together = time.perf_counter()
    gain, direct = _gain(problem, rough, table, paths, share * DIRECT * unit, seed)
    together = time.perf_counter() - together
    judge, unknown = error_of_circuit(problem, float(path.rails.max()), seed)
    less = judge + elements + abs(gain.value)
    currents = table, table.halved(), table.scaled(1.0 - less), table.shifted()
    others = [rough.run(current, duration, step) for current in currents]
    whole = settled_part(duration)
    shorter = settled_part(float(paths[0].t[-1]))

    def known(name: str, stderr: float = 0.0) -> tuple[Value, float]:
        """Mean of an integral of the path with its errors, and the change by fluctuations."""
        mean, base, *changed = (mean_rate(run, name, whole) for run in (path, *others))
        by_voltages, by_less, by_sampling = (other - base for other in changed)
        short, *changes = (mean_rate(run, name, shorter) for run in (others[0], *paths))
        change, spread = mean_and_error((np.array(changes) - short).reshape(-1, 2).mean(axis=1))
        model = abs(by_voltages) + abs(by_less) + judge * mean + abs(change)
        errors = math.hypot(stderr, by_sampling, spread, gain.normal_stderr * by_less / less)
        corrected = mean + change - gain.value * by_less / less
        return Value(corrected, errors, abs(base - mean), model, unknown=unknown), abs(change)

    assert table.square_error is not None, "noise"
    power, change = known("square")
    square, _ = known("piezo", float(table.column_at("square_error", path.rails).mean()))
    off = max(abs(gain.value), change / max(power.value, 1e-300))
    return SlowPower(
        power=power.scaled(1.0 / circuit.circuit.resistance),
        square=square,
        changed=changed / max(power.value, 1e-300),
        separation=max(off, abs(gain.value) + gain.sampling95),
        scales_apart=off <= LARGEST_SEPARATION,
        direct=share * DIRECT * unit,
        pace=together / (JUDGED * share * DIRECT * unit),
        duration=duration,
        slow_step=unit / FINER,
        steps=steps + more + direct + sum(run.steps for run in (path, *others, *paths)),
        current=table,
        load=of_load(path),
    )


def _fluctuating(
    circuit: SlowCircuit,
    table: RectifiedCurrent,
    duration: float,
    step: float,
    seed: int,
    starts: list[Floats],
) -> list[SlowPath]:
    """A pair of fluctuating runs from each of the ``starts``, mirror images of each other."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 16]))
    variates = rng.standard_normal((len(starts), 1, math.ceil(duration / step))) * np.array(
        [[1.0], [-1.0]]
    )
    pairs = zip(starts, variates, strict=True)
    return [
        circuit.run(table, duration, step, 1, normal, start)
        for start, pair in pairs
        for normal in pair
    ]


def _gain(
    problem: Problem,
    circuit: SlowCircuit,
    table: RectifiedCurrent,
    paths: list[SlowPath],
    seconds: float,
    seed: int,
) -> tuple[Value, int]:
    """Relative excess of the charge by mass and circuit over the slow circuit, and the steps.

    Both continue for so many ``seconds`` from the ends of the ``paths``, with the mass at rest at
    first.
    """
    assert problem.circuit is not None
    eqs = problem.equations
    scales = problem.scales
    farads = problem.circuit.smoothing or 0.0
    whole = compiled_circuit(problem.circuit, scales)
    h = step_from_rest(eqs)
    root = np.random.SeedSequence([seed, 11])
    slow = _fluctuating(
        circuit, table, seconds, float(paths[0].t[0]), seed, [path.end for path in paths]
    )
    full = np.array([0.5 * farads * path.store[-1] ** 2 for path in paths])
    ends = np.array(
        [path.square[-1] / whole.resistance + 0.5 * farads * path.store[-1] ** 2 for path in slow]
    )
    gained = ends.reshape(-1, 2).mean(axis=1) - full
    passed = seconds * float(np.mean([path.rails * table.at(path.rails) for path in slow]))
    runs = Trajectories(eqs, JUDGED, root, h, circuit=whole)
    which = np.arange(JUDGED) % len(paths)
    rows = runs.state[0, MASS_ROWS:]
    states = np.array([paths[k].end for k in which]).T
    for k, (name, *_) in enumerate(circuit.circuit.system.charges):
        if name != "piezo":
            rows[whole.charge_at(name)] = states[k]
    to = whole.switches_at
    switches = len(whole.system.switches)
    since = circuit.circuit.switches_at
    rows[to : to + switches] = states[since : since + switches]
    load = (
        (eqs.beta or 0.0)
        * runs.run(seconds * scales.frequency).load
        * scales.watts
        * runs.time
        / scales.frequency
    )
    direct = load + 0.5 * farads * rows[whole.voltages_at + 1] ** 2 - (full + gained)[which]
    rectifier = Rectifier(problem)
    held = rectifier.fast(rectifier.held)
    many = Trajectories(eqs, MANY if rectifier.ideal else 3 * JUDGED, root, h, circuit=held)
    volts = float(np.mean([path.rails.mean() for path in slow]))
    stores = StoresOfMany(many, held, rectifier.held, scales)
    charges = stores.advance(volts, seconds * scales.frequency).charges
    mean = Value(*mean_and_error(charges[JUDGED:]))
    off = controlled(direct, charges[:JUDGED], mean).value
    return off.scaled(
        1.0 / max(float(gained.mean()), LEAST * passed, 1e-300)
    ), runs.steps + many.steps
