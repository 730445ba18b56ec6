"""Recorded shaking: an acceleration over time, or a table of its density over frequency, from CSV files.

The header names the columns with their units, in any order: ``time (s),acceleration (g)`` at equal steps of time, or
``frequency (Hz),psd (g^2/Hz)``, one-sided.

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

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.machine import files
from harvester.scene.kinds import ACCELERATION, ACCELERATION_PSD, FREQUENCY, TIME, Kind

BRIDGE = 4  # steps
FEWEST = 16  # rows of a record
MOST_BYTES = 64_000_000
UNEVEN = 0.01  # of a step: how far a time may be off an even grid
SPAN = 8192.0  # period of a record made from a density, in units of 1/w0
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
    """A one-sided density over ascending frequencies: straight lines in log-log between them, zero outside."""

    frequencies: Floats
    values: Floats

    @property
    def rms(self) -> float:
        """The root of the density's integral, by the trapezoidal rule."""
        return math.sqrt(float(np.trapezoid(self.values, self.frequencies)))

    def scaled(self, time: float, value: float) -> "TabulatedDensity":
        """The density of shaking whose times are multiplied by ``time`` and accelerations by ``value``."""
        return TabulatedDensity(self.frequencies / time, self.values * value**2 * time)

    def at(self, frequencies: Floats) -> Floats:
        """The density at any frequencies, in their shape."""
        with np.errstate(divide="ignore"):
            logs = np.interp(np.log(frequencies), np.log(self.frequencies), np.log(self.values), -np.inf, -np.inf)
        return np.asarray(np.exp(logs))

    def record(self, h: float, rng: np.random.Generator) -> Record:
        """Make a record of the period `SPAN` with random phases, for a grid of steps h.

        Each line has the amplitude sqrt(2 G df): the sum is near Gaussian, and its density exact.
        """
        from scipy.fft import irfft

        count = round(SPAN / h)
        lines = np.arange(1, (count + 1) // 2)
        series = np.zeros(count // 2 + 1, complex)
        phases = np.exp(2j * math.pi * rng.uniform(size=len(lines)))
        series[lines] = np.sqrt(0.5 * self.at(lines / SPAN) / SPAN) * phases * count
        return Record(SPAN / count, np.asarray(irfft(series, count)))


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
        raise InputError(f"{key} must have a column '{name} ({kind.unit})', but has {shown(','.join(heads))}")
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
        if not math.isfinite(values[k]):
            got = row[place] if place < len(row) else ""
            raise invalid(f"{key} column {name!r} row {k + 1}", "be a finite number", got)
    return values * factor
