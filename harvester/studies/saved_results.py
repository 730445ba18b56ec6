"""Results that a study wrote into a folder, read back with their errors, units and provenance."""

import csv
import io
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from harvester.errors import InputError, SimulationError, invalid, names_arguments, shown
from harvester.machine import files
from harvester.presentation.result import TableResult
from harvester.presentation.table import PARTS, Cell, Column, Table
from harvester.studies.sweep.points import Points, axis_of
from harvester.studies.sweep.rows import SweepRow, read_cells
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.uncertainty.value import Value

MOST_BYTES = 256_000_000  # of a file
SWEEP = "sweep"
BESIDE = frozenset({"levels"})  # tables of a folder in addition to its main one
_HEAD = re.compile(r"(.*?)(?: \(([^()]*(?:\([^()]*\))?[^()]*)\))?", re.DOTALL)
_TRUTH = {"True": True, "False": False}


class SavedTable(TableResult):
    """A table that a study wrote, with its provenance.

    Attributes
    ----------
    study : str
        the name of the file without its ending, such as ``response``.
    rows : Table
        its rows; a number with an error is a `Value`.
    about : mapping
        the provenance: versions, scene, seed, machine; empty if the study writes none.

    Examples
    --------
    >>> import harvester as hv
    >>> import tempfile
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = hv.motion(scene, duration=50.0, execution=hv.Execution(out=folder))
    ...     saved = hv.read(folder)
    >>> saved.study, len(saved.table) == len(path.time), saved.about["seed"]
    ('motion', True, 0)
    """

    DERIVED = ("table",)
    INTERNAL = frozenset({"rows", "about"})
    SHORT = ("study", "table")

    study: str
    rows: Table
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def physical(self) -> bool:
        """Whether its numbers have SI units."""
        scene = self.about.get("scene")
        return not isinstance(scene, dict) or "nondimensional" not in scene

    @property
    def table(self) -> Table:
        """Its rows; a number with an error is a `Value`."""
        return self.rows


@names_arguments
def read(path: str | Path) -> SweepTable | SavedTable:
    """Read back the results that a study wrote with ``out``.

    Parameters
    ----------
    path : str or path
        The folder, or one of its CSV files, if it has several.

    Returns
    -------
    SweepTable or SavedTable
        A sweep as `sweep` returned it, with ``plot``; the table of any other study.  Numbers are
        in SI units.  The columns ``NAME``, ``NAME_stderr`` and others of a file are one column of `Value`.

    Raises
    ------
    InputError
        There is no such file, several, or one that no study wrote.

    Examples
    --------
    >>> import harvester as hv
    >>> import tempfile
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = hv.sweep(
    ...         scene,
    ...         vary={"nondimensional.mu": [0.5, 2.0]},
    ...         engines=[hv.Averaged()],
    ...         execution=hv.Execution(out=folder),
    ...     )
    ...     again = hv.read(folder)
    >>> again.rows[1].mean_power == found.rows[1].mean_power
    True
    """
    if not isinstance(path, str | os.PathLike):
        raise invalid("`path`", "be the path of a folder or a CSV file", path)
    file = _file(Path(path))
    text = files.read(file, "`path`", MOST_BYTES).decode("utf-8", errors="replace")
    try:
        heads, *rows = csv.reader(io.StringIO(text), strict=True)
    except (ValueError, csv.Error):
        heads, rows = [], []
    if not heads or any(len(row) != len(heads) for row in rows):
        raise invalid(
            "`path`", "be a CSV file of a study, with as many cells in each row", str(file)
        )
    named = [_head(head)[0] for head in heads]
    for name in named:
        if named.count(name) > 1:
            raise InputError(
                f"`path` must name each of its columns once, but {shown(str(file))} has several "
                f"{shown(name)}"
            )
    about = _provenance(file.parent / "provenance.json")
    if file.stem == SWEEP:
        return _sweep(file, heads, rows, about)
    columns = dict(zip(heads, zip(*rows, strict=True) if rows else [()] * len(heads), strict=True))
    return SavedTable(file.stem, Table(tuple(_columns(file, columns))), about)


def _file(path: Path) -> Path:
    """The CSV file that is meant."""
    if not path.is_dir():
        return path
    tables = {p.stem: p for p in sorted(path.glob("*.csv"))}
    main = [stem for stem in tables if stem not in BESIDE] or [*tables]
    if len(main) != 1:
        names = ", ".join(f"{stem}.csv" for stem in tables)
        has = f"it has {names}: name one of these files" if tables else "it has none"
        raise InputError(
            "`path` must be a folder with one CSV file of a study, "
            f"but {shown(str(path))} is not: {has}"
        )
    return tables[main[0]]


