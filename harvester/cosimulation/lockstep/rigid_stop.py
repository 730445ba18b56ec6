"""Impacts in lock-step of a mass that no white noise moves, which may come to rest on a stop.

They are those of `harvester.mechanics.kernels.equation_of_motion.drift_at_stop`: on the parabola of
the force that presses the mass on the stop, known at the kick, and a rest if the next flight is
shorter than a step.  Between targets ngspice sees chords of it.

    plan_impact          at a kick: when the coming drift meets a stop, how fast, and how it continues
    target_as_planned    the target of the next leg, and its velocity
    impact               at the stop: x'+ = -r x'-
    velocity_in_flight   velocity at a sample or a kick
"""

import math

from harvester.cosimulation.lockstep.state import DURING, IMPACT, KICK, TINY, note_impact
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import meeting, push, spring
from harvester.mechanics.kernels.offset_stops import wall_of


@inlined
def plan_impact(s, V, a, c):
    """Plan the impact of the drift that begins now.

    The voltage V and the excitation's mean acceleration ``a`` (None: no excitation) press the mass
    on the stop.
    """
    s.flown = 0
    s.meet = math.inf
    s.side = 1.0
    s.before = s.v
    ratio = c.r
    if c.r_high is not None and s.v > 0.0:
        s.side = -1.0
        ratio = c.r_high
    edge = wall_of(s.side, c)
    y = max(s.side * (s.x - edge), 0.0)
    u = s.side * s.v
    pull = 0.0 if c.gap is None else s.side * spring(edge, c)
    shaking = 0.0 if a is None else s.side * a
    force = push(y, s.side * V, c, pull, shaking)
    if (y == 0.0 and u == 0.0) or y + s.h * u >= 0.0:
        return
    s.meet, s.speed = meeting(y, u, s.h, force)
    s.up = ratio * s.speed
    s.pressing = force
    s.again = math.inf
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
def target_as_planned(s, target, goal, impacts, c):
    """Choose (phase, goal) of the next target, the planned impact if it comes first.

    Set the chord to it.
    """
    if s.flown == 0 and s.meet < target - TINY * s.h:
        if s.meet < s.phase + TINY * s.h:  # at the stop already
            impact(s, impacts, c)
        else:
            target = s.meet
            goal = IMPACT
    s.v = chord(s, target, c)
    return target, goal


@inlined
def chord(s, target, c):
    """Mean velocity from here to a target: to the stop if that is next, and along the parabola after it."""
    if s.flown == 0:
        if target != s.meet:
            return s.before
        return (wall_of(s.side, c) - s.x) / (target - s.phase)
    left = since_impact(s, target)
    x = wall_of(s.side, c) + s.side * max(left * (s.up + 0.5 * s.pressing * left), 0.0)
    return (x - s.x) / (target - s.phase)


@inlined
def velocity_in_flight(s, phase, back):
    """Velocity a time ``back`` before a phase of the drift: on the parabola after an impact, else the drift's own."""
    if s.flown == 0:
        return s.before
    return s.side * (s.up + s.pressing * (since_impact(s, phase) - back))


@inlined
def impact(s, impacts, c):
    """Make the planned impact: the mass is at the stop, and the impact on record and in the energy balance."""
    s.x = wall_of(s.side, c)
    note_impact(s, impacts, s.n_steps * s.h + s.meet, s.side * s.speed)
    s.flown = 1
    if s.measuring == DURING:
        s.impact_work += 0.5 * (s.speed * s.speed - s.up * s.up)
        s.noise_work += 0.5 * s.share * (s.speed * s.speed - s.before * s.before)


@inlined
def arrive(s, x, impacts, c):
    """Return the mass's place at a target.

    Make the impact, or set the velocity that a sample or a kick sees.
    """
    if s.goal == IMPACT:
        impact(s, impacts, c)
        return s.x
    s.v = velocity_at_kick(s) if s.goal == KICK else velocity_in_flight(s, s.phase, 0.0)
    return between_stops(x, c)


@inlined
def velocity_at_kick(s):
    """Velocity at the end of the drift.

    Add the excitation's work since the impact to the energy balance.
    """
    v = velocity_in_flight(s, s.h, 0.5 * s.h)
    if s.flown == 1 and s.measuring == DURING:
        s.noise_work += 0.5 * s.share * (v * v - s.up * s.up)
    return v


@inlined
def between_stops(x, c):
    """Return x, or the place of the stop behind which rounding, or a narrow gap, has put it."""
    x = max(x, wall_of(1.0, c))
    return x if c.high is None else min(x, c.high)
