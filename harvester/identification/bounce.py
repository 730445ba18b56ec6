"""A ring-down against a rigid stop: flights in closed form, x'+ = -r x'- where the mass meets x = -gap.

    x = e^(-k t) (x0 cos w t + (v0 + k x0)/w sin w t),   k = w0/(2 Q),  w = sqrt(w0^2 - k^2)

`start` reads the flights one by one: between two impacts the motion is linear, so for a given frequency and quality
its amplitudes are linear least squares; the speeds before and after each impact give the restitution coefficient.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError

MOST = 2000  # impacts
FEWEST, FLIGHTS, POINTS = 8, 12, 24  # samples of a flight; flights and points of each that the start is found from
KINK = 0.4  # jump of the speed over the fastest speed nearby, beyond that of a sine
LOOKS = 48  # points of a period at which an impact is looked for


@dataclass(frozen=True)
class Bounce:
    """A device against a stop and the state that it starts from: Hz, 1, 1, m, m, m/s; ``zero`` is the sensor's (m)."""

    frequency: float
    quality: float
    restitution: float
    gap: float
    x0: float
    v0: float
    zero: float


def path(b: Bounce, t: Floats) -> Floats:
    """What the sensor shows at ascending times t (s), shape (n,)."""
    w0 = 2.0 * math.pi * b.frequency
    k = 0.5 * w0 / b.quality
    w = math.sqrt(max(w0 * w0 - k * k, 1e-12 * w0 * w0))
    at, x, v = float(t[0]), b.x0, b.v0
    out = np.empty(len(t))
    looked = np.linspace(0.0, 2.0 * math.pi / w, LOOKS + 1)[1:]
    envelope, cosine, sine = np.exp(-k * looked), np.cos(w * looked), np.sin(w * looked)
    first = 0
    for _ in range(MOST):
        p, q = x, (v + k * x) / w
        below = envelope * (p * cosine + q * sine) < -b.gap
        hit = math.inf
        if below.any():
            n = int(below.argmax())
            hit = _crossing(p, q, k, w, b.gap, looked[n - 1] if n else 0.0, float(looked[n]))
        last = len(t) if hit == math.inf else int(np.searchsorted(t, at + hit))
        s = t[first:last] - at
        out[first:last] = np.exp(-k * s) * (p * np.cos(w * s) + q * np.sin(w * s))
        first = last
        if first >= len(t):
            break
        fall = math.exp(-k * hit)
        c, d = math.cos(w * hit), math.sin(w * hit)
        speed = fall * ((q * w - k * p) * c - (p * w + k * q) * d)
        at, x, v = at + hit, -b.gap, -b.restitution * min(speed, 0.0)
        if v * w <= 1e-6 * w * w * (abs(b.x0) + abs(b.v0) / w + abs(b.gap)):  # it rests on the stop, or barely leaves
            if b.gap <= 0.0:
                break
            x = -b.gap * (1.0 - 1e-12)
    out[first:] = -b.gap
    return out + b.zero


def _crossing(p: float, q: float, k: float, w: float, gap: float, low: float, high: float) -> float:
    """The time between two where x falls through -gap: bisection that ends with secant steps."""

    def above(s: float) -> float:
        return math.exp(-k * s) * (p * math.cos(w * s) + q * math.sin(w * s)) + gap

    low = max(low, 1e-9 * high)
    a, b = above(low), above(high)
    if a <= 0.0:
        return low
    for n in range(40):
        middle = 0.5 * (low + high) if n < 4 or n % 3 == 2 else low + (high - low) * a / (a - b)
        y = above(middle)
        if abs(y) < 1e-14 * (abs(p) + abs(q)):
            return middle
        if y > 0.0:
            low, a = middle, y
        else:
            high, b = middle, y
    return 0.5 * (low + high)


def impacts(t: Floats, y: Floats) -> list[int]:
    """The samples of the first impacts: lowest points with a corner, where the speed jumps, up to the first without.

    The jump is measured against the fastest speed nearby; where a free swing turns there is next to none.
    """
    span, floor = float(np.ptp(y)), float(np.quantile(y, 0.01))
    low = (y[1:-1] <= y[:-2]) & (y[1:-1] < y[2:]) & (y[1:-1] < floor + 0.15 * span)
    found: list[int] = []
    for k in np.flatnonzero(low) + 1:
        if found and y[found[-1] : k + 1].max() - max(y[found[-1]], y[k]) < 0.05 * span:
            found[-1] = int(k) if y[k] < y[found[-1]] else found[-1]  # noise about one impact
        else:
            found.append(int(k))
    if not found:
        return []
    flight = float(np.median(np.diff(found))) if len(found) > 1 else 0.5 * found[0] + FEWEST
    reach = max(3, round(flight / 30.0))
    smooth = 2.0 * math.sin(min(math.pi * (reach + 1) / flight, 0.5 * math.pi))  # jump of a sine over these samples
    speeds = np.abs(np.gradient(np.convolve(y, np.ones(reach) / reach, "same"), t))
    speeds[:reach] = speeds[-reach:] = 0.0  # where the mean lacks samples
    return list(itertools.takewhile(lambda k: _jump(t, y, k, reach, speeds, flight) > KINK + smooth, found))


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
    """From where a ring-down against a stop is fitted: its beginning, or the first impact where that is too near."""
    at = impacts(t, y)
    return 0 if not at or at[0] >= FEWEST else at[0] + 1


