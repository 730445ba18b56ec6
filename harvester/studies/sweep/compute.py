"""The computation of a sweep: rows that survive whatever ends the program, then the table, its figure and its files."""

import contextlib
import csv
import importlib
import io
import itertools
import json
import time
import types
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from harvester.engines.protocol import Engine
from harvester.errors import HarvesterError, InputError, named_once
from harvester.machine import files
from harvester.machine.cores import cores
from harvester.machine.execution import DEFAULT, Execution
from harvester.presentation import drawing
from harvester.presentation.answer_units import AnswerUnits
from harvester.scene.scene import Scene
from harvester.studies.output_folder import OutputFolder, provenance_with_engines
from harvester.studies.sweep.journal import Journal, JournalRow
from harvester.studies.sweep.points import Points
from harvester.studies.sweep.rows import COLUMNS, SweepRow, lines, read_cells
from harvester.studies.sweep.runners import (
    Done,
    Paces,
    by_executor,
    in_this_process,
    pool,
    tasks_at_once,
)
from harvester.studies.sweep.same_study import check_same, identity
from harvester.studies.sweep.shared_budget import SharedBudget
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.studies.sweep.tasks import Task, tasks

SAVED = 60.0  # seconds between two times that sweep.csv is written on the way
SHARE = 0.02  # of the time that this may take
CHECKS = 3  # points at most of an engine that checks another
MOST_BYTES = 1_000_000_000  # of a file of an earlier sweep


def compute_table(
    scene: Scene,
    points: Points,
    engines: Sequence[Engine],
    execution: Execution = DEFAULT,
    budget: float | None = None,
    in_place_of: Mapping[str, Sequence[str]] = types.MappingProxyType({}),
    common_noise: bool = False,
    check: str | None = None,
) -> SweepTable:
    """Run every engine at every point.

    Write sweep.csv, sweep.nc, sweep.png and provenance.json if there is `out`.

    Each finished point is in sweep.journal at once; `resume` keeps those of an earlier run of the
    same sweep and computes the others, also those that failed.  A point that fails is a row with
    its error.  Whoever computes, the answers are the same, but for their seconds, and for the values that a
    budget makes of these.  The progress is reported the rows of each engine.  A ``budget`` (s) is
    that of all rows together; ``in_place_of``: the formulas that an engine replaces.  Each point
    has independent noise, or with ``common_noise`` all have that of the engine's seed.  The engine
    named ``check`` runs at few points only: a third of them, at most `CHECKS`, and one if it is
    ngspice.

    Raises InputError for a point that no scene can be, before anything is computed, an option that
    no engine supports, a folder that cannot be written, or an earlier sweep that was another one;
    KeyboardInterrupt at ^C, with a text that states how to continue; HarvesterError when every
    point failed, the last error; the table is written all the same.
    """
    engines = [engine.at_many_points for engine in engines]
    names = [engine.NAME for engine in engines]
    named_once(names, "`engine`")
    points.check(scene)
    vary = {axis.key: list(axis.values) for axis in points.axes}
    about = provenance_with_engines(
        scene,
        engines,
        points="list" if points.listed else "grid",
        vary=vary,
        noise=_noise(engines, common_noise),
    )
    about |= {"in_place_of": in_place_of} if in_place_of else {}
    about |= {"check": check} if check else {}
    folder = OutputFolder.of(execution)
    with (
        contextlib.closing(execution.progress),
        contextlib.closing(Journal(None if folder is None else folder.path)) as journal,
    ):
        sweep = _Sweep(points, engines, about, journal, folder, execution=execution, check=check)
        sweep.begin()
        todo = tasks(
            scene,
            points,
            engines,
            sweep.is_missing,
            common_noise=common_noise,
            alone=budget is not None,
            check=check,
        )
        try:
            workers, todo = _workers(todo, execution)
            done = _answers(todo, execution, budget, sweep.rows_that_sample, workers=workers)
            return sweep.finished(sweep.fill(done, tasks_at_once(execution.executor, workers)))
        except KeyboardInterrupt:
            if folder is None:
                raise
            raise journal.interrupted(f"{sum(map(sweep.count, range(len(names))))} rows") from None


