"""The mean power of a chip's load under a harmonic excitation, from the rectifier's current.

The slow circuit runs from empty until its mean power changes no more.  Its errors are measured: by
the rectifier's current at twice the step and at half of the voltages, by slow steps of twice the
length and a larger tolerance, and by a direct run of mass and circuit from rest, on the same
excitation, of `DIRECT` time constants of the mass.  The difference of the latter is added to the
mean (two levels), and is the error of the separation of time scales.  If it differs by more than
`LARGEST_SEPARATION` a longer direct run replaces the slow one.  The difference of compiled circuits
from ngspice is applied to the rectifier's current (`error_of_circuit`), with its effect in the
slow circuit, and that of the circuit behind it (`JUDGE`) to the power.
"""

import math
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.machine.progress import report_share, stage
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.checked_mean import (
    COARSEST,
    CYCLES,
    FINER,
    LARGEST_SEPARATION,
    MOST,
    ROUGHER,
    WHOLE,
    Check,
    CheckedMean,
    Correction,
    SlowPace,
    SlowPower,
    first_duration,
    halves,
    mean_rate,
    of_load,
    settled_part,
    settled_path,
)
from harvester.storage.held_in_ngspice import error_of_circuit, seconds_of_judging
from harvester.storage.measured_current import FADED, JUDGE, VOLTAGES, measured, time_constant
from harvester.storage.rectifier_cut import Cut
from harvester.storage.slow_circuit import TOLERANCE, SlowCircuit, SlowPath
from harvester.uncertainty.value import Value

# fractions of the time: until the rectifier's current is known, until the slow circuit runs, and
# until its checks begin
MEASURING = 0.35
SETTLING = 0.5
CHECKING = 0.7
# time constants of the direct run; times that, where it takes the slow one's place
DIRECT, LONGER = 150.0, 4.0
PILOT = 100.0  # nondimensional time of a run that measures the pace
PILOT_STEPS = 16  # of a run that only compiles
RUNGS = 1.5 * VOLTAGES * (FADED + 1.0)  # time constants of the rectifier's current, by two steps


def steady_power(
    problem: Problem, cut: Cut, seed: int = 0, deadline: float | None = None
) -> SlowPower | None:
    """The load's stationary mean power behind a cut, under a harmonic excitation, for any ``seed``.

    A ``deadline`` of `time.perf_counter` makes slow steps longer, which their part of the error
    states as always; None if they would be more than `COARSEST` times as long, or if the deadline
    is too soon for the rectifier's current and the direct run.

    Raises as `harvester.circuits.compiled_circuit.CompiledCircuit`, UnboundedResponseError if
    the motion grows.
    """
    if deadline is not None and time.perf_counter() + _least_seconds(problem) > deadline:
        return None
    with stage(0.0, MEASURING):
        table, rough, measuring, _ = measured(problem)
    circuit = SlowCircuit(problem.load_circuit, cut, problem.scales)
    unit = time_constant(problem.equations) / problem.scales.frequency
    h = unit / FINER
    begin = time.perf_counter()
    direct = _direct(problem, DIRECT * unit)
    took = time.perf_counter() - begin
    pace = None
    judging = 0.0
    if deadline is not None:
        first = min(first_duration(circuit, table, unit), MOST * h)
        judging = seconds_of_judging(problem, deadline)
        pace = SlowPace.of(circuit, table, first, h, deadline - judging)
        coarser = pace.coarser(first)
        if coarser > COARSEST:
            return None
        h *= coarser

    report_share(SETTLING)
    run = settled_path(circuit, table, h, unit, pace)
    path, duration, changed, clock = run
    whole = run.has_whole_cycles
    judge, unknown = error_of_circuit(
        problem,
        float(path.rails.max()),
        deadline=None if pace is None else time.perf_counter() + judging,
    )
    checks = {
        "step": Check(rough, "bias"),
        "voltages": Check(table.halved(), "model"),
        "judge": Check(table.scaled(1.0 - judge), "model"),
    }
    rougher = SlowCircuit(problem.load_circuit, cut, problem.scales, ROUGHER * TOLERANCE)
    report_share(CHECKING)
    mean = CheckedMean(path, duration, rougher, table, checks, step=2.0 * h, stride=2)
    off = {name: _off(direct, path, mean.mean(name), name) for name in ("square", "piezo")}
    power, square = (
        mean.value(name, JUDGE, unknown, Correction(off[name], abs(off[name])))
        for name in ("square", "piezo")
    )
    separation = abs(off["square"])
    steps = measuring + direct.steps + mean.steps

    scales_apart = separation <= LARGEST_SEPARATION * power.value
    if not scales_apart:
        longer = max(LONGER, CYCLES * clock / direct.seconds)
        longer = longer if pace is None else min(max(pace.left / (2.0 * took), 1.0), longer)
        direct, twice = (_direct(problem, longer * direct.seconds, factor) for factor in (1.0, 2.0))
        whole = direct.seconds >= WHOLE * CYCLES * clock
        power, square = (
            _of_direct(direct, twice, name, max(judge, JUDGE)).with_unknown(unknown)
            for name in ("square", "piezo")
        )
        changed = 0.0
        steps = steps + direct.steps + twice.steps
    size = max(power.value, 1e-300)
    power = replace(power, model=(power.model or 0.0) + changed)
    return SlowPower(
        power=power.scaled(1.0 / circuit.circuit.resistance),
        square=square,
        changed=changed / size,
        separation=separation / size,
        scales_apart=scales_apart,
        direct=direct.seconds,
        duration=duration,
        slow_step=h,
        steps=steps,
        current=table,
        load=mean.load(separation / size) if scales_apart else of_load(path),
        clock=clock,
        has_whole_cycles=whole,
    )


