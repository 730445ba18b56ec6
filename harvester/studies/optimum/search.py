"""One search for the largest mean power, from its arguments to its answer and files."""

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
from harvester.studies.optimum.ranges import Range, Vary, middle, problem_at, ranges
from harvester.studies.optimum.sampled_search import SampledSearch
from harvester.studies.optimum.search_result import SearchResult
from harvester.studies.output_folder import OutputFolder, provenance

SEARCHED = 0.75  # of the budget at most, so that the rest evaluates the power at the optimum
# standard errors between the surface's power and the last evaluation's that bring a warning
DISAGREE = 4.0


@dataclass(frozen=True)
class SearchRequest:
    """The checked arguments of a search: scene, ranges, engine, target error and seconds."""

    scene: Scene
    ranges: tuple[Range, ...]
    engine: Engine
    within: float
    budget: float

    @classmethod
    def of(
        cls,
        scene: AnyScene,
        vary: Vary,
        engine: Named | None,
        within: float | str,
        budget: float | str,
    ) -> "SearchRequest":
        """The arguments of `harvester.optimise`, checked; raises InputError as it does."""
        searched = ranges(vary)
        problem = Problem.of(scene)
        chosen = engine_of(
            default_engine(middle(problem.scene, searched)) if engine is None else engine
        )
        if chosen.chooses:
            raise InputError(
                "`engine` must be one for all places, such as 'ensemble', but is left out"
            )
        if any(r.steps for r in searched) and not chosen.is_formula:
            raise InputError(
                f"`engine` must be one of formulas for the values of a series, but is {chosen.NAME!r}"
            )
        options = Request(within=within, budget=budget)
        if options.within is None or options.budget is None:
            raise InputError(
                "`within` and `budget` must be numbers or texts, but one of them is None"
            )
        for ends in ({r.key: r.low for r in searched}, {r.key: r.high for r in searched}):
            problem.scene.varied(ends)  # a key of another table is an error before anything runs
        return cls(
            problem.scene,
            searched,
            chosen,
            number(options.within) or 0.0,
            number(options.budget) or 0.0,
        )


