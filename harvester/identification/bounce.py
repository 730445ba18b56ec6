"""A ring-down against a rigid stop: flights in closed form, x'+ = -r x'- at x = -gap.

    x = e^(-k t) (x0 cos w t + (v0 + k x0)/w sin w t),   k = w0/(2 Q),  w = sqrt(w0^2 - k^2)

`start` reads the flights one by one: between two impacts the motion is linear, so for a given
frequency and quality its amplitudes are linear least squares; the speeds before and after each
impact give the restitution coefficient.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError

MOST = 2000  # impacts
FEWEST = 8  # samples of a swing
LARGE = 0.15  # of the range: swings that tell their frequency
KINK = 0.4  # jump of the speed over the fastest speed nearby, beyond that of a sine
# swings of the parts that a start is fitted to, one after the other
HORIZONS = (2.2, 4.0, 8.0, 16.0, 32.0)
LOOKED_AT = 80  # samples of the first part that the points of the grid are compared at
STARTS = 6  # points of the grid that fits begin from
GOOD = 1.1  # times the noise: a residual that no other start would make smaller


@dataclass(frozen=True)
class Bounce:
    """A device against a stop and the state that it starts from: Hz, 1, 1, m, m, m/s.

    ``zero`` is the sensor's (m).
    """

    frequency: float
    quality: float
    restitution: float
    gap: float
    x0: float
    v0: float
    zero: float


def path(b: Bounce, t: Floats) -> Floats:
    """The sensor's output at ascending times t (s), shape (n,).

    In a flight x'(s) = e^(-k s) C cos(w s + phi), so that its turning points are known exactly:
    if the lowest one is above the stop no later one meets it, as swings decay; else the crossing
    lies before it, after the highest one.
    """
    w0 = 2.0 * math.pi * b.frequency
    k = 0.5 * w0 / b.quality
    w = math.sqrt(max(w0 * w0 - k * k, 1e-12 * w0 * w0))
    at = float(t[0])
    x = b.x0
    v = b.v0
    out = np.empty(len(t))
    slowest = 1e-6 * (w * abs(b.x0) + abs(b.v0) + w * abs(b.gap))
    first = 0
    for _ in range(MOST):
        p = x
        q = (v + k * x) / w
        phi = math.atan2(p * w + k * q, v)
        top, bottom = ((turn * math.pi - phi) % (2.0 * math.pi) for turn in (0.5, 1.5))
        meets = math.exp(-k * bottom / w) * (p * math.cos(bottom) + q * math.sin(bottom)) < -b.gap
        hit = (
            _crossing(p, q, k / w, b.gap, top if top < bottom else 0.0, bottom) / w
            if meets
            else math.inf
        )
        last = int(np.searchsorted(t, at + hit)) if meets else len(t)
        s = t[first:last] - at
        out[first:last] = np.exp(-k * s) * (p * np.cos(w * s) + q * np.sin(w * s))
        first = last
        if first >= len(t):
            break
        speed = math.exp(-k * hit) * (v * math.cos(w * hit) - (p * w + k * q) * math.sin(w * hit))
        at = at + hit
        x = -b.gap
        v = -b.restitution * min(speed, 0.0)
        if v <= slowest:  # it rests on the stop, or barely leaves
            if b.gap <= 0.0:
                break
            x = -b.gap * (1.0 - 1e-12)
    out[first:] = -b.gap
    return out + b.zero


def _crossing(p: float, q: float, k: float, gap: float, low: float, high: float) -> float:
    """The angle between two at which e^(-k a) (p cos a + q sin a) falls through -gap: by Brent's method."""
    from scipy.optimize import brentq

    def above(a: float) -> float:
        return math.exp(-k * a) * (p * math.cos(a) + q * math.sin(a)) + gap

    if above(low) <= 0.0:
        return low
    return float(brentq(above, low, high, xtol=1e-14)) if above(high) < 0.0 else high


