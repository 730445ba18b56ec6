"""Richardson extrapolation: what a scheme of second order gives at a step of 0, from a step h and twice that step.

    E_h = E_0 + c h^2 + O(h^4)   =>   E_h - E_0 = (E_2h - E_h)/3,   E_0 = (4 E_h - E_2h)/3

`step_bias` and `extrapolated` take one entry a trajectory, shape (n,), at the step h (``fine``) and at 2 h
(``coarse``), entry by entry on the same noise: where the paths of both steps stay together, the difference has a
smaller error than either mean; ``controls`` and ``together`` are as of `controlled_entries`.  `limit` takes single
numbers without noise.
"""

from collections.abc import Sequence

from harvester.arrays import Floats
from harvester.uncertainty.controls import controlled_mean

SLOWEST, FASTEST = 2.5, 8.0  # times that a halved step makes changes smaller, where the order is taken to hold


def step_bias(fine: Floats, coarse: Floats, controls: Floats | None = None, together: int = 1) -> tuple[float, float]:
    """The bias E_h - E_0 of the mean at the step h, and its standard error."""
    difference, error = controlled_mean(coarse - fine, controls, together)
    return difference / 3.0, error / 3.0


def extrapolated(
    fine: Floats, coarse: Floats, controls: Floats | None = None, together: int = 1
) -> tuple[float, float]:
    """The mean E_0 at a step of 0, and its standard error."""
    return controlled_mean((4.0 * fine - coarse) / 3.0, controls, together)


def limit(values: Sequence[float]) -> tuple[float, float]:
    """What numbers at steps that are halved, the finest last, come to, and the error of that.

    Where the last three fall as the order says, by about 4, it is E_0, whose error is what the finest step changed in
    it.  Else it is the last one, whose error is the larger of its change and a quarter of the change before.

    >>> limit([17.0, 5.0, 2.0]), limit([1.0, 2.0, 1.0])
    ((1.0, 0.0), (1.0, 1.0))
    """
    coarse, middle, fine = values[-3:]
    first, second = coarse - middle, middle - fine
    if SLOWEST * second**2 <= first * second <= FASTEST * second**2 and second != 0.0:
        now, before = fine - second / 3.0, middle - first / 3.0
        return now, abs(now - before)
    return fine, max(abs(second), 0.25 * abs(first))