def _workers(todo: Iterator[Task], execution: Execution) -> tuple[int, Iterator[Task]]:
    """How many processes compute the tasks, and these: one if an executor does."""
    workers = execution.workers if execution.executor is None else 1
    if workers is not None:
        return workers, todo
    first = list(itertools.islice(todo, 2 * cores()))  # a process takes a second to start
    return max(1, min(cores(), len(first) // 2)), itertools.chain(first, todo)


def _answers(
    todo: Iterator[Task], execution: Execution, budget: float | None, rows: int, *, workers: int
) -> Done:
    """The tasks with their answers, from the executor, this process, or a pool, which loads the drawing code meanwhile.

    A ``budget`` is shared by the ``rows`` that sample.
    """
    shared = None if budget is None else SharedBudget(budget, rows, workers)
    todo = todo if shared is None else shared.share(todo)
    done = _computed(todo, execution, workers)
    return done if shared is None else shared.watch(done)


def _computed(todo: Iterator[Task], execution: Execution, workers: int) -> Done:
    if execution.executor is not None:
        return by_executor(todo, execution.executor)
    meanwhile: Callable[[], object] | None = None if execution.out is None else _preload_figures
    return in_this_process(todo) if workers == 1 else pool(todo, workers, meanwhile)


def _noise(engines: Sequence[Engine], common_noise: bool) -> str:
    """Which noise the points have, as the provenance states it."""
    draws = any(not engine.is_formula for engine in engines)
    return "independent" if draws and not common_noise else "common"


def _preload_figures() -> None:
    """Load the modules that draw and write the finished table: half a second, in which the workers compute."""
    importlib.import_module("scipy.io")
    drawing.drawing_of(SweepTable)


@dataclass(frozen=True)
class _Sweep:
    """The rows of a sweep on their way from the answers to the journal, the table and its files."""

    points: Points
    engines: Sequence[Engine]
    about: dict[str, Any]
    journal: Journal
    folder: OutputFolder | None
    execution: Execution
    check: str | None

    @cached_property
    def checked(self) -> frozenset[int]:
        """The points of the engine that checks."""
        ngspice = any(e.runs_ngspice for e in self.engines if self.check == e.NAME)
        return self.points.spread(1 if ngspice else min(max(len(self.points) // 3, 1), CHECKS))

    def count(self, index: int) -> int:
        """At how many points an engine runs."""
        return len(self.checked if self.names[index] == self.check else self.points)

    def is_missing(self, point: int, index: int) -> bool:
        """Whether an engine runs at a point, and has not yet."""
        is_wanted = self.names[index] != self.check or point in self.checked
        return is_wanted and not self.journal.has(point, index)

    @property
    def names(self) -> list[str]:
        """The names of the engines."""
        return [engine.NAME for engine in self.engines]

    @property
    def rows_that_sample(self) -> int:
        """How many rows of engines that sample are to come."""
        sampling = [index for index, engine in enumerate(self.engines) if not engine.is_formula]
        return sum(
            self.is_missing(point, index) for index in sampling for point in range(len(self.points))
        )

    @property
    def units(self) -> AnswerUnits:
        """The units of its answers."""
        return AnswerUnits.of("nondimensional" not in self.about["scene"])

    def begin(self) -> None:
        """Begin the journal, with the results of an earlier run, and the files."""
        now = identity(self.about)
        kept = list(self._kept(now)) if self.execution.resume else []
        self.journal.begin(now, kept)
        if self.folder is not None:
            self.save()  # before the provenance, which must never stand beside another sweep's rows
            self.folder.provenance(self.about)
            for name in (
                "sweep.nc",
                *(f"sweep.{form}" for form in ("png", *files.VECTOR)),
            ):  # nor an older plot
                files.remove(self.folder.path / name)
        done = Counter(row.engine_index for row in kept)
        for index, name in enumerate(self.names):
            self.execution.progress.start(self.count(index), name, done[index])

    def fill(self, done: Done, at_once: int) -> HarvesterError | None:
        """Write the answers into the journal as they come; returns the last error of a point.

        So many tasks are computed ``at_once``.
        """
        last: HarvesterError | None = None
        paces = Paces(self.execution.progress, at_once)
        saved = time.monotonic()
        took = 0.0
        try:
            for task, answers in done:
                name = self.names[task.engine_index]
                rows: list[JournalRow] = []
                for point, answer in zip(task.points, answers, strict=True):
                    if self.journal.has(
                        point, task.engine_index
                    ):  # of a batch that other points needed again
                        continue
                    last = answer if isinstance(answer, HarvesterError) else last
                    row = (
                        SweepRow.failed(name, answer)
                        if isinstance(answer, HarvesterError)
                        else answer
                    )
                    rows.append(JournalRow(point, task.engine_index, row.engine, row.written))
                self.journal.add(rows)
                self.execution.progress.step(len(rows), name)
                paces.add(name, answers)
                if time.monotonic() - saved > max(SAVED, took / SHARE):
                    begin = time.monotonic()
                    self.save()
                    saved = time.monotonic()
                    took = saved - begin
        except BaseException:
            done.close()
            with contextlib.suppress(InputError):
                self.save()
            raise
        return last

    def rows(self) -> Iterator[SweepRow]:
        """The rows that are done, in the order of the points."""
        for row in self.journal.rows():
            answer = SweepRow.read(row.content)
            varied = self.points.varied(row.point)
            yield replace(answer, varied=varied, warnings=(*row.warnings, *answer.warnings))

    def save(self) -> None:
        """Write sweep.csv with the rows that are done."""
        if self.folder is not None:
            self.folder.table("sweep", lines(self.points.keys, self.rows(), self.units))

    def finished(self, last: HarvesterError | None) -> SweepTable:
        """The whole table, in its files; the last error if there is nothing but errors."""
        which = array("q", (row.point for row in self.journal.rows()))
        table = SweepTable(
            self.points.axes, tuple(self.rows()), which, self.points.listed, self.about
        )
        self.save()
        if last is not None and all(row.error for row in table.rows):
            self.journal.remove()
            raise last
        if self.folder is not None:
            from harvester.studies.sweep.dataset import netcdf

            files.write(self.folder.path / "sweep.nc", netcdf(table))
            self.folder.figure("sweep", table.plot())
        self.journal.remove()
        return table

    def _kept(self, now: dict[str, str]) -> Iterator[JournalRow]:
        """The rows of an earlier run of the same sweep that hold an answer.

        None if its files are damaged.
        """
        assert self.folder is not None
        rows = self.journal.earlier(now)
        if rows is None:  # the sweep was finished, or there was none
            rows = list(self._rows_of_files(self.folder.path, now))
        for row in rows:
            if not SweepRow.read(row.content).error:
                yield row

    def _rows_of_files(self, out: Path, now: dict[str, str]) -> Iterator[JournalRow]:
        """The rows of sweep.csv, if provenance.json states that they are of the same sweep."""
        keys = self.points.keys
        try:
            before = json.loads(files.read(out / "provenance.json", "`out`", MOST_BYTES))
            text = files.read(out / "sweep.csv", "`out`", MOST_BYTES).decode()
            # a last line without end was cut off
            table = csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1]))
            lines_read = list(table)
        except (InputError, ValueError, RecursionError, csv.Error):
            return
        made = identity(before) if isinstance(before, dict) else {}
        check_same(out, made, now)
        if table.fieldnames == [*keys, *COLUMNS]:
            raise InputError(
                f"`resume` must find a sweep.csv of this version, but version 0.1 wrote that in {str(out)!r}, which "
                "lacks parts of the errors: use another `out`"
            )
        points_by_values: dict[tuple[str, ...], list[int]] = {}
        for point in range(len(self.points)):
            points_by_values.setdefault(tuple(map(repr, self.points.values(point))), []).append(
                point
            )
        chosen = next((engine.NAME for engine in self.engines if engine.chooses), None)
        for cells in lines_read:
            row = read_cells(cells)
            name = row and (chosen or row.engine)
            if row is not None and name in self.names:
                for point in points_by_values.get(tuple(cells.get(key, "") for key in keys), ()):
                    content = JournalRow(point, self.names.index(name), row.engine, row.written)
                    yield content.seen_by(made["versions"], now["versions"])
