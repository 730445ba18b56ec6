"""The lock-step for mechanics of one's own: the steps of `transitions` with a user's functions in place of the mass.

A model is kicked at grid times and drifts in between (Strang's splitting); at t = n h

    half a kick, the record, half a kick, then drifts to the next event or to the next grid time

and ngspice ends a step exactly at each of these.  ``f`` are the model's `Functions`, ``m`` its coefficients, ``at`` its
state, and ``s`` the record of the run (`harvester.cosimulation.lockstep.state`), in SI units: w0 = 1.

    port      source's voltage u           reaction R          R does the work
    piezo     coupling source/Cp           coupling V          (R0 + R1)/2 (source1 - source0) of each leg
    coil      coupling source + line       coupling i          h R (source- + source+)/2 of each kick

The charge of a piezo is continuous, and so is V.  The e.m.f. of a coil would jump at each kick, and its current with
it; so it goes on from drift to drift along the ``line`` b (t - middle of the drift), where b is its growth by the last
kick over h.  The i of a kick is (3 j1 - j0)/2 of the mean currents j0, j1 of the last two drifts (Adams and Bashforth):
of second order, and no charge is lost, however short the pulses of a rectifier are.
"""

import math
from typing import Any, NamedTuple

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.state import AFTER, DURING, IMPACT, KICK, SAMPLE, TINY, Point
from harvester.cosimulation.lockstep.transitions import aim, reached
from harvester.mechanics.kernels.compiled import inlined

START = 1e-6  # parts of a step after which the first kick comes: ngspice tells no current at time 0
MOST = 100  # events in a step
# What ended a motion: the function that gave no finite number; an event outside its step, or too many of them.
DRIFT, KICKED, JUMP, SOURCE, EVENT, OFTEN = range(1, 7)


class Functions(NamedTuple):
    """A model's functions, compiled or plain; ``floats`` makes a state of what they give."""

    drift: Any
    kick: Any
    source: Any
    event: Any
    jump: Any
    floats: Any


class ModelRecord(NamedTuple):
    """Arrays of a run of n steps.

    ``noise``, shape (n, 2), are normal variates of the half kicks that begin and end each drift; ``samples`` have a row
    at every reading: the state, the terminals' voltage, the current and the load's power; ``events`` their times.
    """

    noise: Floats
    samples: Floats
    events: Floats


@inlined
def is_finite(state):
    """Whether all of a state's numbers are finite."""
    size = 0.0
    for one in state:
        size += 0.0 * one
    return size == 0.0


@inlined
def port_voltage(s, t, f, m, at):
    """Voltage of the source at a time within the present leg: open-circuit voltage of a piezo, or a coil's e.m.f."""
    into = t - s.leg_t if s.fault == 0 else 0.0
    u = s.volts * f.source(m, f.floats(f.drift(m, at, into))) + s.bend * (s.phase + into - 0.5 * s.h)
    if math.isfinite(u):
        return u
    s.fault = SOURCE
    return 0.0


@inlined
def half_kick(s, at, reaction, xi, f, m):
    """The state after half a kick; as it was where that is not finite."""
    after = f.floats(f.kick(m, at, 0.5 * s.h, reaction, xi))
    if is_finite(after):
        return after
    s.fault = KICKED
    return at


