"""The common part of the engines that are formulas: one scene is a grid of one, and many are solved in one call."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.moment_existence import existence
from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene, Engine, needs_known_effects, served
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, answer_or_error
from harvester.presentation.diagnostic import Diagnostic, warning


class Formula(Request, Engine):
    """The base of `Exact` and the theories: they sample nothing, so that any seed and budget give the same answer."""

    is_formula = True
    share_of_time = 0.02
    UNSERVED: ClassVar[frozenset[str]]  # effects that the theory does not know

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the theory does not support a problem; None if it can."""
        return needs_known_effects(problem, cls, cls.UNSERVED)

    def run_many(
        self, scenes: Sequence[AnyScene], seeds: Sequence[int] | None = None
    ) -> list[Estimate | HarvesterError]:
        """`run` for many scenes, solved in one call, or the error that each raises.

        Its part of the time each.
        """

        def checked(scene: AnyScene) -> Problem:
            problem = served(type(self), scene)
            existence(problem, is_sampled=False)
            return problem

        problems = [answer_or_error(checked, scene) for scene in scenes]
        solve = self._theory()
        begin = time.perf_counter()
        eqs = [problem.equations for problem in problems if isinstance(problem, Problem)]
        solved = iter(solve(eqs))
        seconds = (time.perf_counter() - begin) / max(len(eqs), 1)
        return [
            self._answer(item, next(solved), seconds) if isinstance(item, Problem) else item
            for item in problems
        ]

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        """The function that solves many equations, an error in the place of each that has no solution."""
        raise NotImplementedError

    def _estimate(self, problem: Problem, solution: Any, seconds: float) -> Estimate:
        """The solution of a problem as an answer."""
        raise NotImplementedError

    def _answer(self, problem: Problem, solution: Any, seconds: float) -> Estimate | HarvesterError:
        """The answer, with a warning if its error is not known to be ``within``."""
        if isinstance(solution, HarvesterError):
            return solution
        answer = self._estimate(problem, solution, seconds)
        if (within := number(self.within)) is None:
            return answer
        power = answer.mean_power
        if power.model is not None and power.known_error95 <= within * abs(power.value):
            return answer
        error = None if power.model is None else power.known_error95 / abs(power.value or 1.0)
        beyond = warning("beyond_formula", engine=self.NAME, within=within, error=error)
        return dataclasses.replace(answer, diagnostics=(*answer.diagnostics, beyond))
