"""Ranges of scene keys, and the unit cube that they are searched in."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.errors import invalid, named_once
from harvester.quantities.preferred_numbers import SERIES, between
from harvester.scene.keys import read_value, split_key
from harvester.scene.scene import Scene

NETLIST = "load.netlist"  # the key whose values are circuits
MOST_KEYS = 4  # a cubic of five variables has 56 coefficients: nobody waits for that


@dataclass(frozen=True)
class Range:
    """A scene key and the ends that it is searched between, in SI units.

    ``steps`` are all values that it may have.
    """

    key: str
    low: float
    high: float
    steps: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        split_key(self.key)
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise invalid(
                f"the range of {self.key}",
                "be LOW:HIGH with LOW below HIGH",
                f"{self.low:g}:{self.high:g}",
            )

    @property
    def logarithmic(self) -> bool:
        """Whether it is searched by ratio: if the ends differ tenfold."""
        return self.low > 0.0 and self.high >= 10.0 * self.low

    def value(self, u: float) -> float:
        """The key's value at a place from 0 to 1."""
        if self.steps:
            return self.steps[min(int(u * len(self.steps)), len(self.steps) - 1)]
        if u in (
            0.0,
            1.0,
        ):  # to the last digit: a value beyond the end may be one that the key cannot take
            return self.high if u else self.low
        if self.logarithmic:
            return float(self.low * (self.high / self.low) ** u)
        return self.low + u * (self.high - self.low)

    def slope(self, u: float) -> float:
        """The derivative of the logarithm of the key's size in the place, if it is not 0."""
        if self.logarithmic:
            return math.log(self.high / self.low)
        return (self.high - self.low) / self.value(u)


# What is varied: keys with the ends of their ranges or a text LOW:HIGH, or texts KEY=LOW:HIGH.
Vary: TypeAlias = Sequence[Range | str] | Mapping[str, Any] | str


def parse(text: str) -> Range:
    """The range that a text describes, such as ``load.resistance=1k:10M``, or the values of a series: E24:1k:10M.

    Raises InputError for a key that no scene has, or ends that it cannot have.
    """
    key, equals, ends = text.partition("=")
    series, _, rest = ends.partition(":")
    stepped = series.strip().upper() in SERIES
    if not equals or (rest if stepped else ends).count(":") != 1:
        raise invalid(
            "`vary`",
            f"be KEY={series.strip().upper()}:LOW:HIGH" if stepped else "be KEY=LOW:HIGH",
            text,
        )
    key = ".".join(split_key(key))
    low, high = (read_value(key, end) for end in (rest if stepped else ends).split(":"))
    if not stepped:
        return Range(key, low, high)
    values = between(series.strip().upper(), low, high) if low < high else ()
    if len(values) < 2:
        raise invalid("`vary`", f"hold two values of {series} or more", text)
    return Range(key, values[0], values[-1], values)


def varied(vary: Vary) -> tuple[tuple[str, ...], tuple[Range, ...]]:
    """The circuits to choose between, none or several, and the ranges to search, of 1 to `MOST_KEYS` different keys.

    Raises InputError for others.
    """
    some = vary.items() if isinstance(vary, Mapping) else [vary] if isinstance(vary, str) else vary
    pairs = [_pair(item) for item in some]
    circuits = [value for key, value in pairs if key in (NETLIST, "netlist")]
    ranges = tuple(_range(key, value) for key, value in pairs if key not in (NETLIST, "netlist"))
    if not 1 <= len(ranges) <= MOST_KEYS:
        raise invalid("`vary`", f"be given for 1 to {MOST_KEYS} keys", len(ranges))
    named_once([*(r.key for r in ranges), *[NETLIST] * len(circuits)], "`vary`")
    return (_circuits(circuits[0]) if circuits else ()), ranges


def ranges(vary: Vary) -> tuple[Range, ...]:
    """The ranges of `varied`, if circuits are not among it."""
    return varied(vary)[1]


def _pair(item: Any) -> tuple[str, Any]:
    """A key and its statement; for a text that names none, the text."""
    if isinstance(item, Range):
        return item.key, item
    if not isinstance(item, str):
        return str(item[0]), item[1]
    key, equals, value = item.partition("=")
    return (key.strip(), value) if equals else (item, "")


def _range(key: str, ends: Any) -> Range:
    """The range of a key with its ends, or their text."""
    if isinstance(ends, Range):
        return ends
    if isinstance(ends, str):
        return parse(f"{key}={ends}" if ends else key)
    if not isinstance(ends, Sequence) or len(ends) != 2:
        raise invalid(f"the range of {key}", "be (LOW, HIGH) or a text 'LOW:HIGH'", ends)
    low, high = (read_value(key, end) if isinstance(end, str) else float(end) for end in ends)
    return Range(".".join(split_key(key)), low, high)


def _circuits(given: str | Sequence[str]) -> tuple[str, ...]:
    """The names of circuits, from a text or a list; InputError for fewer than two, or one twice."""
    names = [name.strip() for name in (given.split(",") if isinstance(given, str) else given)]
    if len(names) < 2 or len({*names}) < len(names) or not all(names):
        raise invalid("`vary`", f"be {NETLIST}=A,B,... with two circuits or more", given)
    return tuple(names)


def problem_at(scene: Scene, ranges: Sequence[Range], u: Floats) -> Problem:
    """The problem at a place in the unit cube; InputError if none is possible."""
    return Problem(scene.varied({r.key: r.value(float(x)) for r, x in zip(ranges, u, strict=True)}))


def middle(scene: Scene, ranges: Sequence[Range]) -> Problem:
    """The problem in the middle of all ranges: these give a scene parts that it may not have itself."""
    return problem_at(scene, ranges, np.full(len(ranges), 0.5))


def spread(count: int, dimensions: int) -> Floats:
    """Places that fill the unit cube evenly, shape (count, dimensions): a grid of one key, Halton's points of several.

    The first is the middle, if there are several keys.
    """
    if dimensions == 1:
        return np.linspace(0.0, 1.0, count)[:, None]
    from scipy.stats import qmc  # which takes a second to load

    points: Floats = qmc.Halton(dimensions, rng=np.random.default_rng(0)).random(count - 1)
    return np.vstack([np.full(dimensions, 0.5), points])


def scan(count: int, dimensions: int) -> Floats:
    """The places of `spread`, coarse to fine: a scan that ends early has seen the whole of the range."""
    points = spread(count, dimensions)
    if dimensions > 1:  # Halton's points come in such an order
        return points
    return points[np.argsort([-(k & -k) for k in range(count)], kind="stable")]
