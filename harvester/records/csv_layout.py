"""How a logger's CSV file is laid out: its delimiter, decimal sign, names and units of columns, and if data begin.

Nothing is asked of the file but that its rows hold numbers or times: the layout that makes most
lines such rows, and whose header has as many cells as they have, is the file's.
"""

import csv
import io
import itertools
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from harvester.errors import escaped
from harvester.quantities.kinds import ACCELERATION_PSD
from harvester.quantities.units import is_unit

DELIMITERS = ("\t", ";", ",", "|", " ")
LOOKED_AT = 300  # lines that tell the layout
LONGEST_NUMBER = 64  # letters of a number, a time or a unit: a longer cell is none of them
COMMENTS = ("#", "%", "//", "!")
MISSING = frozenset(
    ("", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "ovr", "ovl", "#n/a")
)
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")
CLOCK = re.compile(
    r"(?:(\d{4}-\d\d-\d\d|\d\d\.\d\d\.\d{4})[T ]+)?\d{1,2}:\d\d:\d\d(?:[.,]\d+)?(?:Z|[+-]\d\d:?\d\d)?"
)


@dataclass(frozen=True)
class Layout:
    """The layout of a file: ``heads`` and ``units`` have a text for each column, empty if absent.

    ``rows`` are the lines of data, ``remarks`` those of comments and of what stands above the
    header.
    """

    delimiter: str
    decimal: str
    heads: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[str, ...]
    remarks: tuple[str, ...]


def layout(text: str) -> Layout | None:
    """The layout of a text; None if no line is a row of numbers."""
    remarks = tuple(
        line.rstrip() for line in text.splitlines() if line.lstrip().startswith(COMMENTS)
    )
    plain = plain_lines(text)
    looked = plain[:LOOKED_AT]
    scored = [(_score(looked, *form), form) for form in itertools.product(DELIMITERS, ".,")]
    best, (delimiter, decimal) = max(scored, key=lambda candidate: candidate[0])
    if not best[0]:
        return None
    data = [is_data(cells(line, delimiter), decimal) for line in looked]
    first = data.index(True)
    heads, units, above = _header(
        looked[:first], remarks, delimiter, _width(looked, data, delimiter)
    )
    names = tuple(map(escaped, heads)), tuple(map(escaped, units))
    return Layout(delimiter, decimal, *names, tuple(plain[first:]), (*remarks, *above))


def plain_lines(text: str) -> list[str]:
    """The lines that are neither empty nor comments."""
    return [
        line.rstrip()
        for line in text.splitlines()
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]


def most_cells(text: str) -> int:
    """The most cells that a line has whose layout is looked at."""
    lines = itertools.islice(io.StringIO(text), 2 * LOOKED_AT)
    return max((max(line.count(sign) for sign in ",;|\t") + 1 for line in lines), default=0)


def _score(lines: Sequence[str], delimiter: str, decimal: str) -> tuple[int, bool, bool, int]:
    """How well a delimiter and a decimal sign make lines rows: how many, below a header of as many cells; the usual."""
    rows = [cells(line, delimiter) for line in lines]
    data = [is_data(row, decimal) for row in rows]
    count = _width(lines, data, delimiter)
    fits = sum(numeric and len(row) <= count for numeric, row in zip(data, rows, strict=True))
    first = data.index(True) if fits else 0
    named = first == 0 or len(rows[first - 1]) == count
    return fits, named, count > 1, -2 * DELIMITERS.index(delimiter) - (decimal == ",")


def _width(lines: Sequence[str], data: Sequence[bool], delimiter: str) -> int:
    """The commonest number of cells of the rows of data."""
    counts = Counter(
        len(cells(line, delimiter)) for line, numeric in zip(lines, data, strict=True) if numeric
    )
    return max(counts, key=lambda n: (counts[n], n)) if counts else 0


def cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without spaces and quotation marks around them."""
    if delimiter == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return [line]


def is_data(row: Sequence[str], decimal: str) -> bool:
    """Whether a row holds nothing but numbers, times and missing values, and a number or time among them."""
    numbers = [_is_number(cell, decimal) for cell in row]
    return any(numbers) and all(
        number or cell.lower() in MISSING for number, cell in zip(numbers, row, strict=True)
    )


def _is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number or a time."""
    if len(cell) > LONGEST_NUMBER:
        return False
    return bool(_NUMBER.fullmatch(as_number(cell, decimal)) or CLOCK.fullmatch(cell))


def as_number(cell: str, decimal: str) -> str:
    """A cell's number with a decimal point; with a decimal comma a point is no number's."""
    return cell if decimal == "." else cell.replace(".", "?").replace(",", ".")


def _header(
    lines: Sequence[str], remarks: Sequence[str], delimiter: str, count: int
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """The names and units of the columns, and the lines that are above them."""
    rows = [cells(line, delimiter) for line in lines]
    while rows and len(rows[-1]) != count:
        rows.pop()
    blank = ("",) * count
    if not rows:  # NumPy writes its header as a comment
        commented = [cells(line.lstrip("#%/! "), delimiter) for line in remarks]
        header = next(
            (tuple(row) for row in reversed(commented) if len(row) == count and count > 1), None
        )
        return header or blank, blank, tuple(lines)
    last = tuple(rows[-1])
    above = tuple(lines[: len(rows) - 1])
    if len(rows) > 1 and len(rows[-2]) == count and all(_is_unit_cell(cell) for cell in last):
        return tuple(rows[-2]), tuple(map(_without_brackets, last)), above[:-1]
    return last, blank, above


def _is_unit_cell(cell: str) -> bool:
    bare = _without_brackets(cell)
    if len(bare) > LONGEST_NUMBER:
        return False
    known = is_unit(bare) or ACCELERATION_PSD.scale(bare)[0] is not None
    return bare in ("", "-", "1") or known or bool(re.fullmatch(r"[munµ]?[gG]", bare))


def _without_brackets(cell: str) -> str:
    """A unit without the brackets around it: (g) is g, while those of (m/s^2)^2/Hz belong to it."""
    bare = cell.strip("()[]{} ")
    return cell.strip() if bare.count("(") != bare.count(")") else bare
