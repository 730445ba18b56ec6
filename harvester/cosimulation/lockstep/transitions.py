"""The motion of the mass when ngspice asks: the functions that its three callbacks call, compiled.

The mass is kicked at grid times (spring, damping, noise, and the voltage's force -beta V) and moves
at constant velocity in between (`harvester.mechanics.kernels.equation_of_motion`).  ngspice
advances the circuit under that motion and ends a step exactly at every target: kick, impact or
sample; at a kick the accepted voltage is known, so that the force has no lag.  The piezo is a
voltage source theta x/Cp in series with Cp, whose slope is the integrator's velocity: x is
continuous when the velocity jumps, at kicks and impacts.

    ngspice asks                 answer
    SYNC, before a step          step to the next target         `proposed_step`
    source voltage at time t     theta x(t)/Cp of this leg       `source_voltage`
    accepted v(t)                at a target: act, choose anew   `accept_point`

`source_voltage` is a pure function of the accepted state and t, so a rejected step changes nothing.
``s`` is the state of a run (`harvester.cosimulation.lockstep.state`), ``c`` the coefficients: one
that is None is an effect that is absent.
"""

import math

from harvester.cosimulation.lockstep.compliant_stop import arrive_in_contact, target_in_contact
from harvester.cosimulation.lockstep.energy_ledger import (
    add_terminal_flow,
    add_works_of_kick,
    note_stored_energy,
    stored_in_mass,
)
from harvester.cosimulation.lockstep.rigid_stop import arrive, plan_impact, target_as_planned
from harvester.cosimulation.lockstep.state import (
    BEYOND,
    DURING,
    EARLY,
    IMPACT,
    KICK,
    SAMPLE,
    TINY,
    note_impact,
)
from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.offset_stops import kick_at_stops, lower_stop
from harvester.mechanics.kernels.path import between_kicks
from harvester.mechanics.kernels.stored_energy import contact_energy

# parts of a kick's step before a target, from which on rounding is not to halve ngspice's steps any
# more
NEAR = 1e-3
# parts of a kick's step, of which ngspice's first step after a turn of the motion is one
FIRST = 64.0


@inlined
def source_voltage(s, t):
    """Open-circuit voltage theta x(t)/Cp at a time within the present leg, in volt.

    A drift is a straight line, or the parabola of the last kick's acceleration between the same
    ends.
    """
    into = s.w0 * (t - s.leg_t)
    x = s.x + s.v * into
    if s.bend != 0.0:
        x += 0.5 * s.bend * (s.phase + into) * (s.phase + into - s.h)
    return s.volts * x


@inlined
def proposed_step(s, t, delta):
    """Step that ngspice is to try at t: to the next target, or its own step ``delta`` if it is free to refine.

    Its own is all of the rest, or at most half: a sliver before a target would leave C dv/dt to
    rounding.  After an impact or another turn of the motion it begins with a small one.  There
    switches act, and ngspice, which judges a step by differences that reach back over the steps
    before, does not see a jump within a step much shorter than those: it passed the closing of a
    switch.

    No step passes the end of the run: if one does, versions from 42 on leave a rest of
    rounding, and some never get over it.  An end that is early by a few roundings is treated as the
    end by all.
    """
    left = min(s.target_time, (1.0 - EARLY) * (s.noise_size + BEYOND) * s.h / s.w0) - t
    if not s.free:
        return left
    if s.turned == 1 and t <= s.leg_t:
        delta = min(delta, s.h / (FIRST * s.w0))
    near = s.smooth != 0 or left * s.w0 < NEAR * s.h
    if delta >= left or (
        near and delta >= (1.0 - TINY) * left
    ):  # the same but for rounding: no slivers ever smaller
        return left
    return min(delta, 0.5 * left)


@inlined
def stop_ahead(v, c):
    """The place of the stop ahead of a mass of velocity v; infinite if absent."""
    if v < 0.0:
        return lower_stop(c)
    return math.inf if c.high is None else c.high


@inlined
def bounce(s, time, impacts, c):
    """Apply the impact law x'+ = -r x'-, and put the impact on record and into the energy balance."""
    note_impact(s, impacts, time, -s.v)
    ratio = c.r
    if c.r_high is not None:
        ratio = c.r if s.v < 0.0 else c.r_high
    if s.measuring == DURING:
        s.impact_work += 0.5 * (1.0 - ratio * ratio) * s.v * s.v
    s.v = -ratio * s.v


@inlined
def target_in_flight(s, target, goal, impacts, c):
    """Choose (phase, goal) of the next target of a mass that white noise moves: an impact, if one comes before it."""
    if s.v < 0.0 or (c.high is not None and s.v > 0.0):
        hit = s.phase + (stop_ahead(s.v, c) - s.x) / s.v
        if hit < s.phase + TINY * s.h:  # at the stop already
            bounce(s, s.n_steps * s.h + s.phase, impacts, c)
        elif hit < target - TINY * s.h:
            return hit, IMPACT
    return target, goal


