"""Richardson extrapolation: what a scheme of second order gives at a step of 0, from a step h and twice that step.

    E_h = E_0 + c h^2 + O(h^4)   =>   E_h - E_0 = (E_2h - E_h)/3,   E_0 = (4 E_h - E_2h)/3

Both functions take one entry a trajectory, shape (n,), at the step h (``fine``) and at 2 h (``coarse``), entry by entry
on the same noise: where the paths of both steps stay together, the difference has a smaller error than either mean.
``controls`` are as of `controlled_entries`.
"""

from harvester.arrays import Floats
from harvester.uncertainty.controls import controlled_mean


def step_bias(fine: Floats, coarse: Floats, controls: Floats | None = None) -> tuple[float, float]:
    """The bias E_h - E_0 of the mean at the step h, and its standard error."""
    difference, error = controlled_mean(coarse - fine, controls)
    return difference / 3.0, error / 3.0


def extrapolated(fine: Floats, coarse: Floats, controls: Floats | None = None) -> tuple[float, float]:
    """The mean E_0 at a step of 0, and its standard error."""
    return controlled_mean((4.0 * fine - coarse) / 3.0, controls)
