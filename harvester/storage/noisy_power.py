"""The mean power of a chip's load under noise: from the rectifier's mean current, and from how that fluctuates.

The current is measured behind ideal diodes if those of the rectifier are alike, up to the voltage
at which the slow circuit ends. That runs until its mean power changes no more, and again in `PAIRS`
of runs whose current fluctuates, the second as the mirror image of the first, with the measured
spectral density and the correlation time of the mass's energy.  Their difference from the run
without is added, and counts as an error.

The time scales are separated as far as a direct run agrees: mass and circuit together continue
for `DIRECT` time constants of the mass from where the fluctuating runs end, as the slow circuit
does. The gains of load and storage capacitor differ by a part, which corrects the current (two
levels); its size and its sampling are current errors.  Runs with a held storage capacitor on the
same noise, whose mean is known from many more, remove most of the sampling error.
"""

import math
import time

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import CompiledCircuit, compiled_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.mechanics.kernels.trajectory_batch import MASS_ROWS
from harvester.storage.checked_mean import (
    COARSEST,
    FINER,
    FIRST,
    LARGEST_SEPARATION,
    MOST,
    ON,
    ROUGHER,
    Check,
    CheckedMean,
    Correction,
    SlowPace,
    SlowPower,
    first_duration,
    mean_rate,
    settled_part,
    settled_path,
)
from harvester.storage.held_in_ngspice import error_of_circuit, seconds_of_judging
from harvester.storage.held_stores import StoresOfMany
from harvester.storage.measured_current import JUDGE, RUNS, Rectifier, measured, time_constant
from harvester.storage.rectified_current import RectifiedCurrent, reached
from harvester.storage.rectifier_cut import Cut
from harvester.storage.slow_circuit import JUDGED, TOLERANCE, SlowCircuit, SlowPath, noise_check
from harvester.uncertainty.control_variate import controlled
from harvester.uncertainty.value import Value, mean_and_error

# runs with a held storage capacitor; times the highest voltage of the slow run
MANY = 8 * RUNS
WIDER = 1.25
PAIRS = 6  # of fluctuating runs
DIRECT = 50.0  # time constants of the mass of the direct run
# duration of the whole over that of the first measurement; least fraction of runs and direct time
# in a short budget
WHOLE, LEAST_SHARE = 50.0, 0.2
PILOT_STEPS = 2  # of a run that only compiles
CHECKED = 4  # slow runs that are as long as the first
GAINING = 0.7  # of what they leave, for the direct run
# times the seconds of the first slow run, those of others; times those of mass and circuit
# together, with those of held storage capacitors
EASIER, OF_GAIN = 0.5, 2.0
# of the rectifier's energy: what a chip passes on at least, for the part that it differs by
LEAST = 0.1