@inlined
def arrive_in_flight(s, x1, impacts, c):
    """Return the place at a target of a mass that white noise moves, and make the impact there, if it is one."""
    ahead = stop_ahead(s.v, c)
    if s.goal == IMPACT or (x1 - ahead) * s.v > 0.0:
        bounce(s, s.n_steps * s.h + s.phase, impacts, c)
        return ahead
    return x1


@inlined
def next_event(s, impacts, c):
    """Choose the next target: the kick at the end of the drift, a sample in mid-drift, or an impact."""
    target = s.h
    goal = KICK
    if s.phase < 0.5 * s.h and s.n_steps > 0 and s.n_steps % s.stride == 0:
        target = 0.5 * s.h
        goal = SAMPLE
    if c.k is not None:
        target, goal = target_in_contact(s, target, goal, impacts, c)
    elif c.r is not None and c.n1 is None:
        target, goal = target_as_planned(s, target, goal, impacts, c)
    elif c.r is not None:
        target, goal = target_in_flight(s, target, goal, impacts, c)
    set_target(s, target, goal)


@inlined
def set_target(s, target, goal):
    """Set the next target of ngspice: a phase of the present drift, and its meaning."""
    s.next_phase = target
    s.goal = goal
    s.leg_t = s.t
    s.target_time = (s.n_steps * s.h + target) / s.w0


@inlined
def reached(s, p):
    """Take an accepted `Point` into the energy balance; whether it is the target."""
    add_terminal_flow(s, p)
    s.t = p.t
    s.accepted += 1
    return p.t >= s.target_time - TINY * s.h / s.w0


@inlined
def keep_kick(s, V, smooth, row):
    """Record the states ahead of a kick; return the acting voltage, that of its record or V."""
    force = row[2] if s.follows == 1 else V
    row[0] = s.x
    row[1] = s.v
    row[2] = force
    row[3] = smooth / s.volts
    row[4] = s.load
    return force


@inlined
def arrive_at_target(s, impacts, c):
    """Move the mass to the end of its leg, and make the impact there, if it is one."""
    elapsed = s.next_phase - s.phase
    x1 = s.x + s.v * elapsed
    s.phase = s.next_phase
    if c.k is not None:
        x1 = arrive_in_contact(s, elapsed, c)
    elif c.r is not None and c.n1 is None:
        x1 = arrive(s, x1, impacts, c)
    elif c.r is not None:
        x1 = arrive_in_flight(s, x1, impacts, c)
    s.x = x1


@inlined
def make_kick(s, p, recording, c):
    """Kick the mass, with the entries of the energy balance, and begin the next drift."""
    before = s.v
    V = p.v / s.volts
    force = V
    if s.n_steps < s.noise_size:
        force = keep_kick(s, V, p.smooth, recording.kicked[s.n_steps])
        xi = recording.noise[s.n_steps]
        (_, a) = between_kicks(recording.shaking, s.n_steps + 1)
        s.v = kick_at_stops(State(s.x, before, force), xi, s.h, c, a)
        if s.measuring == DURING:
            add_works_of_kick(s, before, s.v, s.x, volts=force, xi=xi, h=s.h, c=c, a=a)
    s.n_steps += 1
    s.phase = 0.0
    note_stored_energy(s, p, stored_in_mass(s, contact_energy(s.x, c), c))
    if s.n_steps % s.stride == 0 and s.n_steps <= s.noise_size:
        row = s.n_steps // s.stride - 1
        recording.samples[row, 0] = s.x
        recording.samples[row, 1] = V
    if c.r is not None and c.n1 is None:
        mean, _ = between_kicks(recording.shaking, min(s.n_steps + 1, s.noise_size))
        plan_impact(s, force, mean, c)
    if s.smooth != 0:
        s.bend = (s.v - before) / s.h if s.meet == math.inf else 0.0


@inlined
def accept_point(s, p, recording, c):
    """Take an accepted `Point`; at a target make the impact, the sample or the kick, and choose the next target."""
    if not reached(s, p):
        return
    came = s.v
    arrive_at_target(s, recording.impacts, c)
    if s.goal == SAMPLE:
        row = s.n_steps // s.stride - 1
        samples = recording.samples
        samples[row, 2] = s.x
        samples[row, 3] = s.v
        samples[row, 4] = p.v / s.volts
        recording.charge[row] = p.smooth
    elif s.goal == KICK:
        make_kick(s, p, recording, c)
    next_event(s, recording.impacts, c)
    s.turned = 1 if came * s.v <= 0.0 and s.bend == 0.0 else 0
