"""Which scenes a sweep computes: the grid of some axes, or a list."""

import csv
import io
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, named_once, shown
from harvester.machine import files
from harvester.scene.keys import read_value, whole_key
from harvester.scene.scene import Scene

# of a key: "1k:10M:25", or numbers in SI units and texts with their unit
Values: TypeAlias = str | Sequence[float | str]

MOST_POINTS = 100_000
MOST_BYTES = 64_000_000  # of a list of points


@dataclass(frozen=True)
class Axis:
    """A scene key and its values, in SI units."""

    key: str
    values: tuple[float, ...]

    @property
    def logarithmic(self) -> bool:
        """Whether a plot shows it best on a logarithmic axis."""
        return min(self.values) > 0.0 and max(self.values) >= 10.0 * min(self.values)


def read_axis(text: str, present: Collection[str] = ()) -> Axis:
    """The axis that a text describes, such as ``load.resistance=1k:10M:25`` or ``load.resistance=1k,2k,5k``.

    FROM:TO:COUNT is spaced evenly, by ratio if the ends differ tenfold.  A key without its table is
    that of the tables ``present`` in a scene (`harvester.scene.keys.full_key`).

    Raises InputError for a key that no scene has, or values that it cannot have.
    """
    key, equals, written = text.partition("=")
    if not equals:
        raise invalid("`vary`", "be KEY=FROM:TO:COUNT or KEY=A,B,C", text)
    key = whole_key(key, present)
    parts = written.split(":")
    if len(parts) == 1:
        return Axis(key, tuple(read_value(key, part) for part in written.split(",")))
    if (
        len(parts) != 3
        or not re.fullmatch("[0-9]{1,6}", parts[2])
        or not 1 <= int(parts[2]) <= MOST_POINTS
    ):
        raise invalid(
            "`vary`",
            f"be KEY=FROM:TO:COUNT with a whole COUNT between 1 and {MOST_POINTS}, spaced "
            "geometrically if FROM and TO differ tenfold or more, else linearly",
            text,
        )
    low = read_value(key, parts[0])
    high = read_value(key, parts[1])
    count = int(parts[2])
    by_ratio = Axis(key, (low, high)).logarithmic
    values = np.geomspace(low, high, count) if by_ratio else np.linspace(low, high, count)
    return Axis(key, tuple(map(float, values)))


def axes_of(
    vary: Mapping[str, Values] | Sequence[Axis | str] | str, present: Collection[str] = ()
) -> list[Axis]:
    """The axes of ``vary``, as of `harvester.studies.sweep.sweep.sweep`.

    Raises InputError for another form.
    """
    if isinstance(vary, Mapping):
        return [axis_of(key, some, present) for key, some in vary.items()]
    must = "be KEY=VALUES, such as 'load.resistance=1k:10M:25', or an Axis"
    if isinstance(vary, bytes) or not isinstance(vary, Iterable):
        raise invalid("`vary`", must, vary)
    axes = list[Axis]()
    for entry in [vary] if isinstance(vary, str) else vary:
        if not isinstance(entry, Axis | str):
            raise invalid("`vary`", must, entry)
        axes.append(read_axis(entry, present) if isinstance(entry, str) else entry)
    return axes


def axis_of(key: str, values: Values, present: Collection[str] = ()) -> Axis:
    """The axis of a key and its values: numbers in SI units, texts with units, or one text.

    Raises as `read_axis`.
    """
    if isinstance(values, str):
        return read_axis(f"{key}={values}", present)
    key = whole_key(key, present)
    if len(values) == 0:
        raise InputError(f"{key} must have values, but has none")
    return Axis(
        key,
        tuple(
            read_value(key, value) if isinstance(value, str) else float(value) for value in values
        ),
    )


