"""The step of many trajectories under shocks: short enough for the shock too, where the response alone asks for less.

What a grid of steps cannot carry of a shock is left out, and beside a stop that moves the impacts.  The bias that is
measured at twice the step sees that only where both steps carry nearly all of it.
"""

from typing import TYPE_CHECKING

from harvester.equations.problem import Problem
from harvester.equations.repeated_shaking import briefest

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.trajectories import Trajectories

STEPS = 8  # of a shock, at least
MOST = 64  # times shorter than the step of the response: a shock that is shorter is a blow, whatever its shape


def resolve_shocks(trajectories: "Trajectories", problem: Problem, dt: float | None) -> None:
    """Begin again with a shorter step where the scene has shocks that the present one is too long for.

    Nothing is done where the user gives the step ``dt``.
    """
    time = briefest(problem.scene)
    if time is None or dt is not None:
        return
    h = trajectories.h
    shorter = max(time * problem.units.frequency / STEPS, h / MOST)
    if shorter < h:
        trajectories.restart(shorter)
