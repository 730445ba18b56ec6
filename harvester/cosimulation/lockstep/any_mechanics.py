"""The lock-step for mechanics of one's own: the steps of `transitions` with a user's functions in place of the mass.

A model drifts from one grid time to the next, or to an event and from there on; each such part of
length a begins and ends with half a kick (Strang's splitting), and ngspice ends a step exactly at
each of its ends:

    kick of a/2, drift of a, kick of a/2; then the record at a grid time, or the jump at an event

so that the force after an event is that of the time after it, and the whole is of second order with
events as well.  How long the part to an event is depends on its first kick, and that on the length:
they are iterated together.  If the noise acts on a model, whose path has no second order, the
kicks are those of whole steps, as how much noise comes must not depend on the event; the event is
then met in mid-drift, as it also is if the iteration finds no length.

``f`` are the model's `Functions`, ``m`` its coefficients, ``at`` its state, and ``s`` the record of
the run (`harvester.cosimulation.lockstep.state`), in SI units: w0 = 1.

    port      source's voltage u           reaction R          work of the model against R
    piezo     coupling source/Cp           coupling V          (R0 + R1)/2 (source1 - source0) of each leg
    coil      coupling source + line       coupling i          a/2 R (source- + source+)/2 of each half kick

The charge of a piezo is continuous, and so is V.  A coil's e.m.f. would jump at each kick, and
its current with it; so it continues from part to part along the ``line`` b (t - middle of the
part), where b is its growth by the last kick over the kick's time.  The i of a kick follows from
the mean currents j0, j1 of the last two parts, (3 j1 - j0)/2 for equal ones (Adams and Bashforth),
which is of second order, and no charge is lost, however short the pulses of a rectifier are.

Long because all that happens at a target is one state machine.
"""

import math
from typing import Any, NamedTuple

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.state import AFTER, DURING, IMPACT, KICK, SAMPLE, TINY, Point
from harvester.cosimulation.lockstep.transitions import reached, set_target
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.noise import HALF_ROOT

# Parts of a step after which the first kick comes, at the beginning and after an event of a coil:
# ngspice tells no current at time 0, and none of the time after a jump.
START = 1e-6
MOST, ROUNDS = 100, 60  # events in a step; iterations of a part's length
# What ended a motion: the function that gave no finite number; an event outside its step, or too
# many of them.
DRIFT, KICKED, JUMP, SOURCE, EVENT, OFTEN, RAISED = range(1, 8)


class Functions(NamedTuple):
    """A model's functions, compiled or plain; ``floats`` makes a state of their results."""

    drift: Any
    kick: Any
    source: Any
    event: Any
    jump: Any
    floats: Any


class ModelRecord(NamedTuple):
    """Arrays of a run of n steps.

    ``noise``, shape (n, 2), are normal variates of the first two parts of each step, and of all
    others in turn; ``samples`` have a row at every reading: the state, the terminals' voltage, the
    current and the load's power; ``events`` are times.
    """

    noise: Floats
    samples: Floats
    events: Floats


@inlined
def is_finite(state):
    """Whether all of a state's numbers are finite."""
    size = 0.0
    for component in state:
        size += 0.0 * component
    return size == 0.0


@inlined
def port_voltage(s, t, f, m, at):
    """Voltage of the source at a time within the present leg: open-circuit voltage of a piezo, or a coil's e.m.f."""
    there = f.floats(f.drift(m, at, t - s.leg_t if s.fault == 0 else 0.0))
    u = s.volts * f.source(m, there) + s.bend * (s.phase + t - s.leg_t - s.middle)
    if math.isfinite(u):
        return u
    s.fault = SOURCE if is_finite(there) else DRIFT
    return 0.0


@inlined
def kicked(s, at, reaction, record, f, m):
    """The state after half a kick of the present part; its two halves share one variate."""
    xi = HALF_ROOT * record.noise[s.n_steps, s.parts % 2]
    return f.floats(f.kick(m, at, 0.5 * s.part, reaction, xi))


