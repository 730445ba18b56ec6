"""Engine `averaged`: impact-aware averaging on two time scales, which knows its own error."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.averaging.stability.power_law_tail import MEAN, PowerTail, moment_growth
from harvester.engines.formula import Formula
from harvester.engines.moment_existence import existence
from harvester.engines.protocol import estimate
from harvester.equations.coefficients import Equations
from harvester.equations.effects import AVERAGED, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.averaging.two_scale.law import TwoScale

DOUBTFUL = 0.05  # estimated model error that brings a warning
LEAST_RESTITUTION = 0.3  # of the scenes by which the estimate was made


class Averaged(Formula):
    """Impact-aware averaging: E[V^2], E[P] = beta mu E[V^2], and its own error.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> f"{answer.mean_power.value:.5f} +- {answer.mean_power.known_error95:.5f}"
    '0.00323 +- 0.00002'

    Parameters
    ----------
    within, budget, seed : float or str or int, optional
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a load other than a resistance, or a spring or stop that the theory does not know.
    SimulationError
        without external noise, or if the response grows without bound.
    """

    NAME = "averaged"
    LOOK = EngineLook("averaged (impact-aware)", "#009E73", "P", order=3.1, trust=1)
    next_fidelity = "ensemble"
    UNSERVED = unknown_to(AVERAGED)

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.averaging.two_scale.law import solve_many

        return solve_many

    def _estimate(self, problem: Problem, solution: Any, seconds: float) -> Estimate:
        mean = solution.mean_square_voltage
        exists = existence(problem, is_sampled=False)
        bias = solution.bias
        if (free := free_orbits(problem.equations, solution)).any():
            bias = max(bias, float(free.sum()) * linear_error(problem.equations, solution, free))
        if (
            problem.equations.restitution is not None
            and exists.tail is not None
            and not exists.unknown
        ):
            bias += tail_error(exists.tail, solution)
        v2 = Value(mean, model=None if exists.unknown else bias * mean, unknown=exists.unknown)
        diagnostics = [exists.warning, note("theory")]
        if bias > DOUBTFUL:
            why = "impacts" if solution.stored <= solution.impact_loss else "coupling"
            why = "noise" if problem.equations.n2 and bias > 2.0 * solution.bias else why
            diagnostics.append(warning("averaging_doubtful", error=bias, why=why))
        r = problem.equations.restitution
        if r is not None and problem.equations.mu is None:
            diagnostics.append(warning("open_circuit_variance"))
        if r is not None and r < LEAST_RESTITUTION:
            diagnostics.append(
                warning("restitution_untested", restitution=r, least=LEAST_RESTITUTION)
            )
        details = {
            "exchange_per_cycle": solution.exchange,
            "impact_loss_per_cycle": solution.impact_loss,
            "slow_share": solution.slow / (solution.fast + solution.slow),
        }
        return estimate(self.NAME, problem, v2, None, diagnostics, seconds, details=details)


def free_orbits(eqs: Equations, law: "TwoScale") -> Floats:
    """The probability of each amplitude of the law whose orbit meets no stop, 0 for the others."""
    if law.spread is None:
        return law.mass if eqs.restitution is None else np.zeros_like(law.mass)
    return np.where(law.spread.left > -law.spread.gap, law.mass, 0.0)


def linear_error(eqs: Equations, law: "TwoScale", free: Floats) -> float:
    """The relative error of E[V^2] of free orbits: that of the linear scene which does the same in a cycle.

    There the exact moments are known (`harvester.linear.solve`).  Averaging misses the action of a
    load within a cycle, and that of parametric noise on the load's phase: 5 % at n2 = 0.12, beta =
    1, mu = 2; 12 % at beta = 5, mu = 0.013, c1 = 0.007; 8 % at beta = 0.42, mu = 1.3, c1 = 0.17.
    Motions A cos(w t) with the law's amplitudes have

        k = 1 + 3/4 alpha E[A^4]/E[A^2],   c = -c1 - c2/4 E[A^4]/E[A^2] + c3/8 E[A^6]/E[A^2]

    are the linear scene's stiffness and damping.  A fifth is added, because springs and damping
    that are not linear change the error a little.  If that scene grows without bound it is 1, and
    with a stop, which bounds it, 0.
    """
    from harvester.averaging.two_scale.law import solve
    from harvester.linear.solve import solve as exact

    square, fourth, sixth = (float(free @ law.A**power) for power in (2, 4, 6))
    k = 1.0 + 0.75 * (eqs.alpha or 0.0) * fourth / square
    c1 = (
        (eqs.c1 or 0.0)
        + 0.25 * (eqs.c2 or 0.0) * fourth / square
        - 0.125 * (eqs.c3 or 0.0) * sixth / square
    )
    # of k, in units of the new resonance
    powers = {"beta": -1.0, "mu": -0.5, "n1": -1.5, "n2": -1.5, "n12": -1.5}
    scaled = {
        name: value * k**power
        for name, power in powers.items()
        if (value := getattr(eqs, name)) is not None
    }
    linear = replace(
        eqs,
        alpha=None,
        c2=None,
        c3=None,
        restitution=None,
        gap=None,
        c1=c1 / math.sqrt(k),
        **scaled,
    )
    lost = 1.0 if eqs.restitution is None else 0.0
    try:
        if moment_growth(linear, int(MEAN)) >= 0.0:
            return lost
        solution = law if linear == eqs else solve(linear)
        return 1.2 * abs(exact(linear).value / solution.mean_square_voltage - 1.0)
    except SimulationError:
        return lost


def tail_error(tail: "PowerTail", law: "TwoScale") -> float:
    """The relative error of E[V^2] that comes from the power tail p(A) ~ A^-(1 + q) of parametric noise.

    E[A^2] is in proportion to 1/(q - 2), so that an error d of q is a relative one of d/(q - 2), whose
    part d/q is that of the damping and stated already.  With a stop at a distance also the share of the tail that lies
    beyond the law's last amplitude.
    """
    from harvester.averaging.grids import KEPT

    q = tail.exponent
    off = q - tail.lowest
    if law.spread is None:
        off = max(
            off, abs(q - math.log(law.mass[-2] / law.mass[-1]) / math.log(law.A[-1] / law.A[-2]))
        )
        return 2.0 * off / (q * (q - 2.0))
    return 2.0 * off / (q * (q - 2.0)) + math.exp(-KEPT[1] * (1.0 - 2.0 / q))
