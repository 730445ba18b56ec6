"""Whether the trajectories of a response to a steady drive, where nothing is random, agree."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from harvester.answers.responses import SteadyResponse
    from harvester.mechanics.kernels.moments import Moments

NO_NOISE = (
    "no sampling error: nothing is random, and all starts that were tried come to the same response; a nonlinear "
    "device may have another, which other starts reach"
)
ALIKE, UNLIKE = 1e-3, 0.05  # relative differences of trajectories that are: between them, of impacts' places in a step


def disagreement(moments: "Moments", name: str = "V2", responses: "tuple[SteadyResponse, ...]" = ()) -> str | None:
    """`NO_NOISE` where the trajectories of a steady response agree; where they differ, a warning.

    They are compared by V^2 and by the moment ``name``, which the power is made of, whichever differs more.  Where all
    starts are known to come to one periodic response, they differ only by where in a step impacts and switchings lie,
    which needs no warning.
    """
    told = {"V2": "E[V^2]", "load": "the load's power"}
    name = max(("V2", name), key=lambda one: np.ptp(getattr(moments, one)) / (getattr(moments, one).max() or 1.0))
    values = getattr(moments, name)
    low, high = values.min(), values.max()
    if high - low <= UNLIKE * high:
        return NO_NOISE if high - low <= ALIKE * high else None
    if len(responses) == 1 and responses[0].periods:
        return None
    low, high = (one / values.mean() for one in (low, high))
    return (
        f"trajectories differ in {told[name]}, from {low:.3g} to {high:.3g} times the mean: the drive has several "
        "responses, a chaotic one, or one that settles late; the mean is over the starts"
    )