def impacts(t: Floats, y: Floats) -> list[int]:
    """The samples of the first impacts: lowest points with a corner, at which the speed jumps, up to the first without.

    The jump is measured against the fastest speed nearby; at a turn of a free swing there is
    next to none.
    """
    span = float(np.ptp(y))
    floor = float(np.quantile(y, 0.01))
    low = (y[1:-1] <= y[:-2]) & (y[1:-1] < y[2:]) & (y[1:-1] < floor + 0.15 * span)
    lows: list[int] = []
    for k in np.flatnonzero(low) + 1:
        if lows and y[lows[-1] : k + 1].max() - max(y[lows[-1]], y[k]) < 0.05 * span:
            lows[-1] = int(k) if y[k] < y[lows[-1]] else lows[-1]  # noise about one impact
        else:
            lows.append(int(k))
    if not lows:
        return []
    flight = float(np.median(np.diff(lows))) if len(lows) > 1 else 0.5 * lows[0] + FEWEST
    reach = max(3, round(flight / 30.0))
    # jump of a sine over these samples
    smooth = 2.0 * math.sin(min(math.pi * (reach + 1) / flight, 0.5 * math.pi))
    speeds = np.abs(np.gradient(np.convolve(y, np.ones(reach) / reach, "same"), t))
    speeds[:reach] = speeds[-reach:] = 0.0  # where the mean lacks samples
    return list(
        itertools.takewhile(lambda k: _jump(t, y, k, reach, speeds, flight) > KINK + smooth, lows)
    )


def _jump(t: Floats, y: Floats, k: int, reach: int, speeds: Floats, flight: float) -> float:
    """The speed's jump at a sample over the fastest speed nearby."""
    parts = slice(max(k - reach, 0), k), slice(k + 1, k + 1 + reach)
    if parts[0].stop - parts[0].start < 3 or parts[1].stop > len(t):
        return math.inf if k < 3 else 0.0
    before, after = (np.polyfit(t[p] - t[k], y[p], 1)[0] for p in parts)
    return float((after - before) / speeds[max(k - round(flight), 0) : k + round(flight)].max())


def meets_stop(t: Floats, y: Floats) -> bool:
    """Whether a ring-down meets a stop."""
    return len(t) > 4 * FEWEST and bool(impacts(t, y))


def first_sample(t: Floats, y: Floats) -> int:
    """The start from which a ring-down against a stop is fitted: its beginning, or the first impact if too near."""
    at = impacts(t, y)
    return 0 if not at or at[0] >= FEWEST else at[0] + 1


def noise_of(y: Floats) -> float:
    """The noise of even samples: fourth differences, in which a smooth motion vanishes and a few impacts do not count.

    White noise of variance s^2 gives them a variance of 70 s^2.  For few samples per swing it is
    too high.
    """
    return max(
        1.4826 * float(np.median(np.abs(np.diff(y, 4)))) / math.sqrt(70.0), 1e-9 * float(np.ptp(y))
    )


def start(
    t: Floats, y: Floats, frequency: float | None = None, quality: float | None = None
) -> Bounce:
    """Starting values: the best of several fits to more and more of the path, from the best points of a grid.

    ``frequency`` (Hz) and ``quality`` are those that other measurements give.

    Raises InputError if there are too few samples in a swing.
    """
    swing = frequency or _frequency(t, y)
    if len(t) / (t[-1] - t[0]) < FEWEST * swing:
        raise InputError(
            f"FILE must have {FEWEST} samples a swing or more for a restitution coefficient"
        )
    noise = noise_of(y)
    horizons = [int(np.searchsorted(t, t[0] + n / swing)) for n in HORIZONS]
    horizons = [n for n in horizons if n < len(t)] + [len(t)]
    ends: list[tuple[float, Bounce]] = []
    for begin in _grid(
        t[: horizons[0]], y[: horizons[0]], swing, frequency is not None, quality or 60.0
    ):
        bounce = begin
        for n in horizons:
            bounce = _refined(t[:n], y[:n], bounce, noise)
        ends.append((float(np.std(y - path(bounce, t))), bounce))
        if ends[-1][0] < GOOD * noise:
            break
    return min(ends, key=lambda end: end[0])[1]


