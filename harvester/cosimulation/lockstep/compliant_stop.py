"""A compliant stop in lock-step: ngspice sees a contact in chords of its exact motion (`in_contact`).

Legs end at the beginning of the contact, every `CHORDS`-th part of half its period, and at its end.
"""

import math

from harvester.cosimulation.lockstep.state import DURING, IMPACT, TINY, note_impact
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.offset_stops import in_contact, lower_stop

CHORDS = 16


@inlined
def target_in_contact(s, target, goal, impacts, c):
    """Choose (phase, goal) of the next target, if the contact has one before ``target``.

    Set the chord to it.
    """
    edge = lower_stop(c)
    y = s.x - edge
    v = s.v
    s.before = v
    if y > 0.0 or (y == 0.0 and v >= 0.0):
        hit = s.phase - y / v if v < 0.0 else math.inf
        if hit >= target - TINY * s.h:
            return target, goal
        if hit > s.phase + TINY * s.h:
            return hit, IMPACT
        s.x = edge
        y = 0.0
    if y == 0.0:
        note_impact(s, impacts, s.n_steps * s.h + s.phase, -s.v)
    half = 0.5 * c.c
    w = math.sqrt(c.k - half * half)
    end = math.atan2(abs(y), (v + half * y) / w) / w
    if end < TINY * s.h:
        s.x = edge
        return target, goal
    leg = min(end, math.pi / (CHORDS * w))
    if s.phase + leg < target - TINY * s.h:
        target = s.phase + leg
        goal = IMPACT
    (x1, _, _), _ = in_contact(y, v, 0.0, target - s.phase, c)
    s.v = (x1 - s.x) / (target - s.phase)
    return target, goal


@inlined
def arrive_in_contact(s, elapsed, c):
    """Return the mass's place at a target.

    Set its velocity, and add the contact's loss to the energy balance.
    """
    edge = lower_stop(c)
    y = s.x - edge
    if y > 0.0 or (y == 0.0 and s.before >= 0.0):
        s.v = s.before
        x1 = s.x + elapsed * s.v
        return edge if s.goal == IMPACT else x1
    (x1, s.v, _), did = in_contact(y, s.before, 0.0, elapsed, c)
    if s.measuring == DURING:
        s.impact_work += did.energy
    return x1
