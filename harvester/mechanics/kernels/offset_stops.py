"""Stops elsewhere than at rest: at a distance or pressed on the mass, on both sides, or compliant.

    rigid       x'+ = -r x'-               at x = -gap
    opposite    x'+ = -r x'-               at x = +high, with its own r
    compliant   x'' = ... - k y - c y'     while y = x + gap < 0

`move` is the drift of a step (`harvester.mechanics.kernels.equation_of_motion`) whatever the stops:
x' = v and V' = v - mu V in closed form, with as many impacts as there are, or with the part of a
contact that falls into it.  A contact may be as stiff as it likes: it is an exact flow, so that no
step makes it unstable, and one that outlasts the step continues in the next.  Spring, damping and
noise act in the kicks, also in contact.

``s``, ``d`` and ``c`` are the state, the drift and the coefficients, as of the equation of motion.
"""

import math

import numpy as np

from harvester.mechanics.kernels.coefficients import Coefficients, Impacts, State
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.equation_of_motion import (
    carried,
    decayed,
    drift_at_stop,
    kick,
    meeting,
    push,
)


def loss_unit(c: Coefficients) -> float:
    """The unit of sums of impact losses: (1 - r^2)/2 at rest, of v-^2.

    The mass at a lone rigid stop; else 1.
    """
    if c.r is None or c.high is not None:
        return 1.0
    return 0.5 * (1.0 - c.r**2) if c.gap is None else 1.0 + (c.inertia or 0.0) * c.gap**2


@forced
def move(s, d, c, a=None):
    """Drift, whatever the stops: the state, and the `Impacts`.

    ``a`` is the excitation's mean over the step.
    """
    if c.gap is None:
        s1, speed = drift_at_stop(s, d, c, c.r, None, a)
        if c.r is None:
            return s1, Impacts(0.0, 0.0, 0.0, 0.0)
        return s1, _single(s, d.h, c.r, c, pull=None, a=a, speed=speed)
    if c.r is None:
        return in_contact(s.x + c.gap, s.v, s.V, d.t, c)
    if c.high is None:
        s = State(max(s.x + c.gap, 0.0), s.v, s.V)
        s1, speed = drift_at_stop(s, d, c, c.r, c.pull, a)
        return State(s1.x - c.gap, s1.v, s1.V), _single(
            s, d.h, c.r, c, pull=c.pull, a=a, speed=speed
        )
    return _move_between(s, d, c, a)


@forced
def _single(s, h, r, c, pull, a, speed):
    """The results of one rigid stop in a drift that began at the distance s.x from it."""
    time = meeting(s.x, s.v, h, push(s.x, s.V, c, pull, a))[0]
    return Impacts(time, speed, 1.0 if speed > 0.0 else 0.0, 0.5 * (1.0 - r * r) * speed * speed)


@forced
def lower_stop(c):
    """The place of the lower stop."""
    if c.gap is None:
        return 0.0
    return 0.0 - c.gap


@forced
def wall_of(side, c):
    """The place of a stop: the opposite one if ``side``, as the speed of `Impacts`, is below 0.

    Else the lower.
    """
    if c.high is not None and side < 0.0:
        return c.high
    return lower_stop(c)


@forced
def mirrored(way, a):
    """The acceleration a along the axis turned by ``way``."""
    if a is None:
        return None
    return way * a


@forced
def _move_between(s, d, c, a):
    """Drift between two rigid stops."""
    if (
        c.n1 is None
    ):  # the stop ahead, mirrored if it is the upper one, unless the other one is met too
        way = 1.0
        wall = -c.gap
        r = c.r
        pull = c.pull
        if s.v > 0.0:
            way = -1.0
            wall = c.high
            r = c.r_high
            pull = c.pull_high
        ahead = State(max(way * (s.x - wall), 0.0), way * s.v, way * s.V)
        a_ahead = mirrored(way, a)
        s1, speed = drift_at_stop(ahead, d, c, r, pull, a_ahead)
        if speed == 0.0:
            x1 = min(max(s.x + d.t * s.v, -c.gap), c.high)
            return State(x1, s.v, way * s1.V), Impacts(0.0, 0.0, 0.0, 0.0)
        if s1.x <= c.gap + c.high:
            did = _single(ahead, d.h, r, c, pull=pull, a=a_ahead, speed=speed)
            return State(wall + way * s1.x, way * s1.v, way * s1.V), Impacts(
                did.time, way * speed, did.number, did.energy
            )
    return between(s, d.t, c)


