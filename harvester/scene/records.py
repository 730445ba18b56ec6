"""Recorded shaking: an acceleration over time, or a table of its density over frequency, from CSV files.

The header names the columns with their units, in any order: ``time (s),acceleration (g)`` at equal steps of time, or
``frequency (Hz),psd (g^2/Hz)``, one-sided.  Between its points a density is a straight line in log-log; beside
a 0, which has no logarithm, it is one in the density itself.

A record is repeated for ever.  Its end is joined to its beginning by a cubic over `BRIDGE` steps; between its samples
it is the Fourier series through them, of which a grid of steps h sees what is below pi/h: nothing is folded back.
"""

import csv
import io
import math
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.machine import files
from harvester.scene.kinds import ACCELERATION, ACCELERATION_PSD, FREQUENCY, TIME, Kind
from harvester.scene.units import LARGEST

BRIDGE = 4  # steps
FEWEST = 16  # rows of a record
MOST_BYTES = 64_000_000
UNEVEN = 0.01  # of a step: how far a time may be off an even grid
SPAN = 8192.0  # period of a record made from a density, in units of 1/w0
LINES = 12.0  # of such a record in the narrowest band, at least: E[V^2] is then off by 1 % at worst
MOST_SAMPLES = 2**20  # of such a record, of which an ensemble has 64 or more: .5 GB
_FINER = 8  # points of a fine grid to one that the content needs, for cubic interpolation


