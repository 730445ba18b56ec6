"""Many scenes, several engines: a table that grows point by point, a plot, and where they come from."""

import csv
import io
import itertools
import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harvester import files
from harvester.engines import Cheapest, Engine, Vectorised
from harvester.errors import CannotServeError, HarvesterError, InputError, SimulationError, invalid
from harvester.estimate import Estimate, Value
from harvester.provenance import provenance
from harvester.scaling import equations
from harvester.scene import Scene, read_value, split_key

COLUMNS = (
    "engine",
    "mean_square_voltage",
    "mean_square_voltage_stderr",
    "mean_power",
    "mean_power_stderr",
    "seconds",
    "error",
    "mean_power_bias",  # estimated error of step and model, where the engine knows one
    "warnings",
)
_ANSWER = ("mean_square_voltage", "mean_power", "seconds")  # a row without these is cut off
_MOST_POINTS = 100_000
_TOGETHER = 256  # points that an engine of formulas computes at once


@dataclass(frozen=True)
class Axis:
    """A scene key and the values that it takes, in SI units."""

    key: str
    values: tuple[float, ...]

    @property
    def logarithmic(self) -> bool:
        """Whether a plot shows it best on a logarithmic axis."""
        return min(self.values) > 0.0 and max(self.values) >= 10.0 * min(self.values)


def axis(text: str) -> Axis:
    """``load.resistance=1k:10M:25`` (spaced evenly, by ratio where the ends differ tenfold) or ``=1k,2k,5k``.

    Raises
    ------
    InputError
        for a key that no scene has, or values that it cannot take.
    """
    key, equals, values = text.partition("=")
    if not equals:
        raise invalid("--vary", "be KEY=FROM:TO:COUNT or KEY=A,B,C", text)
    split_key(key)
    parts = values.split(":")
    if len(parts) == 1:
        return Axis(key, tuple(read_value(key, part) for part in values.split(",")))
    if len(parts) != 3 or not re.fullmatch("[0-9]{1,6}", parts[2]) or not 1 <= int(parts[2]) <= _MOST_POINTS:
        raise invalid("--vary", f"be KEY=FROM:TO:COUNT with a whole COUNT between 1 and {_MOST_POINTS}", text)
    low, high, count = read_value(key, parts[0]), read_value(key, parts[1]), int(parts[2])
    if min(low, high) > 0.0 and max(low, high) >= 10.0 * min(low, high):
        grid = np.geomspace(low, high, count)
    else:
        grid = np.linspace(low, high, count)
    return Axis(key, tuple(float(v) for v in grid))


