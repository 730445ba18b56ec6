"""The search for the optimum of an engine of formulas: a scan, its peaks climbed by the simplex method, a level set.

If the power is P(u) with a model error of at most m(u), the true optimum lies among the u with

    P(u) + m(u) >= P(best) - m(best),

however the errors are correlated.  The interval of each key is the extent of that set, found by
scans of ever smaller boxes about it.
"""

from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import Engine
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.studies.optimum.evaluations import (
    Evaluation,
    SpentError,
    Surface,
    flatness,
    local_maxima,
    served,
)
from harvester.studies.optimum.ranges import spread
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.uncertainty.value import Value

SCAN = {1: 129, 2: 513, 3: 1025, 4: 2049}
STARTS = 5
ROUNDS = 3  # scans of the level set
_SAME = 1e-4  # a relative dip between two peaks that is none
_END = 1e-4  # of the range: nearer to its end than this is at it


def search(surface: Surface, engine: Engine, interval: bool = True) -> SearchResult:
    """Find the peaks that a scan shows, and, if ``interval`` asks for it, the interval of the best.

    Raises HarvesterError if every place fails, the last error.
    """
    return FormulaSearch(surface, engine, len(surface.points)).find(interval)


@dataclass
class FormulaSearch:
    """A search over a surface whose evaluations from ``begin`` on are its own."""

    surface: Surface
    engine: Engine
    begin: int

    def find(self, interval: bool) -> SearchResult:
        """As `search`."""
        missing = ""
        climbed = list[Peak]()
        try:
            self.evaluate(spread(SCAN[self.surface.dimensions], self.surface.dimensions), "scan")
        except SpentError:
            missing = "scan"
        u, power, _ = self.served()
        if flat := flatness(power):
            return SearchResult((self.highest(),), flat)
        if not missing:
            try:
                climbed = [
                    self.climb(u[start], len(u)) for start in local_maxima(u, power)[:STARTS]
                ]
            except SpentError:
                missing = "climb"
        climbed = self.separate(climbed) if climbed and not missing else [self.highest()]
        best, *others = climbed
        if missing:
            cut = warning("search_cut_short", stage=missing, budget=self.surface.budget)
            return SearchResult((replace(best, why=cut), *others), warnings=(cut,))
        if best.power.model is None or not interval:
            return SearchResult((replace(best, why=note("no_model_error")), *others))
        return self.with_interval(others)

    def with_interval(self, others: list[Peak]) -> SearchResult:
        """The best place with the extent of its level set, before the ``others``."""
        warnings = list[Diagnostic]()
        try:
            low, high = self.level_set()
        except SpentError:
            low, high = self.hull()
            warnings.append(warning("interval_rough"))
        if any(np.all((peak.u >= low) & (peak.u <= high)) for peak in others):
            warnings.insert(0, warning("other_peak_within_model"))
        # the scans may have come nearer than the climb
        best = replace(self.highest(), low=low, high=high)
        flat = note("flat_within_model") if np.all(high - low > 1 - _END) else None
        return SearchResult((best, *others), flat, tuple(warnings))

    def evaluate(self, where: Floats, stage: str) -> list[Evaluation]:
        """Evaluate places (n, keys); raises SpentError if the budget ends."""
        return self.surface.evaluate(where, self.engine, stage)

    def served(self) -> tuple[Floats, Floats, list[Value]]:
        """The places, powers and values of the search's own evaluations.

        Raises the last error if all failed.
        """
        return served(self.surface.points[self.begin :])

    def highest(self, begin: int | None = None) -> Peak:
        """The best place so far, of the evaluations from ``begin`` on."""
        peak = Peak.best_of(self.surface.points[self.begin if begin is None else begin :])
        return replace(
            peak, faces=np.where(peak.u < _END, -1.0, np.where(peak.u > 1.0 - _END, 1.0, 0.0))
        )

    def climb(self, start: Floats, scanned: int) -> Peak:
        """Climb by the simplex method within the ranges, from a simplex as large as the scan's spacing."""
        from scipy.optimize import minimize

        begin = len(self.surface.points)
        n = len(start)
        size = scanned ** (-1.0 / n)
        simplex = np.vstack([start, start + np.where(start < 0.5, size, -size) * np.eye(n)])
        scale = 0.0

        def down(u: Floats) -> float:
            nonlocal scale
            power = self.evaluate(u[None], "climb")[0].power
            if power is None:
                return 1.0  # worse than any power
            scale = scale or abs(power.value) or 1.0
            return -power.value / scale

        options = {"initial_simplex": simplex, "xatol": 1e-5, "fatol": 1e-10, "maxfev": 80 * n}
        minimize(down, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * n, options=options)
        return self.highest(begin)

    def separate(self, peaks: list[Peak]) -> list[Peak]:
        """The peaks that have a dip between them, best first; on one hill only the best."""
        kept: list[Peak] = []
        for peak in sorted(peaks, key=lambda p: -p.power.value):
            if not any(self.on_one_hill(peak, other) for other in kept):
                kept.append(peak)
        return kept

    def on_one_hill(self, peak: Peak, higher: Peak) -> bool:
        """Whether the power never dips below that of a peak on the way to a higher one."""
        between = peak.u + np.array([0.25, 0.5, 0.75])[:, None] * (higher.u - peak.u)
        try:
            values = [p.power for p in self.evaluate(between, "between")]
        except SpentError:
            return True
        return all(v is not None and v.value >= (1.0 - _SAME) * peak.power.value for v in values)

    def hull(self) -> tuple[Floats, Floats]:
        """The extent of the places that may be the optimum."""
        u, power, values = self.served()
        model = np.array([v.known_error95 for v in values])
        best = int(np.argmax(power))
        held = u[power + model >= power[best] - model[best]]
        return held.min(axis=0), held.max(axis=0)

    def level_set(self) -> tuple[Floats, Floats]:
        """The `hull` after scans of ever smaller boxes, its ends moved outwards by the last scan's spacing."""
        n = self.surface.dimensions
        spacing = np.full(n, SCAN[n] ** (-1.0 / n))
        for _ in range(ROUNDS):
            low, high = self.hull()
            low = np.maximum(low - 1.5 * spacing, 0.0)
            high = np.minimum(high + 1.5 * spacing, 1.0)
            self.evaluate(low + spread(SCAN[n], n) * (high - low), "level set")
            spacing = (high - low) * SCAN[n] ** (-1.0 / n)
        low, high = self.hull()
        return np.maximum(low - spacing, 0.0), np.minimum(high + spacing, 1.0)


def trusted(points: list[Evaluation], most: float) -> bool:
    """Whether all evaluations have answers whose model error is known and at most ``most`` of the power."""
    values = [p.power for p in points]
    return all(
        v is not None and v.model is not None and v.known_error95 <= most * abs(v.value)
        for v in values
    )
