"""The unit of times that state none, and counters that roll over.

A column of times without a unit may be in seconds, milliseconds, microseconds or days.  The
ways differ by 1000 and more in the sampling rate, so that mostly one alone is a rate that
accelerometers have: `SLOWEST` to `FASTEST`.  A date as a number of seconds, milliseconds, ... from
1970 has so many digits as its unit makes.

A counter of k bits goes back by 2^k when it is full, seconds of a minute by 60: such steps are
undone.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats

SLOWEST, FASTEST = 5.0, 60e3  # Hz, of accelerometers; of a current's profiler `FASTEST_PROFILER`
FASTEST_PROFILER = 2.5e6
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "day": 86400.0}
EPOCH = 1e9, 4.2e9  # s from 1970: 2001 to 2103
SERIAL_DAYS = (
    (3e4, 8e4),
    (7.1e5, 7.9e5),
)  # of a spreadsheet from 1900, and of MATLAB from the year 0: 1982 to 2119
SPAN = 64  # rows over which steps are taken
_BITS = (8, 10, 12, 16, 24, 32)
_OF_CLOCKS = (60.0, 100.0, 1000.0, 3600.0, 43200.0, 6e4, 86400.0, 1e6, 3.6e6, 8.64e7)
MODULI = (*(2.0**bits for bits in _BITS), *_OF_CLOCKS, 2.0**32 / 1e3, 2.0**32 / 1e6)
NEAR = 0.5  # of a step: how near a step that was undone must be to a whole number of the others
MOST_LOST = 50.0  # steps that may be missing where a counter rolls over


class Reading(NamedTuple):
    """How times without a unit are read: in a ``unit``, at ``rate`` per second.

    ``others`` are possible as well.
    """

    unit: str
    rate: float
    others: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """The seconds of one of the unit."""
        return UNITS[self.unit]


def typical_step(values: Floats) -> float:
    """The median step of some numbers over `SPAN` rows, nan if they do not ascend."""
    known = values[np.isfinite(values)]
    span = min(SPAN, len(known) - 1)
    if span < 1:
        return math.nan
    steps = (known[span:] - known[:-span]) / span
    ascending = steps[steps > 0.0]
    return float(np.median(ascending)) if len(ascending) else math.nan


def repeated(values: Floats) -> float:
    """The share of neighbours that are equal."""
    steps = np.diff(values[np.isfinite(values)])
    return float((steps == 0.0).mean()) if len(steps) else 0.0


def possible(values: Floats, fastest: float = FASTEST) -> list[Reading]:
    """The ways of times without a unit that are possible, the likeliest first.

    Empty if no step ascends.
    """
    step = typical_step(values)
    if not step > 0.0:
        return []
    first = float(values[np.isfinite(values)][0])
    ways = []
    for unit, size in UNITS.items():
        rate = 1.0 / (step * size)
        dated = any(low < first < high for low, high in SERIAL_DAYS)
        if SLOWEST <= rate <= fastest and (unit != "day" or dated):
            ways.append(Reading(unit, rate))
    dates = [
        reading
        for reading in ways
        if EPOCH[0] < first * reading.seconds < EPOCH[1] and reading.unit != "day"
    ]
    return dates if len(dates) == 1 and first > EPOCH[0] else ways


def decided(values: Floats, fastest: float = FASTEST) -> Reading | None:
    """The reading of times without a unit.

    None if none is possible, or several of which none is seconds.

    Seconds are the rule, if they are possible.
    """
    ways = possible(values, fastest)
    if not ways:
        return None
    others = tuple(reading.unit for reading in ways[1:])
    if len(ways) > 1 and ways[0].unit != "s":
        return None
    return ways[0]._replace(others=others)


def unrolled(values: Floats) -> tuple[Floats, int, float]:
    """Numbers without the steps of a counter that rolled over, how often it did, and its modulus.

    Falls that are not all of one of the `MODULI` are left as they are.
    """
    steps = np.diff(values)
    step = _median_step(values)
    back = np.flatnonzero(steps < 0.0)
    if not len(back) or not step > 0.0:
        return values, 0, 0.0
    for modulus in MODULI:
        new = steps[back] + modulus
        share = new / step
        fits = (new >= 0.0) & (share < MOST_LOST) & (np.abs(share - np.round(share)) < NEAR)
        if (
            fits.all()
            and np.nanmin(values) >= 0.0
            and np.nanmax(values) < modulus
            and new.max() < 0.5 * modulus
        ):
            turns = np.zeros(len(values))
            turns[back + 1] = 1.0
            return values + modulus * np.cumsum(turns), len(back), modulus
    return values, 0, 0.0


def _median_step(values: Floats) -> float:
    """The median of the steps above 0."""
    steps = np.diff(values)
    on = steps[steps > 0.0]
    return float(np.median(on)) if len(on) else math.nan
