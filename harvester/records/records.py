"""Recorded excitation: an acceleration over time, or a table of its density over frequency.

`harvester.records.record_files` reads them.  Between its points a density is a straight line in
log-log; next to a 0, which has no logarithm, it is one in the density itself.

A record is repeated for ever.  One that comes back to its beginning as smoothly as it runs is used
unchanged (`whole_period`); the end of any other is joined to its beginning by a cubic over
`BRIDGE` steps, which nobody recorded. Between its samples it is the Fourier series through them, of
which a grid of steps h resolves the part below pi/h: nothing is folded back.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError

BRIDGE = 4  # steps
EDGE = 64  # samples beside a piece, over which it fades
# fourth difference to the RMS below which a join can be judged; and to the largest inside
SMOOTH, KINK = 0.05, 1.5
# other joins of a record; and the share of them that may be smooth
TRIES = 4096
LOOKED_AT = 32
CHANCE = 2e-3
SPAN = 8192.0  # period of a record made from a density, in units of 1/w0
LINES = 12.0  # of such a record in the narrowest band, at least: E[V^2] is then off by 1 % at worst
MOST_SAMPLES = 2**20  # of such a record, of which an ensemble has 64 or more: 0.5 GB
_FINER = 8  # points of a fine grid to one that the content needs, for cubic interpolation


@dataclass(frozen=True, eq=False)
class Record:
    """One period of a record: samples of shape (n,), ``spacing`` apart.

    ``exact``: the excitation is just that Fourier series, as that of a profile, rather than the
    reading of a sensor. ``bridged``: the last samples are those of a `bridge`.
    """

    spacing: float
    values: Floats
    exact: bool = False
    bridged: bool = False

    @classmethod
    def of(cls, spacing: float, values: Floats) -> "Record":
        """The record of samples that a sensor read: their whole period, or with a `bridge` from end to beginning."""
        period = whole_period(values)
        if period is not None:
            return cls(spacing, period)
        return cls(spacing, np.append(values, bridge(values)), bridged=True)

    @property
    def mean_jerk(self) -> float:
        """E|a'|, of the Fourier series at 8 times a sample."""
        fine = self.at_even_times(8 * len(self.values))
        return float(np.abs(np.diff(fine, append=fine[0])).sum()) / self.period

    @property
    def period(self) -> float:
        """The time after which the record repeats."""
        return self.spacing * len(self.values)

    @property
    def rms(self) -> float:
        """The root of the mean square of the samples."""
        return float(np.sqrt(np.mean(self.values**2)))

    @property
    def count(self) -> int:
        """The samples that were read."""
        return len(self.values) - (BRIDGE - 1 if self.bridged else 0)

    def part(self, begin: int, end: int) -> Floats:
        """Some of its samples."""
        return self.values[begin:end]

    def resampled(self, begin: int, windows: int, samples: int, steps: int) -> Floats:
        """The values at ``steps`` even times a window of so many ``samples``, from a window on.

        Before and after the samples that were read there are none.  They are those of the Fourier
        series of the piece, which fades over `EDGE` samples next to it.
        """
        from scipy.fft import next_fast_len

        edge = math.ceil(EDGE / samples)
        # windows, of a number whose Fourier series is quick
        whole = next_fast_len(windows + 2 * edge, True)
        low = (begin - edge) * samples
        high = (begin - edge + whole) * samples
        values = np.zeros(high - low)
        first = max(low, 0)
        last = max(min(high, self.count // samples * samples), low, 0)
        values[first - low : last - low] = self.part(first, last)
        fade = np.sin(0.5 * math.pi * np.arange(edge * samples) / (edge * samples)) ** 2
        values[: len(fade)] *= fade
        values[len(values) - len(fade) :] *= fade[::-1]
        fine = Record(self.spacing, values).at_even_times(whole * steps)
        return np.ascontiguousarray(fine[edge * steps : (windows + edge) * steps])

    def scaled(self, time: float, value: float) -> "Record":
        """The record with its times multiplied by ``time`` and its values by ``value``, as for other units."""
        return Record(self.spacing * time, self.values * value, self.exact, self.bridged)

    def at_even_times(self, count: int, cut: float = math.inf) -> Floats:
        """The Fourier series at ``count`` even times of a period, without frequencies above theirs or above ``cut``."""
        from scipy.fft import irfft, rfft

        series = rfft(self.values) * (count / len(self.values))
        highest = min(0.5 * count, cut * self.period / (2.0 * math.pi))
        # of both signs
        series[-1] *= 0.5 if count > len(self.values) and len(self.values) % 2 == 0 else 1.0
        series[np.arange(len(series)) >= highest] = 0.0
        return np.asarray(irfft(series[: count // 2 + 1], count))

    def at(self, times: Floats, h: float) -> Floats:
        """The values at any times, without the frequencies above pi/h that a grid of steps h cannot carry."""
        from scipy.interpolate import CubicSpline

        fine = self.at_even_times(
            _FINER * min(len(self.values), math.ceil(self.period / h)), math.pi / h
        )
        whole = np.linspace(0.0, self.period, len(fine) + 1)
        return np.asarray(
            CubicSpline(whole, np.append(fine, fine[0]), bc_type="periodic")(
                np.mod(times, self.period)
            )
        )


@dataclass(frozen=True, eq=False)
class TabulatedDensity:
    """A one-sided density over ascending frequencies: straight lines in log-log between them, zero outside.

    If one end of a segment is 0 the line is straight in the density itself.
    """

    frequencies: Floats
    values: Floats

    @property
    def rms(self) -> float:
        """The root of the density's integral."""
        return math.sqrt(float(self.below(self.frequencies[-1:])[0]))

    @property
    def width(self) -> float:
        """The bandwidth (integral of G)^2/(integral of G^2): for several bands about that of the narrowest."""
        top = self.values.max()
        square = TabulatedDensity(self.frequencies, (self.values / top) ** 2)
        return float((self.rms**2 / top / square.rms) ** 2)

    def scaled(self, time: float, value: float) -> "TabulatedDensity":
        """The PSD of the acceleration whose times are multiplied by ``time`` and accelerations by ``value``."""
        return TabulatedDensity(self.frequencies / time, self.values * value**2 * time)

    def at(self, frequencies: Floats) -> Floats:
        """The density at frequencies between the first and the last, in their shape."""
        f, g = self.frequencies, self.values
        k = np.clip(np.searchsorted(f, frequencies, "right") - 1, 0, len(f) - 2)
        straight = g[k] * g[k + 1] == 0.0
        share = np.log(frequencies / f[k]) / np.log(f[k + 1] / f[k])
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
        """The integral from the beginning of the segments k up to f, for G ~ f^p or a straight line next to a 0."""
        low = self.frequencies[k]
        high = self.frequencies[k + 1]
        left = self.values[k]
        right = self.values[k + 1]
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

        Its lines are 1/period apart, and each has the power of the PSD half-way to its neighbours:
        the sum is near
        Gaussian, and has the whole power in a band that is narrower than that.  The period is
        `SPAN`, or longer so that `LINES` are in the narrowest band.

        Raises InputError if that would be more than `MOST_SAMPLES`, or a step of h carries nothing
        of the density.
        """
        from scipy.fft import irfft

        count = round(max(min(SPAN, MOST_SAMPLES * h), LINES / min(self.width, width)) / h)
        if count > MOST_SAMPLES:
            raise InputError(
                "excitation.acceleration_psd_file must have no band, and the device no resonance, so narrow that "
                f"{LINES:g} lines in it need more than {MOST_SAMPLES} steps, but these need {count} of {h:.2g}/w0: "
                "give a longer `dt`, a larger `within`, or for excitation at one frequency an acceleration_amplitude"
            )
        lines = np.arange(1, (count + 1) // 2)
        powers = np.diff(self.below(np.append(0.0, lines + 0.5) / (count * h)))
        series = np.zeros(count // 2 + 1, complex)
        if not powers.any():
            raise InputError(
                f"excitation.acceleration_psd_file must have densities below {math.pi / h:.2g} times w0, which a step "
                f"of {h:.2g}/w0 can carry, but has none there"
            )
        series[lines] = (
            np.sqrt(0.5 * powers) * np.exp(2j * math.pi * rng.uniform(size=len(lines))) * count
        )
        return Record(h, np.asarray(irfft(series, count)))


def whole_period(values: Floats) -> Floats | None:
    """The samples of one period if a record holds whole periods, else None.

    The last sample is either the one before the first, or the first again.  Across the join the
    fourth differences, which see a jump of the value, slope or curvature, must be no larger than
    inside.  A record so rough that they are large everywhere cannot show that it is periodic, nor
    can one whose ends are so quiet that others would join.
    """
    inside = np.abs(np.diff(values, 4))
    if not inside.std() < SMOOTH * values.std():
        return None
    most = KINK * inside.max()
    for period in (values, values[:-1]):
        if np.abs(np.diff(np.append(period[-4:], period[:4]), 4)).max() <= most:
            return None if _joined_by_chance(period, most) > CHANCE else period
    return None


def _joined_by_chance(period: Floats, most: float) -> float:
    """The share of other joins, of places as quiet as the ends, that are as smooth though the continuation differs."""
    off = np.abs(period - period.mean())
    quiet = np.lib.stride_tricks.sliding_window_view(off, 4).max(axis=1) <= max(
        off[:4].max(), off[-4:].max()
    )
    begins = np.random.default_rng(0).choice(np.flatnonzero(quiet), (TRIES, 2))
    joined = period[begins[:, :, None] + np.arange(4)].reshape(TRIES, 8)
    smooth = np.flatnonzero(np.abs(np.diff(joined, 4)).max(axis=1) <= most)
    # at most: of white noise that is what it makes
    noise = np.sqrt(np.mean(np.diff(period, 4) ** 2) / 70.0)
    after = np.arange(len(period) // 4)
    first = np.array([[4], [0]])
    follow = (
        period.take(begins[k][:, None] + first + after, mode="wrap") for k in smooth[:LOOKED_AT]
    )
    other = [
        np.sqrt(np.mean((first_part - second_part) ** 2)) > 2.0 * noise
        for first_part, second_part in follow
    ]
    return float(len(smooth) / TRIES * np.mean(other)) if other else 0.0


def bridge(values: Floats) -> Floats:
    """The samples between the last and the first, `BRIDGE` steps later: a cubic with the slopes of both ends."""
    before = 1.5 * values[-1] - 2.0 * values[-2] + 0.5 * values[-3]
    after = -1.5 * values[0] + 2.0 * values[1] - 0.5 * values[2]
    s = np.arange(1, BRIDGE) / BRIDGE
    ends = values[-1] * (1 + 2 * s) * (1 - s) ** 2 + values[0] * s**2 * (3 - 2 * s)
    return np.asarray(ends + BRIDGE * (before * s * (1 - s) ** 2 - after * s**2 * (1 - s)))