def start(t: Floats, y: Floats) -> Bounce:
    """Starting values: from the flights between impacts, then from a fit to more and more of the path.

    Raises InputError where there are too few samples between the impacts.
    """
    at = impacts(t, y)
    length = round(float(np.median(np.diff(at)))) if len(at) > 1 else round(0.8 * (len(t) - at[0] - 1))
    ends = [-1, *at[:FLIGHTS], min(at[min(len(at), FLIGHTS) - 1] + length, len(t) - 1)]
    pieces = [slice(a + 1, b) for a, b in itertools.pairwise(ends)]
    pieces = list(itertools.takewhile(lambda p: p.stop - p.start >= FEWEST, pieces))
    if len(pieces) < 2:
        raise InputError(f"FILE must have {FEWEST} samples between two impacts or more for a restitution coefficient")
    flight = float(np.median(np.diff(t[at]))) if len(at) > 1 else 4.0 * float(t[at[0]] - t[0])
    shares = np.linspace(0.45, 1.1, 40) if len(at) > 1 else np.geomspace(0.2, 5.0, 80)
    grid = itertools.product(shares / flight, (8.0, 20.0, 50.0, 200.0))
    found = min((_flights(t, y, pieces, f, q) for f, q in grid), key=lambda one: one[0])[1]
    size, last = float(np.ptp(y)), 0
    for count in (1, 2, 4, 8, 16, 32):
        end = at[min(count, len(at) - 1)] + length if count < len(at) else len(t)
        if last < len(t):
            found = _refined(t[:end], y[:end], found, size)
        last = end
    return found


def _refined(t: Floats, y: Floats, b: Bounce, size: float) -> Bounce:
    """The bounce that is nearest to the first part of a path."""
    from scipy.optimize import least_squares

    def bounce_of(p: Floats) -> Bounce:
        f, q = (float(v) for v in np.exp(np.clip(p[:2], -20.0, 20.0)))
        gap, x0, v0, zero = (size * float(v) for v in p[3:])
        return Bounce(f, q, float(p[2]), gap, x0, v0 * f, zero)

    p = [math.log(b.frequency), math.log(b.quality), b.restitution, b.gap / size, b.x0 / size]
    p += [b.v0 / size / b.frequency, b.zero / size]
    low = np.array([-np.inf, math.log(0.6), 0.0, *[-np.inf] * 4])
    high = np.array([np.inf, math.log(1e5), 1.0, *[np.inf] * 4])
    found = least_squares(
        lambda p: (path(bounce_of(p), t) - y) / (0.01 * size),
        np.clip(p, low + 1e-6, high - 1e-6),
        bounds=(low, high),
        loss="soft_l1",
        x_scale="jac",
        max_nfev=25,
    )
    return bounce_of(found.x)


def _flights(t: Floats, y: Floats, pieces: list[slice], f: float, quality: float) -> tuple[float, Bounce]:
    """The residual of flights at a frequency and quality, and the bounce that they make."""
    w = 2.0 * math.pi * f
    k = 0.5 * w / quality
    picked = [np.unique(np.linspace(p.start, p.stop - 1, POINTS).astype(int)) for p in pieces]
    rows = [len(p) for p in picked]
    basis = np.zeros((sum(rows), 2 * len(pieces) + 1))
    basis[:, -1] = 1.0
    first = 0
    for n, (piece, points) in enumerate(zip(pieces, picked, strict=True)):
        s = t[points] - t[piece.start]
        fall = np.exp(-k * s)
        basis[first : first + rows[n], 2 * n] = fall * np.cos(w * s)
        basis[first : first + rows[n], 2 * n + 1] = fall * np.sin(w * s)
        first += rows[n]
    values = y[np.concatenate(picked)]
    found, *_ = np.linalg.lstsq(basis, values, rcond=None)
    residual = float(np.sum((basis @ found - values) ** 2))
    a, b, zero = found[:-1:2], found[1:-1:2], float(found[-1])
    length = np.array([t[p.stop] - t[p.start] for p in pieces])
    fall, c, d = np.exp(-k * length), np.cos(w * length), np.sin(w * length)
    before = fall * ((b * w - k * a) * c - (a * w + k * b) * d)
    after = b * w - k * a
    good = (before[:-1] < 0.0) & (after[1:] > 0.0)
    r = float(np.clip(np.median(-after[1:][good] / before[:-1][good]) if good.any() else 0.7, 0.02, 0.99))
    gap = -float(np.median(fall * (a * c + b * d)))
    return residual, Bounce(float(f), quality, r, gap, float(a[0]), float(after[0]), zero)
