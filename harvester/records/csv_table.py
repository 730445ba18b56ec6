"""One reader of CSV files for scenes, records and measurements: columns by their names, with their units, in SI.

It takes what loggers, analysers and spreadsheets write: `Time`, `t [s]`, `X (mg)`, `freq_hz`,
`Acceleration / g`, a row of units below the names, ISO times, a decimal comma
(`harvester.records.csv_layout`).  pandas reads the rows.
"""

import io
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.machine import files
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.quantities.kinds import Kind
from harvester.quantities.units import LARGEST, prefix_factor
from harvester.records.csv_layout import CLOCK, Layout, layout, most_cells, plain_lines

MOST_BYTES = 64_000_000
MOST_COLUMNS = 1000
LONGEST_HEAD = 200  # letters above a column
_BRACKETS = re.compile(r"(.*?)\s*[(\[{<]\s*(.+?)\s*[)\]}>]")
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

    ``clock`` states that it holds times of day or dates, which became seconds from the first.
    """

    head: str
    unit: str
    values: Floats
    index: int
    clock: bool = False

    @property
    def words(self) -> tuple[str, ...]:
        """The words of its name in small letters: "Acc_X (mg)" has "acc" and "x"."""
        return tuple(
            re.findall(r"[^\W_\d]+|\d+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", self.name).lower())
        )

    @property
    def name(self) -> str:
        """What stands above it, without a unit in brackets."""
        match = _BRACKETS.fullmatch(self.head.strip())
        return (match[1] if match and match[1] else self.head).strip()

    def scale(self, kind: Kind) -> tuple[float, int] | None:
        """The factor to SI and the power (`Kind.scale`) of its unit; None if it has none of that kind."""
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
        """The unit that is in brackets or in the row of units; empty if absent."""
        match = _BRACKETS.fullmatch(self.head.strip())
        return self.unit or (match[2] if match else "")

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
    """The columns of a file, and what it says beside them; ``bad`` are cells with a text that is not a finite number.

    For a block of a long file ``before`` rows of data stand before its first.
    """

    columns: tuple[CsvColumn, ...]
    remarks: tuple[str, ...]
    layout: Diagnostic
    bad: tuple[tuple[int, int, str], ...]  # row from 1, column from 0, text
    before: int = 0

    @property
    def heads(self) -> str:
        """All heads in one text, as an error shows them."""
        return ",".join(column.head for column in self.columns)

    def find(self, predicate: Callable[[CsvColumn], bool]) -> list[CsvColumn]:
        """The columns for which the predicate holds."""
        return [column for column in self.columns if predicate(column)]


def read_table(path: str | Path, argument: str, most: int = MOST_BYTES) -> CsvTable:
    """Read a CSV file; errors begin with ``argument``.

    Raises InputError in one line for a file that cannot be read, is not a text, or has no row of
    numbers.
    """
    text = decoded(files.read(path, argument, most), path, argument)
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
    return table_of(rows, "\n".join(rows.rows), path, argument)


def decoded(data: bytes, path: str | Path, argument: str) -> str:
    """The text of a file in UTF-8, UTF-16 with its mark, or the letters of Windows."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if b"\x00" in data:
        raise InputError(
            f"{argument} must be a CSV file in UTF-8, but {shown(str(path))} holds bytes that are no text"
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def table_of(form: Layout, text: str, path: str | Path, argument: str) -> CsvTable:
    """The table of a text of rows; errors as of `read_table`."""
    count = len(form.heads)
    if long := [text for text in (*form.heads, *form.units) if len(text) > LONGEST_HEAD]:
        raise InputError(
            f"{argument} must have names of columns of at most {LONGEST_HEAD} letters, but one has {len(long[0])}"
        )
    try:  # nothing but numbers, as most files have, a tenth as dear
        frame = _frame(form, text, dtype=float, decimal=form.decimal)
        if np.isfinite(frame.to_numpy()).all():
            every = zip(
                form.heads, form.units, frame.to_numpy().T.copy(), range(count), strict=True
            )
            return CsvTable(
                tuple(CsvColumn(*entries) for entries in every),
                form.remarks,
                _layout_note(form),
                (),
            )
    except ValueError:
        pass
    return _table(form, "\n".join(plain_lines(text)), path, argument)


def _frame(form: Layout, text: str, **options: Any) -> Any:
    import pandas as pd

    return pd.read_csv(
        io.StringIO(text),
        sep=r"\s+" if form.delimiter == " " else form.delimiter,
        header=None,
        names=list(range(len(form.heads))),
        index_col=False,
        skipinitialspace=True,
        **options,
    )


def _layout_note(form: Layout) -> Diagnostic:
    return note("file_layout", delimiter=form.delimiter, decimal=form.decimal)


def _table(form: Layout, text: str, path: str | Path, argument: str) -> CsvTable:
    """The table if some cells are texts, or missing."""
    import pandas as pd

    count = len(form.heads)
    try:
        frame = _frame(form, text, dtype=str, keep_default_na=False)
    except (
        ValueError
    ) as error:  # pandas' ParserError too: a row with more cells than there are columns
        why = str(error).splitlines()[0]
        raise InputError(
            f"{argument} must be a table, but {shown(str(path))} is not: {why}"
        ) from None
    columns, bad = [], []
    for index in range(count):
        cells = frame[index].fillna("").str.strip()
        if form.decimal == ",":
            cells = cells.str.replace(",", ".", regex=False)
        values = np.asarray(pd.to_numeric(cells, errors="coerce"), float)
        lost = np.flatnonzero(~np.isfinite(values))
        clock = len(lost) > 0 and bool(CLOCK.fullmatch(cells.iloc[lost[0]]))
        if clock:
            values = _seconds(cells, f"{argument} column {form.heads[index]!r}")
            lost = np.flatnonzero(~np.isfinite(values))
        values = np.where(np.isfinite(values), values, math.nan)
        bad += [(int(row) + 1, index, cells.iloc[row]) for row in lost if cells.iloc[row]]
        columns.append(CsvColumn(form.heads[index], form.units[index], values, index, clock))
    full = tuple(column for column in columns if column.head or np.isfinite(column.values).any())
    return CsvTable(full, form.remarks, _layout_note(form), tuple(sorted(bad)))


def _seconds(cells: "object", key: str) -> Floats:
    """Dates and times of day as seconds from the first; a time of day that jumps back is the next day's.

    Raises InputError, which begins with ``key``, if none of the dates is one of the calendar.
    """
    import pandas as pd

    texts = pd.Series(cells).str.replace(",", ".", regex=False).str.replace("Z", "", regex=False)
    if texts.str.contains(r"\d[T ]\d", regex=True).any():
        first = str(texts[texts.str.contains(r"\d[T ]\d", regex=True)].iloc[0])
        if re.match(r"\d\d\.\d\d\.\d{4}", first):  # each with a fraction of a second or without
            texts = texts.str.replace(r"[T ]+", " ", regex=True)
            texts = texts.where(texts.str.contains(r":\d\d\.", regex=True), texts + ".0")
            stamps = pd.to_datetime(texts, format="%d.%m.%Y %H:%M:%S.%f", errors="coerce", utc=True)
        else:
            stamps = pd.to_datetime(texts, format="ISO8601", errors="coerce", utc=True)
        if not stamps.notna().any():
            raise invalid(key, "have dates of the calendar, such as 2024-05-01 12:00:00", first)
        return np.asarray((stamps - stamps.dropna().iloc[0]).dt.total_seconds(), float)
    spans = np.asarray(pd.to_timedelta(texts, errors="coerce").dt.total_seconds(), float)
    back = np.nan_to_num(np.diff(spans, prepend=spans[0])) < -43200.0
    spans = spans + 86400.0 * np.cumsum(back)
    return np.asarray(spans - spans[np.isfinite(spans)][0] if np.isfinite(spans).any() else spans)


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