def compile_direct(problem: Problem, cut: Cut) -> None:
    """Compile mass and circuit together, by a direct run of some steps, before a budget begins."""
    _direct(problem, PILOT_STEPS * step_from_rest(problem.equations) / problem.scales.frequency)


def _least_seconds(problem: Problem) -> float:
    """The predicted seconds of the rectifier's current and of the direct run, by a pilot of some periods.

    For an undamped oscillator, whose time constant is long, they may be minutes.
    """
    unit = time_constant(problem.equations) / problem.scales.frequency
    pilot = PILOT / problem.scales.frequency
    begin = time.perf_counter()
    _direct(problem, pilot)
    pace = (time.perf_counter() - begin) / pilot
    return pace * (RUNGS + DIRECT) * unit


class _Direct(NamedTuple):
    """Mass and circuit together from rest: as of `SlowPath`, with the ``seconds`` of computation."""

    t: Floats
    store: Floats
    square: Floats
    piezo: Floats
    seconds: float
    steps: int


def _direct(problem: Problem, seconds: float, factor: float = 1.0) -> _Direct:
    """The direct run of so many seconds, at a ``factor`` times the usual step."""
    eqs = problem.equations
    w0 = problem.scales.frequency
    h = factor * step_from_rest(problem.equations)
    n_steps = math.ceil(seconds * w0 / h / 16) * 16
    path = compiled_circuit(problem.load_circuit, problem.scales).trace(
        eqs, np.zeros(n_steps), h, 16
    )
    each = path.h * path.stride / w0
    t = each * np.arange(1.0, len(path.square) + 1.0)
    return _Direct(
        t,
        path.voltages[:, 1],
        path.square,
        np.cumsum(path.voltages[:, 0] ** 2) * each,
        seconds,
        path.steps,
    )


def _of_direct(direct: _Direct, coarse: _Direct, name: str, judge: float) -> Value:
    """The mean rate of an integral by a direct run, and by another of twice the step.

    ``judge``: with ngspice.
    """
    whole = settled_part(direct.seconds)
    mean, twice = (mean_rate(run, name, whole) for run in (direct, coarse))
    first, last = (mean_rate(direct, name, half) for half in halves(direct.seconds))
    return Value(mean, bias=abs(twice - mean), model=abs(first - last) + judge * mean)


def _off(direct: _Direct, slow: SlowPath, mean: float, name: str) -> float:
    """The difference of a direct run from the slow one in the mean rate of an integral.

    If nothing has reached the load by then, the difference is that of the energies in the storage
    capacitor, as a part of the ``mean``.
    """
    part = settled_part(direct.seconds)
    slow_mean, direct_mean = (mean_rate(run, name, part) for run in (slow, direct))
    if max(direct_mean, slow_mean) > 1e-3 * mean:
        return direct_mean - slow_mean
    full, slowly = (float(np.interp(direct.seconds, run.t, run.store)) for run in (direct, slow))
    return mean * (full**2 - slowly**2) / max(full**2, slowly**2, 1e-30)