def _provenance(path: Path) -> dict[str, Any]:
    """The provenance of a table; empty without such a file."""
    if not path.exists():
        return {}
    try:
        about = json.loads(files.read(path, "`path`", MOST_BYTES))
    except (ValueError, RecursionError):
        about = None
    if not isinstance(about, dict):
        raise invalid("`path`", "hold a provenance.json that a study wrote", str(path))
    return about


def _sweep(
    file: Path, heads: Sequence[str], rows: Sequence[Sequence[str]], about: dict[str, Any]
) -> SweepTable:
    """The table of a sweep, whose points are those of its provenance."""
    import harvester.engines.selection  # noqa: F401  # the colours of its engines in a figure

    vary = about.get("vary")
    if not isinstance(vary, dict) or not vary:
        raise invalid("`path`", "be in the folder of the provenance.json of its sweep", str(file))
    try:
        axes = tuple(axis_of(key, values) for key, values in vary.items())
        points = Points(axes, about.get("points") == "list", argument="`path`")
    except (TypeError, ValueError) as error:
        raise invalid("`path`", "have the provenance.json of its sweep", str(file)) from error
    left: dict[tuple[str, ...], list[int]] = {}
    for point in range(len(points)):
        left.setdefault(tuple(map(repr, points.values(point))), []).append(point)
    answers: list[SweepRow] = []
    numbers: list[int] = []
    seen: dict[tuple[str, ...], int] = {}
    for line, row in enumerate(rows, 2):
        cells = dict(zip(heads, row, strict=True))
        texts = tuple(cells.get(key, "") for key in points.keys)
        answer = (
            SweepRow(cells.get("engine", ""), error=cells["error"])
            if cells.get("error")
            else read_cells(cells)
        )
        if answer is None or texts not in left:
            raise InputError(
                f"`path` must hold a whole sweep, but line {line} of {shown(str(file))} "
                "is not one of its rows"
            )
        which = (answer.engine, *texts)
        several = left[texts]
        number = several[min(seen.get(which, 0), len(several) - 1)]
        seen[which] = seen.get(which, 0) + 1
        answers.append(answer.at(points.varied(number)))
        numbers.append(number)
    return SweepTable(axes, tuple(answers), tuple(numbers), points.listed, about)


def _columns(file: Path, columns: Mapping[str, Sequence[str]]) -> Iterator[Column]:
    """The columns of a table, with the parts of a value as one."""
    parsed = {}
    for head, texts in columns.items():
        name, unit = _head(head)
        parsed[name] = (unit, _cells(texts))
    parts = {
        name: [name + end for end in PARTS]
        for name in parsed
        if all(name + end in parsed for end in PARTS)
    }
    inner = {part for of in parts.values() for part in of[1:]}
    for name, (unit, cells) in parsed.items():
        if name in parts:
            of_parts = [parsed[part][1] for part in parts[name]]
            yield Column(name, _values(file, of_parts, unit), unit, uncertain=True)
        elif name not in inner:
            # a time without an error is that of a curve, not a mean
            yield Column(name, cells, unit, "time" if name == "time" else "")


def _head(head: str) -> tuple[str, str]:
    """The name and the unit of the head of a column."""
    match = _HEAD.fullmatch(head)
    assert match is not None
    return match[1], match[2] or ""


def _cells(texts: Sequence[str]) -> list[Cell]:
    """The cells of a column: numbers or truth values if all are, else texts; None for nothing."""
    if all(text in _TRUTH or not text for text in texts) and any(texts):
        return [_TRUTH.get(text) for text in texts]
    try:
        return [float(text) if text else None for text in texts]
    except ValueError:
        return [*texts]


def _values(file: Path, parts: Sequence[Sequence[Cell]], unit: str) -> list[Cell]:
    """The values whose parts are in columns, in the order of `PARTS`; None without a number."""
    names = [*PARTS.values()]
    values: list[Cell] = []
    for row in zip(*parts, strict=True):
        fields: dict[str, Any] = dict(zip(names, row, strict=True))
        del fields["error95"]  # which follows from the others
        fields["unknown"] = fields["unknown"] or ""
        try:
            if any((fields[size] or 0.0) < 0.0 for size in ("stderr", "dof", "bias", "model")):
                raise ValueError(fields)
            values.append(None if fields["value"] is None else Value(**fields, unit=unit))
        except (TypeError, ValueError, SimulationError) as error:
            raise invalid("`path`", "hold numbers with their errors", str(file)) from error
    return values
