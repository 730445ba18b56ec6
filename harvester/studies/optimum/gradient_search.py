"""The search for the optimum of an engine that knows the gradient of the power, without noise.

For the logarithm L(u) of the power over the unit cube of the keys, a scan finds the starts, a
quasi-Newton method (L-BFGS-B) climbs from there within the ranges, and a Newton step with the
curvature H = d2L/du2, from differences of the gradient g, ends the climb:

    u* = u - H^-1 g,    error of u* = |H^-1| (error of g) (1 + t) + t |u* - u|,
    t = |g(u + h) + g(u - h) - 2 g(u)|/|g(u + h) - g(u - h)|

The error of g is that of the engine's own solution; t, by which the curvature changes over h, is
the terms beyond second order.  Keys at an end of their range, if the power would rise beyond it,
stay there.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.errors import HarvesterError
from harvester.presentation.diagnostic import note, warning
from harvester.studies.optimum.evaluations import (
    Evaluation,
    SpentError,
    Surface,
    flatness,
    local_maxima,
    served,
)
from harvester.studies.optimum.ranges import problem_at, spread
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.uncertainty.value import Value

SCAN = {1: 9, 2: 17, 3: 33, 4: 65}
STARTS = 2
FINER = 0.1  # of the error that is asked for: that of the climb's evaluations
SPACING = 0.5  # of the range: the first step where the gradient of the logarithm of the power is 1
NEAR = 1e-4  # of the range: the nearest that a place comes to its end
LEVEL = 1e-3  # slope of the logarithm of the power along the range at which a climb ends
SEPARATION = 0.03  # of the range: nearer peaks are one
MOST = 12  # evaluations of a climb
CURVED = 0.02  # of the range: steps by which the curvature is seen
FAR = 5.0  # such steps that the last Newton step may go


@dataclass(frozen=True)
class Slopes:
    """The gradient of L at a place of the cube and its error, shape (keys,)."""

    u: Floats
    value: float
    slopes: Floats
    error: Floats


def search(surface: Surface, engine: Any) -> SearchResult:
    """Find the peaks from the best places of a scan, and the interval of the best.

    Raises HarvesterError if every place fails, the last error.
    """
    return GradientSearch(surface, engine).find()


@dataclass
class GradientSearch:
    """A search over a surface by an engine with a gradient."""

    surface: Surface
    engine: Any

    def find(self) -> SearchResult:
        """As `search`."""
        surface = self.surface
        n = self.surface.dimensions
        where = np.clip(spread(SCAN[n], n), NEAR, 1.0 - NEAR)
        scanned = True
        missing = ""
        climbed = list[Peak]()
        try:
            surface.evaluate(where, self.engine.at_many_points, "scan")
        except SpentError:
            scanned = False
            missing = "scan"
        u, power, _ = served(surface.points)
        if flat := flatness(power):
            return SearchResult((Peak.best_of(surface.points),), flat, scanned=scanned)
        if not missing:
            try:
                for start in local_maxima(u, power)[:STARTS]:
                    if not any(self._leads_to(u[start], other.u) for other in climbed):
                        climbed.append(self._peak(self._climb(u[start])))
            except SpentError:
                missing = "climb"
        if missing:
            cut = warning("search_cut_short", stage=missing, budget=surface.budget)
            if climbed:  # the best start led to its peak, another had no time
                return SearchResult(tuple(climbed), warnings=(cut,))
            return SearchResult(
                (Peak.best_of(surface.points, cut),), warnings=(cut,), scanned=scanned
            )
        kept = list[Peak]()
        for peak in sorted(climbed, key=lambda peak: -peak.power.value):
            if all(np.abs(peak.u - other.u).max() > SEPARATION for other in kept):
                kept.append(peak)
        return SearchResult(tuple(kept))

    def _at(self, u: Floats, stage: str, errors: bool = False) -> Slopes:
        """The power and its gradient at a place; raises SpentError if the budget has ended."""
        surface = self.surface
        if surface.left < (1.0 - surface.share) * surface.budget:
            raise SpentError
        u = np.clip(u, NEAR, 1.0 - NEAR)
        u = u + [
            0.01 * NEAR * (r.value(float(at)) == 0.0)
            for r, at in zip(surface.ranges, u, strict=True)
        ]
        answer, gradient = self.engine.run_with_slopes(problem_at(surface.scene, surface.ranges, u))
        surface.points.append(Evaluation(u, self.engine.NAME, stage, None, answer))
        surface.progress.step(min(1.0 - surface.left / surface.budget, 1.0))
        stretch = np.array([r.slope(float(x)) for r, x in zip(surface.ranges, u, strict=True)])
        keys = [r.key for r in surface.ranges]
        known = [
            gradient.with_error(k) if errors else Value(gradient.elasticity(k), bias=0.0)
            for k in keys
        ]
        slopes, error = (
            np.array([getattr(value, part) for value in known]) for part in ("value", "bias")
        )
        return Slopes(u, answer.mean_power.value, stretch * slopes, np.abs(stretch) * error)

    def _leads_to(self, start: Floats, top: Floats) -> bool:
        """Whether the way from a place to a peak rises at its beginning and in its middle: one hill."""
        way = top - start
        return all(
            float(self._at(start + part * way, "climb").slopes @ way) > 0.0 for part in (0.0, 0.5)
        )

    def _climb(self, start: Floats) -> Floats:
        """The highest place that a quasi-Newton climb reaches from a place."""
        from scipy.optimize import minimize

        best: list[Slopes] = []

        def down(w: Floats) -> tuple[float, Floats]:
            try:
                here = self._at(SPACING * w, "climb")
            except HarvesterError:
                # a place without an answer, which no line search takes
                return 1e3, np.zeros(len(w))
            best.append(here)
            return -math.log(max(here.value, 1e-300) / best[0].value), -SPACING * here.slopes

        ends = [(NEAR / SPACING, (1.0 - NEAR) / SPACING)] * len(start)
        options = {"maxfun": MOST, "ftol": 1e-12, "gtol": SPACING * LEVEL}
        minimize(down, start / SPACING, jac=True, method="L-BFGS-B", bounds=ends, options=options)
        return max(best, key=lambda point: point.value).u

    def _peak(self, u: Floats) -> Peak:
        """The peak near a place where a climb has ended, with its interval."""
        here = self._at(u, "curvature", errors=True)
        power = self._last.mean_power
        low = here.u <= NEAR * 1.5
        high = here.u >= 1.0 - NEAR * 1.5
        faces = np.where(
            low & (here.slopes < 0.0), -1.0, np.where(high & (here.slopes > 0.0), 1.0, 0.0)
        )
        free = np.flatnonzero(faces == 0.0)
        top = np.where(faces < 0.0, 0.0, np.where(faces > 0.0, 1.0, here.u))
        if not len(free):
            return Peak(top, power, faces, top, top)
        curvature = np.zeros((len(free), len(free)))
        third = 0.0
        for row, k in enumerate(free):
            middle = np.clip(here.u[k], NEAR + CURVED, 1.0 - NEAR - CURVED)
            ends = [
                np.where(np.arange(len(u)) == k, middle + step, here.u)
                for step in (-CURVED, CURVED)
            ]
            less, more = (self._at(end, "curvature").slopes[free] for end in ends)
            curvature[row] = (more - less) / (2.0 * CURVED)
            uneven = (
                np.linalg.norm(more + less - 2.0 * here.slopes[free])
                if middle == here.u[k]
                else np.inf
            )
            third = max(third, float(uneven / np.linalg.norm(more - less)))
        curvature = 0.5 * (curvature + curvature.T)
        if np.linalg.eigvalsh(curvature).max() >= 0.0 or third >= 1.0:
            return Peak(top, power, faces, why=note("no_curvature"))
        inverse = -np.linalg.inv(curvature)
        step = np.clip(inverse @ here.slopes[free], -FAR * CURVED, FAR * CURVED)
        half = np.zeros(len(u))
        half[free] = (np.abs(inverse) @ here.error[free]) * (1.0 + third) + third * np.abs(step)
        top[free] = np.clip(here.u[free] + step, 0.0, 1.0)
        low95 = np.clip(top - half, 0.0, 1.0)
        high95 = np.clip(top + half, 0.0, 1.0)
        return Peak(top, power, faces, low95, high95, why=note("by_gradient", third=third))

    @property
    def _last(self) -> Estimate:
        """The answer of the last evaluation."""
        answer = self.surface.points[-1].answer
        assert isinstance(answer, Estimate), "it has just been answered"
        return answer