@dataclass(frozen=True)
class Points:
    """The points of a sweep: all combinations of the axes' values, the last axis fastest, or a list (``listed``).

    The n-th point of a list has the n-th value of each axis.  ``argument`` is the argument that the
    points come from, if it is not that of a sweep.

    Raises InputError for a key that is named twice, more than `MOST_POINTS` points, and listed axes
    of unequal length or none.
    """

    axes: tuple[Axis, ...]
    listed: bool = False
    argument: str = ""

    def __post_init__(self) -> None:
        named_once(self.keys, self.option)
        if self.listed and len({len(a.values) for a in self.axes}) != 1:
            raise InputError(f"{self.option} must have as many values of one key as of another")
        if len(self) > MOST_POINTS:
            raise invalid(self.option, f"make at most {MOST_POINTS} points", len(self))

    @property
    def option(self) -> str:
        """The argument that the points come from, as errors name it."""
        return self.argument or ("`points`" if self.listed else "`vary`")

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys."""
        return tuple(a.key for a in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of values along each axis; for a list, of points."""
        return (
            (len(self.axes[0].values),) if self.listed else tuple(len(a.values) for a in self.axes)
        )

    def __len__(self) -> int:
        return math.prod(self.shape)

    def values(self, point: int) -> tuple[float, ...]:
        """The keys' values at a point."""
        indices = (
            [point] * len(self.axes)
            if self.listed
            else map(int, np.unravel_index(point, self.shape))
        )
        return tuple(a.values[k] for a, k in zip(self.axes, indices, strict=True))

    def varied(self, point: int) -> dict[str, float]:
        """The keys and their values at a point."""
        return dict(zip(self.keys, self.values(point), strict=True))

    def spread(self, count: int) -> frozenset[int]:
        """So many points, evenly among the others."""
        inner = np.linspace(0.0, len(self) - 1.0, count + 2)[1:-1]
        return frozenset(map(int, np.round(inner)))

    def middle(self, scene: Scene) -> Problem:
        """The problem of the middle point: a sweep gives a scene parts that it may not have itself."""
        return self._problem(scene, len(self) // 2)

    def check(self, scene: Scene) -> None:
        """Raise InputError if the scene cannot be made at one of the points."""
        for point in range(len(self)):
            self._problem(scene, point)

    def _problem(self, scene: Scene, point: int) -> Problem:
        try:
            return Problem(scene.varied(self.varied(point)))
        except InputError as error:
            if self.listed:
                raise InputError(f"{self.option}, point {point + 1}: {error}") from None
            raise


def grid(axes: Sequence[Axis]) -> Points:
    """The points that are all combinations of the axes' values."""
    return Points(tuple(Axis(a.key, tuple(map(float, a.values))) for a in axes))


def read_points(path: str | Path, present: Collection[str] = ()) -> Points:
    """A list of points from a CSV file: scene keys in the first line, then one point a line, units allowed.

    Raises InputError if the file cannot be read, or has something that no scene key can have, with
    the line.
    """
    data = files.read(path, "`points`", MOST_BYTES)
    try:
        lines = csv.reader(
            io.StringIO(data.decode("utf-8-sig"), newline=""), skipinitialspace=True, strict=True
        )
        rows = [(lines.line_num, row) for row in lines if any(cell.strip() for cell in row)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"`points` must be a CSV file in UTF-8, but {shown(str(path))} is not: {error}"
        ) from None
    if len(rows) < 2:
        raise InputError(
            f"`points` must have scene keys in its first line and then points, but {shown(str(path))} has none"
        )
    keys = [whole_key(cell.strip(), present) for cell in rows[0][1]]
    columns: list[list[float]] = [[] for _ in keys]
    for number, row in rows[1:]:
        if len(row) != len(keys):
            raise InputError(
                f"`points`, line {number}, must have {len(keys)} values, but has {len(row)}"
            )
        for key, column, cell in zip(keys, columns, row, strict=True):
            try:
                column.append(read_value(key, cell.strip()))
            except InputError as error:
                raise InputError(f"`points`, line {number}: {error}") from None
    return Points(
        tuple(Axis(key, tuple(column)) for key, column in zip(keys, columns, strict=True)),
        listed=True,
    )
