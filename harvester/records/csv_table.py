"""One reader of CSV files for scenes, records and measurements: columns by their names, with their units, in SI.

It reads the files of loggers, analysers and spreadsheets: `Time`, `t [s]`, `X (mg)`, `freq_hz`,
`Acceleration / g`, a row of units below the names, ISO times, a decimal comma
(`harvester.records.csv_layout`).  pandas reads the rows.
"""

import io
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.machine import files
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.quantities.kinds import Kind
from harvester.quantities.units import LARGEST, prefix_factor
from harvester.records.csv_cells import columns_of, refuse_ragged, rows_of
from harvester.records.csv_layout import Layout, cells, layout
from harvester.records.json_records import as_csv
from harvester.records.plain_text import decoded, most_cells, refuse_forms
from harvester.records.preamble import NOTHING, Preamble

MOST_BYTES = 64_000_000
FEWEST_BESIDE = 3  # rows of numbers beside settings: one or two may be a setting of several numbers
MOST_COLUMNS = 1000
LONGEST_HEAD = 200  # letters above a column
_BRACKETS = re.compile(r"(.*?)\s*[(\[{<]\s*(.+?)\s*[)\]}>]")
_INNER_BRACKETS = re.compile(
    r"([^(\[]+?)\s*[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*[-:]?\s*([\w|' .:-]+)"
)  # Z[Ohm] Re
_OTHER_UNITS = (  # a name and its unit without brackets
    re.compile(r"(.+?)\s*/\s*(.+)"),
    re.compile(r"(.+)\s+in\s+(\S+)"),
    re.compile(r"(.+?)_([^_]+)"),
    re.compile(r"(.+_.+|.+)_([^_]+_[^_]+)"),
    re.compile(r"(.+)\s+(\S+)"),
)


@dataclass(frozen=True, eq=False)
class CsvColumn:
    """A column as it is written: ``head`` above it, the text of a row of units, its numbers with nan if missing.

    ``clock`` states that it holds times of day or dates, which became seconds from the first;
    ``texts`` are the cells of a column of words, which has no numbers.
    """

    head: str
    unit: str
    values: Floats
    index: int
    clock: bool = False
    texts: tuple[str, ...] | None = None

    @property
    def words(self) -> tuple[str, ...]:
        """The words of its name in small letters: "Acc_X (mg)" has "acc" and "x"."""
        return tuple(
            re.findall(r"[^\W_\d]+|\d+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", self.name).lower())
        )

    @property
    def name(self) -> str:
        """The text above it without a unit in brackets; else its number."""
        name, _ = self._parts
        return name or f"column {self.index + 1}"

    @property
    def _parts(self) -> tuple[str, str]:
        """The name and the unit in brackets of its head."""
        head = self.head.strip()
        match = _BRACKETS.fullmatch(head)
        if match is not None:
            return (match[1] or head).strip(), match[2]
        inner = _INNER_BRACKETS.fullmatch(head)
        return (f"{inner[1]} {inner[3]}".strip(), inner[2]) if inner is not None else (head, "")

    def scale(self, kind: Kind) -> tuple[float, int] | None:
        """The factor to SI and the power (`Kind.scale`) of its unit.

        None if it has none of that kind.
        """
        for unit in self.candidates():
            if (
                prefix_factor(unit) is not None
                and unit != kind.unit
                and not (kind.gravity and unit in "gG")
            ):
                continue  # a column named T is not a tera
            factor, power = kind.scale(unit)
            if factor is not None:
                return factor, power
        return None

    @property
    def stated(self) -> str:
        """The unit in brackets or in the row of units; empty if there is none."""
        return self.unit or self._parts[1]

    def candidates(self) -> list[str]:
        """The texts that may be its unit, the likeliest first."""
        if self.stated:
            return [self.stated]
        others = (pattern.fullmatch(self.head.strip()) for pattern in _OTHER_UNITS)
        return [*(m[2].replace("_", "/") for m in others if m), self.head.strip()]

    def in_si(self, kind: Kind) -> Floats | None:
        """Its numbers in SI units; None if its unit is not one of the kind."""
        scale = self.scale(kind)
        if scale is None:
            return None
        factor, power = scale
        return (
            self.values * factor
            if power == 1
            else np.copysign(self.values**2, self.values) * factor
        )


@dataclass(frozen=True, eq=False)
class CsvTable:
    """The columns of a file, and its other statements.

    ``bad`` are cells with a text that is not a finite number.

    ``facts`` are stated above the numbers, ``notes`` report omitted lines.  In a block
    of a long file ``before`` rows of data precede its first.
    """

    columns: tuple[CsvColumn, ...]
    remarks: tuple[str, ...]
    layout: Diagnostic
    bad: tuple[tuple[int, int, str], ...]  # row from 1, column from 0, text
    before: int = 0
    facts: Preamble = NOTHING
    notes: tuple[Diagnostic, ...] = ()

    @property
    def heads(self) -> str:
        """All heads in one text, as an error shows them."""
        return ",".join(column.head or column.name for column in self.columns)

    def find(self, predicate: Callable[[CsvColumn], bool]) -> list[CsvColumn]:
        """The columns for which the predicate holds."""
        return [column for column in self.columns if predicate(column)]


