"""What happens to the mass when ngspice asks: the functions that its three callbacks call, compiled.

The mass is kicked at grid times (spring, damping, noise, and the voltage's force -beta V) and moves at constant
velocity in between (`harvester.mechanics.kernels.equation_of_motion`).  ngspice advances the circuit under that motion
and ends a step exactly at every target: kick, impact or reading; at a kick the accepted voltage is known, so that the
force has no lag.  The piezo is a voltage source theta x/Cp in series with Cp, whose slope is the integrator's velocity:
x is continuous where the velocity jumps, at kicks and at impacts.

    ngspice asks                 answer
    SYNC, before a step          step to the next target         `proposed_step`
    source voltage at time t     theta x(t)/Cp of this leg       `source_voltage`
    accepted v(t)                at a target: act, aim anew      `accept_point`

`source_voltage` is a pure function of the accepted state and t, so a rejected step changes nothing.  ``s`` is the state
of a run (`harvester.cosimulation.lockstep.state`); a coefficient that is None is an effect that is absent.
"""

import math

from harvester.cosimulation.lockstep.compliant_stop import arrive_in_contact, contact_energy, target_in_contact
from harvester.cosimulation.lockstep.energy_ledger import add_terminal_flow, add_works_of_kick, note_stored_energy
from harvester.cosimulation.lockstep.rigid_stop import arrive, chord, impact, plan_impact, velocity_off_stop
from harvester.cosimulation.lockstep.state import DURING, IMPACT, KICK, READING, TINY, lower_stop, note_impact
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.path import between_kicks

FIRST = 64.0  # parts of a kick's step, of which ngspice's first step after a turn of the motion is one


@inlined
def source_voltage(s, t):
    """Open-circuit voltage theta x(t)/Cp at a time within the present leg, in volt.

    A drift is a straight line, or the parabola of the last kick's acceleration between the same ends.
    """
    into = s.w0 * (t - s.leg_t)
    x = s.x + s.v * into
    if s.bend != 0.0:
        x += 0.5 * s.bend * (s.phase + into) * (s.phase + into - s.h)
    return s.volts * x


@inlined
def proposed_step(s, t, delta):
    """Step that ngspice is to try at t: to the next target, or its own step ``delta`` where it is free to refine.

    Its own is all of what is left, or at most half: a sliver before a target would leave C dv/dt to rounding.  After an
    impact or another turn of the motion it begins with a small one.  There switches act, and ngspice, which judges a
    step by differences that reach back over the steps before, does not see a jump within a step much shorter than
    those: it went over the closing of a switch.
    """
    left = s.target_time - t
    if not s.free:
        return left
    if s.turned == 1 and t <= s.leg_t:
        delta = min(delta, s.h / (FIRST * s.w0))
    if delta >= left:
        return left
    if s.smooth != 0 and delta >= (1.0 - TINY) * left:  # the same but for rounding: no slivers ever smaller
        return left
    return min(delta, 0.5 * left)


@inlined
def stop_ahead(v, gap, high):
    """Where the stop ahead of a mass of velocity v is; infinite where there is none."""
    if v < 0.0:
        return lower_stop(gap)
    return math.inf if high is None else high


@inlined
def bounce(s, time, impacts, r, r_high):
    """Apply the impact law x'+ = -r x'-, and put the impact on record and into the ledger."""
    note_impact(s, impacts, time, -s.v)
    ratio = r
    if r_high is not None:
        ratio = r if s.v < 0.0 else r_high
    if s.measuring == DURING:
        s.impact_work += 0.5 * (1.0 - ratio * ratio) * s.v * s.v
    s.v = -ratio * s.v


