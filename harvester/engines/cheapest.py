"""No engine asked for, but an accuracy: the cheapest one that is known to reach it."""

import dataclasses

from harvester.answers.estimate import Estimate
from harvester.engines.averaged import Averaged
from harvester.engines.density import Density
from harvester.engines.ensemble import Ensemble
from harvester.engines.exact import Exact
from harvester.engines.formula import Formula
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import AnyScene, Engine, Progress
from harvester.engines.spice.spice import Spice
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError
from harvester.presentation.diagnostic import note

FINER_THAN_SAMPLING = 1e-4  # relative errors at which the density itself is cheaper than any sample


class Cheapest(MonteCarloOptions, Engine):
    """`Exact` if that serves, `Averaged` if its own error allows it, else `Ensemble`; for a netlist `Spice`.

    If ``within`` is finer than sampling reaches in reasonable time, `Density` in place of
    `Ensemble`, if it supports.

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
    within, budget, seed, duration, trajectories, dt
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
            raise InputError("`within` must be given where no engine is, but is left out")
        if problem.netlist is not None:
            return _because(Spice(**vars(self)).run(problem, progress), "netlist", within)
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

    def _unaveraged(self, problem: Problem, progress: Progress | None) -> Estimate:
        """The answer of `Density` if sampling takes very long to reach ``within``, else of `Ensemble`."""
        within, budget = number(self.within), number(self.budget)
        if within is not None and within <= FINER_THAN_SAMPLING and not Density.refusal(problem):
            return Density(within=within, budget=budget).run(problem, progress)
        return Ensemble(**vars(self)).run(problem, progress)


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
    """The answer with a note ``why`` its engine was chosen; ``error`` is what the ``formula`` states."""
    numbers = {"why": why, "error": error, "within": within, "formula": formula, "refused": refused}
    chosen = note("cheapest", engine=answer.engine, **numbers)
    return dataclasses.replace(answer, diagnostics=(chosen, *answer.diagnostics))