def read_table(path: str | Path, argument: str, most: int = MOST_BYTES) -> CsvTable:
    """Read a CSV file; errors begin with ``argument``.

    Raises InputError in one line for a file that cannot be read, is not a text, or has no row of
    numbers.
    """
    return table_of_text(decoded(files.read(path, argument, most), path, argument), path, argument)


def table_of_text(text: str, path: str | Path, argument: str) -> CsvTable:
    """The table of the text of a file; raises as `read_table`."""
    rewritten = as_csv(text, shown(str(path)), argument)
    text = text if rewritten is None else rewritten
    refuse_forms(text, path, argument)
    if (widest := most_cells(text)) > MOST_COLUMNS:
        raise InputError(
            f"{argument} must have at most {MOST_COLUMNS} columns, but {shown(str(path))} has {widest}"
        )
    rows = layout(text)
    if rows is None:
        raise InputError(
            f"{argument} must have rows of numbers below the names of its columns (CSV), "
            f"but {shown(str(path))} has none"
        )
    if rows.too_few_names:
        names = sum(map(bool, rows.heads))
        raise InputError(
            f"{argument} must have a name above each column, but {shown(str(path))} has {names} "
            f"names above {len(rows.heads)} columns: write a comma between names, not in numbers"
        )
    if rows.beside >= FEWEST_BESIDE:
        raise InputError(
            f"{argument} must have settings above its numbers, but {shown(str(path))} has "
            f"{rows.beside} rows of numbers next to them: delete the columns of settings"
        )
    table = table_of(rows, "\n".join(rows.rows), path, argument)
    return table if rewritten is None else replace(table, layout=note("json_records"))


def table_of(form: Layout, text: str, path: str | Path, argument: str) -> CsvTable:
    """The table of a text of rows; errors as of `read_table`."""
    if long := [text for text in (*form.heads, *form.units) if len(text) > LONGEST_HEAD]:
        raise InputError(
            f"{argument} must have names of columns of at most {LONGEST_HEAD} letters, but one has {len(long[0])}"
        )
    if not (form.words or form.joined or form.labelled):
        try:  # nothing but numbers, as most files have, a tenth as expensive
            frame = _frame(form, text, dtype=float, decimal=form.decimal)
            if np.isfinite(frame.to_numpy()).all():
                every = zip(form.heads, form.units, frame.to_numpy().T.copy(), strict=True)
                columns = tuple(
                    CsvColumn(head, unit, values, index)
                    for index, (head, unit, values) in enumerate(every)
                )
                return CsvTable(columns, form.remarks, _layout_note(form), (), facts=form.facts)
        except ValueError:
            pass
    return _table(form, text, path, argument)


def _frame(form: Layout, text: str, **options: Any) -> Any:
    """The cells as pandas reads them; ValueError for a row with too many cells."""
    import pandas as pd

    first = text.partition("\n")[0]  # whose further cells pandas drops
    if any(cell.strip() for cell in cells(first, form.delimiter)[form.raw_cells :]):
        raise ValueError("the first row has more cells than there are columns")
    return pd.read_csv(
        io.StringIO(text),
        sep=r"\s+" if form.delimiter == " " else form.delimiter,
        header=None,
        names=list(range(form.raw_cells)),
        index_col=False,
        skipinitialspace=True,
        **options,
    )


def _layout_note(form: Layout) -> Diagnostic:
    return note("file_layout", delimiter=form.delimiter, decimal=form.decimal)


def _table(form: Layout, text: str, path: str | Path, argument: str) -> CsvTable:
    """The table if some cells are texts, or missing."""
    lines, notes = rows_of(form, text)
    try:
        frame = _frame(form, "\n".join(lines), dtype=str, keep_default_na=False)
    except ValueError:  # pandas' ParserError too: a row with more cells than there are columns
        raise refuse_ragged(form, lines, path, argument) from None
    columns, bad = [], []
    for column in columns_of(form, frame, argument):
        k = column.column
        bad += [(row + 1, k, text) for row, text in column.lost]
        head = column.head or form.heads[k]
        if head or column.texts is not None or np.isfinite(column.values).any():
            columns.append(
                CsvColumn(head, form.units[k], column.values, k, column.clock, column.texts)
            )
    every = tuple(columns)
    remarks = form.remarks
    return CsvTable(
        every, remarks, _layout_note(form), tuple(sorted(bad)), facts=form.facts, notes=tuple(notes)
    )


def refuse_summary(table: CsvTable, key: str) -> None:
    """Refuse lines of a summary below the rows, for readers that do not report them."""
    for line in table.notes:
        if line.code == "lines_below":
            first = shown(line.numbers["first"])
            raise InputError(
                f"{key} must end with a row of numbers, but ends with {first}: delete it"
            )


def check_numbers(table: CsvTable, column: CsvColumn, values: Floats, key: str) -> None:
    """Refuse a column with a value that is missing, no number, or too large, with an InputError that names the row."""
    wrong = ~(np.abs(values) <= LARGEST)
    if not wrong.any():
        return
    row = int(wrong.argmax()) + 1
    raw = column.values[row - 1]
    text = next(
        (text for r, p, text in table.bad if (r, p) == (row, column.index)),
        "" if math.isnan(raw) else f"{raw:g}",
    )
    raise invalid(
        f"{key} column {column.name!r} row {table.before + row}",
        f"be a number of at most {LARGEST:g} in size",
        text,
    )