@inlined
def aim(s, impacts, r, gap, high, r_high, k, c, n1):
    """Choose the next target: the kick at the end of the drift, a reading in mid-drift, or an impact."""
    target, goal = s.h, KICK
    if s.phase < 0.5 * s.h and s.kicks > 0 and s.kicks % s.stride == 0:
        target, goal = 0.5 * s.h, READING
    if k is not None:
        target, goal = target_in_contact(s, target, goal, impacts, gap, k, c)
    elif r is not None and n1 is None:
        if s.flown == 0 and s.meet < target - TINY * s.h:
            if s.meet < s.phase + TINY * s.h:  # at the stop already
                impact(s, impacts, gap, high)
            else:
                target, goal = s.meet, IMPACT
        s.v = chord(s, target, gap, high)
    elif r is not None and (s.v < 0.0 or (high is not None and s.v > 0.0)):
        hit = s.phase + (stop_ahead(s.v, gap, high) - s.x) / s.v
        if hit < s.phase + TINY * s.h:  # at the stop already
            bounce(s, s.kicks * s.h + s.phase, impacts, r, r_high)
        elif hit < target - TINY * s.h:
            target, goal = hit, IMPACT
    s.next_phase = target
    s.goal = goal
    s.leg_t = s.t
    s.target_time = (s.kicks * s.h + target) / s.w0


@inlined
def keep_kick(s, V, smooth, row):
    """Put the states ahead of a kick on record, and return the voltage of its force: of the record it follows, or V."""
    force = row[2] if s.follows == 1 else V
    row[0], row[1], row[2], row[3], row[4] = s.x, s.v, force, smooth / s.volts, s.load
    return force


@inlined
def accept_point(
    s, t, v, power, current, smooth, noise, shaking, readings, impacts, charge, kicked,
    r, gap, high, r_high, k, c, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2,
):  # fmt: skip
    """Take an accepted point at time t; at a target make the impact, the reading or the kick, and aim anew.

    v is the terminal voltage, ``power`` the load's, ``current`` that of the terminals, ``smooth`` the voltage of
    Csmooth, all in SI; ``noise``, ``shaking``, ``readings``, ``impacts``, ``charge`` and ``kicked`` are those of
    `Drive`.
    """
    add_terminal_flow(s, t, v, power, current)
    s.t = t
    s.steps += 1
    if t < s.target_time - TINY * s.h / s.w0:
        return
    V = force = v / s.volts
    came = s.v
    elapsed = s.next_phase - s.phase
    x1 = s.x + s.v * elapsed
    s.phase = s.next_phase
    if k is not None:
        x1 = arrive_in_contact(s, elapsed, gap, k, c)
    elif r is not None and n1 is None:
        x1 = arrive(s, x1, impacts, gap, high)
    elif r is not None:
        ahead = stop_ahead(s.v, gap, high)
        if s.goal == IMPACT or (x1 - ahead) * s.v > 0.0:
            bounce(s, s.kicks * s.h + s.phase, impacts, r, r_high)
            x1 = ahead
    s.x = x1
    if s.goal == READING:
        row = s.kicks // s.stride - 1
        readings[row, 2], readings[row, 3], readings[row, 4] = s.x, s.v, V
        charge[row] = smooth
    elif s.goal == KICK:
        before = s.v
        if s.kicks < s.noise_size:
            force = keep_kick(s, V, smooth, kicked[s.kicks])
            xi, (_, a) = noise[s.kicks], between_kicks(shaking, s.kicks + 1)
            v1 = kick(s.x, before, force, xi, s.h, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, a)
            s.v = velocity_off_stop(s.x, before, v1, r, n1, gap, high)
            if s.measuring == DURING:
                add_works_of_kick(s, before, s.v, s.x, force, xi, s.h, alpha, beta, n1, n2, n12, linear, alpha2, a)
        s.kicks += 1
        s.phase = 0.0
        stored = 0.0 if k is None else contact_energy(s.x, gap, k)
        note_stored_energy(s, t, v, smooth, stored, alpha, linear, alpha2)
        if s.kicks % s.stride == 0 and s.kicks <= s.noise_size:
            row = s.kicks // s.stride - 1
            readings[row, 0], readings[row, 1] = s.x, V
        if r is not None and n1 is None:
            mean, _ = between_kicks(shaking, min(s.kicks + 1, s.noise_size))
            plan_impact(s, force, mean, r, gap, high, r_high, alpha, beta, linear, alpha2)
        if s.smooth != 0:
            s.bend = (s.v - before) / s.h if s.meet == math.inf else 0.0
    aim(s, impacts, r, gap, high, r_high, k, c, n1)
    s.turned = 1 if came * s.v <= 0.0 and s.bend == 0.0 else 0