@dataclass
class Table:
    """Rows of a sweep as they are written: the varied keys, then `COLUMNS`, all as text."""

    axes: tuple[Axis, ...]
    rows: list[dict[str, str]] = field(default_factory=list)

    def text(self) -> str:
        """The CSV file."""
        out = io.StringIO()
        writer = csv.DictWriter(out, [*(a.key for a in self.axes), *COLUMNS], lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.rows)
        return out.getvalue()

    def column(self, name: str, engine: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """One column of one engine's rows as numbers; nan where a point failed."""
        values = [row[name] for row in self.rows if row["engine"] == engine]
        return np.array([float(v) if v else math.nan for v in values])


def sweep(
    scene: Scene,
    axes: Sequence[Axis],
    engines: Sequence[Engine],
    out: str | Path,
    resume: bool = False,
    tick: Callable[[str], None] | None = None,
) -> Table:
    """Run every engine at every point of the grid of ``axes``; write sweep.csv, sweep.png, provenance.json.

    Each finished point is on disk before the next begins; ``resume`` keeps those of an earlier
    run of the same sweep and computes the others, also those that failed.  A point that fails is
    a row with its error.  ``tick`` is told each row that is done.

    Raises
    ------
    InputError
        for a point that no scene can be, before anything is computed, an option that no engine
        takes, a folder that cannot be written, or an earlier sweep that was another one.
    HarvesterError
        when every point failed, the last error; the table is written all the same.
    """
    from harvester import figures

    _once("--vary", [a.key for a in axes])
    _once("--engine", [e.NAME for e in engines])
    points = _points(scene, axes)
    out = files.folder(out)
    table = Table(tuple(axes))
    whence = provenance(
        scene,
        vary={a.key: list(a.values) for a in axes},
        engines={e.NAME: {k: v for k, v in vars(e).items() if v is not None and k != "budget"} for e in engines},
    )
    done = _earlier(out, table, whence) if resume else {}

    def save() -> None:
        names = ((*keys.values(), engine.NAME) for keys, _ in points for engine in engines)
        table.rows = [done[name] for name in names if name in done]
        files.write(out / "sweep.csv", table.text())

    save()  # before the provenance, which must never stand beside the rows of another sweep
    files.write(out / "provenance.json", json.dumps(whence, indent=2, default=str) + "\n")
    last: HarvesterError | None = None
    many = [engine for engine in engines if isinstance(engine, Vectorised)]
    for at in range(0, len(points), _TOGETHER):
        some = points[at : at + _TOGETHER]
        for quick in many:
            todo = [(keys, point) for keys, point in some if (*keys.values(), quick.NAME) not in done]
            for (keys, _), answer in zip(todo, quick.run_many([point for _, point in todo]), strict=True):
                last = _keep(done, keys, quick.NAME, answer) or last
        if many:
            save()
        for keys, point in some:
            for engine in engines:
                if (*keys.values(), engine.NAME) not in done:
                    last = _keep(done, keys, engine.NAME, _run(engine, point)) or last
                    save()
                if tick is not None:
                    tick(engine.NAME)
    if last is not None and all(row["error"] for row in table.rows):
        raise last
    files.write(out / "sweep.png", figures.sweep(table, scene.title, scene.physical))
    return table


def _run(engine: Engine, point: Scene) -> Estimate | HarvesterError:
    try:
        return engine.run(point)
    except (SimulationError, CannotServeError) as error:
        return error


def _keep(
    done: dict[tuple[str, ...], dict[str, str]], keys: dict[str, str], engine: str, answer: Estimate | HarvesterError
) -> HarvesterError | None:
    """Make a row of an answer; returns it if it is an error."""
    if isinstance(answer, Estimate):
        done[*keys.values(), engine] = keys | _row(answer)
        return None
    done[*keys.values(), engine] = keys | dict.fromkeys(COLUMNS, "") | {"engine": engine, "error": str(answer)}
    return answer


def _once(option: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{option} must name each only once, but names {name!r} twice")


def _points(scene: Scene, axes: Sequence[Axis]) -> list[tuple[dict[str, str], Scene]]:
    """The grid: the varied keys as the table shows them, and the scene; InputError where there can be none."""
    count = math.prod(len(a.values) for a in axes)
    if count > _MOST_POINTS:
        raise invalid("--vary", f"make at most {_MOST_POINTS} points", count)
    points = []
    for values in itertools.product(*(a.values for a in axes)):
        point = scene
        for a, value in zip(axes, values, strict=True):
            point = point.vary(a.key, value)
        equations(point)
        points.append(({a.key: repr(float(value)) for a, value in zip(axes, values, strict=True)}, point))
    return points


def _row(estimate: Estimate) -> dict[str, str]:
    def text(value: float | None) -> str:
        return "" if value is None else f"{value:.9g}"

    return {
        "engine": estimate.engine,
        "mean_square_voltage": text(estimate.mean_square_voltage.value),
        "mean_square_voltage_stderr": text(estimate.mean_square_voltage.stderr),
        "mean_power": text(estimate.mean_power.value),
        "mean_power_stderr": text(estimate.mean_power.stderr),
        "seconds": f"{estimate.seconds:.4g}",
        "error": "",
        "mean_power_bias": text(_bias(estimate.mean_power)),
        "warnings": "; ".join(estimate.warnings),
    }


def _bias(value: Value) -> float | None:
    known = [error for error in (value.bias, value.model) if error is not None]
    return sum(known) if known else None


def _earlier(out: Path, table: Table, whence: dict[str, Any]) -> dict[tuple[str, ...], dict[str, str]]:
    """The rows of an earlier run of the same sweep that hold an answer; none where its files are damaged."""
    try:
        before = json.loads((out / "provenance.json").read_text())
        text = (out / "sweep.csv").read_text()
        rows = list(csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1])))  # a last line without end was cut off
    except (OSError, ValueError, csv.Error):
        return {}
    now = json.loads(json.dumps(whence, default=str))
    for what in ("scene_digest", "netlist", "vary", "engines"):
        if not isinstance(before, dict) or before.get(what) != now[what]:
            raise InputError(
                f"--resume must continue the same sweep, but {what} in {str(out)!r} is another: use another --out"
            )
    keys = [a.key for a in table.axes]
    whole = [row for row in rows if set(row) == {*keys, *COLUMNS} and all(_is_number(row[k]) for k in _ANSWER)]
    cheapest = Cheapest.NAME in now["engines"]  # whose rows bear the name of the engine that it chose
    return {
        (*(row[k] for k in keys), Cheapest.NAME if cheapest else row["engine"]): row
        for row in whole
        if row["error"] == ""
    }


def _is_number(text: str | None) -> bool:
    try:
        return text is not None and math.isfinite(float(text))
    except ValueError:
        return False
