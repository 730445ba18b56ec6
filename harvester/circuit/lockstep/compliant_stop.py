"""A compliant stop in lock-step: ngspice sees a contact in chords of its exact motion (`in_contact`).

Legs end where the contact begins, every `CHORDS`-th part of half its period, and where it ends.
"""

import math

from harvester.circuit.lockstep.energy_ledger import DURING
from harvester.circuit.lockstep.rigid_stop import IMPACT, TINY
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.other_stops import in_contact

CHORDS = 16


@inlined
def aim_in_contact(s, target, goal, impacts, gap, k, c):
    """(phase, goal) of the next landing, at ``target`` unless a contact has one before, with the chord in the state."""
    place = 0.0 if gap is None else -gap
    y, v = s.x - place, s.v
    s.before = v
    if y > 0.0 or (y == 0.0 and v >= 0.0):
        hit = s.phase - y / v if v < 0.0 else math.inf
        if hit >= target - TINY * s.h:
            return target, goal
        if hit > s.phase + TINY * s.h:
            return hit, IMPACT
        s.x = place
        y = 0.0
    if y == 0.0:
        touched(s, impacts)
    half = 0.5 * c
    w = math.sqrt(k - half * half)
    end = math.atan2(abs(y), (v + half * y) / w) / w
    if end < TINY * s.h:
        s.x = place
        return target, goal
    leg = min(end, math.pi / (CHORDS * w))
    if s.phase + leg < target - TINY * s.h:
        target, goal = s.phase + leg, IMPACT
    (x1, _, _), _ = in_contact(y, v, 0.0, target - s.phase, -place, None, k, c)
    s.v = (x1 - s.x) / (target - s.phase)
    return target, goal


@inlined
def touched(s, impacts):
    """A contact begins: on record, while there is room."""
    if s.impacts < len(impacts):
        impacts[s.impacts, 0] = s.kicks * s.h + s.phase
        impacts[s.impacts, 1] = -s.v
    s.impacts += 1


@inlined
def landed_in_contact(s, elapsed, gap, k, c):
    """Where the mass is at a landing, with its velocity in the state and the contact's loss in the ledger."""
    place = 0.0 if gap is None else -gap
    y = s.x - place
    if y > 0.0 or (y == 0.0 and s.before >= 0.0):
        s.v = s.before
        x1 = s.x + elapsed * s.v
        return place if s.goal == IMPACT else x1
    (x1, s.v, _), (_, _, _, lost) = in_contact(y, s.before, 0.0, elapsed, -place, None, k, c)
    if s.measuring == DURING:
        s.impact_work += lost
    return x1


@inlined
def contact_energy(x, gap, k):
    """What the stop stores: k y^2/2."""
    y = x if gap is None else x + gap
    return 0.5 * k * y * y if y < 0.0 else 0.0
