"""Engine `averaged`: impact-aware averaging on two time scales, which knows its own error."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.formula import SPRINGS, STOPS, Formula
from harvester.engines.protocol import NOT_WHITE, estimate
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import names_arguments
from harvester.uncertainty.value import Value

DOUBTFUL = 0.05  # estimated model error that brings a warning
LEAST_RESTITUTION = 0.3  # of the scenes by which the estimate was made


@names_arguments
@dataclass(frozen=True, kw_only=True)
class Averaged(Formula):
    """Impact-aware averaging (`harvester.averaging.two_scale.law`): E[V^2], E[P] = beta mu E[V^2], and its own error.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> f"{answer.mean_power.value:.5f} +- {answer.mean_power.error95:.5f}"
    '0.00323 +- 0.00002'

    Raises
    ------
    CannotServeError
        for a load other than a resistance, or a spring or stop that the theory does not know.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "averaged"
    UNSERVED: ClassVar[frozenset[str]] = SPRINGS | STOPS | NOT_WHITE

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.averaging.two_scale.law import solve_many

        return solve_many

    def _estimate(self, problem: Problem, solution: Any, seconds: float) -> Estimate:
        v2 = Value(solution.mean_square_voltage, model=solution.bias * solution.mean_square_voltage)
        warnings = []
        if solution.bias > DOUBTFUL:
            strong = solution.stored > solution.impact_loss
            why = "coupling is strong" if strong else "impacts take much of the energy in one cycle"
            warnings.append(
                f"averaging is doubtful here (estimated error {solution.bias:.0%}): {why}; check with 'ensemble'"
            )
        r = problem.equations.restitution
        if r is not None and r < LEAST_RESTITUTION:
            warnings.append(
                f"the error was not measured for a restitution coefficient of {r:g}, below {LEAST_RESTITUTION}"
            )
        details = {
            "exchange_per_cycle": solution.exchange,
            "impact_loss_per_cycle": solution.impact_loss,
            "slow_share": solution.slow / (solution.fast + solution.slow),
        }
        reason = "no sampling error: a theory; the model's error is estimated from its small parameters"
        return estimate(self.NAME, problem, v2, None, seconds, 0, reason, tuple(warnings), details)
