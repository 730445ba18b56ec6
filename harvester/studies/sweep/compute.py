"""The computation of a sweep: rows that survive whatever ends the program, then the table, its figure and its files."""

import contextlib
import csv
import importlib
import io
import itertools
import json
import tempfile
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from harvester import figures
from harvester.cosimulation.ngspice.locate_libngspice import library_digest
from harvester.engines import Cheapest, Spice
from harvester.engines.protocol import Engine
from harvester.errors import HarvesterError, InputError, invalid
from harvester.machine import files
from harvester.machine.cores import cores
from harvester.scene.scene import Scene
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.sweep.journal import Journal, JournalRow, check_same, identity, noted
from harvester.studies.sweep.points import Points
from harvester.studies.sweep.rows import COLUMNS, Row, failed, holds_an_answer, lines
from harvester.studies.sweep.runners import Done, here, pool
from harvester.studies.sweep.table import SweepTable
from harvester.studies.sweep.tasks import Task, tasks

SAVED = 60.0  # seconds between two times that sweep.csv is written on the way
SHARE = 0.02  # of the time that this may take
MOST_BYTES = 1_000_000_000  # of a file of an earlier sweep

Told = Callable[[str], None]  # called with the name of the engine of a row


def compute_table(
    scene: Scene,
    points: Points,
    engines: Sequence[Engine],
    out: str | Path | None = None,
    *,
    resume: bool = False,
    tick: Told | None = None,
    skip: Told | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    vector: Sequence[str] = (),
) -> SweepTable:
    """Run every engine at every point; write sweep.csv, sweep.nc, sweep.png and provenance.json into a folder ``out``.

    The points are computed in ``workers`` processes (None: one a core where there is work for them; 1: this one), or by
    the workers of a Dask ``scheduler``; the answers are the same, but for their seconds, and for what a budget makes of
    these.  ``vector`` are forms of the figure beside its .png: svg, pdf.

    Each finished point is in sweep.journal at once; ``resume`` keeps those of an earlier run of the same sweep and
    computes the others, also those that failed.  A point that fails is a row with its error.  ``tick`` is called for
    each row that is done, ``skip`` (default: ``tick``) for each that is kept.

    Raises InputError for a point that no scene can be, before anything is computed, an option that no engine takes, a
    folder that cannot be written, or an earlier sweep that was another one; KeyboardInterrupt at ^C, with a text that
    says how to go on; HarvesterError when every point failed, the last error; the table is written all the same.
    """
    names = [e.NAME for e in engines]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"`engine` must name each only once, but names {name!r} twice")
    if workers is not None and not 1 <= workers <= 1000:
        raise invalid("`workers`", "be between 1 and 1000", workers)
    if out is None and resume:
        raise InputError("`resume` must go with the folder of an earlier sweep, but there is none")
    points.check(scene)
    about = provenance(
        scene,
        points="list" if points.listed else "grid",
        vary={a.key: list(a.values) for a in points.axes},
        engines={e.NAME: {k: v for k, v in vars(e).items() if v is not None and k != "budget"} for e in engines},
    )
    if Spice.NAME in names or (Cheapest.NAME in names and about["netlist"] is not None):
        about["versions"]["ngspice"] = library_digest()
    with contextlib.ExitStack() as stack:
        where = stack.enter_context(tempfile.TemporaryDirectory(prefix="harvester-")) if out is None else out
        folder = OutputFolder(where, vector)
        journal = stack.enter_context(contextlib.closing(Journal(folder.path)))
        journal.begin(identity(about), _kept(folder.path, journal, points, names, identity(about)) if resume else [])
        try:
            _save(folder, points, journal)  # before the provenance, which must never stand beside another sweep's rows
            folder.provenance(about)
            for name in ("sweep.nc", *(f"sweep.{form}" for form in ("png", *files.VECTOR))):  # nor an older plot
                (folder.path / name).unlink(missing_ok=True)
            if told := skip or tick:
                for _, place, _ in journal.rows():
                    told(names[place])
            todo = tasks(scene, points, engines, lambda point, place: not journal.has(point, place))
            last = _fill(
                journal,
                points,
                folder,
                _answers(todo, workers, scheduler, None if out is None else _load_what_draws),
                names,
                tick,
            )
            return _finished(folder, points, journal, about, last, drawn=out is not None)
        except KeyboardInterrupt:
            if out is None:
                raise
            raise KeyboardInterrupt(
                f"interrupted: {journal.count()} of {len(points) * len(names)} rows are in {str(out)!r}; "
                "the same command with `resume` goes on from there"
            ) from None


