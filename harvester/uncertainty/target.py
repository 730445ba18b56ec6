"""A target error: whether it is reached, and the step and the effort that reach it at the least cost."""

import math
import time
from dataclasses import dataclass, field

from harvester.uncertainty.value import Value

# of the present step; the first is preferred
FACTORS = (1.0, 4.0, 2.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
CHANGE = 1.5  # times cheaper that another step must be, because all begins anew there
SAFETY = 1.05  # more than the measured spread asks for, so that the next look is the last
HOPELESS = 2.0  # times the budget: a prediction beyond it is no matter of its own error
LEAST_ROOM = 0.3  # of a target, for sampling: what a smaller step leaves if the bias leaves none
GROWTH = 8.0  # times the present effort that one round may add: an early spread is not yet trusted


@dataclass
class Target:
    """The relative total error to reach (sampling at 95 % plus bias), and the seconds allowed (None: any).

    ``model`` is a part of the mean, a model error, which no effort makes smaller.  ``sampling_seconds``
    are those of sampling so far (None: all since ``begin``).  A target that ``gives_up`` is missed
    as soon as the prediction is far beyond its budget, which leaves the rest for another engine.
    """

    within: float
    budget: float | None = None
    begin: float = field(default_factory=time.perf_counter)
    model: float = 0.0
    sampling_seconds: float | None = None
    gives_up: bool = False

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
        more = self.more_seconds(value)
        error = value.known_error95 / size + self.model if size > 0.0 else None
        return {
            "within": self.within,
            "budget": self.budget,
            "error": error,
            "more": more,
            "enough": spent + more,
        }

    def more_seconds(self, value: Value) -> float:
        """The seconds of sampling that are missing: its variance falls as one over its time.

        The step's bias and the model's error leave the rest of the target, and `LEAST_ROOM` of it at
        least; 0 for a mean of zero.
        """
        size = abs(value.value)
        if size == 0.0:
            return 0.0
        left = self.room * size - (value.bias or 0.0) - (value.model or 0.0)
        room = max(left, LEAST_ROOM * self.room * size)
        spent = time.perf_counter() - self.begin
        so_far = spent if self.sampling_seconds is None else self.sampling_seconds
        return so_far * max((value.sampling95 / room) ** 2 - 1.0, 0.0)

    def is_hopeless(self, value: Value) -> bool:
        """Whether the target gives up: the predicted time is more than `HOPELESS` times the budget."""
        if not self.gives_up or self.budget is None:
            return False
        spent = time.perf_counter() - self.begin
        return spent + self.more_seconds(value) > HOPELESS * self.budget

    def variance(self, value: Value) -> float:
        """The variance of sampling that meets the target together with the bias.

        0 if the bias alone is too large.
        """
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
