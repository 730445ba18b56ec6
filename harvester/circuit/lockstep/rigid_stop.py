"""Impacts in lock-step of a mass that no white noise moves, which may come to rest on a stop.

They are those of `harvester.mechanics.kernels.equation_of_motion.drift_at_stop`: on the parabola of the force that
presses the mass on the stop, known at the kick, and a rest where the next flight is shorter than a step.  Between
landings ngspice sees chords of it.

    plan      at a kick: when the coming drift meets a stop, how fast, and how it goes on
    chord     velocity of the leg to the next landing
    impact    at the stop: x'+ = -r x'-
    onward    velocity at a reading or a kick
"""

import math

from harvester.circuit.lockstep.energy_ledger import DURING
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import meeting, push, spring

KICK, IMPACT, READING = 0, 1, 2  # what a leg of the lock-step leads to
TINY = 1e-9  # parts of a step: landings nearer than this are one

# Of the coming drift: phase of the impact, speeds before and after it, the acceleration that presses on the stop and
# the shaking's share of it, the time after which bounces of r = 1 repeat, which stop it is (1, -1 for the opposite
# one), and the velocity from which it began.
PLAN = ("meet", "speed", "up", "pressing", "share", "again", "side", "before")


@inlined
def stop_at(side, gap, high):
    """Where the stop of a side is."""
    if high is not None and side < 0.0:
        return high
    return 0.0 if gap is None else -gap


@inlined
def plan(s, V, a, r, gap, high, r_high, alpha, beta, linear, alpha2):
    """What the drift that begins now meets; V and ``a``, the shaking's mean acceleration (None: none), press it."""
    s.flown, s.meet, s.side, s.before = 0, math.inf, 1.0, s.v
    ratio = r
    if high is not None and r_high is not None and s.v > 0.0:
        s.side, ratio = -1.0, r_high
    place = stop_at(s.side, gap, high)
    y, u = max(s.side * (s.x - place), 0.0), s.side * s.v
    pull = 0.0 if gap is None and high is None else s.side * spring(place, alpha, linear, alpha2)
    shaking = 0.0 if a is None else s.side * a
    force = push(y, s.side * V, beta, None, pull, shaking)
    if (y == 0.0 and u == 0.0) or y + s.h * u >= 0.0:
        return
    s.meet, s.speed = meeting(y, u, s.h, force)
    s.up, s.pressing, s.again = ratio * s.speed, force, math.inf
    s.share = shaking / force if force != 0.0 else 0.0
    if 2.0 * s.up <= -force * s.h:  # back within a step
        if ratio < 1.0 or s.up == 0.0:
            s.up = s.pressing = 0.0
        else:
            s.again = 2.0 * s.up / -force


@inlined
def since_impact(s, phase):
    """Time from the last bounce to a phase of the drift."""
    left = phase - s.meet
    return left % s.again if s.again < math.inf else left


@inlined
def chord(s, target, gap, high):
    """Mean velocity from here to a landing: to the stop where that is next, and along the parabola after it."""
    if s.flown == 0:
        if target != s.meet:
            return s.before
        return (stop_at(s.side, gap, high) - s.x) / (target - s.phase)
    left = since_impact(s, target)
    x = stop_at(s.side, gap, high) + s.side * max(left * (s.up + 0.5 * s.pressing * left), 0.0)
    return (x - s.x) / (target - s.phase)


@inlined
def onward(s, phase, back):
    """Velocity ``back`` before a phase of the drift, on the parabola after an impact; that of the drift without one."""
    if s.flown == 0:
        return s.before
    return s.side * (s.up + s.pressing * (since_impact(s, phase) - back))


@inlined
def impact(s, impacts, gap, high):
    """The impact that was planned, at the stop, on record while there is room for it, and in the ledger."""
    s.x = stop_at(s.side, gap, high)
    if s.impacts < len(impacts):
        impacts[s.impacts, 0] = s.kicks * s.h + s.meet
        impacts[s.impacts, 1] = s.side * s.speed
    s.impacts += 1
    s.flown = 1
    if s.measuring == DURING:
        s.impact_work += 0.5 * (s.speed * s.speed - s.up * s.up)
        s.noise_work += 0.5 * s.share * (s.speed * s.speed - s.before * s.before)


@inlined
def landed(s, x, impacts, gap, high):
    """Where the mass is at a landing, with the impact, or the velocity that a reading and a kick see, in the state."""
    if s.goal == IMPACT:
        impact(s, impacts, gap, high)
        return s.x
    s.v = ended(s) if s.goal == KICK else onward(s, s.phase, 0.0)
    return inside(x, gap, high)


@inlined
def ended(s):
    """The velocity at the end of the drift, with the shaking's work since the impact in the ledger."""
    v = onward(s, s.h, 0.5 * s.h)
    if s.flown == 1 and s.measuring == DURING:
        s.noise_work += 0.5 * s.share * (v * v - s.up * s.up)
    return v


@inlined
def inside(x, gap, high):
    """x, or the stop behind which it is by rounding, or by a narrow room."""
    x = max(x, stop_at(1.0, gap, high))
    return x if high is None else min(x, high)


@inlined
def freed(x, before, v, r, n1, gap, high):
    """The velocity v after a kick; of a mass that lay on a stop, none on to it."""
    if r is not None and n1 is None and before == 0.0:
        if x == stop_at(1.0, gap, high):
            return max(v, 0.0)
        if high is not None and x == high:
            return min(v, 0.0)
    return v