@dataclass
class Search:
    """A search at work: its evaluations, and for an engine that samples the steps between them."""

    request: SearchRequest
    surface: Surface
    sampled_search: SampledSearch | None

    @classmethod
    def begin(cls, request: SearchRequest, progress: Progress = NO_PROGRESS) -> "Search":
        """Begin to count the seconds."""
        surface = Surface(request.scene, request.ranges, request.budget, progress)
        if request.engine.has_gradient:
            engine = with_options(request.engine, within=gradient_search.FINER * request.within)
            return cls(replace(request, engine=engine), surface, None)
        formula = request.engine.is_formula
        return cls(
            request,
            surface,
            None if formula else SampledSearch(surface, request.engine, request.within),
        )

    def finish(
        self, folder: OutputFolder | None = None, result: SearchResult | None = None
    ) -> Optimum:
        """The optimum; an engine that samples may have begun to scan.

        ``found`` has the peaks found already, if the search is to end with it; ``folder`` gets the
        files.
        """
        begin = time.perf_counter()
        surface = self.surface
        if result is None:
            surface.share = SEARCHED
            engine = self.request.engine
            if self.sampled_search is not None:
                result = self.sampled_search.find()
            else:
                result = (gradient_search if engine.has_gradient else formula_search).search(
                    surface, engine
                )
        surface.share = math.inf  # the optimum itself is always evaluated
        result, estimate, warnings = self._last(result)
        answer = self._answer(result, estimate, warnings, time.perf_counter() - begin)
        if folder is not None:
            self._write(folder, answer)
        return answer

    def _sound_before(self) -> list[Evaluation]:
        """The engine's own sound evaluations under a steady excitation, if no noise favours the highest of many."""
        steady = Problem.of(self.request.scene).equations.is_steady
        return [
            p
            for p in self.surface.points
            if steady and p.is_sound and p.engine == self.request.engine.NAME
        ]

    def _last(self, result: SearchResult) -> tuple[SearchResult, Estimate, list[Diagnostic]]:
        """The answer at the optimum: an engine that samples gives it anew, with noise of its own.

        If that has no time left, the best of the sound places before is the optimum, if nothing is
        random.
        """
        surface = self.surface
        engine = self.request.engine
        best = result.peaks[0]
        if self.sampled_search is None:
            return result, engine.run(problem_at(surface.scene, surface.ranges, best.u)), []
        options = {
            "within": self.request.within,
            "budget": surface.left_now,
            "seed": self.sampled_search.new_seed(),
        }
        last = surface.evaluate(best.u[None], with_options(engine, **options), "optimum")[0]
        if not last.is_sound and (sound := self._sound_before()):
            best = self.sampled_search.best_so_far(sound)
            last = next(p for p in sound if p.power is best.power)
            result = replace(result, peaks=(best,))
        answer = last.answer
        if not isinstance(answer, Estimate):
            raise answer
        power = answer.mean_power
        error = best.power.stderr
        if best.low is None or not error:
            return result, answer, []
        difference = abs(power.value - best.power.value)
        if difference <= DISAGREE * math.hypot(error, power.stderr or 0.0) + (power.bias or 0.0):
            return result, answer, []
        return (
            result,
            answer,
            [warning("surface_disagrees", surface=best.power.value, own=power.value)],
        )

    def _answer(
        self, result: SearchResult, estimate: Estimate, warnings: list[Diagnostic], seconds: float
    ) -> Optimum:
        surface = self.surface
        keys = self._keys(result)
        remarks = [
            *result.warnings,
            *warnings,
            *_failures(surface.points, self.request.engine.NAME),
        ]
        remarks += [remark for remark in (result.flat, result.peaks[0].why) if remark is not None]
        remarks += [
            note("end_of_range", key=key.key, end=key.boundary) for key in keys if key.boundary
        ]
        return Optimum(
            engine=self.request.engine.NAME,
            keys=keys,
            estimate=estimate,
            peaks=tuple(PowerPeak(surface.values(p.u), p.power) for p in result.peaks),
            points=tuple(surface.points),
            seconds=seconds,
            diagnostics=(*dict.fromkeys((*remarks, *estimate.diagnostics)),),
            scanned=result.scanned,
        )

    def _keys(self, result: SearchResult) -> tuple[OptimalKey, ...]:
        """The best value of each key with its interval: the whole range if the surface is flat."""
        best = result.peaks[0]
        keys = list[OptimalKey]()
        for k, r in enumerate(self.surface.ranges):
            low, high = (None if u is None else r.value(float(u[k])) for u in (best.low, best.high))
            value = r.value(float(best.u[k]))
            keys.append(
                OptimalKey(r, value, low95=r.low, high95=r.high, boundary=None)
                if result.flat
                else OptimalKey(r, value, low95=low, high95=high, boundary=end(best.faces[k]))
            )
        return tuple(keys)

    def _write(self, folder: OutputFolder, answer: Optimum) -> None:
        request = self.request
        engine: Any = request.engine
        chosen = {f.name: getattr(engine, f.name) for f in dataclasses.fields(engine)}
        chosen |= {"within": request.within, "budget": request.budget}
        about = provenance(
            request.scene,
            over={r.key: [r.low, r.high] for r in request.ranges},
            engine={
                engine.NAME: {name: value for name, value in chosen.items() if value is not None}
            },
        )
        folder.save("optimise", answer.table.csv(), answer.plot(request.scene.name), about)


def _failures(points: list[Evaluation], engine: str) -> list[Diagnostic]:
    """The warnings of an engine's evaluations that failed, and of those that were left out next to sound ones."""
    evaluations = [p for p in points if p.engine == engine]
    failed = [p.answer for p in evaluations if not isinstance(p.answer, Estimate)]
    warnings = []
    if failed:
        warnings.append(
            warning(
                "evaluations_failed",
                failed=len(failed),
                count=len(evaluations),
                first=str(failed[0]),
            )
        )
    served = Counter(p.is_sound for p in evaluations if isinstance(p.answer, Estimate))
    if served[True] and served[False]:
        warnings.append(
            warning(
                "evaluations_unsound", unsound=served[False], count=len(evaluations), engine=engine
            )
        )
    return warnings
