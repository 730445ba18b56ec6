"""Stops elsewhere than at rest: at a distance or pressed on the mass, on both sides, or compliant.

    rigid       x'+ = -r x'-               at x = -gap
    opposite    x'+ = -r x'-               at x = +high, with its own r
    compliant   x'' = ... - k y - c y'     while y = x + gap < 0

`move` is the drift of a step (`harvester.mechanics.kernels.equation_of_motion`) whatever the stops: x' = v and V' = v -
mu V in closed form, with as many impacts as it takes, or with the part of a contact that falls into it.  A contact may
be as stiff as it likes: it is an exact flow, so that no step makes it unstable, and one that outlasts the step goes on
in the next.  Spring, damping and noise act in the kicks, in contact too.

``stops`` is None (no stop, or one at rest, the business of `drift_at_stop`) or a tuple of
gap, pull, high, r_high, pull_high, k and c, None where absent; the pulls are the spring's accelerations at the
rigid stops, away from each.
"""

import math

import numpy as np

from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.equation_of_motion import (
    carried,
    decayed,
    drift_at_stop,
    kick,
    kick_at_stop,
    meeting,
    push,
)


def stops_of(eqs: Equations) -> tuple[float | None, ...] | None:
    """The tuple ``stops`` of the equations, as the kernels take it; None without a stop or with one at rest."""
    if eqs.gap is None and eqs.opposite_restitution is None and eqs.stop_stiffness is None:
        return None
    gap, high = eqs.gap or 0.0, eqs.opposite_gap
    pull_high = None if high is None else -eqs.spring_force(high)
    contact = eqs.stop_stiffness, None if eqs.stop_stiffness is None else eqs.stop_damping or 0.0
    return gap, eqs.spring_force(-gap), high, eqs.opposite_restitution, pull_high, *contact


def loss_unit(r: float | None, stops: tuple[float | None, ...] | None) -> float:
    """The unit of the sums of impact losses: (1 - r^2)/2 for a stop at rest, where v-^2 is added up; else 1."""
    return 1.0 if r is None or stops is not None else 0.5 * (1.0 - r**2)


@forced
def move(x, v, V, h, t, e, g, mu, r, beta, n1, stops, a=None, line=None):
    """Drift by the first t of a step h, whatever the stops: ((x, v, V), what the stops did).

    The latter is the time of the first impact, the speed just before it, negative at the opposite stop, the number of
    impacts and the energy that they took.  ``a`` is the shaking's mean over the step, ``line`` as of `drift`.
    """
    if stops is None:
        x1, v1, V1, speed = drift_at_stop(x, v, V, h, t, e, g, mu, r, beta, n1, None, a, line)
        if r is None:
            return (x1, v1, V1), (0.0, 0.0, 0.0, 0.0)
        return (x1, v1, V1), _single(x, v, V, h, r, beta, n1, None, a, speed)
    return _moved(x, v, V, h, t, e, g, mu, r, beta, n1, a, line, *stops)


@forced
def _single(x, v, V, h, r, beta, n1, pull, a, speed):
    """What one rigid stop did in a drift that began at the distance x from it."""
    time = meeting(x, v, h, push(x, V, beta, n1, pull, a))[0]
    return time, speed, 1.0 if speed > 0.0 else 0.0, 0.5 * (1.0 - r * r) * speed * speed


@forced
def wall_of(speed, stops):
    """Where the mass met a stop, from the speed there as `move` returns it."""
    if stops is None:
        return 0.0
    return _wall_of(speed, *stops)


@forced
def _wall_of(speed, gap, pull, high, r_high, pull_high, k, c):
    if high is not None and speed < 0.0:
        return high
    return -gap


@forced
def mirrored(way, a):
    """The acceleration a along the axis turned by ``way``."""
    if a is None:
        return None
    return way * a


@forced
def _moved(x, v, V, h, t, e, g, mu, r, beta, n1, a, line, gap, pull, high, r_high, pull_high, k, c):
    if r is None:
        return in_contact(x + gap, v, V, t, gap, mu, k, c)
    if high is None:
        y = max(x + gap, 0.0)
        y1, v1, V1, speed = drift_at_stop(y, v, V, h, t, e, g, mu, r, beta, n1, pull, a, line)
        return (y1 - gap, v1, V1), _single(y, v, V, h, r, beta, n1, pull, a, speed)
    if n1 is None:  # the stop ahead, mirrored where it is the opposite one, unless the other one is met too
        way, wall, r_ahead, pull_ahead = 1.0, -gap, r, pull
        if v > 0.0:
            way, wall, r_ahead, pull_ahead = -1.0, high, r_high, pull_high
        y, v_y, V_y = max(way * (x - wall), 0.0), way * v, way * V
        a_y = mirrored(way, a)
        y1, v1, V1, speed = drift_at_stop(y, v_y, V_y, h, t, e, g, mu, r_ahead, beta, n1, pull_ahead, a_y)
        if speed == 0.0:
            return (min(max(x + t * v, -gap), high), v, way * V1), (0.0, 0.0, 0.0, 0.0)
        if y1 <= gap + high:
            first, _, impacts, lost = _single(y, v_y, V_y, h, r_ahead, beta, n1, pull_ahead, a_y, speed)
            return (wall + way * y1, way * v1, way * V1), (first, way * speed, impacts, lost)
    return between(x, v, V, t, mu, gap, r, high, r_high)


