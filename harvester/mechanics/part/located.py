"""A device between located impacts: the package's kick and drift, composed to sixth order.

A step of ``h`` is nine symmetric steps of lengths g h (Kahan and Li, Math. Comp. 66, 1089, 1997),
some of them back in time: their errors of orders 2 and 4 cancel.  The stops are left out of these,
for they would break the order: the step is divided at the root of x(t) - wall, and x'+ = -r x'-
acts there.

A mass whose next flight would be shorter than a part `SHORTEST` of a step rests on its stop, until
a force lifts it.  With a load or a current so fast that steps back in time would grow (mu h above
`STIFF`), one symmetric step of second order replaces the nine.
"""

import math
from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.part.outside_forces import (
    Outside,
    PartMotion,
    acceleration,
    at,
    at_time,
    flown,
    held,
    pushed,
)
from harvester.mechanics.part.part_state import (
    ADVANCE,
    DONE,
    EVENT,
    FAILED,
    JUMP,
    READ,
    SLACK,
    STOPPING,
    kept,
    loaded,
    report,
)

STEP = 0.5  # of the package's default step: the sixth order is then exact to 1e-9 or so
RESOLVED = 0.5  # a step times the frequency, at most: the sixth order is then exact to 1e-6 or so
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
TINY = 1e-6  # of a step: the length of a kick that measures the force
ENDLESS = 2_000  # impacts within one step: flights of `SHORTEST` leave room for 1,000
ROOTS = 80  # steps towards a root, at most


class Wall(NamedTuple):
    """A rigid stop at x with the restitution coefficient r; ``side``: 1 lower, -1 upper."""

    x: float
    r: float
    side: float


class Located(NamedTuple):
    """A device with a longest step h: coefficients without stops and with them, and its walls."""

    h: float
    quiet: Coefficients
    c: Coefficients
    low: Wall | None
    high: Wall | None
    outside: Outside


class Advance(NamedTuple):
    """A motion to the end of a step, or to an impact on a ``side``: 1, -1, or 0 without."""

    m: PartMotion
    side: float


@inlined
def symmetric(m, h, c, outside):
    """One symmetric step of second order."""
    return pushed(flown(pushed(m, 0.5 * h, c, outside), h, c), 0.5 * h, c, outside)


@inlined
def composed(m, h, c, outside):
    """One step of sixth order, without stops."""
    if c.mu is not None and c.mu * h > STIFF:
        return symmetric(m, h, c, outside)
    end = m.t + h
    for part in PARTS:
        m = symmetric(m, part * h, c, outside)
    return at_time(m, end)


@inlined
def _from_wall(m, wall, of_speed):
    """The distance from a wall, or with ``of_speed`` the speed away from it."""
    return wall.side * m.v if of_speed else wall.side * (m.x - wall.x)


@inlined
def _root(m, low, high, wall, of_speed, device):
    """The time between ``low`` and ``high`` at which the distance or speed is 0: regula falsi.

    Illinois's weight keeps either end from staying; the interval halves at least every other step.
    """
    a = low
    b = high
    fa = _from_wall(composed(m, a, device.quiet, device.outside), wall, of_speed)
    fb = _from_wall(composed(m, b, device.quiet, device.outside), wall, of_speed)
    for k in range(ROOTS):
        if abs(b - a) <= 1e-15 * high or fb == 0.0:
            break
        time = b - fb * (b - a) / (fb - fa) if k % 4 < 3 and fb != fa else 0.5 * (a + b)
        if not min(a, b) < time < max(a, b):
            time = 0.5 * (a + b)
        f = _from_wall(composed(m, time, device.quiet, device.outside), wall, of_speed)
        if (f > 0.0) != (fb > 0.0):
            a = b
            fa = fb
        else:
            fa *= 0.5
        b = time
        fb = f
    return b


@inlined
def _meeting(m, m1, h, wall, device):
    """The time within a step from m to m1 of the first impact on a wall; -1 without."""
    if wall is None:
        return -1.0
    d0 = _from_wall(m, wall, False)
    d1 = _from_wall(m1, wall, False)
    u0 = wall.side * m.v
    u1 = wall.side * m1.v
    if d0 <= 0.0 and u0 < 0.0:
        return 0.0
    if d1 >= 0.0:
        if not u0 < 0.0 < u1 or (d0 + u0 * h >= 0.0 or d1 - u1 * h >= 0.0):
            return -1.0
        turn = _root(m, 0.0, h, wall, True, device)
        nearest = composed(m, turn, device.quiet, device.outside)
        if _from_wall(nearest, wall, False) >= 0.0:
            return -1.0
        return _root(m, 0.0, turn, wall, False, device)
    if u0 >= 0.0 and u1 >= 0.0:
        return -1.0
    if u0 >= 0.0:
        turn = _root(m, 0.0, h, wall, True, device)
        nearest = composed(m, turn, device.quiet, device.outside)
        if _from_wall(nearest, wall, False) <= 0.0:
            return turn
        return _root(m, turn, h, wall, False, device)
    return _root(m, 0.0, h, wall, False, device)


