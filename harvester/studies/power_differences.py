"""Normalised sensitivities of the power as differences of an engine's answers, each with its step error.

With the power P at the factors 1 + d and 1 - d of a key's value,

    E(d) = (ln P(1 + d) - ln P(1 - d))/(ln(1 + d) - ln(1 - d)),   E = (4 E(d/2) - E(d))/3,

which is Richardson's extrapolation by the two differences that agree best.  d is halved at least
once, and until the error is small.  The error is the last difference between two successive E(d)
and two extrapolations if each is at most half of the one before, as of a smooth power; otherwise
the largest of them, since some agree by chance, by the noise in a table or on both flanks of a
resonance that is narrower than d.  All answers have the same noise, so that the sampling
error is that of a difference.  A power law has the same E for any d.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from harvester.answers.estimate import Estimate
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError, SimulationError
from harvester.studies.tolerance.first_order import error_of_sum
from harvester.uncertainty.value import Value

CHANGE = 0.05  # of a key, up and down
MOVED = 0.5  # part of a resonance's half-width
LEAST = 0.02  # part of CHANGE, below which a key is not varied
HALVINGS = 2  # of the change at most, until the error is
SMALL = 0.01  # of the larger of E and 1
ANSWERS = 6  # for a key at least: two at each of three changes
LARGE = 0.1  # as SMALL: an error that a warning names


@dataclass
class PowerDifferences:
    """Value and normalised sensitivity by key, the keys ``left`` at the end of a budget, and the errors of others.

    ``seconds`` is the time that the keys left would need.
    """

    by_key: dict[str, tuple[float, Value]] = field(default_factory=dict)
    left: list[str] = field(default_factory=list)
    seconds: float = 0.0
    failed: dict[str, HarvesterError] = field(default_factory=dict)


def largest_change(problem: Problem, key: str, value: float, most: float = CHANGE) -> float:
    """The part of its value by which a key can be larger, at most ``most``; 0 if it cannot."""
    change = most
    while change > LEAST * most:
        try:
            problem.scene.vary(key, (1.0 + change) * value)
        except InputError:
            change *= 0.5
        else:
            return change
    return 0.0


def check_power(power: float) -> None:
    """Raise SimulationError for a power that has no logarithm."""
    if not power > 0.0:
        raise SimulationError("the load receives no power")


def first_change(problem: Problem, key: str, value: float) -> float:
    """The first change of a key, which moves a resonance by at most `MOVED` of its half-width, the damping ratio.

    Other changes are `CHANGE`: a smaller one would have more of the noise of an engine's answers.
    """
    equations = problem.equations
    if equations.drive is None or not equations.c1:
        return CHANGE
    most = MOVED * 0.5 * abs(equations.c1)
    try:
        changed = Problem(problem.scene.vary(key, (1.0 + CHANGE) * value))
    except InputError:
        return min(CHANGE, most)
    pairs = zip(_detunings(problem), _detunings(changed), strict=True)
    moved = max(abs(after - before) for before, after in pairs)
    return CHANGE * min(1.0, most / moved) if moved else CHANGE


def _detunings(problem: Problem) -> tuple[float, float]:
    """Logarithms of the drive's frequency over the resonance with a shorted piezo and an open one."""
    equations = problem.equations
    assert equations.drive_frequency is not None, "a drive has one"
    shorted = math.log(equations.drive_frequency)
    return shorted, shorted - 0.5 * math.log1p(equations.beta or 0.0)


