"""Whether the means that an engine is asked for exist: noise of the stiffness may leave a power tail."""

import math
from dataclasses import dataclass

from harvester.averaging.stability.power_law_tail import MEAN, VARIANCE, PowerTail, power_tail
from harvester.equations.problem import Problem
from harvester.errors import InfiniteMeanError, UnboundedResponseError

LESS = "less noise of the stiffness (stiffness_noise, D22), more damping, or one that grows (damping_x2)"
_RARE = "motions too large and rare for a sample"


@dataclass(frozen=True)
class MomentExistence:
    """What the tail leaves of the means of V^2 and of the power: a warning, and the part of the error not known.

    Both are empty where mean and variance surely exist.  ``tail`` is None where all moments do.
    """

    tail: PowerTail | None
    warning: str = ""
    unknown: str = ""

    @property
    def warnings(self) -> list[str]:
        """The warning in a list of its own, empty without one."""
        return [self.warning] if self.warning else []

    def can_reach(self, within: float, warnings: list[str]) -> bool:
        """Whether sampling can reach an error ``within``; where not, ``warnings`` says so."""
        if self.unknown:
            warnings.append(f"`within` {within:.3g} cannot be promised: the error of {self.unknown} is not known")
        return not self.unknown


def existence(problem: Problem, sampled: bool = True) -> MomentExistence:
    """What is known before the run; ``sampled`` means need a finite variance too.

    Of a mass that nothing but its stiffness shakes, which comes to rest or grows, nothing is said.

    Raises InfiniteMeanError where the mean surely does not exist, and UnboundedResponseError where there is not even a
    stationary law.
    """
    eqs = problem.equations
    if eqs.n2 is None or not eqs.is_shaken:
        return MomentExistence(None)
    tail = power_tail(eqs, driven=problem.netlist is not None)
    if tail is None:
        return MomentExistence(None)
    law = f"noise of the stiffness makes large amplitudes A as likely as A^-(1 + q), {_told(tail)}"
    if tail.moment_diverges(0.0):
        raise UnboundedResponseError(
            f"the response grows without bound: noise of the stiffness feeds more than damping takes; give {LESS}"
        )
    if tail.moment_diverges(MEAN):
        raise InfiniteMeanError(
            f"the means of V^2 and of the power do not exist: {law}, and they need a q above 2, so that the mean of a "
            f"sample grows with its size; give {LESS}"
        )
    if tail.moment_may_diverge(MEAN):
        return MomentExistence(
            tail, f"the means of V^2 and of the power may not exist: {law}, and they need a q above 2", _RARE
        )
    if sampled and tail.moment_may_diverge(VARIANCE):
        may = "has" if tail.moment_diverges(VARIANCE) else "may have"
        return MomentExistence(
            tail,
            f"V^2 {may} no finite variance, so that a sample's spread does not state the error of its mean: {law}, and "
            "a variance needs a q above 4",
            _RARE,
        )
    return MomentExistence(tail)


def _told(tail: PowerTail) -> str:
    """The exponent with its ends, in words."""
    if tail.highest == tail.lowest:
        return f"q = {tail.exponent:.3g}"
    if tail.highest == math.inf:
        return f"q = {max(tail.lowest, 0.0):.2g} or more"
    return f"q = {tail.exponent:.2g} (from {max(tail.lowest, 0.0):.2g} to {tail.highest:.2g})"
