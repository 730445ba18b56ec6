"""Many charges side by side without ngspice, of a circuit of ideal diodes and switches, or a compiled one."""

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.engines.compiled import Compiled
from harvester.engines.ensemble import Ensemble
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import Progress
from harvester.engines.sampling import FEWEST_DRAWN
from harvester.presentation.diagnostic import has, warning
from harvester.studies.charging.passages import SAMPLES, ChargeRuns, Passages

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.own_circuit import OwnCircuit
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.ideal_circuit import IdealCircuit

    Circuit = IdealCircuit | OwnCircuit | None

_MODELS: dict[str, type[Ensemble]] = {engine.NAME: engine for engine in (Ideal, Compiled)}
# nondimensional time between two looks at first; later, parts of the time that has passed
FINEST = 0.4
PARTS = 200
FEW = 32  # runs of a budget's pilot
# of a budget, for the runs at the scene's step: those at twice the step need half as long
FINE = 0.6
FILLED = 0.8  # of the rest of a budget after its pilot: the time of more runs
CUT = "watched_in_budget"


def charge_side_by_side(runs: ChargeRuns, engine: str = Ideal.NAME) -> Passages:
    """The passages of runs up to their duration, or until all have reached the last level, by the circuit of an engine.

    They are paired with the same runs at twice the step, of which every second look is left out:
    the change is that of the step and of looking now and then.  A first passage that is looked for
    now and then comes late by the square root of the time between looks at worst (Broadie,
    Glasserman and Kou, Math. Finance 7, 325, 1997), so that the error is 1/(sqrt(2) - 1) times the
    change.

    In a budget `FEW` runs come first, whose time predicts how many fit into the rest, which in turn
    predict more; the last are the answer.

    Raises as `harvester.mechanics.ensemble.trajectories.Trajectories`.
    """
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.compiled import compilation
    from harvester.mechanics.kernels.step_size import step_from_rest

    problem = runs.problem
    circuit = _MODELS[engine]().model(problem).circuit
    least = 1 if problem.equations.density is None else FEWEST_DRAWN
    h = step_from_rest(problem.equations) if runs.h is None else runs.h
    with compilation():
        Trajectories(problem.equations, 1, _root(runs), h, circuit=circuit, controlled=True).run(
            FINEST
        )
    several = replace(runs, h=h, count=max(runs.count, least))
    few = max(FEW, least)
    if math.isinf(runs.budget) or several.count <= few:
        return _side_by_side(several, engine, circuit)
    best = last = _side_by_side(replace(several, count=few, progress=None), engine, circuit)
    spent = last.seconds
    while not has(last.notes, CUT):
        now = len(last.times)
        left = runs.budget - spent
        count = min(several.count, _fitting(FILLED * left / last.seconds, now) // least * least)
        if now == several.count or count < min(2 * now, several.count):
            break
        last = _side_by_side(replace(several, count=count, budget=left), engine, circuit)
        spent = spent + last.seconds
        best = best if has(last.notes, CUT) else last
    return _fewer(best, several, spent)


def _fitting(times: float, few: int) -> int:
    """How many runs need so many ``times`` the seconds of ``few``; the last arrives as ln n."""
    return int(few * times / (1.0 + math.log(max(times, 1.0)) / math.log(few)))


def _root(runs: ChargeRuns) -> np.random.SeedSequence:
    """The noise of the runs."""
    return np.random.SeedSequence([runs.seed, 8])


def _fewer(passages: Passages, request: ChargeRuns, seconds: float) -> Passages:
    """Passages after so many seconds, with a warning if they are fewer than asked for."""
    runs = len(passages.times)
    notes = passages.notes
    if runs < request.count:
        cut = warning("runs_in_budget", runs=runs, requested=request.count, budget=request.budget)
        notes = (*notes, cut)
    return replace(passages, seconds=seconds, notes=notes)


def _side_by_side(runs: ChargeRuns, engine: str, circuit: "Circuit") -> Passages:
    """The passages of all runs together, at the step of the request and at twice that."""
    from harvester.mechanics.ensemble.trajectories import Trajectories

    problem = runs.problem
    s = problem.scales
    assert runs.h is not None, "the caller chooses it"
    begin = time.perf_counter()
    fine = Trajectories(
        problem.equations, runs.count, _root(runs), runs.h, circuit=circuit, controlled=True
    )
    coarse = fine.coarser()
    volts = runs.levels / s.volts
    watched = end = runs.duration * s.frequency
    until = begin + FINE * runs.budget
    t, u, times = _watch(fine, volts, end, 1.0, lambda part: runs.tell(0.6 * part), until)
    if not np.isfinite(times[-1]).all():
        end = min(end, float(t[-1]))
    _, _, others = _watch(coarse, volts, end, 2.0, lambda part: runs.tell(0.6 + 0.4 * part))
    cut = end < watched * (1.0 - 1e-9) and not np.isfinite(times[-1]).all()
    at = np.linspace(0.0, t[-1], SAMPLES)
    after = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
    share = ((at - t[after - 1]) / (t[after] - t[after - 1]))[:, None]
    curves = (1.0 - share) * u[after - 1] + share * u[after]
    return Passages(
        levels=runs.levels,
        times=times.T / s.frequency,
        coarse=others.T / s.frequency,
        at=at / s.frequency,
        curves=curves.T * s.volts,
        end=end / s.frequency,
        capacitance=problem.load_circuit.smoothing or 0.0,
        steps=fine.steps + coarse.steps,
        seconds=time.perf_counter() - begin,
        unknown=_MODELS[engine].UNKNOWN,
        counted=1.0 / (math.sqrt(2.0) - 1.0),
        together=fine.together,
        notes=(warning(CUT, budget=runs.budget),) if cut else (),
    )


def _watch(
    runs: "Trajectories",
    levels: Floats,
    end: float,
    interval: float,
    progress: Progress,
    until: float = math.inf,
) -> tuple[Floats, Floats, Floats]:
    """Go on to the time ``end``, or until all have reached the last level: times, voltages (times, runs), passages.

    It ends before, but after one look, if the clock of `time.perf_counter` is ``until``.  Looks are ``interval`` times
    `FINEST` apart, or that part of the time.
    """
    times = np.full((len(levels), runs.count), math.inf)
    t = [0.0]
    u = [np.zeros(runs.count)]
    while runs.time < end and not np.isfinite(times[-1]).all():
        if len(t) > 1 and time.perf_counter() >= until:
            break
        runs.run(min(interval * max(FINEST, runs.time / PARTS), max(end - runs.time, FINEST)))
        now = runs.state[:, 3].ravel().copy()
        for level, value in enumerate(levels):
            new = np.flatnonzero((now >= value) & np.isinf(times[level]))
            if len(new):
                share = (value - u[-1][new]) / (now[new] - u[-1][new])
                times[level, new] = t[-1] + share * (runs.time - t[-1])
        t.append(runs.time)
        u.append(now)
        progress(min(max(runs.time / end, float(np.isfinite(times[-1]).mean())), 1.0))
    times[times > end] = math.inf
    return np.array(t), np.array(u), times