@forced
def between(s, t, c):
    """Move at constant speed for a time t between two rigid stops, from one to the other as often as they are met.

    Whole rounds (there and back) last T, T/q, T/q^2, ... with q = r r_high, so that m of them last
    T (q^-m - 1)/(1/q - 1): however many there are, they cost the same.  During the rounds V sees the mass in the
    middle, which is wrong by a part of the room of order (mu T)^2.
    """
    x, v = s.x, s.v
    x1 = x + t * v
    if -c.gap <= x1 <= c.high:
        return State(x1, v, carried(s.V, x1 - x, t, c.mu)), Impacts(0.0, 0.0, 0.0, 0.0)
    way, wall, here, other = (
        (1.0, c.high, c.r_high, c.r) if v > 0.0 else (-1.0, -c.gap, c.r, c.r_high)
    )
    room = c.gap + c.high
    first = max((wall - x) / v, 0.0)
    V1 = carried(s.V, wall - x, first, c.mu)
    left = t - first
    speed = here * abs(v)
    impacts = 1.0
    q = here * other
    if q > 0.0 and speed * left > room:
        lap = room / speed * (1.0 + 1.0 / other)
        log_q = -math.log(q)
        rounds = np.floor(
            left / lap if log_q == 0.0 else math.log1p(left / lap * math.expm1(log_q)) / log_q
        )
        past = lap * (rounds if log_q == 0.0 else math.expm1(rounds * log_q) / math.expm1(log_q))
        left = max(left - past, 0.0)
        speed = speed * math.exp(-rounds * log_q)
        impacts = impacts + 2.0 * rounds
        if c.mu is not None:
            V1 -= decayed(c.mu * past) * (V1 - 0.5 * way * room)
    if speed * left > room:
        leg = room / speed
        V1 = carried(V1, -way * room, leg, c.mu)
        left = left - leg
        speed = other * speed
        impacts = impacts + 1.0
        wall = wall - way * room
        way = -way
    x1 = wall - way * min(speed * left, room)
    did = Impacts(first, -v, impacts, 0.5 * (v * v - speed * speed))
    return State(x1, -way * speed, carried(V1, x1 - wall, left, c.mu)), did


@forced
def in_contact(y, v, V, t, c):
    """Move for a time t at constant speed where y > 0, by y'' = -k y - c y' where y < 0; V' = y' - mu V throughout.

    In contact y = exp(-c s/2) (y0 cos w s + b sin w s) with w^2 = k - c^2/4 and b = (v0 + c y0/2)/w, up to y = 0; for
    a whole contact that is half a period, after which x'+ = -r x'- with r = exp(-pi zeta/sqrt(1 - zeta^2)), zeta =
    c/(2 sqrt(k)).  The voltage is V = exp(-mu s) (V0 - J0) + J with J = (k y + mu y')/(k - mu c + mu^2).
    """
    y1 = y + t * v
    if c.k is None or (y >= 0.0 and y1 >= 0.0):
        return State(y1 - c.gap, v, carried(V, y1 - y, t, c.mu)), Impacts(0.0, 0.0, 0.0, 0.0)
    before = v * v
    first = 0.0
    speed = 0.0
    if y >= 0.0:
        first = -y / v
        speed = -v
        V = carried(V, -y, first, c.mu)
        y = 0.0
    else:
        before += c.k * y * y
    half = 0.5 * c.c
    w = math.sqrt(c.k - half * half)
    b = (v + half * y) / w
    left = t - first
    end = math.atan2(abs(y), b) / w
    s = min(end, left)
    decay = math.exp(-half * s)
    y1 = decay * (y * math.cos(w * s) + b * math.sin(w * s))
    v1 = decay * w * (b * math.cos(w * s) - y * math.sin(w * s)) - half * y1
    if end <= left:
        y1 = 0.0
        v1 = decay * w * math.sqrt(y * y + b * b)
    if c.mu is None:
        V += y1 - y
    else:
        p = math.exp(-c.mu * s)
        d = c.k - c.mu * c.c + c.mu * c.mu
        V = p * V + (c.k * (y1 - p * y) + c.mu * (v1 - p * v)) / d
    after = v1 * v1 + c.k * y1 * y1
    if end <= left:
        y1 = v1 * (left - s)
        V = carried(V, y1, left - s, c.mu)
    return State(y1 - c.gap, v1, V), Impacts(
        first, speed, 1.0 if speed > 0.0 else 0.0, 0.5 * (before - after)
    )


@forced
def kick_at_stops(s, xi, h, c, a=None, other=None):
    """The velocity after a `kick`, but leave a mass that is stuck on a rigid stop there while it is pressed on it."""
    return kept_on_stop(s.x, s.v, kick(s, xi, h, c, a, other), c)


@forced
def kept_on_stop(x, v, v1, c):
    """The velocity v1 after a kick, or 0 if it would push a mass at rest on a rigid stop into it."""
    if c.r is not None and c.n1 is None and v == 0.0:
        if x == lower_stop(c):
            return max(v1, 0.0)
        if c.high is not None and x == c.high:
            return min(v1, 0.0)
    return v1
