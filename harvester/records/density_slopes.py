"""Density tables as standards print them: `20-80, +3 dB/oct`, breakpoints and ranges.

A slope of s dB per octave between f1 and f2 is G2 = G1 10^(s/10 log2(f2/f1)), in which a multiple
of 3 dB is one of 3.01 dB: 3 dB per octave is G2 = G1 f2/f1.  A slope in the first row leads to
the next row, a slope in the last row comes from the row before.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, shown
from harvester.records.csv_layout import plain_lines

SLOPE = re.compile(
    # Bounded lengths: the search is linear in the text.  A comma is a decimal one behind a sign, or
    # behind a semicolon or a tab between columns: `20,3 dB/oct` has 3 dB per octave from 20 Hz on.
    r"(?<![\d.])([+\u2212\u2013-][ \t]{0,4}\d{1,2}(?:[.,]\d{1,6})?"
    r"|(?<=[;\t])\d{1,2}(?:[.,]\d{1,6})?|\d{1,2}(?:\.\d{1,6})?)"
    r"[ \t]{0,4}dB[ \t]{0,4}(?:/|per)[ \t]{0,4}oct(?:ave)?\.?",
    re.IGNORECASE,
)
RANGE = re.compile(
    r"^(\s*\"?)(\d+(?:\.\d+)?)\s*(?:-|\u2013|\u2014|to|\.\.\.?|\u2026)\s*(\d+(?:\.\d+)?)",
    re.MULTILINE,
)
NOMINAL = 3.0  # dB that stand for a factor of two (3.01 dB) in standards
AGREE = 0.05  # of a value that two ways determine
_ADD, _DIGITS = 1000.0, 1e6  # a slope is written as a whole number: that much more, times so many
MARK = 1e194  # of a cell that holds a slope: no density has such a size


class Row(NamedTuple):
    """A row: from ``low`` to ``high`` Hz a ``value``, or a ``slope`` in dB an octave.

    The other is nan.
    """

    low: float
    high: float
    value: float
    slope: float

    @property
    def is_range(self) -> bool:
        """Whether it holds between two frequencies."""
        return self.high > self.low


def marked(text: str) -> str:
    """A text with each slope as a number that `is_slope`, so that a row of it is one of numbers."""

    def number(match: re.Match[str]) -> str:
        slope = float(
            re.sub(r"\s", "", match[1])
            .replace("\u2212", "-")
            .replace("\u2013", "-")
            .replace(",", ".")
        )
        return f"{round((_ADD + slope) * _DIGITS)}e{round(math.log10(MARK))}"

    return SLOPE.sub(number, text)


def with_ranges(text: str) -> tuple[str, list[float]]:
    """A text whose frequencies `20-80` are their lower end, and the upper ends in the order of rows; nan for others."""
    ends: list[float] = []
    lines = []
    for line in text.splitlines():
        match = RANGE.match(line)
        if match:
            ends.append(float(match[3]))
            lines.append(match[1] + match[2] + line[match.end() :])
        else:
            lines.append(line)
            if plain_lines(line) and any(map(str.isdigit, line)):
                ends.append(math.nan)
    return "\n".join(lines), ends


def slopes(values: Floats) -> tuple[Floats, Floats]:
    """The densities of marked values, nan for slopes, and the slopes, nan for densities."""
    marks = values >= MARK
    return np.where(marks, math.nan, values), np.where(
        marks, np.round(values / MARK / _DIGITS - _ADD, 6), math.nan
    )


def breakpoints(rows: list[Row], key: str) -> tuple[Floats, Floats]:
    """The frequencies and densities of rows, ascending; two at one frequency for a step.

    Raises InputError, which begins with ``key``, for slopes that no value determines, and for two
    that disagree.
    """
    segments = _segments(rows, key)
    ends = np.array([[row.value, row.value] for row in segments])  # densities at low and high
    for _ in segments:  # each pass determines one more slope at least
        for k, row in enumerate(segments):
            if math.isfinite(row.slope):
                ends[k] = _ends_of_slope(segments, ends, k, key)
    f = list[float]()
    g = list[float]()
    for row, both in zip(segments, ends, strict=True):
        if not np.isfinite(both).all():
            raise InputError(
                f"{key} must have a value at one end of each slope, but {row.slope:+g} dB/oct from "
                f"{row.low:g} to {row.high:g} Hz has none"
            )
        for at, value in zip((row.low, row.high), both, strict=True):
            if not (f and f[-1] == at and g[-1] == value):
                f.append(at)
                g.append(float(value))
    return np.array(f), np.array(g)


def _ends_of_slope(segments: list[Row], ends: Floats, k: int, key: str) -> tuple[float, float]:
    """The densities at both ends of a slope, from the segment before or the one after.

    Nan if neither is known.
    """
    row = segments[k]
    factor = (row.high / row.low) ** exponent(row.slope)
    before = ends[k - 1, 1] if k and segments[k - 1].high == row.low else math.nan
    follows = k + 1 < len(segments) and segments[k + 1].low == row.high
    behind = ends[k + 1, 0] if follows else math.nan
    low = before if math.isfinite(before) else behind / factor
    if abs(low * factor / behind - 1.0) > AGREE:
        raise InputError(
            f"{key} must have slopes that lead from one value to the next, but {row.slope:+g} dB/oct "
            f"from {row.low:g} to {row.high:g} Hz leads from {before:.4g} to "
            f"{before * factor:.4g}, not {behind:.4g} (m/s^2)^2/Hz"
        )
    return low, low * factor


def exponent(slope: float) -> float:
    """The exponent of the frequency for a slope in dB per octave; 3 dB are a factor of two."""
    return slope / NOMINAL if slope % NOMINAL == 0.0 else 0.1 * slope / math.log10(2.0)


def _segments(rows: list[Row], key: str) -> list[Row]:
    """Rows between two frequencies each, from breakpoints and slopes at one frequency."""
    segments: list[Row] = []
    for k, row in enumerate(rows):
        if row.is_range or math.isfinite(row.value):
            segments.append(row)
            continue
        if k + 1 < len(rows) and (k == 0 or math.isfinite(rows[k - 1].slope)):
            segments.append(row._replace(high=rows[k + 1].low))
        elif k + 1 == len(rows) and k:
            segments.append(row._replace(low=rows[k - 1].high, high=row.low))
        else:
            raise InputError(
                f"{key} row {k + 1} must have its slope between two frequencies, such as '20-80', or be first or "
                f"last, but is {shown(f'{row.low:g}, {row.slope:+g} dB/oct')}"
            )
        if not segments[-1].is_range:
            raise InputError(
                f"{key} must have ascending frequencies, but row {k + 1} has {row.low:g} Hz"
            )
    return segments
