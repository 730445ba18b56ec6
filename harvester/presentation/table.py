"""The one table: typed columns, and CSV, pandas, xarray and the terminal's lines made of them.

A cell is a number, a text, a truth value, None, or a `harvester.uncertainty.value.Value`, whose
parts become columns of their own wherever cells are plain: ``mean_power``, ``mean_power_stderr``,
``mean_power_dof``, ...

Long because all forms of the one table are together.
"""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from harvester.arrays import Floats
from harvester.presentation.columns import columns
from harvester.presentation.glossary import term
from harvester.uncertainty.value import Value, amount, percent, two_digits

if TYPE_CHECKING:
    import pandas
    import xarray

Cell: TypeAlias = Value | float | int | str | bool | None
# The parts of a Value in plain columns: suffix and attribute.
PARTS = {
    "": "value",
    "_stderr": "stderr",
    "_dof": "dof",
    "_step_bias": "bias",
    "_model_bias": "model",
    "_error95": "error95",
    "_unknown": "unknown",
}
MOST_ROWS = 60  # that a terminal or a notebook shows
WIDEST = 100  # letters of a line
FAILED, UNKNOWN = "failed", "not known"


@dataclass(frozen=True)
class Column:
    """A column: its name (of the glossary, or a scene key), its cells, and the unit of its numbers ("" for none).

    ``units`` are those of each cell, if they differ from row to row, as those of scene keys do.
    ``exact`` numbers are written into files to the last digit.  ``uncertain`` states that its cells
    are values with errors, so that a file has the columns of their errors also if no cell has one.
    """

    name: str
    cells: "Sequence[Cell] | Floats"
    unit: str = ""
    label: str = ""
    units: Sequence[str] = ()
    exact: bool = False
    uncertain: bool = False

    @property
    def head(self) -> str:
        """The text above it."""
        return self.label or term(self.name).label

    @property
    def has_errors(self) -> bool:
        """Whether its numbers are values with errors."""
        return self.uncertain or any(isinstance(cell, Value) for cell in self.cells)

    def file_head(self, name: str) -> str:
        """The head of a plain column in a file: its unit in brackets, unless the name states it."""
        unit = _unit(self, name)
        states_it = unit in ("", "1") or term(self.name).kind == "clock"
        return name if states_it else f"{name} ({unit})"

    def plain(self) -> dict[str, list[Any]]:
        """Its cells without `Value`: one column, or one for each of `PARTS`."""
        if not self.has_errors:
            return {self.name: [*self.cells]}
        return {
            self.name + end: [getattr(cell, part, None) for cell in self.cells]
            for end, part in PARTS.items()
        }

    def shown(self) -> dict[str, list[str]]:
        """Its cells as people read them, and behind values their total errors at 95 %."""
        units = self.units or [self.unit] * len(self.cells)
        clock = term(self.name).kind == "clock"
        texts = [_shown(cell, unit, clock) for cell, unit in zip(self.cells, units, strict=True)]
        if not self.has_errors:
            return {self.head: texts}
        return {self.head: texts, "error, 95 %": [error_in_percent(cell) for cell in self.cells]}


