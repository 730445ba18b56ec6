"""One search for the largest mean power, from what is asked to its answer and files."""

import dataclasses
import math
import time
from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import Named, default_engine
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.machine.progress import NO_PROGRESS, Progress
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.scene.scene import Scene
from harvester.studies.optimum import formula_search, gradient_search
from harvester.studies.optimum.evaluations import Evaluation, Surface, with_options
from harvester.studies.optimum.optimum_result import OptimalKey, Optimum, PowerPeak, end
from harvester.studies.optimum.ranges import Range, Vary, problem_at, ranges
from harvester.studies.optimum.sampled_search import SampledSearch
from harvester.studies.optimum.search_result import SearchResult
from harvester.studies.output_folder import OutputFolder, provenance

SEARCHED = 0.75  # of the budget at most, so that the rest evaluates the power at the optimum
DISAGREE = 4.0  # standard errors between the surface's power and the last evaluation's that bring a warning


@dataclass(frozen=True)
class SearchRequest:
    """What a search is asked, checked: the scene, the ranges, the engine, the error that is aimed at, the seconds."""

    scene: Scene
    ranges: tuple[Range, ...]
    engine: Engine
    within: float
    budget: float

    @classmethod
    def of(
        cls, scene: AnyScene, vary: Vary, engine: Named | None, within: float | str, budget: float | str
    ) -> "SearchRequest":
        """The arguments of `harvester.optimise`, checked; raises InputError as it does."""
        found, problem = ranges(vary), Problem.of(scene)
        chosen = engine_of(default_engine(problem) if engine is None else engine)
        if chosen.chooses:
            raise InputError("`engine` must be one for all places, such as 'ensemble', but is left out")
        if any(r.steps for r in found) and not chosen.is_formula:
            raise InputError(f"`engine` must be one of formulas for the values of a series, but is {chosen.NAME!r}")
        asked = Request(within=within, budget=budget)
        if asked.within is None or asked.budget is None:
            raise InputError("`within` and `budget` must be numbers or texts, but one of them is None")
        for ends in ([r.low for r in found], [r.high for r in found]):
            point = problem.scene
            for r, value in zip(found, ends, strict=True):  # a key of another table is an error before anything runs
                point = point.vary(r.key, value)
        return cls(problem.scene, found, chosen, number(asked.within) or 0.0, number(asked.budget) or 0.0)


