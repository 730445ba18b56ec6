"""The rates at which a displacement is first passed, on either side.

The mesh ends at the level, at which the outflow is lost
(`harvester.density.relaxation.first_passage`).  Every rare passage ends a wait of the same law, so
that the largest value in a time T stays below the level with exp(-lambda T).
"""

import math
from dataclasses import replace

import numpy as np

from harvester.density.box import Setting, potential
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.relaxation import first_passage
from harvester.density.weak_form import WeakForm
from harvester.equations.coefficients import Equations
from harvester.machine.cores import one_blas_thread

# energies of the motion by which the speeds of the mesh go beyond what reaches the level
BEYOND = 6.0
HIGHEST = 60.0  # energies of a level that is asked for


@one_blas_thread
def displacement_rate(
    eqs: Equations, setting: Setting, level: float, resolution: int, modes: int
) -> float:
    """The rate at which |displacement| passes a level for the first time, on the mesh of one of `RESOLUTIONS`.

    0 if the level is too far up to be resolved.
    """
    if eqs.stop_stiffness is not None and level <= (
        eqs.gap or 0.0
    ):  # the compliant stop is never reached
        eqs = replace(eqs, stop_stiffness=None, stop_damping=None, gap=None)
    low, high = eqs.rigid_stops
    box = setting.box
    warmth = box.speed**2 / (2.0 * box.tail)
    ends = max(low, -level), min(high, level)
    x = np.linspace(*ends, 2001)
    energy = potential(eqs, setting.frame, x)
    lost = low < -level, high > level
    tail = (
        min(float(energy[end]) for end, loses in zip((0, -1), lost, strict=True) if loses) / warmth
        + BEYOND
    )
    if tail > HIGHEST:
        return 0.0
    # an end that is so much higher is never passed
    reached = np.flatnonzero(energy <= tail * warmth)
    lost = lost[0] and reached[0] == 0, lost[1] and reached[-1] == len(x) - 1
    x, energy = x[reached[0] : reached[-1] + 1], energy[reached[0] : reached[-1] + 1]
    ends = float(x[0]), float(x[-1])
    padded = np.concatenate([[np.inf], energy, [np.inf]])
    rests = x[(energy <= padded[:-2]) & (energy < padded[2:])]
    reach = max(rests[0] - ends[0], ends[1] - rests[-1], 0.25 * (ends[1] - ends[0]))
    inside = replace(
        box,
        low=ends[0],
        high=ends[1],
        speed=math.sqrt(2.0 * tail * warmth),
        reach=float(reach),
        tail=tail,
    )
    on = mesh(eqs, inside, RESOLUTIONS[resolution])
    return first_passage(WeakForm(eqs, on, setting.frame, modes, lost), float(rests[-1]))