def noisy_power(
    problem: Problem, cut: Cut, seed: int = 0, deadline: float | None = None
) -> SlowPower | None:
    """The load's stationary mean power behind a cut, under noise; see `SlowPower`.

    If the time scales are not apart its ``scales_apart`` is False, and it has no direct run in
    its place.  A ``deadline`` of `time.perf_counter` makes runs fewer and the direct run shorter;
    None if it would leave less than `LEAST_SHARE` of them, or no time for the slow runs.

    Raises as `harvester.storage.steady_power.steady_power`.
    """
    unit = time_constant(problem.equations) / problem.scales.frequency
    circuit, rough = (
        SlowCircuit(problem.load_circuit, cut, problem.scales, factor * TOLERANCE)
        for factor in (1.0, ROUGHER)
    )
    step = ROUGHER * unit / FINER
    begin = time.perf_counter()
    first = measured(problem, seed=seed).best
    share = 1.0
    if deadline is not None:
        now = time.perf_counter()
        share = min((deadline - now) / (WHOLE * (now - begin)), 1.0)
        if share < LEAST_SHARE:
            return None
    table, measuring = _table(problem, rough, first, seed, share)
    h = unit / FINER
    slow_pace = None
    judging = 0.0
    if deadline is not None:
        judging = seconds_of_judging(problem, deadline)
        duration = min(first_duration(circuit, table, unit), MOST * h)
        slow_pace = SlowPace.of(circuit, table, duration, h, deadline - judging)
        if slow_pace.coarser(duration) > COARSEST:
            return None
    began = time.perf_counter()
    run = settled_path(circuit, table, h, unit, slow_pace)
    path, duration, changed, clock = run
    each = EASIER * (time.perf_counter() - began) / duration
    seconds = share * DIRECT * unit
    if slow_pace is not None:
        several = 2 * PAIRS * min(duration, FIRST * unit) + CHECKED * duration
        left = slow_pace.left - each * several
        pilot = LEAST_SHARE * LEAST_SHARE * DIRECT * unit
        if left < each * 2 * PAIRS * LEAST_SHARE * DIRECT * unit:
            return None
        began = time.perf_counter()
        whole = compiled_circuit(problem.load_circuit, problem.scales)
        _together(problem, whole, circuit, JUDGED * [circuit.circuit.rest], pilot, seed)
        together = (time.perf_counter() - began) / pilot
        seconds = min(seconds, GAINING * left / (each * 2 * PAIRS + OF_GAIN * together))
        if seconds < LEAST_SHARE * DIRECT * unit:
            return None
    highest = float(path.rails.max())

    fluctuating = _fluctuating(
        rough, table, min(duration, FIRST * unit), step, seed, PAIRS * [rough.circuit.rest]
    )
    began = time.perf_counter()
    gain, direct = _gain(problem, rough, table, fluctuating, seconds, seed)
    pace = (time.perf_counter() - began) / (JUDGED * seconds)
    charge = reached(table, highest, problem.load_circuit.smoothing or 0.0)
    elements, _, checking = noise_check(problem, table, charge, None, seed)
    judge, unknown = error_of_circuit(
        problem,
        highest,
        seed,
        deadline=None if slow_pace is None else time.perf_counter() + judging,
    )
    less = judge + elements + abs(gain.value)
    checks = {
        "voltages": Check(table.halved(), "model"),
        "less": Check(table.scaled(1.0 - less), "model"),
        "sampling": Check(table.shifted(), "stderr"),
    }
    mean = CheckedMean(path, duration, rough, table, checks, step=step)

    assert table.square_error is not None, "noise"
    of_square = float(table.column_at("square_error", path.rails).mean())
    power, square = (
        mean.value(
            name,
            JUDGE,
            unknown,
            _correction(mean, name, fluctuating, gain.scaled(1.0 / less), stderr),
        )
        for name, stderr in (("square", 0.0), ("piezo", of_square))
    )
    change = abs(_by_fluctuations(mean, "square", fluctuating)[0])
    size = max(power.value, 1e-300)
    off = max(abs(gain.value), change / size)
    return SlowPower(
        power=power.scaled(1.0 / circuit.circuit.resistance),
        square=square,
        changed=changed / size,
        separation=max(off, abs(gain.value) + gain.sampling95),
        scales_apart=off <= LARGEST_SEPARATION,
        direct=seconds,
        pace=pace,
        duration=duration,
        slow_step=unit / FINER,
        steps=measuring + checking + direct + mean.steps + sum(run.steps for run in fluctuating),
        current=table,
        load=mean.load(max(off, abs(gain.value) + gain.sampling95), known=(ON,)),
        clock=clock,
        has_whole_cycles=run.has_whole_cycles,
    )


def compile_direct(problem: Problem, cut: Cut) -> None:
    """Compile mass and circuit together, by a direct run of some steps, before a budget begins."""
    whole = compiled_circuit(problem.load_circuit, problem.scales)
    circuit = SlowCircuit(problem.load_circuit, cut, problem.scales)
    seconds = PILOT_STEPS * step_from_rest(problem.equations) / problem.scales.frequency
    _together(problem, whole, circuit, JUDGED * [circuit.circuit.rest], seconds, seed=0)


def _table(
    problem: Problem, circuit: SlowCircuit, first: RectifiedCurrent, seed: int, share: float
) -> tuple[RectifiedCurrent, int]:
    """The current by a ``share`` of all runs, up to the voltages that ``first`` leads to."""
    unit = time_constant(problem.equations) / problem.scales.frequency
    step = ROUGHER * unit / FINER
    reaches = circuit.run(first, first_duration(circuit, first, unit), step).rails.max()
    top = min(WIDER * float(reaches), float(first.voltages[-1]))
    count = MANY if Rectifier(problem).ideal else RUNS
    currents = measured(problem, top, seed=seed, runs=round(share * count))
    return currents.best.lagging(0.5 * unit), currents.steps