@dataclass(frozen=True, eq=False)
class Record:
    """One period of a record: samples of shape (n,), ``spacing`` apart."""

    spacing: float
    values: Floats

    @property
    def period(self) -> float:
        """The time after which the record repeats."""
        return self.spacing * len(self.values)

    @property
    def rms(self) -> float:
        """The root of the mean square of the samples."""
        return float(np.sqrt(np.mean(self.values**2)))

    def scaled(self, time: float, value: float) -> "Record":
        """The record with its times multiplied by ``time`` and its values by ``value``, as for other units."""
        return Record(self.spacing * time, self.values * value)

    def sampled(self, count: int, cut: float = math.inf) -> Floats:
        """The Fourier series at ``count`` even times of a period, without frequencies above theirs or above ``cut``."""
        from scipy.fft import irfft, rfft

        series = rfft(self.values) * (count / len(self.values))
        highest = min(0.5 * count, cut * self.period / (2.0 * math.pi))
        series[-1] *= 0.5 if count > len(self.values) and len(self.values) % 2 == 0 else 1.0  # of both signs
        series[np.arange(len(series)) >= highest] = 0.0
        return np.asarray(irfft(series[: count // 2 + 1], count))

    def at(self, times: Floats, h: float) -> Floats:
        """The values at any times, without the frequencies above pi/h that a grid of steps h cannot carry."""
        from scipy.interpolate import CubicSpline

        needed = min(len(self.values), math.ceil(self.period / h))
        fine = self.sampled(_FINER * needed, math.pi / h)
        whole = np.linspace(0.0, self.period, len(fine) + 1)
        return np.asarray(CubicSpline(whole, np.append(fine, fine[0]), bc_type="periodic")(np.mod(times, self.period)))


@dataclass(frozen=True, eq=False)
class TabulatedDensity:
    """A one-sided density over ascending frequencies: straight lines in log-log between them, zero outside.

    Where one end of a segment is 0 the line is straight in the density itself.
    """

    frequencies: Floats
    values: Floats

    @property
    def rms(self) -> float:
        """The root of the density's integral."""
        return math.sqrt(float(self.below(self.frequencies[-1:])[0]))

    @property
    def width(self) -> float:
        """The bandwidth (integral of G)^2/(integral of G^2): of several bands about that of the narrowest."""
        top = self.values.max()
        square = TabulatedDensity(self.frequencies, (self.values / top) ** 2)
        return float((self.rms**2 / top / square.rms) ** 2)

    def scaled(self, time: float, value: float) -> "TabulatedDensity":
        """The density of the acceleration whose times are multiplied by ``time`` and accelerations by ``value``."""
        return TabulatedDensity(self.frequencies / time, self.values * value**2 * time)

    def at(self, frequencies: Floats) -> Floats:
        """The density at frequencies between the first and the last, in their shape."""
        f, g = self.frequencies, self.values
        k = np.clip(np.searchsorted(f, frequencies, "right") - 1, 0, len(f) - 2)
        straight, share = g[k] * g[k + 1] == 0.0, np.log(frequencies / f[k]) / np.log(f[k + 1] / f[k])
        ratio = np.where(straight, 1.0, g[k + 1]) / np.where(straight, 1.0, g[k])
        return np.asarray(np.where(straight, np.interp(frequencies, f, g), g[k] * ratio**share))

    def below(self, frequencies: Floats) -> Floats:
        """The density's integral up to any frequencies, in their shape."""
        f = self.frequencies
        whole = np.append(0.0, np.cumsum(self._within(np.arange(len(f) - 1), f[1:])))
        at = np.clip(frequencies, f[0], f[-1])
        k = np.minimum(np.searchsorted(f, at, "right"), len(f) - 1) - 1
        return np.asarray(whole[k] + self._within(k, at))

    def _within(self, k: Any, f: Floats) -> Floats:
        """The integral from the beginning of the segments k up to f: of G ~ f^p, or of a straight line beside a 0."""
        low, high, left, right = self.frequencies[k], self.frequencies[k + 1], self.values[k], self.values[k + 1]
        straight = left * right == 0.0
        way = f - low
        line = way * (left + 0.5 * (right - left) * way / (high - low))
        ratio = np.where(straight, 1.0, right) / np.where(straight, 1.0, left)
        u = np.log(f / low)
        z = u * (1.0 + np.log(ratio) / np.log(high / low))
        law = left * low * u * np.where(z == 0.0, 1.0, np.expm1(z) / np.where(z == 0.0, 1.0, z))
        return np.asarray(np.where(straight, line, law))

    def record(self, h: float, rng: np.random.Generator, width: float = math.inf) -> Record:
        """Make a record with random phases, for a grid of steps h and a response of the bandwidth ``width``.

        Its lines are 1/period apart, and each has the power of the density half-way to its neighbours: the sum is near
        Gaussian, and has the whole power of a band that is narrower than that.  The period is `SPAN`, or longer so that
        `LINES` are in the narrowest band.

        Raises InputError where that would be more than `MOST_SAMPLES`, or a step of h carries nothing of the density.
        """
        from scipy.fft import irfft

        count = round(max(min(SPAN, MOST_SAMPLES * h), LINES / min(self.width, width)) / h)
        if count > MOST_SAMPLES:
            raise InputError(
                "excitation.acceleration_psd_file must have no band, and the device no resonance, so narrow that "
                f"{LINES:g} lines in it take more than {MOST_SAMPLES} steps, but these take {count} of {h:.2g}/w0: "
                "give a longer `dt`, a larger `within`, or for shaking of one frequency an acceleration_amplitude"
            )
        period = count * h
        lines = np.arange(1, (count + 1) // 2)
        powers = np.diff(self.below(np.append(0.0, lines + 0.5) / period))
        series = np.zeros(count // 2 + 1, complex)
        if not powers.any():
            raise InputError(
                f"excitation.acceleration_psd_file must have densities below {math.pi / h:.2g} times w0, which a step "
                f"of {h:.2g}/w0 can carry, but has none there"
            )
        series[lines] = np.sqrt(0.5 * powers) * np.exp(2j * math.pi * rng.uniform(size=len(lines))) * count
        return Record(h, np.asarray(irfft(series, count)))


def read_record(path: str) -> Record:
    """Read the record of a CSV file, in SI units, with its `bridge`.

    Raises InputError in one line, for a file that cannot be read or has no such columns, times that do not ascend in
    equal steps, values that are no finite numbers, or too few of them.
    """
    time, values = _columns_of(path, "acceleration_file", ("time", TIME), ("acceleration", ACCELERATION))
    key, steps = "excitation.acceleration_file", np.diff(time)
    if len(time) < FEWEST:
        raise invalid(key, f"have at least {FEWEST} rows", len(time))
    if not (steps > 0.0).all():
        raise InputError(f"{key} must have ascending times, but row {int(np.argmin(steps > 0.0)) + 2} does not")
    spacing = float(time[-1] - time[0]) / len(steps)
    off = np.abs(time - time[0] - spacing * np.arange(len(time)))
    if off.max() > UNEVEN * spacing:
        raise InputError(f"{key} must have equal steps of time, but row {int(off.argmax()) + 1} is off")
    if not values.any():
        raise invalid(key, "have accelerations other than 0", 0.0)
    return Record(spacing, np.append(values, bridge(values)))


def read_density(path: str) -> TabulatedDensity:
    """Read the density of a CSV file, in SI units; InputError as for `read_record`."""
    f, values = _columns_of(path, "acceleration_psd_file", ("frequency", FREQUENCY), ("psd", ACCELERATION_PSD))
    key = "excitation.acceleration_psd_file"
    if len(f) < 2 or not (f[0] > 0.0 and (np.diff(f) > 0.0).all()):
        raise InputError(f"{key} must have two ascending frequencies above 0 or more, but has not")
    if not (values >= 0.0).all() or not values.any():
        raise InputError(f"{key} must have densities of at least 0, and some above, but has not")
    return TabulatedDensity(f, values)


def bridge(values: Floats) -> Floats:
    """The samples between the last and the first, `BRIDGE` steps later: a cubic with the slopes of both ends."""
    before = 1.5 * values[-1] - 2.0 * values[-2] + 0.5 * values[-3]
    after = -1.5 * values[0] + 2.0 * values[1] - 0.5 * values[2]
    s = np.arange(1, BRIDGE) / BRIDGE
    ends = values[-1] * (1 + 2 * s) * (1 - s) ** 2 + values[0] * s**2 * (3 - 2 * s)
    return np.asarray(ends + BRIDGE * (before * s * (1 - s) ** 2 - after * s**2 * (1 - s)))


def _columns_of(path: str, name: str, *columns: tuple[str, Kind]) -> tuple[Floats, ...]:
    """The columns of a file, by their names, in SI units; a file that did not change is read once."""
    try:
        state = Path(path).stat()
    except (OSError, ValueError):  # `_read` says why
        return _read(path, name, columns, None)
    return _read(path, name, columns, (state.st_mtime_ns, state.st_size))


@lru_cache(8)
def _read(
    path: str, name: str, columns: tuple[tuple[str, Kind], ...], _state: tuple[int, int] | None
) -> tuple[Floats, ...]:
    key = f"excitation.{name}"
    text = files.read(path, key, MOST_BYTES)
    try:
        rows = list(csv.reader(io.StringIO(text.decode("utf-8-sig"), newline=None)))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{key} must be a CSV file in UTF-8, but {shown(path)} is not: {error}") from None
    rows = [row for row in rows if row and not row[0].lstrip().startswith("#")]
    heads = rows[0] if rows else []
    return tuple(_column(rows[1:], heads, key, *column) for column in columns)


def _column(rows: list[list[str]], heads: list[str], key: str, name: str, kind: Kind) -> Floats:
    matches = [re.fullmatch(rf"\s*{name}\s*\((.+)\)\s*", head) for head in heads]
    place = next((k for k, one in enumerate(matches) if one), None)
    if place is None:
        has = shown(",".join(heads)) if not heads or "(" in "".join(heads) else "none with a unit"  # but any text
        raise InputError(f"{key} must have a column '{name} ({kind.unit})', but has {has}")
    unit = matches[place]
    assert unit is not None
    try:
        factor = kind.read(f"1 {unit[1]}")
    except ValueError:
        raise invalid(f"{key} column {name!r}", f"have a unit such as {kind.unit}", unit[1]) from None
    values = np.empty(len(rows))
    for k, row in enumerate(rows):
        try:
            values[k] = float(row[place])
        except (ValueError, IndexError):
            values[k] = math.nan
        if not abs(values[k] * factor) <= LARGEST:
            got = row[place] if place < len(row) else ""
            raise invalid(f"{key} column {name!r} row {k + 1}", f"be a number of at most {LARGEST:g} in size", got)
    return values * factor
