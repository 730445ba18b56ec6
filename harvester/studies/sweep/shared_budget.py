"""The budget of a whole sweep, shared anew whenever a row begins: the excess of one is lost to the others."""

import dataclasses
import time
from collections.abc import Iterator

from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.runners import Done
from harvester.studies.sweep.tasks import Task

LEAST = 0.25  # of its share, that a row gets whatever rows took beyond theirs


class SharedBudget:
    """So many ``seconds`` for ``rows`` rows of engines that sample, of which ``beside`` are computed at a time.

    A row gets its share of the rest, less the time that every row of its engine so far used beyond
    the share it was given, as ngspice does until it has started and charged.  One that begins with
    less than that time is left out.
    """

    def __init__(self, seconds: float, rows: int, beside: int) -> None:
        self._seconds = seconds
        self._end = time.monotonic() + seconds
        self._rows, self._beside = rows, beside
        # when, and what, of tasks at work
        self._given: dict[tuple[int, tuple[int, ...]], tuple[float, float]] = {}
        self._beyond: dict[int, float] = {}  # of an engine, by its index

    def share(self, tasks: Iterator[Task]) -> Iterator[Task]:
        """The tasks, each with its part of the budget when it begins."""
        for task in tasks:
            yield task if task.engine.is_formula else self._with_share(task)

    def _with_share(self, task: Task) -> Task:
        count = len(task.points)
        left = self._end - time.monotonic()
        beyond = self._beyond.get(task.engine_index, 0.0)
        share = left * min(self._beside / max(self._rows, count), 1.0)
        self._rows -= count
        if left <= beyond:
            return dataclasses.replace(task, left_out=self._seconds)
        given = max(share - beyond, LEAST * share)
        self._given[task.engine_index, task.points] = time.monotonic(), given
        return dataclasses.replace(task, engine=dataclasses.replace(task.engine, budget=given))  # type: ignore[type-var]

    def watch(self, done: Done) -> Done:
        """The answers as they come, whose times are measured."""
        for task, answers in done:
            begin, given = self._given.pop((task.engine_index, task.points), (0.0, 0.0))
            if given:
                # no worker's start
                seconds = [row.seconds or 0.0 for row in answers if isinstance(row, SweepRow)]
                took = (
                    sum(seconds) if len(seconds) == len(answers) else time.monotonic() - begin
                ) / len(task.points)
                beyond = max(took - given, 0.0)
                self._beyond[task.engine_index] = min(
                    beyond, self._beyond.get(task.engine_index, beyond)
                )
            yield task, answers
