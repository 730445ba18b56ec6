"""Two aims at once: the largest power for each bound of another quantity, which is the front of what can be had.

The quantity's best value in the ranges and its value at the largest power are the ends; between them the power is made
as large as it can be under a bound that goes from one to the other (epsilon constraint; Haimes, Lasdon, Wismer 1971).
"""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harvester.arrays import Floats
from harvester.engines.formula import Formula
from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError, invalid, names_arguments, unknown
from harvester.studies.extremes.levels import rice_holds
from harvester.studies.optimum.answer import Optimum
from harvester.studies.optimum.evaluations import Tick
from harvester.studies.optimum.optimise import optimise
from harvester.studies.optimum.ranges import Range, ranges, spread
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.robust.engine import Robust
from harvester.studies.robust.front import FrontPoint, ParetoFront
from harvester.studies.robust.optimise import read_share, robust_engine, with_counted_peaks
from harvester.studies.robust.sampled_front import sampled_front
from harvester.studies.tolerance.limits import QUANTITIES, Limit, lifetime_of
from harvester.studies.tolerance.limits import parse as read_limit
from harvester.uncertainty.value import Value

POINTS, MOST_POINTS = 9, 50
SCANNED = 96  # places that are looked at for the best value of the second aim
TENFOLD = 10.0  # between the ends, from which on the bounds are spread by ratio
BUDGET = "budget"  # of the warnings of a search, those that say that it was cut short
BARELY = 1e-6  # relative difference of the ends that is none
WAYS = {"low": -1, "high": 1}


@names_arguments
def pareto(
    scene: AnyScene,
    over: Sequence[Range] | Mapping[str, tuple[float | str, float | str]],
    aim: str,
    vary: Mapping[str, str] | Sequence[str] = (),
    share: float | str | None = None,
    limits: Sequence[str] = (),
    engine: Named | None = None,
    *,
    points: int = POINTS,
    lifetime: float | str | None = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    out: str | Path | None = None,
    tick: Tick | None = None,
    vector: Sequence[str] = (),
) -> ParetoFront:
    """The front of two aims: much power, and little (or much) of another quantity.

    ``aim`` is the quantity, "peak_displacement" or another that `harvester.tolerance` may limit, to be low; with
    ":high" behind it, to be high.  The other arguments are those of `harvester.optimise_robust`; the front has up to
    ``points`` designs, and the ``budget`` is for all of them.  An engine that samples gives the best of places that
    fill the ranges, and says which others cannot be told from them (`harvester.studies.robust.sampled_front`).  ``out``
    is a folder for pareto.csv, pareto.png and provenance.json.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> hv.pareto(scene, {"nondimensional.mu": (0.1, 10.0)}, "voltage")
    Traceback (most recent call last):
    harvester.errors.InputError: unknown quantity of `pareto` 'voltage': did you mean 'voltage_rms'?

    Raises
    ------
    InputError
        for an aim or a number of points that cannot be, and as `harvester.optimise_robust`.
    HarvesterError
        where the engine fails everywhere, the last error.
    """
    begin, problem, found = time.perf_counter(), Problem.of(scene), ranges(over)
    quantity, sign = _aim(aim)
    if not 2 <= points <= MOST_POINTS:
        raise invalid("`points`", f"be between 2 and {MOST_POINTS}", points)
    asked = number(Request(budget=budget).budget) or 0.0
    folder = None if out is None else OutputFolder(out, vector)
    texts = [limits] if isinstance(limits, str) else limits
    bounds = tuple(read_limit(text, problem.physical) for text in texts)
    aimed = Limit(quantity, sign, -sign * np.inf, "")  # which any value meets
    years = lifetime_of([*bounds, aimed], lifetime, problem)
    part = read_share(share)
    chosen = None if engine is None else engine_of(engine)
    if chosen is not None and not isinstance(chosen, Formula) and not vary and part is None:
        if reason := chosen.refusal(problem):
            raise InputError(reason)
        target = number(Request(within=within).within) or 0.0
        sampled = sampled_front(problem, found, aimed, bounds, chosen, years, target, asked, tick)
        taken = time.perf_counter() - begin
        some = ParetoFront(
            chosen.NAME, quantity, sign, sampled.points, problem.physical, taken, sampled.warnings, sampled.alike
        )
        return _saved(some, folder, problem, found, aim, texts)
    free = robust_engine(problem, found, vary, part, (*bounds, aimed), engine, years)
    if years is not None and not rice_holds(problem):
        free, asked, tick = with_counted_peaks(free, problem, found, asked, tick)
    search = _Search(problem, found, free, within, asked / (points + 1), tick, points + 1)
    most = search.best(free)
    end = search.extreme(sign)
    best, designs, warnings = end.quantity, [most], list[str]()
    if abs(best - most.quantity) > BARELY * max(abs(best), abs(most.quantity)):
        designs.append(end)
        for bound in _bounds(best, most.quantity, points)[1:-1]:
            limited = Limit(quantity, sign, float(bound), "")
            designs.append(search.best(dataclasses.replace(free, limits=(*bounds, limited))))
    else:
        warnings.append(f"there is nothing to choose: the most power has the best {quantity} too")
    told = tuple(dict.fromkeys([*warnings, *search.warnings]))
    taken = time.perf_counter() - begin
    answer = ParetoFront(free.engine.NAME, quantity, sign, _front(designs, sign), problem.physical, taken, told)
    return _saved(answer, folder, problem, found, aim, texts)


