"""A target error: whether it is reached, and the step and the effort that reach it at the least cost."""

import math
import time
from dataclasses import dataclass, field

from harvester.uncertainty.value import Value

# of the present step; the first is preferred
FACTORS = (1.0, 4.0, 2.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
CHANGE = 1.5  # times cheaper that another step must be, because all begins anew there
SAFETY = 1.05  # more than the measured spread asks for, so that the next look is the last
GROWTH = 8.0  # times the present effort that one round may add: an early spread is not yet trusted


@dataclass
class Target:
    """The relative total error to reach (sampling at 95 % plus bias), and the seconds allowed (None: any).

    ``model`` is a part of the mean, a model error, which no effort makes smaller.
    """

    within: float
    budget: float | None = None
    begin: float = field(default_factory=time.perf_counter)
    model: float = 0.0

    @property
    def room(self) -> float:
        """The relative error that sampling and bias may have in addition to the model's."""
        return self.within - self.model

    def leave(self, model: float) -> None:
        """Leave room for a model error, a part of the mean; none for one beyond it."""
        self.model = model if model < self.within else 0.0

    @property
    def seconds_left(self) -> float:
        """The seconds until the budget is spent."""
        return math.inf if self.budget is None else self.begin + self.budget - time.perf_counter()

    def reached(self, value: Value) -> bool:
        """Whether the total error is small enough."""
        return value.known_error95 <= self.room * abs(value.value)

    def shortfall(self, value: Value) -> dict[str, float | None]:
        """The numbers of a budget that ended before the target was reached.

        ``error`` is the relative error that there is, None if the mean is not known from zero;
        sampling alone would need ``more`` seconds to the target at this step, at least, which is
        ``enough`` in all.
        """
        size = abs(value.value)
        spent = time.perf_counter() - self.begin
        excess = (value.sampling95 / (self.room * size)) ** 2 - 1.0 if size > 0.0 else 0.0
        more = spent * max(excess, 0.0)
        error = value.known_error95 / size + self.model if size > 0.0 else None
        return {
            "within": self.within,
            "budget": self.budget,
            "error": error,
            "more": more,
            "enough": spent + more,
        }

    def variance(self, value: Value) -> float:
        """The variance of sampling that meets the target together with the bias; 0 if the bias alone is too large."""
        room = self.room * abs(value.value) - (value.bias or 0.0) - (value.model or 0.0)
        return (max(room, 0.0) / value.quantile) ** 2


def best_factor(within: float, bias: float, bias_error: float, order: float = 2.0) -> float:
    """The factor to change the step h by: 1, or one at which the target costs at least `CHANGE` times less.

    Time averages over T have a variance S/T, and T costs T/h: to reach |b| + 1.96 sqrt(S/T) =
    ``within`` with the bias b h^p of the ``order`` p costs

        S (1.96/(within - |b| f^p h^p))^2 / (f h).

    ``bias`` is |b| h^p and ``bias_error`` its standard error, both relative.  A bias that is not seen above its error
    does not make the step smaller; for a larger step it counts at its upper limit.
    """

    def cost(factor: float) -> float:
        seen = bias if bias > 2.0 * bias_error else 0.0
        at_step = (bias + 2.0 * bias_error if factor > 1.0 else seen) * factor**order
        return math.inf if at_step >= 0.7 * within else (within / (within - at_step)) ** 2 / factor

    best = min(FACTORS, key=cost)
    return best if cost(best) * CHANGE < cost(1.0) else 1.0


def added_effort(now: float, needed: float) -> float:
    """The effort to add to the present one, ``now``, if the variance asks for ``needed`` in all.

    It is a tenth of the present effort at least, and `GROWTH` times that at most.
    """
    return min(max(SAFETY * needed - now, 0.1 * now), GROWTH * now)
