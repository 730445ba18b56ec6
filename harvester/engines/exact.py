"""Engine `exact`: linear equations without a stop, in closed form, under any shaking."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.formula import Formula
from harvester.engines.protocol import estimate
from harvester.equations.coefficients import Equations
from harvester.equations.effects import LINEAR, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import names_arguments
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import Value


@names_arguments
@dataclass(frozen=True, kw_only=True)
class Exact(Formula):
    """The stationary E[V^2] and E[P] of a linear scene, whose only error is rounding.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> f"{hv.Exact().run(scene).mean_power.value:.8f}"
    '0.00322581'

    Parameters
    ----------
    within, budget, seed
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a load other than a resistance or none, a stop, and a spring or damping that is not linear.
    UnboundedResponseError
        where the response grows without bound.
    """

    NAME: ClassVar[str] = "exact"
    LOOK: ClassVar[EngineLook] = EngineLook(
        "exact (linear, closed form)", "#000000", "*", (0, (1, 2)), order=3.3, trust=5
    )
    is_exact: ClassVar[bool] = True
    has_frequency_response: ClassVar[bool] = True
    UNSERVED: ClassVar[frozenset[str]] = unknown_to(LINEAR)

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.linear.solve import solve_many

        return solve_many

    def _estimate(self, problem: Problem, solution: Any, seconds: float) -> Estimate:
        from harvester.linear.record_doubts import join_change, record_doubts

        eqs = problem.equations
        diagnostics = [*record_doubts(eqs), note("closed_form" + "_joined" * bool(join_change(eqs)))]
        if eqs.mu is None:
            diagnostics.append(warning("open_circuit"))
        if not eqs.is_shaken:
            diagnostics.append(warning("nothing_shakes"))
        v2 = Value(solution.value, bias=solution.error, model=0.0)
        return estimate(self.NAME, problem, v2, None, diagnostics, seconds)
