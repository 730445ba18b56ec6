"""The arguments of every kernel: a trajectory's state, the coefficients of its equations, and the results of its stops.

A field that is None is an effect that is absent: kernels are compiled without it
(`harvester.mechanics.kernels.absent_effects`).
"""

from typing import NamedTuple

from harvester.equations.coefficients import Equations, check_one_mode

BATCH = 64  # trajectories that a kernel of many advances side by side


class State(NamedTuple):
    """Displacement, velocity and voltage of a trajectory."""

    x: float
    v: float
    V: float


class Coefficients(NamedTuple):
    """The coefficients of Eq. 2, by the names of `Equations`, and its stops, by names of one letter.

    The lower stop is rigid with the restitution ``r``, or compliant with stiffness ``k`` and damping ``c``; the upper
    one is rigid with ``r_high``, at x = ``high``.  If the lower one is rigid, at rest and alone,
    ``gap`` is None; else it is at x = -gap, and the pulls are the spring's accelerations at both.
    """

    mu: float | None = None
    r: float | None = None
    alpha: float | None = None
    beta: float | None = None
    c1: float | None = None
    c2: float | None = None
    c3: float | None = None
    cv: float | None = None
    n1: float | None = None
    n2: float | None = None
    n12: float | None = None
    linear: float | None = None
    alpha2: float | None = None
    softening: float | None = None
    inertia: float | None = None
    gamma: float | None = None
    gap: float | None = None
    pull: float | None = None
    high: float | None = None
    r_high: float | None = None
    pull_high: float | None = None
    k: float | None = None
    c: float | None = None


class Impacts(NamedTuple):
    """The results of stops in a drift: the time of the first impact, the speed just before it, their number and energy.

    The speed is negative at the upper stop.
    """

    time: float
    speed: float
    number: float
    energy: float


def coefficients(eqs: Equations) -> Coefficients:
    """The coefficients of equations, for kernels of one mode.

    Raises CannotServeError for further modes or a magnifier, whose kernels are in
    `harvester.mechanics.modes`.
    """
    check_one_mode(eqs)
    given = {name: getattr(eqs, name) for name in Coefficients._fields if name in vars(eqs)}
    given |= {"r": eqs.restitution, "r_high": eqs.opposite_restitution, "high": eqs.opposite_gap}
    if (
        eqs.gap is not None
        or eqs.opposite_restitution is not None
        or eqs.stop_stiffness is not None
    ):
        given["gap"] = eqs.gap or 0.0
        given["pull"] = eqs.spring_force(-given["gap"])
    if eqs.opposite_gap is not None:
        given["pull_high"] = -eqs.spring_force(eqs.opposite_gap)
    if eqs.stop_stiffness is not None:
        given |= {"k": eqs.stop_stiffness, "c": eqs.stop_damping or 0.0}
    return Coefficients(**given)
