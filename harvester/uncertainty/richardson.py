"""Richardson extrapolation: the limit of a scheme at a step of 0, from a step h and twice that step.

    E_h = E_0 + c h^p   =>   E_h - E_0 = (E_2h - E_h)/(2^p - 1)

with the order p = 2, or a lower one near a stop (`harvester.equations.impact_order`).  There both
parts may be large and of opposite sign, so that a third step distinguishes them:

    E_h = E_0 + c h^2 + d h^p,   u = 3 c h^2,   w = (2^p - 1) d h^p
    E_2h - E_h = u + w,   E_4h - E_2h = 4 u + 2^p w

`step_bias` and `extrapolated` use the values at the steps h, 2 h and perhaps 4 h, each with one
entry a trajectory, shape (n,), entry by entry on the same noise: if the trajectories of the steps
stay together, differences have a smaller error than the means; ``controls`` are those of all steps
side by side and ``together`` is as of `controlled_entries`. If the trajectories part, the moments
of each step are better controlled by themselves: few entries bear few columns. `limit` has single
numbers without noise.
"""

import math
from collections.abc import Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.value import mean_and_error

# times that a halved step makes changes smaller, where the order is taken to hold
SLOWEST, FASTEST = 2.5, 8.0


def step_bias(
    values: Sequence[Floats], order: float = 2.0, controls: Floats | None = None, together: int = 1
) -> tuple[float, float]:
    """The bias E_h - E_0 of the mean at the step h, and its standard error.

    From three steps both of its parts count as if they had one sign: they must not seem to cancel.
    """
    weights = bias_weights(len(values), order)
    mean, error = mean_and_error(_combined(weights.sum(axis=0), values, controls, together))
    if len(weights) == 1:
        return mean, error
    means = [float(_combined(weight, values, controls, together).mean()) for weight in weights]
    return math.copysign(sum(map(abs, means)), means[0]), error


def extrapolated(
    values: Sequence[Floats], order: float = 2.0, controls: Floats | None = None, together: int = 1
) -> Floats:
    """Entries with the mean E_0 at a step of 0."""
    weights = bias_weights(len(values), order).sum(axis=0)
    return _combined(np.eye(len(values))[0] - weights, values, controls, together)


def _combined(
    weights: Floats, values: Sequence[Floats], controls: Floats | None, together: int
) -> Floats:
    """Entries of the sum of weighted moments at all steps, by the better of two ways to use their controls."""
    whole = controlled_entries(weights @ np.array(values), controls, together)
    if controls is None:
        return whole
    by_step = np.hsplit(controls, len(values))
    each = weights @ np.array(
        [
            controlled_entries(moments, variates, together)
            for moments, variates in zip(values, by_step, strict=True)
        ]
    )
    return whole if whole.std() < each.std() else each


def bias_weights(steps: int, order: float) -> Floats:
    """Weights of the values at all steps: for the bias at h of the order p, and from three steps of second order."""
    first = np.eye(steps)[1] - np.eye(steps)[0]
    second = np.eye(steps)[-1] - np.eye(steps)[1]
    power = 2.0**order
    if steps == 2:
        return np.array([first / (power - 1.0)])
    low = (4.0 * first - second) / (4.0 - power)
    return np.array([low / (power - 1.0), (first - low) / 3.0])


def limit(values: Sequence[float]) -> tuple[float, float]:
    """The limit of numbers at steps that are halved, the finest last, and its error.

    If the last three fall by the order, by about 4, it is E_0, whose error is its change by the
    finest step.  Else it is the last one, whose error is the larger of its change and
    a quarter of the change before.

    >>> limit([17.0, 5.0, 2.0]), limit([1.0, 2.0, 1.0])
    ((1.0, 0.0), (1.0, 1.0))
    """
    coarse, middle, fine = values[-3:]
    first, second = coarse - middle, middle - fine
    if SLOWEST * second**2 <= first * second <= FASTEST * second**2 and second != 0.0:
        now, before = fine - second / 3.0, middle - first / 3.0
        return now, abs(now - before)
    return fine, max(abs(second), 0.25 * abs(first))
