"""The text of a file as rows: ends of lines, stamps of a serial monitor, and refused forms.

A serial monitor writes ``11:59:55.010 -> 0.12,0.98``; its arrow becomes the file's delimiter.
"""

import re
from pathlib import Path

from harvester.errors import InputError, shown

_ARROW = re.compile(r"(?m)^[ \t]*(\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?) -> ")
_DELIMITER = re.compile(r"(?m) -> .*?\d\s*([\t;,])")
_UNIVERSAL = re.compile(r"\s*-1\s*\r?\n\s*(\d{1,4})b?\b")
# separators of thousands next to a decimal sign, or spaces, which no single number has
_THOUSANDS = re.compile(
    r"[+-]?[1-9]\d{0,2}(?:(?:,\d{3})+\.\d+|(?:\.\d{3})+,\d+|(?:[\u00a0\u202f' ]\d{3})+(?:[.,]\d+)?)"
)
_LOOKED_AT = 300  # lines that are searched
_DELIMITERS = (";", "\t", "|")
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
        delimiter = _DELIMITER.search(text)
        text = _ARROW.sub(rf"\1{delimiter[1] if delimiter else ','}", text)
    return text


def refuse_forms(text: str, path: str | Path, argument: str) -> None:
    """Refuse a universal file and numbers with separators of thousands, with an InputError."""
    universal = _UNIVERSAL.match(text)
    if universal is not None:
        raise InputError(
            f"{argument} must be a CSV file, but {shown(str(path))} is a universal file (UFF, data "
            f"set {universal[1]}): export its times and values as CSV"
        )
    for number, line in enumerate(text.splitlines()[:_LOOKED_AT], 1):
        quoted = _QUOTED.findall(line)
        split = [line.split(sign) for sign in _DELIMITERS if sign in line]
        for cell in (cell.strip() for row in (quoted, *split) for cell in row):
            if _THOUSANDS.fullmatch(cell):
                raise InputError(
                    f"{argument} must have numbers without separators of thousands, but "
                    f"{shown(str(path))} has {cell!r} in line {number}: export it without them"
                )
