"""The power of a device as a sum of one parabola per key, through runs of each key alone.

About the middle x0 of all spreads, with answers y0 there and yl, yh at the ends xl, xh of a key,

    s = (yh - y0)/(xh - x0),  t = (y0 - yl)/(x0 - xl),  c = (s - t)/(xh - xl)
    y(x) = y0 + sum_k b_k (x_k - x0_k) + c_k (x_k - x0_k)^2,
    b_k = (yh_k - yl_k)/(xh_k - xl_k) - c_k (xh_k + xl_k - 2 x0_k)

which are Newton's divided differences.  All runs are on the same noise, so that a difference has a
far smaller error than a power.  Noise makes the square of a curvature larger by its own variance,
which is subtracted; the slope between the ends remains.  The contribution of several keys together
is missing: runs of sampled devices state its size, and a polynomial through the rest adds it if
they are enough.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.studies.tolerance.surface import Polynomial, fit
from harvester.uncertainty.value import student95

# sampled devices for each coefficient of a plane, before a polynomial through the rest
PER_PLANE = 4
FEWEST = 4  # sampled devices that state a scatter by themselves
MOST = 0.95  # of the devices
FARTHEST = 0.975  # of the devices, whose rest beyond the samples may be off by its change there


@dataclass(frozen=True)
class CurvedLaw:
    """Parabolas of the keys about ``middle``, with ``slopes`` and ``curvatures``, shape (keys,).

    ``rest`` is the polynomial through the rest (None: absent), ``scatter`` the distance from the
    whole within which 95 % of devices lie, ``unexplained`` the fraction of the variance that it
    misses, and ``ratio`` a factor of all values.
    """

    middle: Floats
    value: float
    slopes: Floats
    curvatures: Floats
    rest: Polynomial | None = None
    scatter: float = 0.0
    unexplained: float = 0.0
    ratio: float = 1.0

    def __call__(self, x: Floats) -> Floats:
        """The values at keys' values, shape (n, keys), at least 0."""
        return np.asarray(self.ratio * np.maximum(self.sum_at(x), 0.0))

    def sum_at(self, x: Floats) -> Floats:
        """The sum of the parabolas and the rest at keys' values, shape (n, keys), also below 0."""
        away = x - self.middle
        whole = self.value + away @ self.slopes + self.bend(x)
        return np.asarray(whole if self.rest is None else whole + self.rest(x))

    def bend(self, x: Floats) -> Floats:
        """The contribution of the curvatures at keys' values, shape (n, keys)."""
        return np.asarray((x - self.middle) ** 2 @ self.curvatures)


def through_ends(
    ends: Floats, values: Floats, errors: Floats | Sequence[float] | None = None
) -> CurvedLaw:
    """The law through answers in the middle, then of each key at its low and its high end.

    ``ends`` are the keys' values, shape (1 + 2 keys, keys), ``values`` the answers, and ``errors``
    the standard errors of the curvatures, shape (keys,) (None: 0).
    """
    keys = np.arange(ends.shape[1])
    x0 = ends[0]
    xl = ends[1::2][keys, keys]
    xh = ends[2::2][keys, keys]
    y0 = values[0]
    upper = _slope(xh - x0, values[2::2] - y0)
    lower = _slope(x0 - xl, y0 - values[1::2])
    # ends of a negative value may be in falling order
    curvatures = np.where((xh - x0) * (x0 - xl) > 0.0, _slope(xh - xl, upper - lower), 0.0)
    if errors is not None:
        curvatures = without_noise(curvatures, errors)
    slopes = _slope(xh - xl, values[2::2] - values[1::2]) - curvatures * (xh + xl - 2.0 * x0)
    return CurvedLaw(x0, float(y0), slopes, curvatures)


def without_noise(curvatures: Floats, errors: Floats | Sequence[float]) -> Floats:
    """Curvatures with squares from which the variance of their noise is subtracted, at least 0."""
    squares = np.maximum(curvatures**2 - np.asarray(errors) ** 2, 0.0)
    return np.asarray(np.copysign(np.sqrt(squares), curvatures))


