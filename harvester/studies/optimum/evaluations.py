"""Evaluations of the power over the unit cube of the keys; all are kept, also those that failed."""

import dataclasses
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.options import number
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, SimulationError, answer_or_error
from harvester.machine.progress import NO_PROGRESS, Progress
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.scene.scene import Scene
from harvester.studies.optimum.ranges import Range, problem_at
from harvester.uncertainty.value import Value

SHORTEST = 0.1  # seconds that an evaluation has at least
_FLAT = 1e-6  # relative difference of powers that is none
_TOGETHER = 64  # points of an engine of formulas between two looks at the clock


class SpentError(Exception):
    """The budget has ended; the results until then count."""


@dataclass(frozen=True)
class Evaluation:
    """One evaluation: its place, engine, stage of the search and seed, and the answer or error."""

    u: Floats
    engine: str
    stage: str
    seed: int | None
    answer: Estimate | HarvesterError

    @property
    def power(self) -> Value | None:
        """The mean power; None if the engine failed."""
        return self.answer.mean_power if isinstance(self.answer, Estimate) else None

    @property
    def is_sound(self) -> bool:
        """Whether its power may be compared with others (`harvester.answers.estimate.Estimate.is_sound`)."""
        return isinstance(self.answer, Estimate) and self.answer.is_sound


@dataclass
class Surface:
    """A scene over ranges of its keys, evaluated until the budget ends.

    ``progress`` shows the fraction spent.
    """

    scene: Scene
    ranges: tuple[Range, ...]
    budget: float
    progress: Progress = NO_PROGRESS
    share: float = 1.0  # of the budget that may be spent now
    begin: float = field(default_factory=time.perf_counter)
    points: list[Evaluation] = field(default_factory=list)

    @property
    def dimensions(self) -> int:
        """The number of keys."""
        return len(self.ranges)

    @property
    def left(self) -> float:
        """The seconds of the budget that are left."""
        return self.begin + self.budget - time.perf_counter()

    @property
    def left_now(self) -> float:
        """The seconds of ``share`` of the budget that are left for an evaluation."""
        return max(self.left - (1.0 - min(self.share, 1.0)) * self.budget, SHORTEST)

    def values(self, u: Floats) -> dict[str, float]:
        """The keys' values at a place of the cube."""
        return {r.key: r.value(float(x)) for r, x in zip(self.ranges, u, strict=True)}

    def evaluate(self, where: Floats, engine: Engine, stage: str) -> list[Evaluation]:
        """Evaluate the power at each of the places, shape (n, keys).

        ``stage`` is the part of the search that asks.

        Runs of ngspice have the remainder of ``share`` at most.

        Raises SpentError when ``share`` of the budget is spent before all are done; those that are
        done are kept.
        """
        done: list[Evaluation] = []
        size = _TOGETHER if engine.is_formula else 1
        for start in range(0, len(where), size):
            if self.points and self.left < (1.0 - self.share) * self.budget:
                raise SpentError
            if engine.runs_ngspice:
                budget = number(getattr(engine, "budget", None)) or math.inf
                engine = with_options(engine, budget=min(budget, self.left_now))
            rows = where[start : start + size]
            seed = getattr(engine, "seed", None)
            for u, answer in zip(rows, self._answers(rows, engine), strict=True):
                done.append(Evaluation(np.array(u), engine.NAME, stage, seed, answer))
                self.points.append(done[-1])
            self.progress.step(min(1.0 - self.left / self.budget, 1.0))
        return done

    def _answers(self, where: Floats, engine: Engine) -> list[Estimate | HarvesterError]:
        # raises for stops without room between them
        problem_of = partial(problem_at, self.scene, self.ranges)
        problems = [answer_or_error(problem_of, u) for u in where]
        answers = iter(
            engine.run_many([problem for problem in problems if isinstance(problem, Problem)])
        )
        return [next(answers) if isinstance(problem, Problem) else problem for problem in problems]


def served(points: Sequence[Evaluation]) -> tuple[Floats, Floats, list[Value]]:
    """The places (n, keys), powers (n,) and values of the evaluations that have an answer.

    Those that are not sound are left out, unless there are no others.  Raises the last error
    without an answer.
    """
    known = [p for p in points if p.power is not None]
    sound = [p for p in known if p.is_sound] or known
    good = [(p.u, p.power) for p in sound if p.power is not None]
    if not good:
        last = points[-1].answer if points else None
        raise (
            last if isinstance(last, HarvesterError) else SimulationError("no place was evaluated")
        )
    return (
        np.array([u for u, _ in good]),
        np.array([v.value for _, v in good]),
        [v for _, v in good],
    )


def local_maxima(u: Floats, power: Floats) -> list[int]:
    """The indices of the points that none of their 2 n nearest in n dimensions exceeds, best first."""
    from scipy.spatial import cKDTree

    if len(u) < 3:
        return [int(np.argmax(power))]
    _, near = cKDTree(u).query(u, min(2 * u.shape[1] + 1, len(u)))
    return sorted(
        [k for k in range(len(u)) if power[k] >= power[near[k]].max()], key=lambda k: -power[k]
    )


def flatness(power: Floats) -> Diagnostic | None:
    """Why no place is better than another, if none is."""
    if power.max() <= 0.0:
        return note("no_power_anywhere")
    if len(power) > 1 and np.ptp(power) <= _FLAT * power.max():
        return note("same_power_everywhere")
    return None


def with_options(engine: Any, **options: Any) -> Any:
    """A copy of the engine with those of the options that it has."""
    names = {f.name for f in dataclasses.fields(engine)}
    return dataclasses.replace(engine, **{k: v for k, v in options.items() if k in names})
