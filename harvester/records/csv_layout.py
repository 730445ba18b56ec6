"""The layout of a logger's CSV file: its delimiter, decimal sign, names and units of columns, and the first data row.

Nothing is asked of the file but that its rows hold numbers or times: the layout that makes most
lines such rows, and whose header has as many cells as they have, is the file's.  A column may hold
words in all rows, as a status, and a name may precede each number (`x: 0.12`).
"""

import csv
import itertools
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from harvester.errors import escaped
from harvester.quantities.kinds import ACCELERATION_PSD
from harvester.quantities.units import is_unit
from harvester.records.clock_times import is_clock
from harvester.records.preamble import NOTHING, Preamble, preamble

DELIMITERS = ("\t", ";", ",", "|", " ")
LOOKED_AT = 300  # lines that tell the layout
LONGEST_NUMBER = 64  # letters of a number, a time or a unit: a longer cell is none of them
COMMENTS = ("#", "%", "//", "!")
MISSING = frozenset(
    ("", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "ovr", "ovl", "#n/a")
)
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")
_SEMICOLON_REMARK = re.compile(
    r"\s*;+(?:\s+[A-Za-z][^;]*|[A-Za-z][^;]*,[^;]*)"
)  # a comment, where semicolons do not separate columns
_LABEL = re.compile(
    r"(?<![\w.:])([A-Za-z][A-Za-z_]{0,15}\s*[:=]|[ag]?[xyztXYZT](?=[-+.\d]))\s*(?=[-+.\d])"
)
_LISTS = frozenset(("header", "headers", "columns", "fields", "channels"))  # before names
_KINDS = frozenset(("", "smp", "avg", "max", "min", "std", "tot", "smm", "med"))  # of values (TOA5)
_SECTION = re.compile(r"\s*\*[A-Za-z_]+[\s;,]*")  # *UNIT, as MSR loggers write it
_SEPARATOR = re.compile(r"[-=_+|\s]+")
_WHOLE = re.compile(r"[+-]?\d+")
_DECIMAL = re.compile(r"[+-]?\d*\.\d+(?:[eE][+-]?\d+)?")
_FRACTION = re.compile(r"\d{1,9}(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class Layout:
    """The layout of a file: ``heads`` and ``units`` have a text for each column, empty if absent.

    ``rows`` are the lines of data, ``remarks`` those of comments and of the lines above the
    header, which state the ``facts``; ``header`` are the lines of names and units.  ``words`` are
    the columns of words.  ``joined`` are the columns whose decimal comma made two cells of a
    number; ``labelled``: a name precedes each number.  ``too_few_names``: a column with numbers has no
    name.  ``beside`` is the number of lines above the data that end in a row of numbers.
    """

    delimiter: str
    decimal: str
    heads: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[str, ...]
    remarks: tuple[str, ...]
    facts: Preamble = NOTHING
    header: frozenset[str] = frozenset()
    words: frozenset[int] = frozenset()
    joined: tuple[int, ...] = ()
    labelled: bool = False
    too_few_names: bool = False
    beside: int = 0

    @property
    def raw_cells(self) -> int:
        """The cells of a row as it is written."""
        return len(self.heads) + len(self.joined)


class _Header(NamedTuple):
    """Names and units of columns, the lines above them, and the lines of both."""

    heads: tuple[str, ...]
    units: tuple[str, ...]
    above: tuple[str, ...]
    lines: tuple[str, ...]


def layout(text: str) -> Layout | None:
    """The layout of a text; None if no line is a row of numbers."""
    remarks = tuple(line.rstrip() for line in text.splitlines() if _is_remark(line))
    plain = plain_lines(text)
    looked = plain[:LOOKED_AT]
    labels = _labels(looked)
    if labels:
        looked = [_LABEL.sub("", line) for line in looked]
    scored = [
        (_score(looked, delimiter, decimal), (delimiter, decimal))
        for delimiter, decimal in itertools.product(DELIMITERS, ".,")
    ]
    best, (delimiter, decimal) = max(scored, key=lambda candidate: candidate[0])
    if not best[0]:
        return None
    rows = [cells(line, delimiter) for line in looked]
    words = _word_columns(rows, decimal)
    data = [is_data(row, decimal, words) for row in rows]
    first = _first(rows, data)
    header = _header(plain[:first], remarks, delimiter, _width(rows, data))
    every = (*remarks, *header.above)
    width = _width([[cell for cell in row if cell] for row in rows], data)
    form = Layout(
        delimiter,
        decimal,
        (),
        (),
        tuple(plain[first:]),
        every,
        facts=preamble(every),
        header=frozenset(header.lines),
        words=words,
        labelled=bool(labels),
        beside=sum(_ends_in_data(row, width, decimal) for row in rows[:first]),
    )
    numbers = [row for row, numeric in zip(rows, data, strict=True) if numeric]
    return _named(form, header, labels, numbers)


def _named(
    form: Layout, header: _Header, labels: Sequence[str], rows: Sequence[Sequence[str]]
) -> Layout:
    """A layout with the names and units of its columns, of which ``rows`` are rows of numbers."""
    count = _width(rows, [True] * len(rows))
    joined = _joined(header, rows, count)
    names = header.heads
    if labels and not any(names):
        before = 0 if _LABEL.match(form.rows[0].lstrip()) else max(count - len(labels), 0)
        names = (*[""] * before, *labels, *[""] * count)[:count]
    kept = max(count - len(joined), len(names))
    blank = [""] * kept
    nameless = count > len(names) and any(any(row[len(names) :]) for row in rows)
    return replace(
        form,
        heads=tuple(map(escaped, (*names, *blank)[:kept])),
        units=tuple(map(escaped, (*header.units, *blank)[:kept])),
        joined=joined,
        too_few_names=not joined and any(names) and nameless,
    )


def _is_remark(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS) or bool(_SEMICOLON_REMARK.fullmatch(line.rstrip()))


def plain_lines(text: str) -> list[str]:
    """The lines that are neither empty nor comments."""
    return [line.rstrip() for line in text.splitlines() if line.strip() and not _is_remark(line)]


def without_labels(text: str) -> str:
    """A text without the names that precede its numbers."""
    return _LABEL.sub("", text)


def _labels(lines: Sequence[str]) -> tuple[str, ...]:
    """The names that precede the numbers of most lines, in their order; else empty."""
    header = Counter(
        tuple(label.rstrip(" :=\t") for label in _LABEL.findall(line))
        for line in lines
        if len(line) < 1000
    )
    labels, times = header.most_common(1)[0] if header else ((), 0)
    return labels if labels and times > 0.5 * len(lines) else ()


def _score(lines: Sequence[str], delimiter: str, decimal: str) -> tuple[int, int, bool, bool, int]:
    """How well a delimiter and a decimal sign make rows: how many, with few words, below a header."""
    rows = [cells(line, delimiter) for line in lines]
    words = _word_columns(rows, decimal)
    data = [is_data(row, decimal, words) for row in rows]
    count = _width(rows, data)
    fits = sum(numeric and len(row) <= count for numeric, row in zip(data, rows, strict=True))
    first = data.index(True) if fits else 0
    named = first == 0 or len(rows[first - 1]) == count
    rows_of_numbers = fits if words else 2 * fits  # a row of words is half of one
    return (
        rows_of_numbers,
        -len(words),
        named,
        count > 1,
        -2 * DELIMITERS.index(delimiter) - (decimal == ","),
    )


def _width(rows: Sequence[Sequence[str]], data: Sequence[bool]) -> int:
    """The commonest number of cells of the rows of data."""
    counts = Counter(len(row) for row, numeric in zip(rows, data, strict=True) if numeric)
    return max(counts, key=lambda n: (counts[n], n)) if counts else 0


def _first(rows: Sequence[Sequence[str]], data: Sequence[bool]) -> int:
    """The first row of data, of the common width if single values of settings precede the names.

    Two shorter rows in a row are data, and so are those below names of the common width.
    """
    count = _width(rows, data)
    first = data.index(True)
    wide = next(k for k, row in enumerate(rows) if data[k] and len(row) == count)
    named = any(len(row) == count for row in rows[:first])
    pairs = itertools.pairwise(data[first:wide])
    settings = not named and not all(data[first:wide]) and not any(map(all, pairs))
    return wide if settings else first


def _word_columns(rows: Sequence[Sequence[str]], decimal: str) -> frozenset[int]:
    """The columns of words in the commonest form of a row with a number; most files have none."""
    forms = Counter(
        (len(row), tuple(k for k, cell in enumerate(row) if not _fits(cell, decimal)))
        for row in rows
        if any(_is_number(cell, decimal) for cell in row)
    )
    if not forms:
        return frozenset()
    (_, words), times = max(forms.items(), key=lambda form: (form[1], -len(form[0][1])))
    return frozenset(words) if times > 2 else frozenset()


def cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without spaces and quotation marks around them."""
    if delimiter == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return [line]


def is_data(row: Sequence[str], decimal: str, words: frozenset[int] = frozenset()) -> bool:
    """Whether a row holds nothing but numbers, times and missing values, and a number or time among them.

    The columns of ``words`` may hold any text.
    """
    numbers = [_is_number(cell, decimal) for cell in row]
    return any(numbers) and all(
        number or k in words or cell.lower() in MISSING
        for k, (number, cell) in enumerate(zip(numbers, row, strict=True))
    )


def _ends_in_data(row: Sequence[str], width: int, decimal: str) -> bool:
    """Whether a line of settings ends in a row of data, as oscilloscopes write the first of them."""
    full = [cell for cell in row if cell]
    return len(full) > width > 1 and all(_is_number(cell, decimal) for cell in full[-width:])


def _fits(cell: str, decimal: str) -> bool:
    return cell.lower() in MISSING or _is_number(cell, decimal)


def _is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number or a time."""
    if len(cell) > LONGEST_NUMBER:
        return False
    return bool(_NUMBER.fullmatch(as_number(cell, decimal))) or is_clock(cell)


def as_number(cell: str, decimal: str) -> str:
    """A cell's number with a decimal point; with a decimal comma a number has no point."""
    return cell if decimal == "." else cell.replace(".", "?").replace(",", ".")


def _header(lines: Sequence[str], remarks: Sequence[str], delimiter: str, count: int) -> _Header:
    """The names and units of the columns, of the lines just above the data or, as NumPy writes them, of a comment."""
    above = _without_limits(lines, delimiter)
    rows = [cells(line, delimiter) for line in above]
    blank = ("",) * count
    if rows and _may_name(rows[-1], count, delimiter):
        last = tuple(rows[-1])
        units = tuple(map(_without_brackets, last))
        if len(rows) > 1 and len(rows[-2]) == len(last) and all(map(_is_unit_cell, last)):
            return _Header(tuple(rows[-2]), units, tuple(above[:-2]), tuple(above[-2:]))
        return _Header(last, blank, tuple(above[:-1]), tuple(above[-1:]))
    listed = [_listed(line, delimiter, count) for line in remarks]
    header = next((tuple(row) for row in reversed(listed) if len(row) == count and count > 1), None)
    return _Header(header or blank, blank, tuple(above), ())


def _without_limits(lines: Sequence[str], delimiter: str) -> list[str]:
    """The lines above the data without separators, and without limits below the names."""
    above = [line for line in lines if not (_SEPARATOR.fullmatch(line) or _SECTION.fullmatch(line))]
    while len(above) > 1 and _names_nothing(cells(above[-1], delimiter)):
        above.pop()
    return above


def _listed(line: str, delimiter: str, count: int) -> list[str]:
    """The cells of a comment, without a word such as Headers before as many names as columns."""
    row = cells(line.lstrip("#%/!; "), delimiter)
    return row[1:] if len(row) > count and row[0].lower() in _LISTS else row


def _names_nothing(row: Sequence[str]) -> bool:
    """Whether a row below the names has neither names nor units, but limits or kinds of values."""
    words = [cell for cell in row if cell]
    kinds = all(cell.lower() in _KINDS for cell in words)
    return not row[0] and (kinds or all(_is_number(cell, ".") for cell in words))


def _may_name(row: Sequence[str], count: int, delimiter: str) -> bool:
    """Whether a line names the columns: a name for each, or more if the last ones are empty in all rows.

    With a decimal comma and commas between columns a row has up to twice as many cells.
    """
    if any(_DECIMAL.fullmatch(cell) for cell in row):  # a line of an oscilloscope's settings
        return False
    setting = any(cell.endswith(":") for cell in row[:-1]) and not row[-1].endswith(":")
    if delimiter == " " and setting:  # a setting and its value
        return False
    if len(row) == count:
        return True
    wider = len(row) > count and delimiter != " " and all(row)
    return wider or (
        delimiter == "," and len(row) > 1 and len(row) < count <= 2 * len(row) and all(row)
    )


def _joined(header: _Header, rows: Sequence[Sequence[str]], count: int) -> tuple[int, ...]:
    """The columns with numbers in two cells, cut at a decimal comma: all, or the first alone."""
    named = len(header.heads)
    if named >= count or not any(header.heads):
        return ()
    columns = tuple(range(named)) if count == 2 * named else (0,) if count == named + 1 else ()
    whole = [row for row in rows if len(row) == count]
    for before, column in enumerate(columns):
        first = {row[column + before] for row in whole}
        second = {row[column + before + 1] for row in whole}
        digits = all(map(_FRACTION.fullmatch, second)) and len(set(map(len, second))) == 1
        if not digits or not all(_WHOLE.fullmatch(cell) or is_clock(cell) for cell in first):
            return ()
    return columns


def _is_unit_cell(cell: str) -> bool:
    bare = _without_brackets(cell)
    if len(bare) > LONGEST_NUMBER:
        return False
    known = is_unit(bare) or ACCELERATION_PSD.scale(bare)[0] is not None
    return bare in ("", "-", "1", "TS", "RN") or known or bool(re.fullmatch(r"[munµ]?[gG]", bare))


def _without_brackets(cell: str) -> str:
    """A unit without the brackets around it: (g) is g, while those of (m/s^2)^2/Hz belong to it."""
    bare = cell.strip("()[]{} ")
    return cell.strip() if bare.count("(") != bare.count(")") else bare
