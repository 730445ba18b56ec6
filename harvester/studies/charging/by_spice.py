"""Charges in ngspice: each run its own process, from rest and empty."""

import contextlib
import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from harvester.engines.protocol import Progress
from harvester.errors import OutOfTimeError, SimulationError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.presentation.messages.unknown_parts import SHUNT
from harvester.studies.charging.afterwards import Afterwards, afterwards
from harvester.studies.charging.passages import SAMPLES, ChargeRuns, Passages
from harvester.studies.smaller_step import at_smaller_steps

if TYPE_CHECKING:
    from harvester.cosimulation.charging import ChargeRun
    from harvester.cosimulation.runs import CoupledDevice

READING = 0.1  # nondimensional time between readings
FINER = 2000  # looks for one of the curve's, at most, that say how long it stays above the target
# times the first runs: what takes longer has a pilot, for the time that it will take
PILOTED = 10.0
# nondimensional time of the first runs, and how much longer the next ones are
FIRST = 120.0 * math.pi
LONGER = 4.0
FEWEST = 2  # runs that have a spread
SHORTER = 0.01  # of a duration: by more than whole steps


def charge_in_ngspice(runs: ChargeRuns) -> Passages:
    """The passages of runs, at the scene's step, or at those of `at_smaller_steps` if ngspice does not converge.

    Unless they are to do the whole of their duration, shorter ones come first, and the first that
    all reach the last level are kept.  Those that do the whole of it also state how long they stay
    above.  In a budget the answer is that of the longest runs of which enough end in time.

    Raises as `harvester.cosimulation.runs.measure_in_workers`; SimulationError if the budget ends
    before the first runs do.
    """
    from harvester.cosimulation.runs import warm_up_workers
    from harvester.mechanics.kernels.step_size import step_from_rest

    problem, whole = runs.problem, runs.whole
    end = runs.duration * problem.scales.frequency
    deadline = math.inf

    def at_step(step: float, shunt: float = 0.0) -> Passages:
        nonlocal deadline
        device = replace(_device(runs, step), shunt=shunt)
        warm_up_workers(device)
        begin = time.monotonic()
        deadline = min(deadline, begin + runs.budget)  # of all steps
        steps = 0
        past = 0.0
        lengths = lengths_of_runs(end, whole)
        passages: Passages | None = None
        runs.tell(0.0)
        for length in lengths:
            request = replace(
                runs,
                whole=whole and length == end,
                progress=_part(runs, past / sum(lengths), length / sum(lengths)),
            )
            longer = _runs(device, request, length, deadline)
            if longer is None:
                break
            passages = longer
            steps = steps + passages.steps
            past = past + length
            if passages.reached == 1.0 and not whole:
                break
        if passages is None:
            raise SimulationError(
                f"no charge in a `budget` of {runs.budget:.3g} s, in which no run of ngspice "
                "ended: give a longer one"
            )
        unknown = SHUNT if shunt else passages.unknown
        seconds = time.monotonic() - begin
        notes = (*passages.notes, *_cut(runs, passages))
        return replace(passages, steps=steps, seconds=seconds, unknown=unknown, notes=notes)

    if runs.h is not None:
        return at_step(runs.h)
    passages, _, notes = at_smaller_steps(problem, step_from_rest(problem.equations), at_step)
    return replace(passages, notes=(*notes, *passages.notes))


def _cut(runs: ChargeRuns, passages: Passages) -> list[Diagnostic]:
    """Warnings of runs that are fewer or shorter than asked for."""
    count = len(passages.times)
    cut = list[Diagnostic]()
    if count < runs.count:
        cut.append(warning("runs_in_budget", runs=count, requested=runs.count, budget=runs.budget))
    unfinished = runs.whole or passages.reached < 1.0
    if unfinished and passages.end < runs.duration * (1.0 - SHORTER):
        cut.append(warning("watched_in_budget", budget=runs.budget))
    return cut


def lengths_of_runs(end: float, whole: bool) -> list[float]:
    """How long the runs are, one after another: ever longer ones; a pilot, and the ``whole``."""
    if whole:
        return [FIRST, end] if end > PILOTED * FIRST else [end]
    lengths = [min(FIRST, end)]
    while lengths[-1] < end:
        lengths.append(min(LONGER * lengths[-1], end))
    return lengths


def _part(runs: ChargeRuns, past: float, share: float) -> Progress:
    """The progress of a part of the work, a ``share`` of it after the ``past`` part."""
    return lambda done: runs.tell(past + share * done)


def _device(runs: ChargeRuns, h: float) -> "CoupledDevice":
    """The device at a step."""
    from harvester.cosimulation.runs import CoupledDevice
    from harvester.equations.bounds import check_bounded
    from harvester.mechanics.kernels.step_size import whole_steps

    problem = runs.problem
    eqs = runs.problem.equations
    check_bounded(eqs, driven=not problem.load.is_in_equations)
    step = whole_steps(h, eqs.shaking_period)
    probes = () if runs.probe is None else (runs.probe,)
    return CoupledDevice(
        eqs,
        problem.scales,
        problem.load_circuit,
        step,
        max(1, round(READING / step)),
        probes=probes,
    )


def _runs(
    device: "CoupledDevice", runs: ChargeRuns, length: float, deadline: float
) -> Passages | None:
    """Runs of a nondimensional ``length`` that end before the deadline; None if too few do."""
    from harvester.cosimulation.charging import charges_in_workers
    from harvester.mechanics.kernels.noise import child

    levels = runs.levels
    s = device.scales
    unit = 2 * device.stride
    n_steps = max(math.ceil(length / (device.h * unit) - 1e-6), 1) * unit
    end = length / s.frequency
    finer = min(max(round(n_steps / device.stride / (SAMPLES - 1)), 1), FINER) if runs.whole else 1
    at = np.linspace(0.0, end, (SAMPLES - 1) * finer + 1)
    root = np.random.SeedSequence([runs.seed, 9])
    seeds = [child(root, k) for k in range(runs.count)]
    pairs: list[tuple[ChargeRun, ChargeRun]] = []
    after: tuple[list[Afterwards], list[Afterwards]] = [], []
    with contextlib.suppress(OutOfTimeError):
        for pair in charges_in_workers(
            device,
            seeds,
            n_steps=n_steps,
            levels=levels,
            times=at,
            anywhere=runs.anywhere,
            deadline=deadline,
        ):
            for runs_after, run in zip(after, pair, strict=True):
                runs_after.append(afterwards(at, run.curve, float(levels[-1])))
            fine, coarser = (replace(run, curve=run.curve[::finer].copy()) for run in pair)
            pairs.append((fine, coarser))
            runs.tell(len(pairs) / runs.count)
    if len(pairs) < min(FEWEST, runs.count):
        return None
    times, coarse = (np.array([pair[k].passages for pair in pairs]) for k in (0, 1))
    times[times > end], coarse[coarse > end] = math.inf, math.inf
    steps = sum(run.steps for pair in pairs for run in pair)
    curves = np.array([pair[0].curve for pair in pairs])
    smoothing = pairs[0][0].smoothing
    looked = after if runs.whole else None
    return Passages(
        levels=levels,
        times=times,
        coarse=coarse,
        at=at[::finer],
        curves=curves,
        end=end,
        capacitance=smoothing,
        steps=steps,
        seconds=0.0,
        after=looked,
    )