@forced
def between(x, v, V, t, mu, gap, r, high, r_high):
    """Move at constant speed for a time t between two rigid stops, from one to the other as often as it takes.

    Whole rounds (there and back) last T, T/q, T/q^2, ... with q = r r_high, so that m of them take
    T (q^-m - 1)/(1/q - 1): however many there are, they cost the same.  During the rounds V sees the mass in the
    middle, which is wrong by a part of the room of order (mu T)^2.
    """
    x1 = x + t * v
    if -gap <= x1 <= high:
        return (x1, v, carried(V, x1 - x, t, mu)), (0.0, 0.0, 0.0, 0.0)
    way, wall, here, other = (1.0, high, r_high, r) if v > 0.0 else (-1.0, -gap, r, r_high)
    room = gap + high
    first = max((wall - x) / v, 0.0)
    V1, left, speed, impacts = carried(V, wall - x, first, mu), t - first, here * abs(v), 1.0
    q = here * other
    if q > 0.0 and speed * left > room:
        one, log_q = room / speed * (1.0 + 1.0 / other), -math.log(q)
        rounds = np.floor(left / one if log_q == 0.0 else math.log1p(left / one * math.expm1(log_q)) / log_q)
        past = one * (rounds if log_q == 0.0 else math.expm1(rounds * log_q) / math.expm1(log_q))
        left, speed, impacts = max(left - past, 0.0), speed * math.exp(-rounds * log_q), impacts + 2.0 * rounds
        if mu is not None:
            V1 -= decayed(mu * past) * (V1 - 0.5 * way * room)
    if speed * left > room:
        leg = room / speed
        V1, left, speed, impacts = carried(V1, -way * room, leg, mu), left - leg, other * speed, impacts + 1.0
        wall, way = wall - way * room, -way
    x1 = wall - way * min(speed * left, room)
    did = first, -v, impacts, 0.5 * (v * v - speed * speed)
    return (x1, -way * speed, carried(V1, x1 - wall, left, mu)), did


@forced
def in_contact(y, v, V, t, gap, mu, k, c):
    """Move for a time t at constant speed where y > 0, by y'' = -k y - c y' where y < 0; V' = y' - mu V throughout.

    In contact y = exp(-c s/2) (y0 cos w s + b sin w s) with w^2 = k - c^2/4 and b = (v0 + c y0/2)/w, up to y = 0; of
    a whole contact that is half a period, after which x'+ = -r x'- with r = exp(-pi zeta/sqrt(1 - zeta^2)), zeta =
    c/(2 sqrt(k)).  The voltage is V = exp(-mu s) (V0 - J0) + J with J = (k y + mu y')/(k - mu c + mu^2).
    """
    y1 = y + t * v
    if k is None or (y >= 0.0 and y1 >= 0.0):
        return (y1 - gap, v, carried(V, y1 - y, t, mu)), (0.0, 0.0, 0.0, 0.0)
    before, first, speed = v * v, 0.0, 0.0
    if y >= 0.0:
        first, speed = -y / v, -v
        V, y = carried(V, -y, first, mu), 0.0
    else:
        before += k * y * y
    half = 0.5 * c
    w = math.sqrt(k - half * half)
    b = (v + half * y) / w
    left = t - first
    end = math.atan2(abs(y), b) / w
    s = min(end, left)
    decay = math.exp(-half * s)
    y1 = decay * (y * math.cos(w * s) + b * math.sin(w * s))
    v1 = decay * w * (b * math.cos(w * s) - y * math.sin(w * s)) - half * y1
    if end <= left:
        y1, v1 = 0.0, decay * w * math.sqrt(y * y + b * b)
    if mu is None:
        V += y1 - y
    else:
        p, d = math.exp(-mu * s), k - mu * c + mu * mu
        V = p * V + (k * (y1 - p * y) + mu * (v1 - p * v)) / d
    after = v1 * v1 + k * y1 * y1
    if end <= left:
        y1 = v1 * (left - s)
        V = carried(V, y1, left - s, mu)
    return (y1 - gap, v1, V), (first, speed, 1.0 if speed > 0.0 else 0.0, 0.5 * (before - after))


@forced
def kick_at_stops(x, v, V, xi, h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a=None, other=None):
    """Kick a mass, but leave one that is stuck on a rigid stop there: `kick_at_stop` for stops wherever they are."""
    if stops is None:
        return kick_at_stop(x, v, V, xi, h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, a, other)
    v1 = kick(x, v, V, xi, h, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, a, other)
    return _kept_on_stop(x, v, v1, r, n1, *stops)


@forced
def _kept_on_stop(x, v, v1, r, n1, gap, pull, high, r_high, pull_high, k, c):
    if r is not None and n1 is None and v == 0.0:
        if x == -gap:
            return max(v1, 0.0)
        if high is not None and x == high:
            return min(v1, 0.0)
    return v1
