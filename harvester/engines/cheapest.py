"""No engine asked for, but an accuracy: the cheapest one that is known to reach it."""

import dataclasses
import math
import time

from harvester.answers.estimate import Estimate
from harvester.engines.averaged import Averaged
from harvester.engines.compiled import Compiled
from harvester.engines.density import Density
from harvester.engines.ensemble import Ensemble
from harvester.engines.exact import Exact
from harvester.engines.formula import Formula
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import AnyScene, Engine, Progress
from harvester.engines.slow import Slow
from harvester.engines.spice.spice import Spice
from harvester.equations.effects import SEVERAL_MODES
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError, MissingProgramError, SimulationError
from harvester.presentation.diagnostic import note

LEAST = 0.1  # part of a budget: if less is left, no further engine begins
SHORTEST = 0.1  # s of a budget
FINER_THAN_SAMPLING = 1e-4  # relative errors at which the density itself is cheaper than any sample


class Cheapest(MonteCarloOptions, Engine):
    """`Exact` if it supports the scene, `Averaged` if its own error allows it, else `Ensemble`.

    For a netlist `Slow` for a chip, `Compiled` if no circuit of ideal elements can be paired with
    ngspice, and `Spice` for others, or if their stated error is too large.

    If ``within`` is finer than sampling reaches in reasonable time, `Density` in place of
    `Ensemble`, if it supports the scene.

    The answer is that engine's, and states why.  `Published` does not know the model error, and
    `Ideal` only after its run.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.Cheapest(within="5%").run(scene).engine
    'exact'

    Parameters
    ----------
    within, budget, seed, duration, trajectories, dt : float or str or int, optional
        the options of `run`.

    Raises
    ------
    InputError
        without ``within``.
    HarvesterError
        of the engine that was chosen.
    """

    NAME = "cheapest"
    chooses = True

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene."""
        problem = Problem.of(scene)
        within = number(self.within)
        if within is None:
            raise InputError("`within` must be given if no engine is, but is left out")
        if problem.netlist is not None:
            return self._of_netlist(problem, within, progress)
        kind = formula(problem)
        try:
            quick = kind(within=within).run(problem)
        except HarvesterError as error:
            if kind is Exact:
                raise
            return _because(
                self._unaveraged(problem, progress), "refused", within, refused=str(error)
            )
        power = quick.mean_power
        stated = power.known_error95 / abs(power.value) if power.value else 0.0
        if stated <= within:
            return _because(quick, "reached", within, stated)
        return _because(self._unaveraged(problem, progress), "beyond", within, stated, kind.NAME)

    def _of_netlist(self, problem: Problem, within: float, progress: Progress | None) -> Estimate:
        """The answer of the first engine that reaches ``within``, or of the one that comes closest.

        Each has the rest of the budget that those before it left.
        """
        end = (
            math.inf if self.budget is None else time.perf_counter() + (number(self.budget) or 0.0)
        )
        answers: list[Estimate] = []
        for kind in self._for_netlist(problem):
            left = end - time.perf_counter()
            if answers and left < LEAST * (number(self.budget) or 0.0):
                break
            try:
                answer = self._as(kind, left).run(problem, progress)
            except (SimulationError, MissingProgramError):
                if not answers and kind is Spice:
                    raise
                continue
            if not answers and kind is Spice:
                return _because(answer, "netlist", within)
            answers.append(answer)
            if _stated(answer) <= within:
                return _because(answer, "reached", within, _stated(answer))
        closest = min(answers, key=_stated)
        return _because(closest, "closest", within, _stated(closest))

    def _for_netlist(self, problem: Problem) -> list[type[Slow | Compiled | Spice]]:
        """The engines for a netlist, the cheapest first; `Spice` knows its error whatever the circuit."""
        kinds: list[type[Slow | Compiled | Spice]] = []
        free = (self.trajectories, self.duration, self.dt) == (None, None, None)
        if free and Slow.refusal(problem) is None:
            kinds.append(Slow)
        if stands_alone(problem) and Compiled.refusal(problem) is None:
            kinds.append(Compiled)
        return [*kinds, Spice]

    def _as(self, kind: type[Slow | Compiled | Spice], left: float) -> Engine:
        """An engine with those of the options that it has, and the seconds that are ``left``."""
        names = {field.name for field in dataclasses.fields(kind)}
        given = {name: value for name, value in vars(self).items() if name in names}
        budget = None if math.isinf(left) else max(round(left, 1), SHORTEST)
        return kind(**{**given, "budget": budget})

    def _unaveraged(self, problem: Problem, progress: Progress | None) -> Estimate:
        """The answer of `Density` if sampling needs very long to reach ``within``, else of `Ensemble`."""
        within, budget = number(self.within), number(self.budget)
        if within is not None and within <= FINER_THAN_SAMPLING and not Density.refusal(problem):
            return Density(within=within, budget=budget).run(problem, progress)
        return Ensemble(**vars(self)).run(problem, progress)


def stands_alone(problem: Problem) -> bool:
    """Whether runs of ngspice are not paired with a circuit of ideal elements, and so are few.

    Under a steady drive of one mode engine `Spice` finds periodic responses, and seeks others.
    """
    from harvester.engines.spice.cheap_model import ideal_elements

    load = problem.circuit
    assert load is not None, "a netlist is a circuit"
    if not SEVERAL_MODES.isdisjoint(problem.effects):
        return True
    return problem.equations.is_random and ideal_elements(problem, load) is None


def _stated(answer: Estimate) -> float:
    """The relative error of an answer's power; infinite if a part is not known."""
    power = answer.mean_power
    known = power.error95 is not None and power.value
    return power.known_error95 / abs(power.value) if known else math.inf


def formula(problem: Problem) -> type[Formula]:
    """The formula that knows its own error best: `Exact` for linear equations, else `Averaged`, which may refuse."""
    return Averaged if Exact.refusal(problem) else Exact


def _because(
    answer: Estimate,
    why: str,
    within: float,
    error: float | None = None,
    formula: str = "",
    refused: str = "",
) -> Estimate:
    """The answer with a note ``why`` its engine was chosen; ``error`` is that of the ``formula``."""
    numbers = {"why": why, "error": error, "within": within, "formula": formula, "refused": refused}
    chosen = note("cheapest", engine=answer.engine, **numbers)
    return dataclasses.replace(answer, diagnostics=(chosen, *answer.diagnostics))
