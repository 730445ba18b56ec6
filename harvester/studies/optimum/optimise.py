"""The largest mean power over one or several keys of a scene, with intervals of both."""

import dataclasses
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harvester import figures
from harvester.answers.estimate import Estimate
from harvester.engines import Cheapest
from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import Named, default_engine
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.scene.scene import Scene
from harvester.studies.optimum import formula_search
from harvester.studies.optimum.answer import OptimalKey, Optimum, end
from harvester.studies.optimum.evaluations import Surface, Tick, with_options
from harvester.studies.optimum.ranges import Range, problem_at, ranges
from harvester.studies.optimum.sampled_search import SampledSearch
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.studies.output_folder import OutputFolder, provenance

SEARCHED = 0.75  # of the budget at most, so that the rest evaluates the power at the optimum
DISAGREE = 4.0  # standard errors between the surface's power and the last evaluation's that bring a warning


@names_arguments
def optimise(
    scene: AnyScene,
    over: Sequence[Range] | Mapping[str, tuple[float | str, float | str]],
    engine: Named | None = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    out: str | Path | None = None,
    tick: Tick | None = None,
    vector: Sequence[str] = (),
) -> Optimum:
    """Find the values of one or several keys with the largest mean power.

    ``over`` maps each key to the ends of its range, numbers in SI units or texts with their unit; ``engine`` may be a
    name, and is by default `Exact` for a linear scene, else `Ensemble`, for a netlist `Spice`.  ``within`` is the
    relative error of the power at the optimum; at the ends of the keys' intervals, at most a quarter of it is lost.
    Only engines that sample can work towards it.  ``budget`` is in seconds, compilation included; both may be texts
    ("1%", "30s").  ``out`` is a folder for optimise.csv (all evaluations), optimise.png, its ``vector`` forms (svg,
    pdf) and provenance.json.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> best = hv.optimise(scene, {"nondimensional.mu": (0.1, 10.0)}, hv.Averaged())
    >>> f"{best.keys[0].value:.2f}"  # sqrt(1 + beta)
    '1.02'

    Raises
    ------
    InputError
        for a range that cannot be, the engine 'cheapest', a target or a budget out of range, or a folder that cannot
        be written.
    HarvesterError
        where the engine fails everywhere, the last error.
    """
    asked = prepared(scene, over, engine, within, budget)
    folder = None if out is None else OutputFolder(out, vector)
    surface = Surface(asked.scene, asked.ranges, asked.budget, tick)
    return finished(asked, surface, asked.search(surface), folder)


@dataclass(frozen=True)
class SearchAsked:
    """What a search is asked, checked: the scene, the ranges, the engine, the error that is aimed at, the seconds."""

    scene: Scene
    ranges: tuple[Range, ...]
    engine: Engine
    within: float
    budget: float

    def search(self, surface: Surface) -> SampledSearch | None:
        """The search of an engine that samples; None for an engine of formulas."""
        return None if self.engine.is_formula else SampledSearch(surface, self.engine, self.within)


def prepared(
    scene: AnyScene,
    over: Sequence[Range] | Mapping[str, tuple[float | str, float | str]],
    engine: Named | None,
    within: float | str,
    budget: float | str,
) -> SearchAsked:
    """The arguments of `optimise`, checked; raises InputError as it does."""
    found_ranges = ranges(over)
    problem = Problem.of(scene)
    scene = problem.scene
    engine = engine_of(default_engine(problem) if engine is None else engine)
    if isinstance(engine, Cheapest):
        raise InputError("`engine` must be one for all places, such as 'ensemble', but is left out")
    if any(r.steps for r in found_ranges) and not engine.is_formula:
        raise InputError(f"`engine` must be one of formulas for the values of a series, but is {engine.NAME!r}")
    asked = Request(within=within, budget=budget)
    if asked.within is None or asked.budget is None:
        raise InputError("`within` and `budget` must be numbers or texts, but one of them is None")
    within, budget = number(asked.within) or 0.0, number(asked.budget) or 0.0
    for ends in ([r.low for r in found_ranges], [r.high for r in found_ranges]):
        point = scene
        for r, value in zip(found_ranges, ends, strict=True):  # a key of another table is an error before anything runs
            point = point.vary(r.key, value)
    return SearchAsked(scene, found_ranges, engine, within, budget)


