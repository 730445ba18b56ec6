"""A unit of computation: one point of an engine that samples, or a batch for an engine of formulas.

An engine with continuation continues from the answer at one point to that at the next, through a
few points at a time, which are always the same ones.
"""

import dataclasses
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

from harvester.answers.estimate import Estimate
from harvester.engines.many_designs import seed_of
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, MissingProgramError, SimulationError, named
from harvester.scene.scene import Scene
from harvester.studies.sweep.points import Points
from harvester.studies.sweep.rows import SweepRow

BATCH = 256  # points that an engine of formulas computes at once
# points through which an engine goes from answer to answer: what is lost where a program is killed
CONTINUED = 7
FIRST = 2  # points of the first call, by which the time for all is known early

Answer: TypeAlias = SweepRow | HarvesterError  # a row without the varied keys, or why there is none


@dataclass(frozen=True)
class Task:
    """Points of one engine, with all that a worker needs to compute them.

    ``engine_index`` counts the sweep's.
    """

    scene: Scene
    engine: Engine
    engine_index: int
    keys: tuple[str, ...]
    points: tuple[int, ...]
    values: tuple[tuple[float, ...], ...]
    tries: int = 0  # how often its worker died
    # of the noise of each point; None: that of the engine
    seeds: tuple[int, ...] | None = None
    continues: bool = False
    # the budget (s) of the sweep that was spent before it could begin
    left_out: float | None = None

    @property
    def by_continuation(self) -> bool:
        """Whether its engine continues from point to point."""
        return self.continues and len(self.points) > 1

    def again(self) -> "list[Task]":
        """The tasks that replace this one after its worker died: itself once more, then its points one by one."""
        return self.split() if self.tries else [dataclasses.replace(self, tries=1)]

    def split(self) -> "list[Task]":
        """A task for each point, for one of them may have killed the worker.

        None for a single point.
        """
        if len(self.points) == 1:
            return []
        return [
            dataclasses.replace(
                self,
                points=(point,),
                values=(self.values[row],),
                seeds=None if self.seeds is None else (self.seeds[row],),
            )
            for row, point in enumerate(self.points)
        ]

    def lost(self) -> list[Answer]:
        """The answers, errors all, of a task whose worker died again and again."""
        return [SimulationError(LOST) for _ in self.points]


LOST = (
    "the worker process ended abruptly, twice (crash or out of memory): try fewer `trajectories` or fewer `workers`, "
    "and `resume`"
)
SPENT = "left out, as the `budget` of {:.3g} s for the whole sweep was spent before: give a longer one, or `resume`"


def tasks(
    scene: Scene,
    points: Points,
    engines: Sequence[Engine],
    is_missing: Callable[[int, int], bool],
    common_noise: bool = True,
    alone: bool = False,
    check: str | None = None,
) -> Iterator[Task]:
    """The tasks of a sweep, made one by one; ``is_missing(point, index)`` states the missing ones.

    A batch is always the same points, also if some of them are done: an answer's last digits
    depend on the batch.  Without ``common_noise`` each point has noise of its own; ``alone``:
    engines that sample compute one point at a time, as each has its share of a budget, and so does
    the engine named ``check``, which has few of the points.
    """
    for begin in range(0, len(points), BATCH):
        batch = range(begin, min(begin + BATCH, len(points)))
        sizes = [
            (1, False) if check == e.NAME else _at_once(e, scene, points, begin, alone)
            for e in engines
        ]
        for size, continues in sorted(set(sizes), reverse=True):
            shorter = FIRST if begin == 0 and size < BATCH else 0
            calls = sorted({*range(0, len(batch), size), shorter})
            for first, end in pairwise([*calls, len(batch)]):
                numbers = batch[first:end]
                for index in (k for k, how in enumerate(sizes) if how == (size, continues)):
                    if any(is_missing(point, index) for point in numbers):
                        yield Task(
                            scene,
                            engines[index],
                            index,
                            points.keys,
                            points=tuple(numbers),
                            values=tuple(points.values(point) for point in numbers),
                            seeds=None if common_noise else _seeds(engines[index], numbers),
                            continues=continues,
                        )


def _seeds(engine: Engine, points: Sequence[int]) -> tuple[int, ...] | None:
    """The seeds of points, of an engine that draws noise."""
    seed = None if engine.is_formula else getattr(engine, "seed", None)
    return None if seed is None else tuple(seed_of(seed, point) for point in points)


def _at_once(
    engine: Engine, scene: Scene, points: Points, first: int, alone: bool
) -> tuple[int, bool]:
    """How many points an engine computes at once from the first on, and whether it continues."""
    if engine.is_formula:
        return BATCH, False
    if len(points) == 1:
        return 1, False
    try:
        problem = Problem(scene.varied(points.varied(first)))
        if engine.continues(problem):
            return CONTINUED, True
        return 1 if alone else engine.many_at_once(problem), False
    except HarvesterError:  # which its own task will tell
        return 1, False


def compute_alone(task: Task) -> tuple[list[Answer], bool]:
    """Compute a task in a worker process, and state whether that may accept another one.

    If an engine continues from point to point, ngspice runs in this very process, which is not
    started for more; a task that ended its process before, or whose runs may be given up at the end
    of a budget, has processes of ngspice as elsewhere.
    """
    if not task.by_continuation or task.tries or getattr(task.engine, "budget", None) is not None:
        return compute(task), True
    from harvester.cosimulation.worker_pool import ngspice_here

    with ngspice_here() as here:
        return compute(task), here.trusted


def compute(task: Task) -> list[Answer]:
    """Compute an answer for each point of a task, in whatever process this runs.

    Raises MissingProgramError if ngspice is not installed, which is not a fault of the point.
    """
    if task.left_out is not None:
        return [SimulationError(SPENT.format(task.left_out)) for _ in task.points]
    answers: list[Estimate | HarvesterError] = []
    try:
        scenes = [
            task.scene.varied(dict(zip(task.keys, values, strict=True))) for values in task.values
        ]
        if task.by_continuation:
            answers = task.engine.run_continued(scenes)
        else:
            named_seeds = {} if task.seeds is None else {"seeds": task.seeds}
            answers = task.engine.run_many(scenes, **named_seeds)
    except MissingProgramError:
        raise
    except HarvesterError as error:
        answers = [error for _ in task.points]
    except Exception as error:  # a defect of ours must not end a sweep of a day
        if os.environ.get("HARVESTER_TRACEBACK"):
            raise
        answers = [named(error) for _ in task.points]
    return [
        SweepRow.answered(answer) if isinstance(answer, Estimate) else answer for answer in answers
    ]
