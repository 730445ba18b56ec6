"""Many scenes, several engines: a table that survives what ends the program, a plot, and where they come from."""

import contextlib
import csv
import io
import itertools
import json
import tempfile
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from harvester.engines import Cheapest
from harvester.engines.protocol import Engine
from harvester.errors import HarvesterError, InputError, invalid
from harvester.machine import files
from harvester.machine.cores import cores
from harvester.scene.scene import Scene
from harvester.studies.output_folder import provenance
from harvester.studies.sweep.journal import Journal, Kept, check_same, identity, read
from harvester.studies.sweep.points import Axis, Points, axis, grid, read_points
from harvester.studies.sweep.runners import Done, here, pool
from harvester.studies.sweep.table import COLUMNS, Row, Table, failed, holds_an_answer, lines
from harvester.studies.sweep.tasks import Task, tasks

__all__ = ["COLUMNS", "Axis", "Points", "Table", "axis", "grid", "read_points", "sweep"]

SAVED = 60.0  # seconds between two times that sweep.csv is written on the way
SHARE = 0.02  # of the time that this may take


def sweep(
    scene: Scene,
    axes: Sequence[Axis] | Points,
    engines: Sequence[Engine],
    out: str | Path | None = None,
    resume: bool = False,
    tick: Callable[[str], None] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    skip: Callable[[str], None] | None = None,
    vector: Sequence[str] = (),
) -> Table:
    """Run every engine at every point; write sweep.csv, sweep.nc, sweep.png, provenance.json into the folder ``out``.

    ``vector`` are forms of the figure beside its .png: svg, pdf.

    ``axes`` are those of a grid, or a list of points (`read_points`).  The points are computed in ``workers`` processes
    (None: one a core where there is work for them; 1: this one), or by the workers of a Dask ``scheduler``; the answers
    are the same, but for their seconds, and for what `--budget` makes of these.

    Each finished point is in sweep.journal at once; ``resume`` keeps those of an earlier run of the same sweep and
    computes the others, also those that failed.  A point that fails is a row with its error.  ``tick`` is told each row
    that is done; ``skip`` (default: ``tick``) each that is kept.

    Raises
    ------
    InputError
        for a point that no scene can be, before anything is computed, an option that no engine takes, a folder that
        cannot be written, or an earlier sweep that was another one.
    KeyboardInterrupt
        at ^C, with a text that says how to go on.
    HarvesterError
        when every point failed, the last error; the table is written all the same.
    """
    if out is None:
        if resume:
            raise InputError("`resume` must go with the folder of an earlier sweep, but there is none")
        with tempfile.TemporaryDirectory(prefix="harvester-") as folder:  # for the journal
            return _sweep(scene, axes, engines, folder, False, tick, workers, scheduler, None, None)
    return _sweep(scene, axes, engines, out, resume, tick, workers, scheduler, skip or tick, vector)


def _sweep(
    scene: Scene,
    axes: Sequence[Axis] | Points,
    engines: Sequence[Engine],
    out: str | Path,
    resume: bool,
    tick: Callable[[str], None] | None,
    workers: int | None,
    scheduler: str | None,
    skip: Callable[[str], None] | None,
    vector: Sequence[str] | None,
) -> Table:
    files.check_vector(vector or ())
    points = axes if isinstance(axes, Points) else grid(axes)
    names = [e.NAME for e in engines]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"`engine` must name each only once, but names {name!r} twice")
    if workers is not None and not 1 <= workers <= 1000:
        raise invalid("`workers`", "be between 1 and 1000", workers)
    points.check(scene)
    out = files.folder(out)
    about = provenance(
        scene,
        points="list" if points.listed else "grid",
        vary={a.key: list(a.values) for a in points.axes},
        engines={e.NAME: {k: v for k, v in vars(e).items() if v is not None and k != "budget"} for e in engines},
    )
    now = identity(about)
    kept = _earlier(out, points, names, now) if resume else ()
    journal = Journal(out, now, len(points), len(engines), kept)
    try:
        _save(out, points, journal)  # before the provenance, which must never stand beside the rows of another sweep
        files.write(out / "provenance.json", json.dumps(about, indent=2, default=str) + "\n")
        for name in ("sweep.nc", *(f"sweep.{form}" for form in ("png", *files.VECTOR))):  # nor an older plot
            (out / name).unlink(missing_ok=True)
        if skip is not None:
            for _, place, _ in journal.rows():
                skip(names[place])
        todo = tasks(scene, points, engines, lambda point, place: not journal.has(point, place))
        last = _fill(journal, points, out, _run(todo, workers, scheduler), names, tick)
        return _finished(out, points, journal, about, last, vector)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted: {journal.count()} of {len(points) * len(names)} rows are in {str(out)!r}; "
            "the same command with `resume` goes on from there"
        ) from None
    finally:
        journal.close()