def finished(
    asked: SearchAsked,
    surface: Surface,
    search: SampledSearch | None,
    folder: OutputFolder | None,
    found: SearchResult | None = None,
) -> Optimum:
    """The optimum of a search over a surface, in which an engine that samples may have begun to scan.

    ``found`` is what was found already, where the search is to end with it; ``folder`` gets the files.
    """
    begin, engine = time.perf_counter(), asked.engine
    if found is None:
        surface.share = SEARCHED
        found = formula_search.search(surface, engine) if search is None else search.find()
    surface.share = math.inf  # the optimum itself is always evaluated
    best = found.peaks[0]
    estimate, warnings = _last(surface, engine, search, best, asked.within)
    answer = _answer(surface, engine, found, estimate, warnings, time.perf_counter() - begin)
    if folder is not None:
        _write(folder, answer, asked.scene, engine, {"within": asked.within, "budget": asked.budget})
    return answer


def _last(
    surface: Surface, engine: Engine, search: SampledSearch | None, best: Peak, within: float
) -> tuple[Estimate, tuple[str, ...]]:
    """The answer at the optimum: an engine that samples gives it anew, with noise of its own."""
    if search is None:
        return engine.run(problem_at(surface.scene, surface.ranges, best.u)), ()
    options = {"within": within, "budget": surface.left_now, "seed": search.new_seed()}
    point = surface.evaluate(best.u[None], with_options(engine, **options), "optimum")[0]
    if not isinstance(point.answer, Estimate):
        raise point.answer
    power, error = point.answer.mean_power, best.power.stderr
    if best.low is None or not error:
        return point.answer, ()
    if abs(power.value - best.power.value) > DISAGREE * math.hypot(error, power.stderr or 0.0) + (power.bias or 0.0):
        word = f"the surface says {best.power.value:.5g} at the optimum, and its own evaluation {power.value:.5g}"
        return point.answer, (word,)
    return point.answer, ()


def _answer(
    surface: Surface, engine: Engine, found: SearchResult, estimate: Estimate, warnings: tuple[str, ...], seconds: float
) -> Optimum:
    best, keys = found.peaks[0], []
    for k, r in enumerate(surface.ranges):
        low, high = (None if u is None else r.value(float(u[k])) for u in (best.low, best.high))
        if found.flat:
            low, high = r.low, r.high
        keys.append(OptimalKey(r, r.value(float(best.u[k])), low, high, None if found.flat else end(best.faces[k])))
    own = [p.answer for p in surface.points if p.engine == engine.NAME]
    failed = [answer for answer in own if not isinstance(answer, Estimate)]
    failures = [f"{len(failed)} of {len(own)} evaluations failed, the first: {failed[0]}"] if failed else []
    return Optimum(
        engine=engine.NAME,
        keys=tuple(keys),
        estimate=estimate,
        peaks=tuple((surface.values(p.u), p.power) for p in found.peaks),
        why=best.why,
        flat=found.flat,
        points=tuple(surface.points),
        seconds=seconds,
        warnings=(*dict.fromkeys((*found.warnings, *warnings, *failures, *map(str, estimate.warnings))),),
        scanned=found.scanned,
    )


def _write(folder: OutputFolder, answer: Optimum, scene: Scene, engine: Any, options: dict[str, float]) -> None:
    chosen = {f.name: getattr(engine, f.name) for f in dataclasses.fields(engine)} | options
    about = provenance(
        scene,
        over={key.range.key: [key.range.low, key.range.high] for key in answer.keys},
        engine={engine.NAME: {name: value for name, value in chosen.items() if value is not None}},
    )
    folder.save("optimise", answer.text(), figures.optimum(answer, scene.title), about)
