"""Many charges side by side without ngspice, of a circuit of ideal diodes and switches, or a compiled one."""

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.engines.compiled import Compiled
from harvester.engines.ensemble import Ensemble
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import Progress
from harvester.engines.sampling import FEWEST_DRAWN
from harvester.studies.charging.passages import SAMPLES, ChargeRuns, Passages

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.trajectories import Trajectories

_MODELS: dict[str, type[Ensemble]] = {engine.NAME: engine for engine in (Ideal, Compiled)}
# nondimensional time between two looks at first; later, parts of the time that has passed
FINEST = 0.4
PARTS = 200


def charge_side_by_side(runs: ChargeRuns, engine: str = Ideal.NAME) -> Passages:
    """The passages of runs up to their duration, or until all have reached the last level, by the circuit of an engine.

    They are paired with the same runs at twice the step, of which every second look is left out:
    the change is that of the step and of looking now and then.  A first passage that is looked for
    now and then comes late by the square root of the time between looks at worst (Broadie,
    Glasserman and Kou, Math. Finance 7, 325, 1997), so that the error is 1/(sqrt(2) - 1) times the
    change.

    Raises as `harvester.mechanics.ensemble.trajectories.Trajectories`.
    """
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.compiled import compilation
    from harvester.mechanics.kernels.step_size import step_from_rest

    problem = runs.problem
    s = runs.problem.scales
    circuit = _MODELS[engine]().model(problem).circuit
    count = runs.count if problem.equations.density is None else max(runs.count, FEWEST_DRAWN)
    root = np.random.SeedSequence([runs.seed, 8])
    h = step_from_rest(problem.equations) if runs.h is None else runs.h
    with compilation():
        Trajectories(problem.equations, 1, root, h, circuit=circuit, controlled=True).run(FINEST)
    begin = time.perf_counter()
    fine = Trajectories(problem.equations, count, root, h, circuit=circuit, controlled=True)
    coarse = fine.coarser()
    volts = runs.levels / s.volts
    end = runs.duration * s.frequency
    t, u, times = _watch(fine, volts, end, 1.0, lambda part: runs.tell(0.6 * part))
    _, _, others = _watch(coarse, volts, end, 2.0, lambda part: runs.tell(0.6 + 0.4 * part))
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
        end=runs.duration,
        capacitance=problem.load_circuit.smoothing or 0.0,
        steps=fine.steps + coarse.steps,
        seconds=time.perf_counter() - begin,
        unknown=_MODELS[engine].UNKNOWN,
        counted=1.0 / (math.sqrt(2.0) - 1.0),
        together=fine.together,
    )


def _watch(
    runs: "Trajectories", levels: Floats, end: float, interval: float, progress: Progress
) -> tuple[Floats, Floats, Floats]:
    """Go on to the time ``end``, or until all have reached the last level: times, voltages (times, runs), passages.

    Looks are ``apart`` times `FINEST`, or that part of the time.
    """
    times = np.full((len(levels), runs.count), math.inf)
    t = [0.0]
    u = [np.zeros(runs.count)]
    while runs.time < end and not np.isfinite(times[-1]).all():
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
