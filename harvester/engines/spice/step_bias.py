"""The bias of ngspice's step where no cheap model tells it: runs beside others of twice the step on the same noise."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.value import Value, mean_and_error

if TYPE_CHECKING:
    from harvester.cosimulation.runs import TrajectoryMeans


def largest_step_bias(
    name: str, fine: "Sequence[TrajectoryMeans]", coarse: "Sequence[TrajectoryMeans]", watts: float
) -> float:
    """The largest bias of a mean at the step of ``fine`` that ``coarse``, of twice the step, leaves at 95 %.

    It is a third of the difference of the means (`harvester.uncertainty.richardson`) and of the half-width of that
    one's 95 % together.  Each coarse run is on the noise of the
    fine one in its place; their controls weigh side by side.  ``name`` is "V2" or "load", whose unit is ``watts``.
    """
    fine = fine[: len(coarse)]
    blocks = len(fine[0].load_power)
    rough, ours = (_entries(name, several, watts) for several in (coarse, fine))
    entries = controlled_entries(rough - ours, _side_by_side(fine, coarse), blocks) / 3.0
    found = Value(*mean_and_error(entries), dof=len(entries) - 1.0)
    return abs(found.value) + found.sampling95


def _entries(name: str, several: "Sequence[TrajectoryMeans]", watts: float) -> Floats:
    """One entry a block of every run, nondimensional."""
    if name == "load":
        return np.concatenate([one.load_power for one in several]) / watts
    return np.concatenate([one.moments.V2 for one in several])


def _side_by_side(*both: "Sequence[TrajectoryMeans]") -> Floats | None:
    """The controls of all, those of each member in columns of its own; None where there are none."""
    columns = [[one.moments.controls for one in several if one.moments.controls is not None] for several in both]
    return np.hstack([np.vstack(several) for several in columns]) if all(columns) else None