@inlined
def write_row(s, at, p, samples):
    """Put a reading on record."""
    if s.n_steps % s.stride == 0:
        row = samples[s.n_steps // s.stride]
        for k in range(len(at)):
            row[k] = at[k]
        row[-3], row[-2], row[-1] = p.v, p.current, p.power


@inlined
def begin_drift(s, at, before, reaction, part, record, f, m):
    """The half kick with which a drift begins; ``part`` of a kick it is, with what came ahead of it."""
    after = half_kick(s, at, reaction, record.noise[s.n_steps, 0], f, m)
    if s.coil == 1:
        grown = f.source(m, after)
        s.voltage_work += 0.5 * part * s.h * reaction * (before + grown)
        s.bend = s.volts * (grown - before) / (part * s.h)
    return after


@inlined
def make_whole_kick(s, p, at, reaction, record, f, m):
    """The kick at a grid time, read in its middle; the last one is only half of it."""
    before = f.source(m, at)
    at = half_kick(s, at, reaction, record.noise[s.n_steps, 1], f, m)
    s.n_steps += 1
    s.phase, s.flown = 0.0, 0
    write_row(s, at, p, record.samples)
    if s.n_steps < s.noise_size:
        return begin_drift(s, at, before, reaction, 1.0, record, f, m)
    if s.coil == 1:
        s.voltage_work += 0.25 * s.h * reaction * (before + f.source(m, at))
    s.measuring, s.end, s.voltage_end, s.smooth_end = AFTER, p.t, p.v, p.smooth
    return at


@inlined
def meet_event(s, at, events, f, m):
    """Make the event that the state stands at, and note its time."""
    if s.impacts < len(events):
        events[s.impacts] = s.t
    s.impacts += 1
    s.flown += 1
    after = f.floats(f.jump(m, at))
    if s.flown > MOST:
        s.fault = OFTEN
    elif not is_finite(after):
        s.fault = JUMP
    else:
        return after
    return at


@inlined
def next_target(s, at, f, m):
    """Phase and goal of the next target: the event of this drift, or the kick at its end."""
    if s.measuring == AFTER or s.fault != 0:
        return s.h, KICK
    left = s.h - s.phase
    wait = f.event(m, at, left)
    if wait is None or wait == math.inf:
        return s.h, KICK
    if not -TINY * s.h <= wait <= left + TINY * s.h:
        s.fault = EVENT
        return s.h, KICK
    return min(s.phase + max(wait, 0.0), s.h), IMPACT


@inlined
def drifted(s, at, target, f, m):
    """The state at a phase of the drift; as it was where that is not finite."""
    after = f.floats(f.drift(m, at, target - s.phase))
    s.phase = target
    if is_finite(after):
        return after
    s.fault = DRIFT
    return at


@inlined
def take_current(s, p):
    """Add the charge that passed the coil since the last point; after an event, whose jump it shares, the new i."""
    if s.turned == 1 and s.t <= s.leg_t:
        s.current = p.current
    s.charge += 0.5 * (p.t - s.t) * (s.current + p.current)


@inlined
def reaction_of(s, p):
    """The port's reaction at a target: of a coil that of its kick, from the mean currents of the last two drifts."""
    if s.coil == 0:
        return s.coupling * p.v
    if s.goal == SAMPLE:  # the beginning
        s.mean_before = p.current
        return s.coupling * p.current
    if s.goal == IMPACT:
        return s.reaction
    mean = s.charge / s.h
    weight = 2.0 if s.n_steps == 0 else 1.5  # the first one goes by the current at its beginning
    i = weight * mean - (weight - 1.0) * s.mean_before
    s.charge, s.mean_before = 0.0, mean
    return s.coupling * i


@inlined
def accept_model(s, p, record, f, m, at):
    """Take an accepted `Point`: the state of the model, in which the next leg begins where the point is a target."""
    u = p.v
    if s.coil == 1:
        u = port_voltage(s, p.t, f, m, at)
        take_current(s, p)
    if not reached(s, Point(p.t, u, p.power, p.current, p.smooth)):
        return at
    if s.fault != 0 or s.measuring == AFTER:  # the rest is ngspice's alone
        if s.measuring == DURING:
            s.measuring, s.end = AFTER, s.leg_t
        s.n_steps += 1
        aim(s, s.h, KICK)
        return at
    at = drifted(s, at, s.next_phase, f, m)
    reaction = reaction_of(s, p)
    come = f.source(m, at) - s.driven
    if s.coil == 0:
        s.voltage_work += 0.5 * (s.reaction + reaction) * come
    goal, events = s.goal, s.impacts
    while True:
        if goal == IMPACT:
            at = meet_event(s, at, record.events, f, m)
        elif goal == SAMPLE:
            record.samples[0, -3], record.samples[0, -2], record.samples[0, -1] = p.v, p.current, p.power
            at = begin_drift(s, at, f.source(m, at), reaction, 0.5, record, f, m)
        else:
            at = make_whole_kick(s, p, at, reaction, record, f, m)
        target, goal = next_target(s, at, f, m)
        if target - s.phase > TINY * s.h:
            break
        at = drifted(s, at, target, f, m)
    aim(s, target, goal)
    s.goal = goal
    s.driven, s.reaction = f.source(m, at), reaction
    s.turned = 1 if s.impacts > events else 0
    if s.coil == 1:
        s.voltage = port_voltage(s, s.t, f, m, at)
    elif come * (f.source(m, f.floats(f.drift(m, at, target - s.phase))) - s.driven) <= 0.0:
        s.turned = 1
    return at


def begin_model(s: Any, start: Any, samples: Floats, f: Functions, m: Any) -> None:
    """Begin a run: the first target is a little after time 0, where the current is known and the first kick is made."""
    samples[0, : len(start)] = start
    s.measuring, s.driven = DURING, f.source(m, start)
    s.next_phase, s.goal, s.target_time = START * s.h, SAMPLE, START * s.h
