"""The mass beside a compiled circuit: a drift at constant speed, with impacts, that the circuit follows."""

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.offset_stops import move, wall_of


@inlined
def drifted(s, h, t, c, a):
    """The mass after the first t of a drift of a step h, with the shaking's mean acceleration a (None: no shaking).

    Returns its state, whose voltage is for the circuit to find, then the wall that it met and when
    (its end, and t, if it met none), and what the stops did.
    """
    s1, did = move(s, interval(h, t, None), c, a)
    wall = s1.x
    at = t
    if c.r is not None or c.gap is not None:  # noqa: SIM102 - the first is decided when this is compiled
        if did.number > 0.0:
            wall = wall_of(did.speed, c)
            at = did.time
    return State(s1.x, s1.v, s.V), wall, at, did