@dataclass
class Search:
    """A search at work: its evaluations, and for an engine that samples the steps between them."""

    request: SearchRequest
    surface: Surface
    sampled: SampledSearch | None

    @classmethod
    def begin(cls, request: SearchRequest, progress: Progress = NO_PROGRESS) -> "Search":
        """Begin to count the seconds."""
        surface = Surface(request.scene, request.ranges, request.budget, progress)
        if request.engine.has_gradient:
            engine = with_options(request.engine, within=gradient_search.FINER * request.within)
            return cls(replace(request, engine=engine), surface, None)
        formula = request.engine.is_formula
        return cls(request, surface, None if formula else SampledSearch(surface, request.engine, request.within))

    def finish(self, folder: OutputFolder | None = None, found: SearchResult | None = None) -> Optimum:
        """The optimum; an engine that samples may have begun to scan.

        ``found`` is what was found already, where the search is to end with it; ``folder`` gets the files.
        """
        begin, surface = time.perf_counter(), self.surface
        if found is None:
            surface.share = SEARCHED
            engine = self.request.engine
            if self.sampled is not None:
                found = self.sampled.find()
            else:
                found = (gradient_search if engine.has_gradient else formula_search).search(surface, engine)
        surface.share = math.inf  # the optimum itself is always evaluated
        found, estimate, doubts = self._last(found)
        answer = self._answer(found, estimate, doubts, time.perf_counter() - begin)
        if folder is not None:
            self._write(folder, answer)
        return answer

    def _sound_before(self) -> list[Evaluation]:
        """The engine's own sound evaluations under a steady drive, where no noise favours the highest of many."""
        steady = Problem.of(self.request.scene).equations.is_steady
        return [p for p in self.surface.points if steady and p.is_sound and p.engine == self.request.engine.NAME]

    def _last(self, found: SearchResult) -> tuple[SearchResult, Estimate, list[Diagnostic]]:
        """The answer at the optimum: an engine that samples gives it anew, with noise of its own.

        Where that has no time left, the best of what was sound before is the optimum, if nothing is random.
        """
        surface, engine, best = self.surface, self.request.engine, found.peaks[0]
        if self.sampled is None:
            return found, engine.run(problem_at(surface.scene, surface.ranges, best.u)), []
        options = {"within": self.request.within, "budget": surface.left_now, "seed": self.sampled.new_seed()}
        last = surface.evaluate(best.u[None], with_options(engine, **options), "optimum")[0]
        if not last.is_sound and (sound := self._sound_before()):
            best = self.sampled.so_far(sound)
            last = next(p for p in sound if p.power is best.power)
            found = replace(found, peaks=(best,))
        answer = last.answer
        if not isinstance(answer, Estimate):
            raise answer
        power, error = answer.mean_power, best.power.stderr
        if best.low is None or not error:
            return found, answer, []
        apart = abs(power.value - best.power.value)
        if apart <= DISAGREE * math.hypot(error, power.stderr or 0.0) + (power.bias or 0.0):
            return found, answer, []
        return found, answer, [warning("surface_disagrees", surface=best.power.value, own=power.value)]

    def _answer(self, found: SearchResult, estimate: Estimate, doubts: list[Diagnostic], seconds: float) -> Optimum:
        surface, keys = self.surface, self._keys(found)
        remarks = [*found.warnings, *doubts, *_failures(surface.points, self.request.engine.NAME)]
        remarks += [one for one in (found.flat, found.peaks[0].why) if one is not None]
        remarks += [note("end_of_range", key=key.key, end=key.boundary) for key in keys if key.boundary]
        return Optimum(
            engine=self.request.engine.NAME,
            keys=keys,
            estimate=estimate,
            peaks=tuple(PowerPeak(surface.values(p.u), p.power) for p in found.peaks),
            points=tuple(surface.points),
            seconds=seconds,
            diagnostics=(*dict.fromkeys((*remarks, *estimate.diagnostics)),),
            scanned=found.scanned,
        )

    def _keys(self, found: SearchResult) -> tuple[OptimalKey, ...]:
        """The best value of each key with its interval: the whole range where the surface is flat."""
        best, keys = found.peaks[0], list[OptimalKey]()
        for k, r in enumerate(self.surface.ranges):
            low, high = (None if u is None else r.value(float(u[k])) for u in (best.low, best.high))
            ends = (r.low, r.high, None) if found.flat else (low, high, end(best.faces[k]))
            keys.append(OptimalKey(r, r.value(float(best.u[k])), *ends))
        return tuple(keys)

    def _write(self, folder: OutputFolder, answer: Optimum) -> None:
        request = self.request
        engine: Any = request.engine
        chosen = {f.name: getattr(engine, f.name) for f in dataclasses.fields(engine)}
        chosen |= {"within": request.within, "budget": request.budget}
        about = provenance(
            request.scene,
            over={r.key: [r.low, r.high] for r in request.ranges},
            engine={engine.NAME: {name: value for name, value in chosen.items() if value is not None}},
        )
        folder.save("optimise", answer.table.csv(), answer.plot(request.scene.name), about)


def _failures(points: list[Evaluation], engine: str) -> list[Diagnostic]:
    """The warnings of an engine's evaluations that failed, and of those that were left out beside sound ones."""
    own = [p for p in points if p.engine == engine]
    failed = [p.answer for p in own if not isinstance(p.answer, Estimate)]
    found = []
    if failed:
        found.append(warning("evaluations_failed", failed=len(failed), count=len(own), first=str(failed[0])))
    served = Counter(p.is_sound for p in own if isinstance(p.answer, Estimate))
    if served[True] and served[False]:
        found.append(warning("evaluations_unsound", unsound=served[False], count=len(own), engine=engine))
    return found
