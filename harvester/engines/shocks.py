"""The step of many trajectories under shocks: short enough for the shock too, where the response alone asks for less.

What a grid of steps cannot carry of a shock is left out, and beside a stop that moves the impacts.  The bias that is
measured at twice the step sees that only where both steps carry nearly all of it.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.trajectories import Trajectories

STEPS = 8  # of a shock, at least
MOST = 64  # times shorter than the step of the response: a shock that is shorter is a blow, whatever its shape


def resolve_shocks(trajectories: "Trajectories", briefest: float) -> None:
    """Begin again with a shorter step where the present one is too long for shocks that change in ``briefest`` / w0."""
    h = trajectories.h
    shorter = max(briefest / STEPS, h / MOST)
    if shorter < h:
        trajectories.restart(shorter)