def weights(ends: Floats, k: int) -> tuple[float, float, float]:
    """The weights by which a key's curvature is a sum of the answers in the middle and at both ends."""
    low = ends[0, k] - ends[1 + 2 * k, k]
    high = ends[2 + 2 * k, k] - ends[0, k]
    if low * high <= 0.0:
        return 0.0, 0.0, 0.0
    return -1.0 / (low * high), 1.0 / (low * (low + high)), 1.0 / (high * (low + high))


def _slope(dx: Floats, dy: Floats) -> Floats:
    """The slope dy/dx; 0 for a key with an end at its middle."""
    return np.asarray(np.divide(dy, dx, out=np.zeros_like(dy), where=dx != 0.0))


def steepest(law: CurvedLaw, x: Floats, far: float) -> Floats:
    """The two places of `first_order` for devices at ``x``, shape (2, keys)."""
    spread = np.atleast_2d(np.cov(x.T)) @ law.slopes
    step = far * spread / max(float(np.sqrt(law.slopes @ spread)), 1e-300)
    return np.clip(law.middle + np.outer([-1.0, 1.0], step), x.min(axis=0), x.max(axis=0))


def checked(
    law: CurvedLaw, x: Floats, y: Floats, held: Floats, devices: Floats, corners: int = 0
) -> CurvedLaw:
    """The law with its scatter and its rest, by the answers ``y`` of devices at ``x``, (n, keys).

    The first ``corners`` of them are `steepest`, which were chosen rather than sampled: their
    distance from the law is the least scatter.  With fewer than `FEWEST` sampled devices the
    contribution of the curvatures, within which 95 % of ``devices`` lie, adds to the scatter.
    ``held`` are the keys' values of the law's runs, without a rest.
    """
    if not len(y):
        return replace(law, unexplained=1.0)
    off = y - law(x)
    by_sample = off[corners:]
    count = len(by_sample)
    spread = float(np.sqrt(np.mean((by_sample if count else off) ** 2)))
    scatter = 0.0
    if count:
        scatter = student95(count) * spread * float(np.sqrt(1.0 + 1.0 / count))
    scatter = max(scatter, float(np.abs(off[:corners]).max(initial=0.0)))
    if count < FEWEST:
        scatter += float(np.quantile(np.abs(law.bend(devices)), MOST))
    variance = max(float(law(devices).var()), 1e-300)
    plain = replace(law, scatter=scatter, unexplained=min(spread**2 / variance, 1.0))
    if count < PER_PLANE * (1 + x.shape[1]):
        return plain
    # a rest of the sum below 0 too, to which it is added
    beyond = y - law.sum_at(x)
    rest = fit(
        np.vstack([x[corners:], x[:corners], held]),
        np.concatenate([beyond[corners:], beyond[:corners], np.zeros(len(held))]),
        count,
    )
    if rest.scatter >= spread:
        return plain
    missed = min(rest.scatter**2 / variance, 1.0)
    # a prediction interval by the leverage of devices, and the change beyond the sampled ones
    wide = float(np.sqrt(1.0 + np.quantile(rest.leverage(devices), MOST)))
    wide *= student95(max(count - len(rest.coefficients), 1))
    beyond_samples = float(np.quantile(rest.change_beyond(devices), FARTHEST))
    return replace(law, rest=rest, scatter=wide * rest.scatter + beyond_samples, unexplained=missed)


def noise(
    law: CurvedLaw, errors: Sequence[float], bend_errors: Sequence[float], ends: Floats, x: Floats
) -> float:
    """The noise of slopes and curvatures in devices at ``x``, as a standard deviation.

    ``errors`` are the standard errors of the differences between each key's ends, ``bend_errors``
    those of the curvatures.
    """
    keys = np.arange(ends.shape[1])
    width = np.abs(ends[2::2][keys, keys] - ends[1::2][keys, keys])
    relative = np.divide(x.std(axis=0), width, out=np.zeros_like(width), where=width > 0.0)
    bends = np.asarray(bend_errors) * np.sqrt(((x - law.middle) ** 4).mean(axis=0))
    return float(law.ratio * np.linalg.norm([np.asarray(errors) * relative, bends]))
