"""Quantities beyond the modes of the density, counted on a trajectory: the joint density with the voltage, passages.

The joint density of displacement and voltage has edges, where impacts end, and the first passage of
a voltage would need elements of the voltage.  A path needs neither, and its groups give the
standard error.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.studies.motion import Motion, motion
from harvester.uncertainty.value import Value

STEPS = 2_000_000  # of the trajectory
BURN_IN = 0.25  # fraction of the trajectory that is left out
# parts of the trajectory, each all but independent of the others; bins along each axis
GROUPS, BINS = 32, 40
FEWEST = 25  # windows that pass the level, and as many that do not
LONGEST_WINDOW = 128  # pairs of windows that the trajectory has at least


def longer_path(path: Motion, problem: Problem, seed: int) -> Motion:
    """A trajectory of about `STEPS` steps, of the same scene as a shorter one."""
    span = STEPS * path.step * path.shown / float(path.time[-1])
    return motion(problem, duration=max(span, path.shown), seed=seed)


def voltage_plane(
    path: Motion, x: tuple[float, float], volts: tuple[float, float]
) -> tuple[Floats, ...]:
    """The density of displacement and voltage between some ends, in their units.

    Centres of the bins, shape (n,) each, the density and its standard error, shape (n, n).
    """
    first = int(BURN_IN * len(path.time))
    edges = [np.linspace(*ends, BINS + 1) for ends in (x, volts)]
    area = (edges[0][1] - edges[0][0]) * (edges[1][1] - edges[1][0])
    parts = [np.array_split(values[first:], GROUPS) for values in (path.displacement, path.voltage)]
    counted = [
        np.histogram2d(a, b, edges)[0] / (len(a) * area) for a, b in zip(*parts, strict=True)
    ]
    centres = (0.5 * (edge[1:] + edge[:-1]) for edge in edges)
    return *centres, np.mean(counted, axis=0), np.std(counted, axis=0, ddof=1) / math.sqrt(GROUPS)


def counted_passage(time: Floats, values: Floats, level: float, forgetting_time: float) -> Value:
    """The mean time until |values| at the times of a path first pass a level, in the unit of these.

    Windows in which no value passes it get rarer as exp(-lambda t) with their length t, from
    ``forgetting_time`` on, in which the motion forgets its start: P(t)/P(2 t) = exp(lambda t),
    counted in neighbours.  The motion between two values follows from every other one of them.

    Raises SimulationError if too few windows pass it, or do not.
    """
    settled = np.abs(values[int(BURN_IN * len(values)) :])
    step = float(time[1] - time[0])
    rate, part = _rate(settled, step, level, forgetting_time)
    coarse, _ = _rate(settled[::2], 2.0 * step, level, forgetting_time)
    return Value(
        1.0 / rate, part / rate**2, bias=abs(1.0 / coarse - 1.0 / rate), model=forgetting_time
    )


def _rate(values: Floats, step: float, level: float, forgetting_time: float) -> tuple[float, float]:
    """The rate of passages and its standard error."""
    length = max(round(forgetting_time / step), 1)
    while True:
        pairs = len(values) // (2 * length)
        highest: Floats = np.asarray(
            values[: 2 * length * pairs].reshape(pairs, 2, length).max(axis=2)
        )
        calm = highest < level
        both = calm[:, 0] & calm[:, 1]
        each = calm.mean(axis=1)
        if both.sum() < 0.5 * pairs or pairs < LONGEST_WINDOW:
            break
        length *= 2
    if both.sum() < FEWEST or calm.size - calm.sum() < FEWEST:
        way = "rarely: give less" if both.sum() >= FEWEST else "often: give more"
        raise SimulationError(
            f"`level` is passed too {way}, for it to be counted on a path of {pairs} pieces"
        )
    spread = (both / both.mean() - each / each.mean()).std() / math.sqrt(pairs)
    return math.log(each.mean() / both.mean()) / (length * step), float(spread) / (length * step)