@inlined
def half_kick(s, at, reaction, record, f, m):
    """The same with its work in the energy balance; the state as it was if it is not finite."""
    after = kicked(s, at, reaction, record, f, m)
    if not is_finite(after):
        s.fault = KICKED
        return at
    if s.coil == 1:
        s.voltage_work += 0.25 * s.part * reaction * (f.source(m, at) + f.source(m, after))
    return after


@inlined
def write_row(s, at, p, samples):
    """Put a reading on record."""
    if s.n_steps % s.stride == 0:
        row = samples[s.n_steps // s.stride]
        for k in range(len(at)):
            row[k] = at[k]
        row[-3] = p.v
        row[-2] = p.current
        row[-1] = p.power


@inlined
def meet_event(s, at, events, f, m):
    """Make the event that the state is at, and note its time."""
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
def time_to_event(s, at, f, m):
    """Time to the event of the coming drift, infinite without one."""
    left = s.h - s.phase
    wait = f.event(m, at, left)
    if wait is None or wait == math.inf:
        return math.inf
    if -TINY * s.h <= wait <= left + TINY * s.h:
        return min(max(wait, 0.0), left)
    s.fault = EVENT
    return math.inf


@inlined
def is_noisy(s, at, reaction, f, m):
    """Whether the noise acts on this state."""
    up = f.kick(m, at, s.h, reaction, 1.0)
    down = f.kick(m, at, s.h, reaction, -1.0)
    return f.floats(up) != f.floats(down)


@inlined
def part_to_event(s, at, first, reaction, record, f, m):
    """Time to the event after the kick of a part that ends there, the present ``part`` from then on; or infinite.

    With the kick of the whole step the event is at ``first``, so that such a length lies below the
    step's.
    """
    low = 0.0
    high = s.part
    wait = first
    last = s.part
    short = first - s.part
    for _ in range(ROUNDS):
        s.part = wait
        again = time_to_event(s, kicked(s, at, reaction, record, f, m), f, m)
        now = again - wait
        if abs(now) <= 1e-3 * TINY * s.h:
            return again
        if now > 0.0:
            low = wait
        else:
            high = wait
        secant = (
            wait - now * (wait - last) / (now - short)
            if now < math.inf and now != short
            else math.inf
        )
        if now < math.inf:
            last, short = wait, now
        wait = secant if low < secant < high else 0.5 * (low + high)
    return math.inf


@inlined
def begin_part(s, at, reaction, record, f, m):
    """Begin a part: the state after its first half kick, and its target, (state, phase, goal)."""
    whole = s.h - s.phase
    s.split = 0
    s.part = whole
    target = s.h
    goal = KICK
    first = time_to_event(s, kicked(s, at, reaction, record, f, m), f, m)
    if first < math.inf:
        length = math.inf
        if not is_noisy(s, at, reaction, f, m):
            length = part_to_event(s, at, first, reaction, record=record, f=f, m=m)
        s.split = 1 if length < math.inf else 0
        if s.split == 0:
            s.part = whole
        target = s.phase + (length if s.split == 1 else first)
        goal = IMPACT
    after = half_kick(s, at, reaction, record, f, m)
    s.middle = s.phase + 0.5 * s.part
    if s.coil == 1 and s.part > TINY * s.h:
        s.bend = s.volts * (f.source(m, after) - s.grown) / (0.5 * (s.part + s.part_before))
    return after, target, goal


@inlined
def end_step(s, p, at, record):
    """Come to a grid time: the reading, and the next step."""
    s.n_steps += 1
    s.phase = 0.0
    s.flown = 0
    s.parts = 0
    write_row(s, at, p, record.samples)
    if s.n_steps == s.noise_size:
        s.measuring = AFTER
        s.end = p.t
        s.voltage_end = p.v
        s.smooth_end = p.smooth


@inlined
def drifted(s, at, target, f, m):
    """The state at a phase of the drift; as it was if that is not finite."""
    after = f.floats(f.drift(m, at, target - s.phase))
    s.phase = target
    if is_finite(after):
        return after
    s.fault = DRIFT
    return at


@inlined
def take_current(s, p):
    """Add the charge that passed the coil since the last point.

    After an event, whose jump it shares, the new i.
    """
    if s.turned == 1 and s.t <= s.leg_t:
        s.current = p.current
    s.charge += 0.5 * (p.t - s.t) * (s.current + p.current)


@inlined
def reaction_of(s, p):
    """The port's reaction at a target.

    For a coil that of its kick, from the mean currents of the last two parts.
    """
    if s.coil == 0:
        return s.coupling * p.v
    if s.goal == IMPACT and s.split == 0:
        return s.reaction
    i = mean = p.current
    if s.goal == SAMPLE:
        s.part = 0.0
    elif s.part > TINY * s.h:
        mean = s.charge / s.part
        i = mean + (mean - s.mean_before) * s.part / (s.part + s.part_before)
    s.charge = 0.0
    s.mean_before = mean
    s.part_before = s.part
    return s.coupling * i


@inlined
def next_leg(s, p, at, goal, reaction, record, f, m):
    """Execute the ``goal`` of a target, and begin the next part: (state, phase, goal)."""
    if goal == IMPACT and s.split == 0:  # in mid-drift
        at = meet_event(s, at, record.events, f, m)
        wait = time_to_event(s, at, f, m)
        return (at, s.h, KICK) if wait == math.inf else (at, s.phase + wait, IMPACT)
    s.grown = f.source(m, at)
    if goal != SAMPLE:
        at = half_kick(s, at, reaction, record, f, m)
    if goal == IMPACT:
        at = meet_event(s, at, record.events, f, m)
        s.parts += 1
        if s.coil == 1 and s.phase + START * s.h < s.h:
            return at, s.phase + START * s.h, SAMPLE
    elif goal == KICK:
        end_step(s, p, at, record)
    if s.fault != 0 or s.measuring == AFTER:
        return at, s.h, KICK
    return begin_part(s, at, reaction, record, f, m)


@inlined
def accept_model(s, p, record, f, m, at):
    """Take an accepted `Point`: the state of the model, in which the next leg begins if the point is a target."""
    u = p.v
    if s.coil == 1:
        u = port_voltage(s, p.t, f, m, at)
        take_current(s, p)
    if not reached(s, Point(p.t, u, p.power, p.current, p.smooth)):
        return at
    if s.fault != 0 or s.measuring == AFTER:  # the rest is ngspice's alone
        if s.measuring == DURING:
            s.measuring = AFTER
            s.end = s.leg_t
        s.n_steps += 1
        set_target(s, s.h, KICK)
        return at
    at = drifted(s, at, s.next_phase, f, m)
    reaction = reaction_of(s, p)
    come = f.source(m, at) - s.driven
    if s.coil == 0:
        s.voltage_work += 0.5 * (s.reaction + reaction) * come
    elif s.n_steps == 0 and s.goal == SAMPLE:
        record.samples[0, -3] = p.v
        record.samples[0, -2] = p.current
        record.samples[0, -1] = p.power
    goal, events = s.goal, s.impacts
    while True:
        at, target, goal = next_leg(s, p, at, goal, reaction=reaction, record=record, f=f, m=m)
        if target - s.phase > TINY * s.h or s.fault != 0:
            break
        at = drifted(s, at, target, f, m)
    set_target(s, target, goal)
    s.driven = f.source(m, at)
    s.reaction = reaction
    s.turned = 1 if s.impacts > events else 0
    if s.coil == 1:
        s.voltage = port_voltage(s, s.t, f, m, at)
    elif come * (f.source(m, f.floats(f.drift(m, at, target - s.phase))) - s.driven) <= 0.0:
        s.turned = 1
    return at


def begin_model(s: Any, start: Any, samples: Floats, f: Functions, m: Any) -> None:
    """Begin a run: the first target is a little after time 0, with a known current and the first kick."""
    samples[0, : len(start)] = start
    s.measuring = DURING
    s.driven = f.source(m, start)
    s.next_phase = START * s.h
    s.goal = SAMPLE
    s.target_time = START * s.h
