"""The rectifier's current for a node, and its errors: measured once, of a record in each of its windows."""

import dataclasses
import math
import time
from dataclasses import dataclass

import numpy as np

from harvester.equations.problem import Problem
from harvester.machine.progress import stage
from harvester.presentation.messages.unknown_parts import TIME_SCALES
from harvester.scene.sensor_node import Storage
from harvester.storage.bought_parts import Chip
from harvester.storage.held_in_ngspice import error_of_circuit, seconds_of_judging
from harvester.storage.measured_current import JUDGE, Rectifier, measured
from harvester.storage.recorded_current import AnyCurrent, recorded
from harvester.storage.rectified_current import RectifiedCurrent, reached
from harvester.storage.supply import INPUT, input_without_load
from harvester.storage.time_limit import deadline_of_limit

# under noise, and the power by which they are closer at the bottom
OF_TABLE = 0.6  # fraction of the current's time under noise: its table, without the checks
VOLTAGES = 24
CLOSER = 2.0
FEWER = 12  # voltages of a rectifier without ideal elements
# under noise at first, at each voltage; of a rectifier without ideal elements
RUNS, OF_ELEMENTS = 1024, 64
DAY = 86400.0  # s
MOST_VOLTS = 1e3  # of a clamp: one above leaves a rectifier's voltage as it is


@dataclass(frozen=True)
class Effort:
    """The seed of runs under noise, and how many times as many as usual there are of the current and its checks."""

    seed: int
    runs: float = 1.0
    checks: float = 1.0
    judge: tuple[float, str] | None = None  # of the circuit, where it is known from before


@dataclass(frozen=True)
class Known:
    """The rectifier's current, its variants whose changes are its errors, and its relative errors.

    They are that of taking the time scales apart and that of the ``elements``; ``late`` is by how
    much the first packet may be later or sooner (s).  ``chip`` is one that holds its input, by the
    charge that its law gives on the same noise; None for any other.  The ``judge`` is
    `error_of_circuit`, of which the elements are a part.
    """

    table: AnyCurrent
    by_step: AnyCurrent
    steps: int
    separation: float = 0.0
    elements: float = JUDGE
    late: float = 0.0
    unknown: str = ""
    chip: Chip | None = None
    judge: tuple[float, str] | None = None


def measure_current(
    problem: Problem, storage: Storage, chip: Chip | None, wake: float, effort: Effort
) -> Known:
    """The rectifier's current of the scene, up to the clamp or the open circuit."""
    tracking = chip if chip is not None and chip.ratio is not None else None
    top = None if tracking else storage.battery_voltage or storage.clamp_voltage
    top = top if (top or math.inf) < MOST_VOLTS else None
    farads = INPUT if tracking else storage.farads
    if problem.equations.record is None:
        return _of_alike_shaking(problem, tracking, farads, top, wake, effort)
    currents = recorded(
        problem, None if tracking else farads or None, top, None if tracking else wake
    )
    known = Known(
        currents.best, currents.rough, currents.steps, currents.separation, currents.elements
    )
    return dataclasses.replace(
        known, unknown=_together(TIME_SCALES if tracking else "", currents.unknown)
    )


def _together(*parts: str) -> str:
    """Parts of an error that are not known."""
    return " and ".join(filter(None, parts))


def _of_alike_shaking(
    problem: Problem,
    tracking: Chip | None,
    farads: float,
    top: float | None,
    wake: float,
    effort: Effort,
) -> Known:
    """The same for steady excitation: for storage of ``farads``, 0 for a battery, or a ``tracking`` chip's.

    A battery holds its voltage as the measurement does; under noise a chip's law is run next to the
    mean currents.
    """
    from harvester.storage.slow_circuit import direct_check, noise_check
    from harvester.storage.tracked_input import tracked_input

    seed = effort.seed
    noise = problem.equations.is_random
    if noise:
        count, runs = (VOLTAGES, RUNS) if Rectifier(problem).ideal else (FEWER, OF_ELEMENTS)
        runs = round(runs * effort.runs)
        with stage(0.0, OF_TABLE):
            table, rough, steps, _ = measured(
                problem, top, seed=seed, count=count, runs=runs, power=CLOSER
            )
    else:
        table, rough, steps, _ = measured(problem, top)
    last = float(table.voltages[-1])
    judge = effort.judge or error_of_circuit(
        problem,
        _working(table, tracking, wake if farads else last),
        seed,
        deadline=_end_of_judging(problem),
    )
    elements, unknown = judge
    if tracking is not None:  # whose input is behind the rectifier
        elements = max(elements, JUDGE)
    known = Known(table, rough, steps, 0.0, elements, unknown=unknown, judge=judge)
    if tracking is not None and noise:
        law = tracked_input(problem, table, tracking, seed)
        if law is None:
            return dataclasses.replace(known, unknown=_together(TIME_SCALES, unknown))
        known = dataclasses.replace(known, steps=steps + law.steps, chip=law.correct(tracking))
        return dataclasses.replace(known, separation=law.error, elements=elements + law.elements)
    if not farads:
        volts = np.full(2, last)
        times = np.array([0.0, DAY])
        free = None
    else:
        volts, times = reached(table, last if tracking else min(wake, last), farads)
        free = farads
    if noise:
        path = volts, times
        off, separation, more = noise_check(problem, table, path, free, seed, effort.checks)
        return dataclasses.replace(
            known, steps=steps + more, separation=separation, elements=elements + off
        )
    if free is None:
        return known
    check = direct_check(problem, Rectifier(problem).compiled(farads), volts, times, DAY)
    separation = (abs(check.late) + check.error) / check.seconds
    late = check.error
    if tracking is not None:
        late += abs(check.late) + 0.5 * tracking.look
    else:
        table, rough = table.later(check.late), rough.later(check.late)
    steps += check.steps
    return dataclasses.replace(
        known, table=table, by_step=rough, steps=steps, separation=separation, late=late
    )


def _end_of_judging(problem: Problem) -> float | None:
    """Until when (`time.perf_counter`) the circuit may be judged by ngspice.

    None without a budget.
    """
    deadline = deadline_of_limit()
    if deadline is None:
        return None
    return time.perf_counter() + seconds_of_judging(problem, deadline)


def _working(table: RectifiedCurrent, tracking: Chip | None, volts: float) -> float:
    """The rectifier's voltage (V) that storage is to come to, or that a ``tracking`` chip holds its input at."""
    if tracking is None:
        return min(volts, float(table.voltages[-1]))
    opened = min(
        float(input_without_load(tracking, table.voltages, table.current[None])[0]), tracking.most
    )
    return (tracking.ratio or 1.0) * opened
