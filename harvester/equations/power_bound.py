"""The upper bound of the power of any device of the scene's mass, for all springs, stops and circuits.

White noise of the base gives N1 = m G/4 however the mass moves (Ito's formula).  For a finite
acceleration a the rest of the device receives E[a x'] - c E[x'^2] <= E[a^2]/(4 c), c being the
least friction, and between two rigid stops with the room 2 D no more than D E|a'|, because
E[a x'] = -E[a' x].  Derived in docs/model.md.  (Langley, J. Sound Vib. 333, 6521, 2014.)
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.equations.bounds import least_friction
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import Diagnostic, note


class PowerBound(NamedTuple):
    """An upper bound of the mean power in the scene's unit, and ``why`` it holds."""

    value: float
    why: Diagnostic


def power_bound(problem: Problem) -> PowerBound | None:
    """The least bound that applies to a problem; None if none does.

    None applies to parametric noise, to friction that feeds energy, to a circuit with supplies, and
    to an acceleration that no friction and no pair of stops limits.
    """
    eqs = problem.equations
    load = problem.scene.load
    least = least_friction(problem.equations)
    gives = (
        least < 0.0
        or eqs.n2 is not None
        or eqs.n12 is not None
        or (load is not None and load.supplies)
    )
    if gives or not eqs.is_shaken:
        return None
    white = eqs.n1 or 0.0
    unit = problem.units.watts
    white *= eqs.modal.shaken_mass
    if eqs.is_shaken_otherwise and not eqs.modal.shares_friction:
        return None
    if not eqs.is_shaken_otherwise:
        return PowerBound(white * unit, note("bound_by_white_noise"))
    others = {"bound_by_damping": _mean_square(eqs) / (4.0 * least) if least else math.inf}
    room = float(np.subtract(*eqs.rigid_stops[::-1]))
    others["bound_by_stroke"] = 0.5 * room * _mean_jerk(eqs) if room < math.inf else math.inf
    name = min(others, key=lambda code: others[code])
    if not others[name] < math.inf:
        return None
    return PowerBound((white + others[name]) * unit, note(name, white=bool(white)))


def _mean_square(eqs: Equations) -> float:
    """E[a^2] of the excitation in addition to white noise."""
    recorded = eqs.record or eqs.density
    if recorded is not None:
        return recorded.rms**2
    mean_square = 0.0 if eqs.drive is None else 0.5 * eqs.drive**2
    if eqs.coloured is not None:
        mean_square += eqs.coloured * (
            1.0 / (eqs.correlation_time or 0.0) if eqs.bandwidth is None else eqs.bandwidth
        )
    return mean_square


def _mean_jerk(eqs: Equations) -> float:
    """E|a'| for a harmonic excitation or a record; infinite for noise."""
    if eqs.drive is not None and eqs.coloured is None:
        assert eqs.drive_frequency is not None, "Scene checks this"
        return 2.0 / math.pi * eqs.drive * eqs.drive_frequency
    return math.inf if eqs.record is None else eqs.record.mean_jerk
