"""A device between located impacts: the package's own kick and drift, composed to sixth order, up to each impact.

A step of ``h`` is nine symmetric steps of lengths g h (Kahan and Li, Math. Comp. 66, 1089, 1997), some of them back in
time: their errors of orders 2 and 4 cancel.  The stops are left out of these, for they would break the order: the
step is divided where x meets a stop, at the root of x(t) - wall, and x'+ = -r x'- acts there.

A mass whose next flight would be shorter than a part `SHORTEST` of a step rests on its stop, until a force lifts it.
With a load or a current so fast that steps back in time would grow (mu h above `STIFF`), one symmetric step of second
order takes the place of the nine.
"""

from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.part.forces import Motion, acceleration, flown, held, pushed

PARTS = (
    0.39216144400731413928,
    0.33259913678935943860,
    -0.70624617255763935981,
    0.08221359629355080023,
    0.79854399093482996340,
    0.08221359629355080023,
    -0.70624617255763935981,
    0.33259913678935943860,
    0.39216144400731413928,
)
STIFF = 2.0
SHORTEST = 1e-3
TINY = 1e-6  # of a step: the length of a kick that tells the force
ENDLESS = 200_000  # impacts within one step
ROOTS = 80  # steps towards a root, at most


class Walls(NamedTuple):
    """The rigid stops, None if absent: their places and restitution coefficients."""

    low: float | None = None
    r_low: float | None = None
    high: float | None = None
    r_high: float | None = None


class Leg(NamedTuple):
    """A motion to the end of a step or to an impact on the ``side`` of a stop: 1 lower, -1 upper, 0 none."""

    m: Motion
    side: float


@inlined
def symmetric(m, h, c, outside, record):
    """One symmetric step of second order."""
    return pushed(flown(pushed(m, 0.5 * h, c, outside, record), h, c), 0.5 * h, c, outside, record)


@inlined
def composed(m, h, c, outside, record):
    """One step of sixth order, without stops."""
    if c.mu is not None and c.mu * h > STIFF:
        return symmetric(m, h, c, outside, record)
    end = m.t + h
    for part in PARTS:
        m = symmetric(m, part * h, c, outside, record)
    return Motion(m.x, m.v, m.V, end, m.work, m.load, m.damping)


@inlined
def _root(m, low, high, wall, way, speed, c, outside, record):
    """The time between ``low`` and ``high`` at which the distance to a wall is 0, or the ``speed``: regula falsi.

    Illinois's weight keeps either end from staying; the interval halves at least every other step.
    """
    a, b = low, high
    at_a, at_b = composed(m, a, c, outside, record), composed(m, b, c, outside, record)
    fa = way * at_a.v if speed else way * (at_a.x - wall)
    fb = way * at_b.v if speed else way * (at_b.x - wall)
    for k in range(ROOTS):
        if abs(b - a) <= 1e-15 * high or fb == 0.0:
            break
        time = b - fb * (b - a) / (fb - fa) if k % 4 < 3 and fb != fa else 0.5 * (a + b)
        if not min(a, b) < time < max(a, b):
            time = 0.5 * (a + b)
        found = composed(m, time, c, outside, record)
        f = way * found.v if speed else way * (found.x - wall)
        if (f > 0.0) != (fb > 0.0):
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = time, f
    return b


@inlined
def _meeting(m, m1, h, wall, way, c, outside, record):
    """When within a step from m to m1 the mass first meets a wall; -1 if it does not."""
    d0, d1 = way * (m.x - wall), way * (m1.x - wall)
    u0, u1 = way * m.v, way * m1.v
    if d0 <= 0.0 and u0 < 0.0:
        return 0.0
    if d1 >= 0.0:
        if not u0 < 0.0 < u1 or (d0 + u0 * h >= 0.0 or d1 - u1 * h >= 0.0):
            return -1.0
        turn = _root(m, 0.0, h, wall, way, True, c, outside, record)
        nearest = composed(m, turn, c, outside, record)
        if way * (nearest.x - wall) >= 0.0:
            return -1.0
        return _root(m, 0.0, turn, wall, way, False, c, outside, record)
    if u0 >= 0.0 and u1 >= 0.0:
        return -1.0
    if u0 >= 0.0:
        turn = _root(m, 0.0, h, wall, way, True, c, outside, record)
        nearest = composed(m, turn, c, outside, record)
        if way * (nearest.x - wall) <= 0.0:
            return turn
        return _root(m, turn, h, wall, way, False, c, outside, record)
    return _root(m, 0.0, h, wall, way, False, c, outside, record)


@inlined
def _presses(m, h, c, with_stops, outside, record):
    """Whether a mass at rest on a stop is pressed on it at the time of m."""
    a = acceleration(m.t, outside, record)
    return kick_at_stops(State(m.x, 0.0, m.V), 0.0, TINY * h, with_stops, a) == 0.0


@inlined
def _rested(m, h, c, with_stops, outside, record):
    """The motion of a mass that rests on a stop, up to h or to where a force lifts it."""
    after = held(m, h, c, outside)
    if _presses(after, h, c, with_stops, outside, record):
        return after
    low, high = 0.0, h
    for _ in range(ROOTS):
        middle = 0.5 * (low + high)
        if _presses(held(m, middle, c, outside), h, c, with_stops, outside, record):
            low = middle
        else:
            high = middle
    return held(m, high, c, outside)


@inlined
def up_to_event(m, h, c, with_stops, walls, outside, record):
    """One step of h at most, which ends at the first impact: the `Leg`, whose speed is that before the impact.

    ``c`` are the coefficients without stops, ``with_stops`` those that know where a mass may rest.
    """
    if walls.low is None:
        return Leg(composed(m, h, c, outside, record), 0.0)
    on_low = m.x == walls.low
    on_high = False if walls.high is None else m.x == walls.high
    if m.v == 0.0 and (on_low or on_high) and _presses(m, h, c, with_stops, outside, record):
        return Leg(_rested(m, h, c, with_stops, outside, record), 0.0)
    m1 = composed(m, h, c, outside, record)
    low = _meeting(m, m1, h, walls.low, 1.0, c, outside, record)
    high = -1.0
    if walls.high is not None:
        high = _meeting(m, m1, h, walls.high, -1.0, c, outside, record)
    side, wall, time = 0.0, 0.0, h
    if low >= 0.0:
        side, wall, time = 1.0, walls.low, low
    if walls.high is not None and high >= 0.0 and (low < 0.0 or high < low):
        side, wall, time = -1.0, walls.high, high
    if side == 0.0:  # rounding must not put a mass behind a stop that it is leaving
        x = max(m1.x, walls.low)
        if walls.high is not None:
            x = min(x, walls.high)
        return Leg(Motion(x, m1.v, m1.V, m1.t, m1.work, m1.load, m1.damping), 0.0)
    m1 = composed(m, time, c, outside, record) if time > 0.0 else m
    return Leg(Motion(wall, m1.v, m1.V, m1.t, m1.work, m1.load, m1.damping), side)


@inlined
def rebounded(m, side, h, c, walls, outside, record):
    """The motion after the impact on a side; at rest, where the next flight would be too short."""
    r = walls.r_low
    if walls.high is not None and side < 0.0:
        r = walls.r_high
    v = -r * m.v
    a = acceleration(m.t, outside, record)
    pull = side * kick_at_stops(State(m.x, 0.0, m.V), 0.0, TINY * h, c, a) / (TINY * h)
    if 2.0 * abs(v) <= -pull * SHORTEST * h:
        v = 0.0
    return Motion(m.x, v, m.V, m.t, m.work, m.load, m.damping)