def _by_fluctuations(
    mean: CheckedMean, integral: str, fluctuating: list[SlowPath]
) -> tuple[float, float]:
    """By how much a fluctuating current changes a mean, and the standard error of that."""
    part = settled_part(float(fluctuating[0].t[-1]))
    base, *others = (mean_rate(run, integral, part) for run in (mean.base, *fluctuating))
    return mean_and_error((np.array(others) - base).reshape(-1, 2).mean(axis=1))


def _correction(
    mean: CheckedMean, integral: str, fluctuating: list[SlowPath], gain: Value, stderr: float
) -> Correction:
    """A mean's change by fluctuations, and by the ``gain`` of the direct run in units of "less"."""
    change, spread = _by_fluctuations(mean, integral, fluctuating)
    by_less = mean.change(integral, "less")
    errors = math.hypot(stderr, spread, gain.normal_stderr * by_less)
    return Correction(change - gain.value * by_less, abs(change), errors)


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
    whole = compiled_circuit(problem.load_circuit, problem.scales)
    half = 0.5 * (problem.load_circuit.smoothing or 0.0)  # F, of the storage capacitor
    ends = [path.end for path in paths]
    slow = _fluctuating(circuit, table, seconds, float(paths[0].t[0]), seed, ends)
    full = half * _last(paths, "store") ** 2
    energies = _last(slow, "square") / whole.resistance + half * _last(slow, "store") ** 2
    gained = energies.reshape(-1, 2).mean(axis=1) - full

    which = np.arange(JUDGED) % len(paths)
    together, steps = _together(problem, whole, circuit, [ends[k] for k in which], seconds, seed)
    volts = float(np.mean([path.rails.mean() for path in slow]))
    charges, more = _charges(problem, volts, seconds, seed)
    mean = Value(*mean_and_error(charges[JUDGED:]))
    off = controlled(together - (full + gained)[which], charges[:JUDGED], mean).value

    passed = seconds * float(np.mean([path.rails * table.at(path.rails) for path in slow]))
    return off.scaled(1.0 / max(float(gained.mean()), LEAST * passed, 1e-300)), steps + more


def _last(paths: list[SlowPath], name: str) -> Floats:
    """The last number of a row of each trajectory."""
    return np.array([getattr(path, name)[-1] for path in paths])


def _together(
    problem: Problem,
    whole: CompiledCircuit,
    circuit: SlowCircuit,
    states: list[Floats],
    seconds: float,
    seed: int,
) -> tuple[Floats, int]:
    """The energy (J) of load and storage capacitor by mass and ``whole`` circuit, and the steps."""
    eqs, scales = problem.equations, problem.scales
    runs = Trajectories(
        eqs, len(states), np.random.SeedSequence([seed, 11]), step_from_rest(eqs), circuit=whole
    )
    rows = runs.state[0, MASS_ROWS:]
    begin = np.array(states).T
    for k, (name, *_) in enumerate(circuit.circuit.system.charges):
        if name != "piezo":
            rows[whole.charge_at(name)] = begin[k]
    switches = len(whole.system.switches)
    to = whole.switches_at
    since = circuit.circuit.switches_at
    rows[to : to + switches] = begin[since : since + switches]

    power = (eqs.beta or 0.0) * runs.run(seconds * scales.frequency).load * scales.watts
    volts = rows[whole.voltages_at + 1]
    stored = 0.5 * (problem.load_circuit.smoothing or 0.0) * volts**2
    return power * runs.time / scales.frequency + stored, runs.steps


def _charges(problem: Problem, volts: float, seconds: float, seed: int) -> tuple[Floats, int]:
    """The charges (C) of storage capacitors that are held at a voltage, and the steps."""
    eqs = problem.equations
    rectifier = Rectifier(problem)
    circuit = rectifier.fast(rectifier.held)
    runs = Trajectories(
        eqs,
        MANY if rectifier.ideal else 3 * JUDGED,
        np.random.SeedSequence([seed, 11]),
        step_from_rest(eqs),
        circuit=circuit,
    )
    stores = StoresOfMany(runs, circuit, rectifier.held, problem.scales)
    return stores.advance(volts, seconds * problem.scales.frequency).charges, runs.steps
