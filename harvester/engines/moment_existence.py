"""Whether the means that an engine is asked for exist: parametric noise may leave a power tail."""

import math
from dataclasses import dataclass

from harvester.averaging.stability.power_law_tail import MEAN, VARIANCE, PowerTail, power_tail
from harvester.equations.problem import Problem
from harvester.errors import InfiniteMeanError, UnboundedResponseError
from harvester.presentation.diagnostic import Diagnostic, refusal, warning
from harvester.presentation.messages.unknown_parts import RARE_MOTIONS


@dataclass(frozen=True)
class MomentExistence:
    """The effect of the tail on the means of V^2 and of the power: a warning, and the part of the error not known.

    ``warning`` is None and ``unknown`` empty if mean and variance surely exist.  ``tail`` is None
    if all moments do.
    """

    tail: PowerTail | None
    warning: Diagnostic | None = None
    unknown: str = ""

    def obstacle(self, within: float) -> Diagnostic | None:
        """Why sampling cannot reach an error ``within``; None if it can."""
        return (
            warning("within_not_promised", within=within, unknown=self.unknown)
            if self.unknown
            else None
        )


def existence(problem: Problem, is_sampled: bool = True) -> MomentExistence:
    """The known part before the run; ``is_sampled``: means need a finite variance as well.

    For a mass that nothing but its stiffness shakes, which comes to rest or grows, nothing is
    stated.

    Raises InfiniteMeanError if the mean surely does not exist, and UnboundedResponseError if
    there is not even a stationary law.
    """
    eqs = problem.equations
    if eqs.n2 is None or not eqs.is_shaken:
        return MomentExistence(None)
    if (tail := power_tail(eqs, driven=not problem.load.is_in_equations)) is None:
        return MomentExistence(None)
    if tail.moment_diverges(0.0):
        raise UnboundedResponseError(refusal("grows_by_stiffness_noise"))
    highest = tail.highest if math.isfinite(tail.highest) else None
    law = {"exponent": tail.exponent, "lowest": tail.lowest, "highest": highest}
    if tail.moment_diverges(MEAN):
        raise InfiniteMeanError(refusal("mean_infinite", **law))
    if tail.moment_may_diverge(MEAN):
        return MomentExistence(tail, warning("mean_may_be_infinite", **law), RARE_MOTIONS)
    if is_sampled and tail.moment_may_diverge(VARIANCE):
        surely = tail.moment_diverges(VARIANCE)
        return MomentExistence(
            tail, warning("variance_missing", surely=surely, **law), RARE_MOTIONS
        )
    return MomentExistence(tail)