def _frequency(t: Floats, y: Floats) -> float:
    """The frequency of the large swings: the highest line of their speed's spectrum, if a decaying mean is small."""
    large = np.abs(y - np.median(y)) > LARGE * np.ptp(y)
    n = min(int(np.flatnonzero(large)[-1]) + FEWEST, len(t))
    even = np.linspace(t[0], t[n - 1], n)
    lines = np.fft.rfft(np.gradient(np.interp(even, t[:n], y[:n])) * np.hanning(n), 8 * n)
    lines[:4] = 0.0  # less than half a swing
    return float(np.argmax(np.abs(lines[: len(lines) // 3])) / (8 * n * (even[1] - even[0])))


def _grid(t: Floats, y: Floats, swing: float, sure: bool, quality: float) -> list[Bounce]:
    """The best points of a grid over frequency, place of rest and restitution for the first swings.

    The stop is at the lower end of the samples; the swings have the frequency of the device, or up
    to its double if the stop cuts them.  The start of the first flight is by linear least squares.
    """
    low, high = float(y.min()), float(y.max())
    first = max(int(np.argmax(y < low + 0.1 * (high - low))), 4)
    pick = slice(None, None, max(1, len(t) // LOOKED_AT))
    size = 0.05 * (high - low)
    candidates: list[tuple[float, Bounce]] = []
    for f in [swing] if sure else swing * np.geomspace(0.45, 1.1, 31):
        w = 2.0 * math.pi * f
        k = math.pi * f / quality
        s = t[:first] - t[0]
        basis = (
            np.exp(-k * s)[:, None]
            * np.array([np.cos(w * s) + k / w * np.sin(w * s), np.sin(w * s) / w]).T
        )
        for zero in low + (high - low) * np.linspace(0.0, 0.6, 13):
            (x0, v0), *_ = np.linalg.lstsq(basis, y[:first] - zero, rcond=None)
            for r in (0.15, 0.35, 0.55, 0.75, 0.92):
                bounce = Bounce(
                    frequency=float(f),
                    quality=quality,
                    restitution=r,
                    gap=float(zero - low),
                    x0=float(x0),
                    v0=float(v0),
                    zero=float(zero),
                )
                off = (path(bounce, t[pick]) - y[pick]) / size
                candidates.append((float(np.sum(np.log1p(off * off))), bounce))
    candidates.sort(key=lambda candidate: candidate[0])
    return [bounce for _, bounce in candidates[:STARTS]]


def _refined(t: Floats, y: Floats, b: Bounce, noise: float) -> Bounce:
    """The bounce that is nearest to the first part of a path."""
    from scipy.optimize import least_squares

    size = float(np.ptp(y))

    def bounce_of(p: Floats) -> Bounce:
        f, q = (float(v) for v in np.exp(np.clip(p[:2], -20.0, 20.0)))
        gap, x0, v0, zero = (size * float(v) for v in p[3:])
        return Bounce(
            frequency=f, quality=q, restitution=float(p[2]), gap=gap, x0=x0, v0=v0 * f, zero=zero
        )

    p = [math.log(b.frequency), math.log(b.quality), b.restitution, b.gap / size, b.x0 / size]
    p += [b.v0 / size / b.frequency, b.zero / size]
    low = np.array([-np.inf, math.log(0.6), 0.0, *[-np.inf] * 4])
    high = np.array([np.inf, math.log(1e5), 1.0, *[np.inf] * 4])
    solution = least_squares(
        lambda p: (path(bounce_of(p), t) - y) / max(3.0 * noise, 0.003 * size),
        np.clip(p, low + 1e-6, high - 1e-6),
        bounds=(low, high),
        loss="soft_l1",
        x_scale="jac",
        max_nfev=25,
    )
    return bounce_of(solution.x)