def _saved(
    answer: ParetoFront,
    folder: OutputFolder | None,
    problem: Problem,
    found: Sequence[Range],
    aim: str,
    limits: Sequence[str],
) -> ParetoFront:
    """The answer, whose files are written where there is a folder."""
    if folder is not None:
        over_ends = {one.key: [one.low, one.high] for one in found}
        about = provenance(problem, over=over_ends, pareto=aim, limits=list(limits), engine=answer.engine)
        folder.save("pareto", answer.text(), answer.plot(problem.scene.title), about)
    return answer


def _aim(text: str) -> tuple[str, int]:
    """The quantity of the second aim, and whether it is to be low (-1) or high (1)."""
    name, colon, way = text.partition(":")
    known = [one for one in QUANTITIES if one != "mean_power"]
    if name not in known:
        raise unknown("quantity of `pareto`", name, known)
    if colon and way not in WAYS:
        raise invalid("`pareto`", f"be {name}:low or {name}:high", text)
    return name, WAYS[way or "low"]


def _bounds(best: float, most: float, points: int) -> Floats:
    """The bounds from the best value of the quantity to that at the most power, both among them."""
    low, high = sorted((abs(best), abs(most)))
    if best * most > 0.0 and high > TENFOLD * low:
        return np.geomspace(best, most, points)
    return np.linspace(best, most, points)


def _front(designs: Sequence[FrontPoint], sign: int) -> tuple[FrontPoint, ...]:
    """The designs that no other beats in both aims, from the best quantity on."""
    kept: list[FrontPoint] = []
    for one in sorted(designs, key=lambda point: (-sign * point.quantity, -point.mean_power.value)):
        if not kept or one.mean_power.value > kept[-1].mean_power.value:
            kept.append(one)
    return tuple(kept)


@dataclass
class _Search:
    """The searches of one front, which share the ``budget`` of each and the progress of all."""

    problem: Problem
    ranges: tuple[Range, ...]
    free: Robust
    within: float | str
    budget: float
    tick: Tick | None
    parts: int
    done: int = 0
    warnings: list[str] = dataclasses.field(default_factory=list)

    def best(self, robust: Robust) -> FrontPoint:
        """The design of most power that keeps the limits of an engine."""
        part, parts, tick = self.done, self.parts, self.tick
        told = None if tick is None else lambda share: tick(min((part + share) / parts, 1.0))
        found: Optimum = optimise(self.problem, self.ranges, robust, self.within, self.budget, None, told)
        self.done += 1
        self.warnings += [word for word in found.warnings if BUDGET in word]
        return self._design({key.range.key: key.value for key in found.keys})

    def _design(self, keys: dict[str, float]) -> FrontPoint:
        """The design at values of the keys."""
        place = self.free.place(self.problem.scene.varied(keys))[1]
        error = None if place.off is None else place.off * abs(place.aim)
        return FrontPoint(keys, Value(place.aim, model=error), place.quantities[-1])

    def extreme(self, sign: int) -> FrontPoint:
        """The design with the best value of the quantity in the ranges: the best of many places, climbed from."""
        from scipy.optimize import minimize

        def values(u: Floats) -> dict[str, float]:
            return {r.key: r.value(float(np.clip(x, 0.0, 1.0))) for r, x in zip(self.ranges, u, strict=True)}

        def loss(u: Floats) -> float:
            try:
                place = self.free.place(self.problem.scene.varied(values(u)))[1]
            except HarvesterError:
                return np.inf
            return np.inf if place.broken else -sign * place.quantities[-1]

        places = spread(SCANNED, len(self.ranges))
        self.free.run_many([self.problem.scene.varied(values(u)) for u in places])  # together, which is quicker
        first = min(places, key=loss)
        if not np.isfinite(loss(first)):
            raise InputError(
                "`limit` must be met somewhere in the ranges for a front, but no place was found that does"
            )
        box = [(0.0, 1.0)] * len(self.ranges)
        options = {"maxfev": 60 * len(self.ranges), "xatol": 1e-4, "fatol": 0.0}
        climbed = minimize(loss, first, method="Nelder-Mead", bounds=box, options=options)
        return self._design(values(min(first, climbed.x, key=loss)))