def by_differences(
    problem: Problem,
    engine: Engine,
    values: Mapping[str, float],
    report: Callable[[float], None],
    deadline: float = math.inf,
    most: float | None = None,
) -> PowerDifferences:
    """The normalised sensitivities of an engine's power in the keys with these values, which are not 0.

    ``most`` is the first change of a key, up and down, relative to its value; None: `first_change`.
    A key that cannot be larger is not varied.  Keys for which there is no time until ``deadline``
    (s, of `time.monotonic`) are left, and one without an answer has its error.
    """
    done = PowerDifferences()
    seconds = 0.0
    if deadline < math.inf:  # the first key has to fit as well
        begin = time.monotonic()
        engine.run_many([problem.scene])
        seconds = ANSWERS * (time.monotonic() - begin)
    for k, (key, value) in enumerate(values.items()):
        begin = time.monotonic()
        if begin + seconds > deadline:
            done.left = [*values][k:]
            done.seconds = seconds * len(done.left)
            break
        widest = first_change(problem, key, value) if most is None else most
        if change := largest_change(problem, key, value, widest):
            differences = _Differences(problem, engine, key, value)
            try:
                done.by_key[key] = value, differences.elasticity(change)
            except HarvesterError as error:
                done.failed[key] = error
        seconds = max(seconds, time.monotonic() - begin)
        report((k + 1) / len(values))
    return done


class _Differences:
    """The differences of an engine's power in one key, at ever smaller changes of it."""

    def __init__(self, problem: Problem, engine: Engine, key: str, value: float) -> None:
        self.problem = problem
        self.engine = engine
        self.key = key
        self.value = value

    def elasticity(self, change: float) -> Value:
        """The normalised sensitivity at ever smaller changes, each one half of the one before, and its error.

        They end if the error is small, after at most `HALVINGS`.  Raises the error of an answer,
        and SimulationError for one without power.
        """
        levels = self._at(change, 0.5 * change, 0.25 * change)
        best = _extrapolated(levels)
        for _ in range(HALVINGS - 1):
            if is_within(SMALL, best):
                break
            change *= 0.5
            levels += self._at(0.25 * change)
            best = _extrapolated(levels)
        return best

    def _at(self, *changes: float) -> list[Value]:
        """The normalised sensitivity between two answers, at each change of the key."""
        factors = [1.0 + sign * change for change in changes for sign in (1.0, -1.0)]
        scenes = [self.problem.scene.vary(self.key, factor * self.value) for factor in factors]
        answers = self.engine.run_many(scenes)
        pairs = zip(answers[::2], answers[1::2], strict=True)
        return [
            _difference(change, more, less)
            for change, (more, less) in zip(changes, pairs, strict=True)
        ]


def is_within(part: float, elasticity: Value) -> bool:
    """Whether the step error of a normalised sensitivity is at most this part of the larger of it and 1."""
    return (elasticity.bias or 0.0) <= part * max(abs(elasticity.value), 1.0)


def _extrapolated(levels: Sequence[Value]) -> Value:
    """Richardson's extrapolation of three or more differences, each at half the change of the one before."""
    pairs = list(pairwise(levels))
    values = [(4.0 * fine.value - coarse.value) / 3.0 for coarse, fine in pairs]
    gaps = [abs(fine.value - coarse.value) for coarse, fine in pairs]
    best = min(range(len(values)), key=gaps.__getitem__)
    if len(gaps) > 2 and all(fine <= 0.5 * coarse for coarse, fine in pairwise(gaps)):
        bias = max(gaps[-1], abs(values[-1] - values[-2]))
    else:
        bias = max(*gaps, max(values) - min(values))
    fine = pairs[best][1]
    stderr = None if fine.stderr is None else 4.0 / 3.0 * fine.stderr
    return Value(values[best], stderr, bias, unknown=fine.unknown)


def _difference(
    change: float, more: Estimate | HarvesterError, less: Estimate | HarvesterError
) -> Value:
    """The normalised sensitivity between two answers on the same noise."""
    for answer in (more, less):
        if isinstance(answer, HarvesterError):
            raise answer
        check_power(answer.mean_power.value)
    assert isinstance(more, Estimate) and isinstance(less, Estimate), "checked"
    width = math.log1p(change) - math.log1p(-change)
    powers = [more.mean_power, less.mean_power]
    weights = [1.0 / (width * powers[0].value), -1.0 / (width * powers[1].value)]
    stderr = error_of_sum((more, less), weights) if powers[0].stderr is not None else None
    slope = math.log(powers[0].value / powers[1].value) / width
    return Value(slope, stderr, unknown=powers[0].unknown)
