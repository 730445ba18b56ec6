"""95 % intervals by profile: how far a quantity may move before the best fit with it fixed is worse by chance's amount.

    S(c) = min of the weighted sum of squares over all parameters with g(p) = c
    the interval is the range in which S(c) - S(best) <= t^2 k,  t = Student's 0.975 quantile

k is 1 if the noise is that of its channel's level; if it grows with the signal, or is rare and
large, the residuals determine how much more g scatters (the sandwich variance over the plain one),
and k is that, never below 1. Along the way the other parameters follow by Gauss and Newton's steps
with the Jacobian of the best fit.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.identification.fit import DeviceFit
from harvester.uncertainty.value import student95

Quantity = Callable[[dict[str, float]], float]
STEPS, FOLLOW = 4, 4  # of the search for an end; of the other parameters at each


@dataclass(frozen=True)
class ProfileInterval:
    """The value of a quantity, its 95 % interval, and its standard error by linear propagation."""

    value: float
    low: float
    high: float
    error: float


def hull(intervals: Sequence[ProfileInterval]) -> ProfileInterval:
    """The first value, from the lowest to the highest end of all intervals."""
    low = min(interval.low for interval in intervals)
    high = max(interval.high for interval in intervals)
    return replace(intervals[0], low=low, high=high)


class Profiles:
    """The intervals of one fit."""

    def __init__(self, fit: DeviceFit) -> None:
        self.fit = fit
        # what nothing determines varies by 1e6
        curvature = fit.jacobian.T @ fit.jacobian + 1e-12 * np.eye(len(fit.p))
        scale = 1.0 / np.sqrt(np.diag(curvature))
        self.plain = np.linalg.inv(
            curvature * np.outer(scale, scale) + 1e-14 * np.eye(len(scale))
        ) * np.outer(scale, scale)
        meat = (
            (fit.jacobian * fit.residual[:, None] ** 2).T
            @ fit.jacobian
            * (len(fit.residual) / fit.dof)
        )
        self.robust = self.plain @ meat @ self.plain
        self.sum = float(fit.residual @ fit.residual)
        self.reach = student95(fit.dof)

    def correlations(self) -> Floats:
        """The correlation of the fitted parameters, shape (m, m)."""
        scale = np.sqrt(np.diag(self.plain))
        return np.asarray(self.plain / np.outer(scale, scale))

    def interval(self, quantity: Quantity, above_0: bool) -> ProfileInterval:
        """The interval of a quantity of the parameters.

        ``above_0``: it is searched in the logarithm.
        """

        def g(p: Floats) -> float:
            try:
                value = quantity(self.fit.values(p))
            except (OverflowError, ZeroDivisionError):  # far from any device
                value = math.inf
            return math.log(max(value, 1e-300)) if above_0 else value

        p = self.fit.p
        steps = 1e-6 * np.maximum(1.0, np.abs(p))
        slope = np.array([(g(p + d) - g(p - d)) / (2.0 * d.sum()) for d in np.diag(steps)])
        variance = float(slope @ self.plain @ slope)
        best = g(p)
        if variance <= 0.0:  # all that it is made of is known
            value = math.exp(best) if above_0 else best
            return ProfileInterval(value, value, value, 0.0)
        more = max(1.0, float(slope @ self.robust @ slope) / variance)
        error = math.sqrt(variance * more)
        low, high = (self._end(g, slope, best, way, error, more) for way in (-1.0, 1.0))
        if above_0:
            return ProfileInterval(math.exp(best), math.exp(low), math.exp(min(high, 300.0)), error)
        return ProfileInterval(best, low, high, error)

    def _end(
        self,
        g: Callable[[Floats], float],
        slope: Floats,
        best: float,
        way: float,
        error: float,
        more: float,
    ) -> float:
        """The place at which the profile reaches a limit on one side.

        The linear end if the search does not find it.
        """
        linear = self.reach * error
        if linear > 1.0 and best != 0.0:  # not determined: where exactly it ends does not matter
            return best + way * linear
        direction = self.plain @ slope / float(slope @ self.plain @ slope)
        target = self.reach * math.sqrt(more)
        distance = linear
        for _ in range(STEPS):
            worse = self._profile(g, slope, direction, best, best + way * distance)
            if not worse > 0.0:
                return best + way * linear
            factor = target / math.sqrt(worse)
            distance *= min(max(factor, 0.5), 2.0)
            if abs(factor - 1.0) < 0.01:
                break
        return best + way * min(max(distance, 0.5 * linear), 3.0 * linear)

    def _profile(
        self, g: Callable[[Floats], float], slope: Floats, direction: Floats, best: float, at: float
    ) -> float:
        """S(at) - S(best)."""
        p = self.fit.p + direction * (at - best)
        least = math.inf
        for _ in range(FOLLOW):
            p = p + direction * (at - g(p))
            residual = self.fit.weighted(p)
            now = float(residual @ residual) - self.sum
            if now > least * (1.0 - 1e-3):
                return min(least, now)
            least = now
            step = -self.plain @ (self.fit.jacobian.T @ residual)
            p = p + step - direction * float(slope @ step)
        return least