@inlined
def _presses(m, device, h):
    """Whether a mass at rest on a stop is pressed on it at the time of m."""
    a = acceleration(m.t, device.outside)
    return kick_at_stops(State(m.x, 0.0, m.V), 0.0, TINY * h, device.c, a) == 0.0


@inlined
def _rests(m, wall, device, h):
    """Whether the mass rests on a wall."""
    if wall is None:
        return False
    return m.v == 0.0 and m.x == wall.x and _presses(m, device, h)


@inlined
def _rested(m, h, device):
    """The motion of a mass that rests on a stop, up to h or until a force lifts it."""
    after = held(m, h, device.quiet, device.outside)
    if _presses(after, device, h):
        return after
    low = 0.0
    high = h
    for _ in range(ROOTS):
        middle = 0.5 * (low + high)
        if _presses(held(m, middle, device.quiet, device.outside), device, h):
            low = middle
        else:
            high = middle
    return held(m, high, device.quiet, device.outside)


@inlined
def up_to_event(m, h, device):
    """One step of h at most, up to the first impact; the speed is that before it."""
    if device.low is None:
        return Advance(composed(m, h, device.quiet, device.outside), 0.0)
    if _rests(m, device.low, device, h) or _rests(m, device.high, device, h):
        return Advance(_rested(m, h, device), 0.0)
    m1 = composed(m, h, device.quiet, device.outside)
    low = _meeting(m, m1, h, device.low, device)
    high = _meeting(m, m1, h, device.high, device)
    if low < 0.0 and high < 0.0:  # rounding must not put a mass behind a stop that it is leaving
        x = max(m1.x, device.low.x)
        if device.high is not None:
            x = min(x, device.high.x)
        return Advance(at(m1, x, m1.v), 0.0)
    side = 1.0
    time = low
    x = device.low.x
    if device.high is not None and high >= 0.0 and (low < 0.0 or high < low):
        side = -1.0
        time = high
        x = device.high.x
    m1 = composed(m, time, device.quiet, device.outside) if time > 0.0 else m
    return Advance(at(m1, x, m1.v), side)


@inlined
def rebounded(m, side, device):
    """The motion after the impact on a side; at rest, if the next flight would be too short."""
    h = device.h
    r = device.low.r
    if device.high is not None and side < 0.0:
        r = device.high.r
    v = -r * m.v
    a = acceleration(m.t, device.outside)
    resting = State(m.x, 0.0, m.V)
    pull = side * kick_at_stops(resting, 0.0, TINY * h, device.c, a) / (TINY * h)
    if 2.0 * abs(v) <= -pull * SHORTEST * h:
        v = 0.0
    return at(m, m.x, v)


@inlined
def jumped(w, m, side, device):
    """The motion after an impact, which is counted."""
    if device.low is None:
        return m
    m1 = rebounded(m, side, device)
    w[9] += 0.5 * (m.v * m.v - m1.v * m1.v)
    w[10] += m1.v - m.v
    w[11] += 1.0
    w[12] = m.t
    w[13] = -m.v
    w[14] = 0.0
    return m1


@inlined
def advanced(w, until, stopping, device):
    """Advance to the time ``until``, or ``stopping`` to the next impact."""
    m = loaded(w)
    if w[14] != 0.0:
        m = jumped(w, m, w[14], device)
    steps = max(math.ceil((until - m.t) / device.h - SLACK), 1.0)
    h = (until - m.t) / steps
    begin = m.t
    for k in range(int(steps)):
        end = begin + (k + 1.0) * h if k + 1.0 < steps else until
        events = 0
        while m.t < end:
            stage = up_to_event(m, end - m.t, device)
            m = stage.m
            if stage.side != 0.0:
                if stopping:
                    w[14] = stage.side
                    return EVENT if kept(w, m) else FAILED
                m = jumped(w, m, stage.side, device)
                events += 1
                if events > ENDLESS:
                    return FAILED
    return DONE if kept(w, m) else FAILED


@inlined
def located_part(task, w, out, until, device):
    """Advance, jump, or report."""
    if task == ADVANCE or task == STOPPING:  # noqa: PLR1714, SIM109 - as numba needs it
        return advanced(w, until, task == STOPPING, device)
    if task == JUMP and w[14] != 0.0:
        kept(w, jumped(w, loaded(w), w[14], device))
    if task == READ:
        m = loaded(w)
        report(out, m, device.quiet, device.c, None, acceleration(m.t, device.outside))
        out[5] = w[11]
        out[6] = w[12]
        out[7] = w[13]
        out[9] = w[10]
        out[13] = w[9]
        out[17] = 0.0
    return DONE