def _answers(
    todo: Iterator[Task], workers: int | None, scheduler: str | None, meanwhile: Callable[[], object] | None
) -> Done:
    """The tasks with their answers, from this process, a scheduler's workers, or a pool; ``meanwhile`` as of `pool`."""
    if scheduler is not None:
        from harvester.studies.sweep.cluster import dask

        return dask(todo, scheduler)
    if workers is None:  # a process takes a second to start
        first = list(itertools.islice(todo, 2 * cores()))
        workers, todo = max(1, min(cores(), len(first) // 2)), itertools.chain(first, todo)
    return here(todo) if workers == 1 else pool(todo, workers, meanwhile)


def _load_what_draws() -> None:
    """Load what draws and writes the finished table: half a second, in which the workers compute."""
    importlib.import_module("scipy.io")
    _ = figures.sweep


def _fill(
    journal: Journal, points: Points, folder: OutputFolder, done: Done, names: Sequence[str], tick: Told | None
) -> HarvesterError | None:
    """Write the answers into the journal as they come; returns the last error of a point."""
    last: HarvesterError | None = None
    saved, took = time.monotonic(), 0.0
    try:
        for task, answers in done:
            rows: list[JournalRow] = []
            for point, answer in zip(task.points, answers, strict=True):
                if journal.has(point, task.place):  # of a batch that was computed again for other points
                    continue
                if isinstance(answer, HarvesterError):
                    last = answer
                    rows.append((point, task.place, failed(names[task.place], answer)))
                else:
                    rows.append((point, task.place, answer))
            journal.add(rows)
            if tick is not None:
                for _ in rows:
                    tick(names[task.place])
            if time.monotonic() - saved > max(SAVED, took / SHARE):
                begin = time.monotonic()
                _save(folder, points, journal)
                saved = time.monotonic()
                took = saved - begin
    except BaseException:
        done.close()
        with contextlib.suppress(InputError):
            _save(folder, points, journal)
        raise
    return last


def _save(folder: OutputFolder, points: Points, journal: Journal) -> None:
    """Write sweep.csv with the rows that are done, in the order of the points."""
    folder.table("sweep", lines(points.keys, (points.cells(point) | row for point, _, row in journal.rows())))


def _finished(
    folder: OutputFolder,
    points: Points,
    journal: Journal,
    about: dict[str, Any],
    last: HarvesterError | None,
    drawn: bool,
) -> SweepTable:
    """The whole table, in its files where they are ``drawn``; the last error where there is nothing but errors."""
    which = array("q")
    rows: list[Row] = []
    for point, _, row in journal.rows():
        which.append(point)
        rows.append(points.cells(point) | row)
    table = SweepTable(points.axes, rows, which, points.listed, about)
    if drawn:
        _save(folder, points, journal)
    if last is not None and all(row["error"] for row in table.rows):
        journal.remove()
        raise last
    if drawn:
        from harvester.studies.sweep.dataset import netcdf

        files.write(folder.path / "sweep.nc", netcdf(table))
        folder.figure("sweep", table.plot())
    journal.remove()
    return table


def _kept(out: Path, journal: Journal, points: Points, names: Sequence[str], now: dict[str, str]) -> list[JournalRow]:
    """The rows of an earlier run of the same sweep that hold an answer; none where its files are damaged."""
    found = journal.earlier(now)
    if found is None:  # the sweep was finished, or is by an earlier version
        found = list(_rows_of_files(out, points, names, now))
    return [row for row in found if holds_an_answer(row[2])]


def _rows_of_files(out: Path, points: Points, names: Sequence[str], now: dict[str, str]) -> Iterator[JournalRow]:
    """The rows of sweep.csv, where provenance.json says that they are of the same sweep."""
    try:
        before = json.loads(files.read(out / "provenance.json", "`out`", MOST_BYTES))
        text = files.read(out / "sweep.csv", "`out`", MOST_BYTES).decode()
        rows = list(csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1])))  # a last line without end was cut off
    except (InputError, ValueError, RecursionError, csv.Error):
        return
    made = identity(before) if isinstance(before, dict) else {}
    check_same(out, made, now)
    of: dict[tuple[str, ...], list[int]] = {}
    for point in range(len(points)):
        of.setdefault(tuple(points.cells(point).values()), []).append(point)
    cheapest = Cheapest.NAME in names  # whose rows bear the name of the engine that it chose
    for row in rows:
        if set(row) == {*points.keys, *COLUMNS} and all(isinstance(cell, str) for cell in row.values()):
            name = Cheapest.NAME if cheapest else row["engine"]
            if name in names:
                for point in of.get(tuple(row[key] for key in points.keys), ()):
                    cells = {column: row[column] for column in COLUMNS}
                    yield point, names.index(name), noted(cells, made["versions"], now["versions"])
