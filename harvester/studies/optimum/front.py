"""The Pareto front of two objectives: the largest power for each bound on another quantity.

The quantity's best value in the ranges and its value at the largest power are the ends; between
them the power is made as large as it can be under a bound that moves from one to the other (epsilon
constraint; Haimes, Lasdon, Wismer 1971).
"""

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.errors import HarvesterError, InputError
from harvester.machine.progress import PartOfProgress, Progress
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.studies.optimum.optimum_result import CUT_SHORT
from harvester.studies.optimum.pareto_front import FrontPoint, ParetoFront, remarks
from harvester.studies.optimum.ranges import spread
from harvester.studies.optimum.search import Search, SearchRequest
from harvester.studies.optimum.under_limits import followed, robust_of, with_counted_peaks
from harvester.studies.tolerance.device_limits import Limit

SCANNED = 96  # places that are looked at for the best value of the second objective
TENFOLD = 10.0  # between the ends, from which on the bounds are spread by ratio
BARELY = 1e-6  # relative difference of the ends that is none


def front(request: SearchRequest, points: int, progress: Progress) -> ParetoFront:
    """The front of the power and of the quantity that the last limit of the request names, of up to ``points`` designs.

    Raises HarvesterError if the engine fails everywhere, the last error.
    """
    begin = time.perf_counter()
    request, progress = with_counted_peaks(request, progress)
    *bounds, second = robust_of(request).limits
    quantity, sign = second.quantity, second.sign
    search = _Search(
        dataclasses.replace(request, budget=request.budget / (points + 1)), progress, points + 1
    )
    most = search.best()
    end = search.extreme(sign)
    best = end.quantity
    designs = [most]
    warnings = list[Diagnostic]()
    if abs(best - most.quantity) > BARELY * max(abs(best), abs(most.quantity)):
        designs.append(end)
        between = (
            Limit(quantity, sign, float(bound), "")
            for bound in _bounds(best, most.quantity, points)[1:-1]
        )
        designs += [search.best((*bounds, limit)) for limit in between]
    else:
        warnings.append(warning("nothing_to_choose", quantity=quantity))
    kept = _front(designs, sign)
    notes = tuple(dict.fromkeys([*warnings, *search.warnings, *remarks(quantity, sign, kept, ())]))
    seconds = time.perf_counter() - begin
    return ParetoFront(
        engine=robust_of(request).engine.NAME,
        quantity=quantity,
        sign=sign,
        points=kept,
        physical=request.scene.physical,
        seconds=seconds,
        diagnostics=notes,
    )


def _bounds(best: float, most: float, points: int) -> Floats:
    """The bounds from the best value of the quantity to that at the most power, both among them."""
    low, high = sorted((abs(best), abs(most)))
    if best * most > 0.0 and high > TENFOLD * low:
        return np.geomspace(best, most, points)
    return np.linspace(best, most, points)


def _front(designs: Sequence[FrontPoint], sign: int) -> tuple[FrontPoint, ...]:
    """The designs that no other beats in both objectives, from the best quantity on."""
    kept: list[FrontPoint] = []
    for design in sorted(
        designs, key=lambda point: (-sign * point.quantity, -point.mean_power.value)
    ):
        if not kept or design.mean_power.value > kept[-1].mean_power.value:
            kept.append(design)
    return tuple(kept)


@dataclass
class _Search:
    """The searches of one front, each with the budget of the ``request``, which share the progress."""

    request: SearchRequest
    progress: Progress
    parts: int
    done: int = 0
    warnings: list[Diagnostic] = field(default_factory=list)

    def best(self, limits: tuple[Limit, ...] | None = None) -> FrontPoint:
        """The design of most power that keeps limits (None: those of the request)."""
        part = PartOfProgress(self.progress, self.done / self.parts, 1.0 / self.parts)
        request = self.request
        begin = time.perf_counter()
        if limits is not None:
            request = dataclasses.replace(
                request, engine=dataclasses.replace(robust_of(request), limits=limits)
            )
        optimum = Search.begin(request, part).finish()
        self.done += 1
        self.warnings += [word for word in optimum.warnings if word.code in CUT_SHORT]
        left = request.budget - (time.perf_counter() - begin)
        return self._design({key.range.key: key.value for key in optimum.keys}, left)

    def _design(self, keys: dict[str, float], seconds: float) -> FrontPoint:
        """The design at values of the keys, by devices one by one if their polynomial is off."""
        robust = robust_of(self.request)
        scene = self.request.scene.varied(keys)
        searched = robust.outcome(scene)[1]
        budget = self.request.budget * self.parts
        outcome, warnings = followed(robust, scene, searched, seconds, budget)
        codes = {word.code for word in self.warnings}  # those of the first point stand for all
        self.warnings += [word for word in warnings if word.code not in codes]
        return FrontPoint(keys, outcome.power, outcome.quantities[-1])

    def extreme(self, sign: int) -> FrontPoint:
        """The design with the best value of the quantity in the ranges: the best of many places, climbed from."""
        from scipy.optimize import minimize

        begin = time.perf_counter()
        robust = robust_of(self.request)
        scene = self.request.scene
        ranges = self.request.ranges

        def values(u: Floats) -> dict[str, float]:
            return {
                r.key: r.value(float(np.clip(x, 0.0, 1.0))) for r, x in zip(ranges, u, strict=True)
            }

        def loss(u: Floats) -> float:
            try:
                outcome = robust.outcome(scene.varied(values(u)))[1]
            except HarvesterError:
                return np.inf
            return np.inf if outcome.violation else -sign * outcome.quantities[-1]

        scan = spread(SCANNED, len(ranges))
        robust.run_many([scene.varied(values(u)) for u in scan])  # together, which is quicker
        first = min(scan, key=loss)
        if not np.isfinite(loss(first)):
            raise InputError(
                "`limit` must be met somewhere in the ranges for a front, but no place was found that does"
            )
        box = [(0.0, 1.0)] * len(ranges)
        options = {"maxfev": 60 * len(ranges), "xatol": 1e-4, "fatol": 0.0}
        climbed = minimize(loss, first, method="Nelder-Mead", bounds=box, options=options)
        best = values(min(first, climbed.x, key=loss))
        return self._design(best, self.request.budget - (time.perf_counter() - begin))
