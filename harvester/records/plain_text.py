"""The text of a file as rows: ends of lines, stamps of a serial monitor, and refused forms.

A serial monitor writes ``11:59:55.010 -> 0.12,0.98``; its arrow becomes the file's delimiter.
"""

import io
import itertools
import re
from pathlib import Path

from harvester.errors import InputError, shown
from harvester.records.csv_layout import LOOKED_AT

_ARROW = re.compile(r"(?m)^[ \t]*(\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?) -> ")
_STAMPED = re.compile(r"(?m) -> (.*\d.*)$")  # the first line with numbers behind the arrow
# -1, the number of a data set, and a line that is more than a number, as a column of numbers has
_UNIVERSAL = re.compile(
    r"\s*-1\s*\r?\n\s*(\d{1,4})b?\b(?![.,])[^\n]*\n(?!\s*[-+.,\deE]*\s*(?:\n|$))"
)
# separators of thousands next to a decimal sign, or spaces, which no single number has
_THOUSANDS = re.compile(
    r"[+-]?[1-9]\d{0,2}(?:(?:,\d{3})+\.\d+|(?:\.\d{3})+,\d+|(?:[\u00a0\u202f' ]\d{3})+(?:[.,]\d+)?)"
)
_ROW = re.compile(r"\s*[\"']?[-+.,\d]")  # begins with a number, as neither settings nor remarks do
_LOOKED_AT = 300  # lines that are searched
_DELIMITERS = (";", "\t", "|")
_BEHIND_ARROW = ("\t", ";", ",")  # else a space
_QUOTED = re.compile(r'"([^"]*)"')


def decoded(data: bytes, path: str | Path, argument: str) -> str:
    """The text of a file in UTF-8, UTF-16 with its mark, or the letters of Windows."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return _plain(data.decode("utf-16", errors="replace"))
    if b"\x00" in data:
        raise InputError(
            f"{argument} must be a CSV file in UTF-8, but {shown(str(path))} holds bytes that are not text"
        )
    try:
        return _plain(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        return _plain(data.decode("latin-1"))


def _plain(text: str) -> str:
    """A text with line feeds, and with stamps of a serial monitor as cells of their own."""
    if "\n" not in text:
        text = text.replace("\r", "\n")
    if _ARROW.match(text):
        stamped = _STAMPED.search(text)
        behind = stamped[1] if stamped else ""
        delimiter = next((sign for sign in _BEHIND_ARROW if sign in behind), " ")
        text = _ARROW.sub(rf"\1{delimiter}", text)
    return text


def most_cells(text: str) -> int:
    """The most cells that a line has whose layout is looked at."""
    lines = itertools.islice(io.StringIO(text), 2 * LOOKED_AT)
    return max((max(line.count(sign) for sign in ",;|\t") + 1 for line in lines), default=0)


def refuse_forms(text: str, path: str | Path, argument: str) -> None:
    """Refuse a universal file and numbers with separators of thousands, with an InputError."""
    universal = _UNIVERSAL.match(text)
    if universal is not None:
        raise InputError(
            f"{argument} must be a CSV file, but {shown(str(path))} is a universal file (UFF, data "
            f"set {universal[1]}): export its times and values as CSV"
        )
    for number, line in enumerate(text.splitlines()[:_LOOKED_AT], 1):
        if not _ROW.match(line):
            continue
        quoted = _QUOTED.findall(line)
        split = [line.split(sign) for sign in _DELIMITERS if sign in line]
        for cell in (cell.strip() for row in (quoted, *split) for cell in row):
            if _THOUSANDS.fullmatch(cell):
                raise InputError(
                    f"{argument} must have numbers without separators of thousands, but "
                    f"{shown(str(path))} has {cell!r} in line {number}: export it without them"
                )