def _run(todo: Iterator[Task], workers: int | None, scheduler: str | None) -> Done:
    """Whoever computes."""
    if scheduler is not None:
        from harvester.studies.sweep.cluster import dask

        return dask(todo, scheduler)
    if workers is None:  # a process takes a second to start
        first = list(itertools.islice(todo, 2 * cores()))
        workers = max(1, min(cores(), len(first) // 2))
        todo = itertools.chain(first, todo)
    return here(todo) if workers == 1 else pool(todo, workers)


def _fill(
    journal: Journal, points: Points, out: Path, done: Done, names: Sequence[str], tick: Callable[[str], None] | None
) -> HarvesterError | None:
    """Write down what is computed; returns the last error of a point."""
    last: HarvesterError | None = None
    saved, took = time.monotonic(), 0.0
    try:
        for task, answers in done:
            rows: list[Kept] = []
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
                _save(out, points, journal)
                saved = time.monotonic()
                took = saved - begin
    except BaseException:
        done.close()
        with contextlib.suppress(InputError):
            _save(out, points, journal)
        raise
    return last


def _save(out: Path, points: Points, journal: Journal) -> None:
    """sweep.csv of what is done, in the order of the points."""
    rows = (points.cells(point) | row for point, _, row in journal.rows())
    files.write(out / "sweep.csv", (line.encode() for line in lines(points.keys, rows)))


def _finished(
    out: Path,
    points: Points,
    journal: Journal,
    about: dict[str, Any],
    last: HarvesterError | None,
    vector: Sequence[str] | None,
) -> Table:
    """The whole table, its file, and what is made of it."""
    which = array("q")
    rows: list[Row] = []
    for point, _, row in journal.rows():
        which.append(point)
        rows.append(points.cells(point) | row)
    table = Table(points.axes, rows, which, points.listed, about)
    _save(out, points, journal)
    if last is not None and all(row["error"] for row in table.rows):
        journal.remove()
        raise last
    if vector is None:
        return table
    from harvester import figures
    from harvester.studies.sweep.dataset import netcdf

    files.write(out / "sweep.nc", netcdf(table))
    figures.save(table.plot(), out, "sweep", vector)
    journal.remove()
    return table


def _earlier(out: Path, points: Points, names: Sequence[str], now: dict[str, str]) -> Iterator[Kept]:
    """The rows of an earlier run of the same sweep that hold an answer; none where its files are damaged."""
    found = read(out, now)
    if found is None:  # it was finished, or is by an earlier version
        found = _table(out, points, names, now)
    return ((point, place, row) for point, place, row in list(found) if holds_an_answer(row))


def _table(out: Path, points: Points, names: Sequence[str], now: dict[str, str]) -> Iterator[Kept]:
    """Those of sweep.csv and provenance.json."""
    try:
        before = json.loads((out / "provenance.json").read_text())
        text = (out / "sweep.csv").read_text()
        rows = list(csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1])))  # a last line without end was cut off
    except (OSError, ValueError, csv.Error):
        return
    check_same(out, identity(before) if isinstance(before, dict) else before, now)
    of: dict[tuple[str, ...], list[int]] = {}
    for point in range(len(points)):
        of.setdefault(tuple(points.cells(point).values()), []).append(point)
    cheapest = Cheapest.NAME in names  # whose rows bear the name of the engine that it chose
    for row in rows:
        if set(row) == {*points.keys, *COLUMNS} and all(isinstance(cell, str) for cell in row.values()):
            name = Cheapest.NAME if cheapest else row["engine"]
            if name in names:
                for point in of.get(tuple(row[key] for key in points.keys), ()):
                    yield point, names.index(name), {column: row[column] for column in COLUMNS}
