"""Engine `averaged`: impact-aware averaging on two time scales, which knows its own error."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.formula import Formula
from harvester.engines.moment_existence import existence
from harvester.engines.protocol import estimate
from harvester.equations.coefficients import Equations
from harvester.equations.effects import AVERAGED, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import names_arguments
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.averaging.stability.power_law_tail import PowerTail
    from harvester.averaging.two_scale.law import TwoScale

DOUBTFUL = 0.05  # estimated model error that brings a warning
LEAST_RESTITUTION = 0.3  # of the scenes by which the estimate was made


@names_arguments
@dataclass(frozen=True, kw_only=True)
class Averaged(Formula):
    """Impact-aware averaging: E[V^2], E[P] = beta mu E[V^2], and its own error.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> f"{answer.mean_power.value:.5f} +- {answer.mean_power.known_error95:.5f}"
    '0.00323 +- 0.00002'

    Parameters
    ----------
    within, budget, seed
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a load other than a resistance, or a spring or stop that the theory does not know.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "averaged"
    LOOK: ClassVar[EngineLook] = EngineLook("averaged (impact-aware)", "#009E73", "P", order=3.1, trust=1)
    next_fidelity: ClassVar[str | None] = "ensemble"
    UNSERVED: ClassVar[frozenset[str]] = unknown_to(AVERAGED)

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.averaging.two_scale.law import solve_many

        return solve_many

    def _estimate(self, problem: Problem, solution: Any, seconds: float) -> Estimate:
        mean, exists = solution.mean_square_voltage, existence(problem, sampled=False)
        bias = solution.bias
        if problem.equations.restitution is None and problem.equations.n2:
            bias = max(bias, noise_error(problem.equations, solution))
        elif exists.tail is not None and not exists.unknown:
            bias += tail_error(exists.tail, solution)
        v2 = Value(mean, model=None if exists.unknown else bias * mean, unknown=exists.unknown)
        diagnostics = [exists.warning, note("theory")]
        if bias > DOUBTFUL:
            why = "impacts" if solution.stored <= solution.impact_loss else "coupling"
            why = "noise" if bias > 2.0 * solution.bias else why
            diagnostics.append(warning("averaging_doubtful", error=bias, why=why))
        r = problem.equations.restitution
        if r is not None and problem.equations.mu is None:
            diagnostics.append(warning("open_circuit_variance"))
        if r is not None and r < LEAST_RESTITUTION:
            diagnostics.append(warning("restitution_untested", restitution=r, least=LEAST_RESTITUTION))
        details = {
            "exchange_per_cycle": solution.exchange,
            "impact_loss_per_cycle": solution.impact_loss,
            "slow_share": solution.slow / (solution.fast + solution.slow),
        }
        return estimate(self.NAME, problem, v2, None, diagnostics, seconds, details=details)


def noise_error(eqs: Equations, law: "TwoScale") -> float:
    """The relative error of E[V^2] that noise of the stiffness leaves without a stop: that of the linear scene.

    There the exact second moments are known (`harvester.linear.solve`): averaging misses what the noise does to the
    load's phase, which is 5 % at n2 = 0.12, beta = 1, mu = 2.  A tenth is added for cubic springs and damping, which
    change it by less.  It is 0, for not known, where the linear scene grows without bound.
    """
    from harvester.averaging.stability.power_law_tail import MEAN, moment_growth
    from harvester.averaging.two_scale.law import solve
    from harvester.linear.solve import solve as exact

    linear = replace(eqs, alpha=None, c2=None, c3=None)
    if moment_growth(linear, int(MEAN)) >= 0.0:
        return 0.0
    found = law if linear == eqs else solve(linear)
    return 1.1 * abs(found.mean_square_voltage / exact(linear).value - 1.0)


def tail_error(tail: "PowerTail", law: "TwoScale") -> float:
    """The relative error of E[V^2] that comes from the power tail p(A) ~ A^-(1 + q) of noise of the stiffness.

    E[A^2] is in proportion to 1/(q - 2), so that q off by d takes d/(q - 2), of which d/q is that of the damping and
    stated already.  With a stop at a distance also the share of the tail that lies beyond the law's last amplitude.
    """
    from harvester.averaging.grids import KEPT

    q = tail.exponent
    off = q - tail.lowest
    if law.spread is None:
        off = max(off, abs(q - math.log(law.mass[-2] / law.mass[-1]) / math.log(law.A[-1] / law.A[-2])))
        return 2.0 * off / (q * (q - 2.0))
    return 2.0 * off / (q * (q - 2.0)) + math.exp(-KEPT[1] * (1.0 - 2.0 / q))