@dataclass(frozen=True)
class Table:
    """Columns of equal length, with a title.

    >>> from harvester.presentation.table import Column, Table
    >>> from harvester.uncertainty.value import Value
    >>> powers = [Value(8.4e-6, stderr=1e-7, bias=1e-8, dof=2), Value(9e-6, stderr=1e-7, unknown="the step")]
    >>> table = Table((Column("load.resistance", [1e5, 1e6], "ohm"), Column("mean_power", powers, "W")))
    >>> print(table)
    load.resistance  mean power  error, 95 %
           100 kohm      8.4 uW        5.2 %
             1 Mohm        9 uW  at least 2.2 %
    """

    columns: tuple[Column, ...]
    title: str = ""
    index: tuple[str, ...] = ()  # columns that name a row: the axes of its dataset
    first: tuple[str, ...] = ()  # names of plain columns that stand before the others in files

    def __post_init__(self) -> None:
        assert len({len(column.cells) for column in self.columns}) <= 1, [
            len(column.cells) for column in self.columns
        ]

    def __len__(self) -> int:
        return len(self.columns[0].cells) if self.columns else 0

    def __getitem__(self, name: str) -> "Sequence[Cell] | Floats":
        return next(column.cells for column in self.columns if column.name == name)

    def cells_or_none(self, name: str) -> "Sequence[Cell] | Floats":
        """The cells of a column, each None if there is not such a column."""
        return next(
            (column.cells for column in self.columns if column.name == name), [None] * len(self)
        )

    def plain(self) -> dict[str, list[Any]]:
        """All columns without `Value`, by name."""
        cells_of = {
            name: cells for column in self.columns for name, cells in column.plain().items()
        }
        return {name: cells_of[name] for name in self.first} | cells_of

    def as_json(self) -> list[dict[str, Any]]:
        """One object a row."""
        from harvester.presentation.plain import plain

        names = [column.name for column in self.columns]
        return [
            dict(zip(names, map(plain, row), strict=True))
            for row in zip(*(column.cells for column in self.columns), strict=True)
        ]

    def csv(self, units: bool = True) -> str:
        """The text of a CSV file; with ``units``, these are in brackets in its heads."""
        return "".join(self.csv_lines(units))

    def csv_lines(self, units: bool = True) -> Iterator[str]:
        """The lines of a CSV file: nine digits, and an empty cell if there is nothing."""
        of = {name: column for column in self.columns for name in column.plain()}
        cells_of = {
            name: map(repr, cells) if of[name].exact else cells
            for name, cells in self.plain().items()
        }
        heads = [of[name].file_head(name) if units else name for name in cells_of]
        return csv_lines(heads, zip(*cells_of.values(), strict=True))

    def npz(self) -> bytes:
        """The bytes of an NPZ file (numpy.load): an array for each column, and ``units``, their names and units."""
        out = io.BytesIO()
        of = {name: _unit(column, name) for column in self.columns for name in column.plain()}
        arrays: dict[str, Any] = {name: _typed(cells) for name, cells in self.plain().items()}
        np.savez_compressed(out, units=np.array([*of.items()]), **arrays)
        return out.getvalue()

    def to_pandas(self) -> "pandas.DataFrame":
        """A data frame: numbers as numbers, nan if absent."""
        import pandas

        return pandas.DataFrame({name: _typed(cells) for name, cells in self.plain().items()})

    def to_xarray(self) -> "xarray.Dataset":
        """A dataset over the columns of ``index`` (over the rows if absent).

        Units are attributes.
        """
        frame = self.to_pandas()
        dataset = (
            frame.set_index(list(self.index)) if self.index else frame.rename_axis("row")
        ).to_xarray()
        for column in self.columns:
            for name in column.plain():
                dataset[name].attrs = {"long_name": column.head} | (
                    {"units": unit} if (unit := _unit(column, name)) else {}
                )
        return dataset  # type: ignore[no-any-return]

    def shown(self) -> tuple[list[str], list[list[str]]]:
        """The heads, and the rows as texts."""
        shown = [shown_column for column in self.columns for shown_column in column.shown().items()]
        return [head for head, _ in shown], [
            list(row) for row in zip(*(cells for _, cells in shown), strict=True)
        ]

    def lines(self, indent: str = "", elsewhere: str = "") -> list[str]:
        """The lines of a terminal: for a long table the first and the last rows.

        ``elsewhere`` names who has all.
        """
        few = self if len(self) <= MOST_ROWS else self._ends()
        head, body = few.shown()
        lines = columns([head, *body], indent, right=True)
        if max(map(len, lines)) > WIDEST:  # keys without their tables
            lines = columns([[name.rpartition(".")[2] for name in head], *body], indent, right=True)
        if len(few) < len(self):
            more = f"({len(self) - len(few)} more rows" + (
                f" in {elsewhere})" if elsewhere else ")"
            )
            lines.insert(1 + MOST_ROWS // 2, indent + more)
        return lines

    def __str__(self) -> str:
        return "\n".join(([self.title] if self.title else []) + self.lines())

    def __repr__(self) -> str:
        return f"Table({len(self)} rows: {', '.join(column.name for column in self.columns)})"

    def _repr_html_(self) -> str:
        from harvester.presentation import html

        head, body = (self if len(self) <= MOST_ROWS else self._ends()).shown()
        return html.table(self.title, head, body)

    def head(self, rows: int) -> "Table":
        """Its first rows."""
        return self.rows(range(min(rows, len(self))))

    def rows(self, indices: Sequence[int]) -> "Table":
        """Some of its rows."""

        def chosen(column: Column) -> Column:
            units = [column.units[k] for k in indices] if column.units else ()
            return replace(column, cells=[column.cells[k] for k in indices], units=units)

        return replace(self, columns=tuple(map(chosen, self.columns)))

    def _ends(self) -> "Table":
        half = MOST_ROWS // 2
        return self.rows([*range(half), *range(len(self) - half, len(self))])


def csv_lines(heads: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    """The lines of a CSV file, its header first.

    Numbers have nine digits, and None is an empty cell.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(heads)
    for row in rows:
        yield out.getvalue()
        out.seek(0)
        out.truncate()
        writer.writerow([f"{cell:.9g}" if isinstance(cell, float) else cell for cell in row])
    yield out.getvalue()


def error_in_percent(cell: Cell) -> str:
    """The total error of a value at 95 % in percent of it, or that a part of it is not known."""
    if not isinstance(cell, Value) or cell.value == 0.0:
        return ""
    if cell.error95 is not None:
        return percent(cell.error95, cell.value)
    return f"at least {percent(cell.known_error95, cell.value)}" if cell.known_error95 else UNKNOWN


def _shown(cell: Cell, unit: str, clock: bool) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool | str):
        return cell if isinstance(cell, str) else ("yes" if cell else "no")
    if isinstance(cell, float) and not math.isfinite(cell):
        return f"{cell:g}"
    if clock:
        return two_digits(float(cell.value if isinstance(cell, Value) else cell))
    if unit == "%":
        return f"{float(cell.value if isinstance(cell, Value) else cell):.4g} %"
    return amount(float(cell.value if isinstance(cell, Value) else cell), unit)


def _unit(column: Column, name: str) -> str:
    """The unit of a plain column: that of its numbers, but for counts and texts."""
    return "" if name.removeprefix(column.name) in ("_dof", "_unknown") else column.unit


def _typed(cells: Sequence[Any]) -> Any:
    """An array of numbers if all cells are numbers or None, else of objects."""
    if all(cell is None or isinstance(cell, float | int | np.number) for cell in cells):
        return np.array([math.nan if cell is None else cell for cell in cells])
    return np.array(cells, dtype=object)
