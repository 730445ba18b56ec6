"""Sensitivities of the power of a netlist's load: its compiled circuit at two values of each key on the same noise."""

import math
import time
from collections.abc import Callable, Iterator

import numpy as np

from harvester.arrays import Floats
from harvester.engines.compiled import Compiled
from harvester.engines.power_slopes import quantities, value_of
from harvester.engines.sampling import LEAST_SHARE
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.moments import Moments
from harvester.storage.held_stores import enough_runs
from harvester.studies.power_differences import largest_change
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.paired_difference import difference95
from harvester.uncertainty.value import Value, mean_and_error

TRAJECTORIES, FEW = 128, 32  # of an ensemble; at least, where a budget has no time for so many
MEAN = 0.2  # of the budget that a burn-in leaves, for the mean power at most
ROOT = np.random.SeedSequence(11)


def keys_with_elements(problem: Problem) -> Iterator[tuple[str, float]]:
    """The keys of a scene and its netlist's parameters and elements that are numbers other than 0, with values."""
    circuit = problem.circuit
    load = problem.scene.load
    assert circuit is not None and load is not None, "asked for a netlist"
    for key in quantities(problem.scene):
        if not key.startswith("load."):
            yield key, value_of(problem.scene, key)
    for name, value in (circuit.elements | circuit.values).items():
        if value != 0.0 and (name != "Cp" or name in load.parameters):  # else that of the piezo
            yield f"load.parameters.{name}", value


def elasticities(
    problem: Problem, report: Callable[[float], None], budget: float | None
) -> tuple[Value, dict[str, tuple[float, Value]], list[str], float]:
    """The mean power, value and sensitivity d ln P/d ln key of each key, the keys left out, and the seconds of these.

    The power is in W (nondimensional scene: without unit); keys are left out if the budget ends.
    A normalised sensitivity is the difference of the logarithms of the power at 5 % more and less
    of the key, over that of the key, which is exact for any power law.  A key that cannot be
    larger, such as a restitution of 1, is not varied.  All run on the same noise, over the same
    time and at the same step.

    Raises InputError and SimulationError as engine `compiled`.
    """
    from harvester.mechanics.ensemble.burn_in import burn_in
    from harvester.mechanics.ensemble.richardson import compile_pair
    from harvester.mechanics.ensemble.trajectories import Trajectories

    def trajectories(scene: Problem, h: float | None, count: int) -> Trajectories:
        model = Compiled().model(scene)
        return Trajectories(scene.equations, count, ROOT, h, circuit=model.circuit, controlled=True)

    most = enough_runs(problem.equations, TRAJECTORIES)
    few = enough_runs(problem.equations, FEW)
    first = trajectories(problem, None, most)
    compile_pair(first)
    begin = time.monotonic()
    deadline = math.inf if budget is None else begin + budget
    burn_in(first, budget)
    settled = first.time
    unit = problem.scales.frequency
    now = time.monotonic()
    share = min(max(MEAN * (deadline - now) / (now - begin), LEAST_SHARE), 1.0)
    power = first.run(share * settled)
    seconds = 4.0 * (time.monotonic() - now) / share  # that a key takes
    by_key = dict[str, tuple[float, Value]]()
    known = [
        (key, value, change)
        for key, value in keys_with_elements(problem)
        if (change := largest_change(problem, key, value))
    ]
    part = max(deadline - time.monotonic(), 0.0) / (len(known) * seconds)  # of what all keys take
    count = round(min(max(part, few / most), 1.0) * most / few) * few
    seconds *= count / most

    def at(key: str, value: float) -> tuple[Moments, float]:
        """The moments with another value of a key, and the unit of the load's power."""
        other = Problem(problem.scene.vary(key, value))
        ratio = other.scales.frequency / unit
        ensemble = trajectories(other, first.h * ratio, count)
        ensemble.run(settled * ratio)
        return ensemble.run(settled * ratio), other.units.watts * (other.equations.beta or 0.0)

    for k, (key, value, change) in enumerate(known):
        if (begin := time.monotonic()) + seconds > deadline:
            break
        (more, log_more), (less, log_less) = (
            _logarithm(*at(key, (1.0 + sign * change) * value)) for sign in (1, -1)
        )
        width = math.log1p(change) - math.log1p(-change)
        slope = difference95(log_more, log_less, (more.controls, less.controls), first.together)
        by_key[key] = value, slope.scaled(1.0 / width).with_unknown(Compiled.UNKNOWN)
        seconds = max(seconds, time.monotonic() - begin)  # a key's own circuit is made, too
        report((k + 1) / len(known))
    entries = controlled_entries(power.load, power.controls, first.together)
    mean, stderr = mean_and_error(entries)
    watts = problem.units.watts * (problem.equations.beta or 0.0)
    left = [key for key, *_ in known if key not in by_key]
    mean_power = Value(mean, stderr, dof=len(entries) - 1.0, unknown=Compiled.UNKNOWN)
    return mean_power.scaled(watts), by_key, left, len(left) * seconds


def _logarithm(moments: Moments, watts: float) -> tuple[Moments, Floats]:
    """The moments, and entries whose mean is the logarithm of the mean power, to first order in their spread."""
    mean = float(controlled_entries(moments.load, moments.controls).mean())
    return moments, math.log(mean * watts) + (moments.load - mean) / mean
