"""The stationary mean square of linear equations, to rounding, under all excitation that a scene may have.

White noise adds N1 times the response to noise of intensity 1 (`harvester.linear.transfer`), other
excitation its own (`harvester.linear.shaking`).  Noise on the stiffness is white noise of intensity
N2 E[x^2], independent of the rest:

    N = N1 + N2 E[x^2],   E[x^2] = N X + E[x^2 of other excitation]

with X that of intensity 1, so that N2 X < 1 or the mean square grows; correlated noise adds N12
E[x] = 0.
"""

from collections.abc import Sequence
from typing import NamedTuple

from harvester.equations.bounds import check_bounded
from harvester.equations.coefficients import Equations
from harvester.errors import HarvesterError, UnboundedResponseError, answer_or_error
from harvester.linear.shaking import ROUNDING, response_to_shaking
from harvester.linear.transfer import white


class MeanSquare(NamedTuple):
    """E[V^2] and its error, of rounding and of the integral over a density; and E[x^2]."""

    value: float
    error: float
    x2: float


def solve(eqs: Equations) -> MeanSquare:
    """The stationary E[V^2] of linear equations without a stop.

    Raises UnboundedResponseError if nothing dissipates energy, or more is fed than dissipated.
    """
    check_bounded(eqs)
    at_one = white(eqs)
    rounding = ROUNDING * (1.0 + at_one.sharpness)
    if not rounding < 1.0:
        raise UnboundedResponseError(
            "the response grows without bound, or never settles: nothing dissipates energy; give a damping"
        )
    n1, n2 = eqs.n1 or 0.0, eqs.n2 or 0.0
    left = 1.0 - n2 * at_one.x2
    if not left > rounding:
        raise UnboundedResponseError(
            f"the response grows without bound: noise on the stiffness feeds more than damping removes; "
            f"N2 must be below {1.0 / at_one.x2:.6g}, but is {n2:.6g}"
        )
    (x2, v2), (x2_error, v2_error) = response_to_shaking(eqs)
    x2 = (x2 + n1 * at_one.x2) / left
    value = float(v2 + (n1 + n2 * x2) * at_one.v2)
    return MeanSquare(
        value,
        float(v2_error + n2 * x2_error / left * at_one.v2 + value * rounding / left),
        float(x2),
    )


def solve_many(several: Sequence[Equations]) -> list[MeanSquare | HarvesterError]:
    """`solve` for each, an error in the place of each that has no solution."""
    return [answer_or_error(solve, eqs) for eqs in several]
