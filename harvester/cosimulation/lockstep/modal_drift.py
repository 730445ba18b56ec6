"""Several modes or masses in lock-step with ngspice, which sees their charge alone, sum s_j y_j in units of theta l.

A drift is known wholly at its kick, as no force acts in it but a stop's: the modes at its end, and
the `Course` of the charge, a straight line that an impact breaks.  ngspice ends a step there, at a
sample, and at the kick, which the circuit's voltage enters as with one mode.  ``s.x`` and ``s.v``
are the charge and its speed, ``meet`` the phase of the impact, ``speed`` that of the contact
coordinate there, and ``up`` the charge's speed from there on.
"""

import math

from harvester.cosimulation.lockstep.energy_ledger import note_stored_energy
from harvester.cosimulation.lockstep.state import DURING, IMPACT, KICK, SAMPLE, TINY, note_impact
from harvester.cosimulation.lockstep.transitions import reached, set_target
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import impulse, spring
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.offset_stops import lower_stop
from harvester.mechanics.kernels.path import between_kicks
from harvester.mechanics.kernels.stored_energy import nonlinear_energy
from harvester.mechanics.modes.modal_circuit import drift_with_course
from harvester.mechanics.modes.modal_step import dot, drift_modes, energy_of_modes, kick_modes

# rows of the modes' states: after the last kick, at the end of the drift, and room
NOW = 0
AHEAD = 1
SPARE = 2


@inlined
def copied(to, state):
    """Copy the first lane of states."""
    for k in range(0, len(to), BATCH):
        to[k] = state[k]


@inlined
def plan_drift(s, modes, a, c):
    """Plan the drift that begins now, under the excitation's mean acceleration a (None: no excitation)."""
    copied(modes[AHEAD], modes[NOW])
    did, course = drift_with_course(0, modes[AHEAD], interval(s.h, s.h, None), c, a)
    s.x = course.begin
    s.flown = 0
    s.meet = math.inf
    s.speed = did.speed
    s.turned = 0
    s.v = (course.end - course.begin) / s.h
    if course.first > TINY * s.h and course.first < (1.0 - TINY) * s.h:
        s.meet = course.first
        s.v = (course.wall - course.begin) / course.first
        s.up = (course.end - course.wall) / (s.h - course.first)
    elif did.speed != 0.0:
        s.meet = 0.0
        s.up = s.v
    if s.measuring == DURING and c.phi is not None:
        mobility = 0.0
        for shape in c.phi:
            mobility += shape * shape
        s.impact_work += did.energy / mobility


@inlined
def next_target(s, impacts):
    """Choose the next target: the impact, a sample in mid-drift, or the kick at its end."""
    target = s.h
    goal = KICK
    if s.phase < 0.5 * s.h and s.n_steps > 0 and s.n_steps % s.stride == 0:
        target = 0.5 * s.h
        goal = SAMPLE
    if s.flown == 0 and s.meet <= s.phase:  # at the stop already
        meet_stop(s, impacts)
    elif s.flown == 0 and s.meet < target - TINY * s.h:
        target = s.meet
        goal = IMPACT
    set_target(s, target, goal)


@inlined
def meet_stop(s, impacts):
    """Break the course of the charge at an impact, and note it."""
    note_impact(s, impacts, s.n_steps * s.h + s.phase, s.speed)
    s.turned = 1 if s.v * s.up <= 0.0 else 0
    s.v = s.up
    s.flown = 1


@inlined
def kicked_modes(s, before, z, xi, a, c):
    """Kick modes, with the works of noise and excitation, springs, voltage and damping in the energy balance.

    ``before`` is room for the states ahead of the kick.
    """
    copied(before, z)
    kick_modes(0, z, xi, s.h, c, a)
    if s.measuring != DURING:
        return
    n = len(c.k)
    x = dot(c.e, z, 0, 0)
    hit = 0.0 if a is None else s.h * a
    if c.oscillator.n1 is not None:
        hit += impulse(x, xi, s.h, c.oscillator)
    for j in range(2 * n):  # the means of the speeds before and after
        before[j * BATCH] = 0.5 * (before[j * BATCH] + z[j * BATCH])
    noise = hit * dot(c.g, before, n, 0)
    pull = spring(x, c.oscillator) * dot(c.e, before, n, 0)
    voltage = (
        0.0
        if c.oscillator.beta is None
        else -c.oscillator.beta * z[2 * n * BATCH] * dot(c.s, before, n, 0)
    )
    gained = 0.0
    for j in range(n):
        mean = before[(n + j) * BATCH]
        pull -= c.k[j] * z[j * BATCH] * mean
        gained += 2.0 * mean * (z[(n + j) * BATCH] - mean)
    if c.pull is not None:
        pull -= c.pull * before[(2 * n - 1) * BATCH]
    s.noise_work += noise
    s.spring_work += s.h * pull
    s.voltage_work += s.h * voltage
    s.damping_work += gained - noise - s.h * (pull + voltage)


@inlined
def stored_in_modes(z, c):
    """Energy of speeds, springs and a compliant stop."""
    energy = energy_of_modes(0, z, c) + nonlinear_energy(dot(c.e, z, 0, 0), c.oscillator)
    if c.contact is not None and c.contact.k is not None:
        into = min(dot(c.phi, z, 0, 0) - lower_stop(c.contact), 0.0)
        mobility = 0.0
        for shape in c.phi:
            mobility += shape * shape
        energy += 0.5 * c.contact.k / mobility * into * into
    if c.pull is not None:
        energy += c.pull * z[(len(c.k) - 1) * BATCH]
    return energy


@inlined
def make_modal_kick(s, p, recording, c):
    """Kick the modes, with the entries of the energy balance, and plan the next drift."""
    V = p.v / s.volts
    modes = recording.modes
    n = len(c.k)
    now = modes[NOW]
    copied(now, modes[AHEAD])
    now[2 * n * BATCH] = V
    if s.n_steps < s.noise_size:
        row = recording.kicked[s.n_steps]
        force = row[2] if s.follows == 1 else V
        row[0] = dot(c.e, now, 0, 0)
        row[1] = dot(c.e, now, n, 0)
        row[2] = force
        row[3] = p.smooth / s.volts
        row[4] = s.load
        _, a = between_kicks(recording.shaking, s.n_steps + 1)
        now[2 * n * BATCH] = force
        kicked_modes(s, modes[SPARE], now, recording.noise[s.n_steps], a, c)
    s.n_steps += 1
    s.phase = 0.0
    note_stored_energy(s, p, stored_in_modes(now, c))
    if s.n_steps % s.stride == 0 and s.n_steps <= s.noise_size:
        row = s.n_steps // s.stride - 1
        recording.samples[row, 0] = dot(c.e, now, 0, 0)
        recording.samples[row, 1] = V
    mean, _ = between_kicks(recording.shaking, min(s.n_steps + 1, s.noise_size))
    plan_drift(s, modes, mean, c)


@inlined
def accept_modal_point(s, p, recording, c):
    """Take an accepted `Point`; at a target make the impact, the sample or the kick, and choose the next target."""
    if not reached(s, p):
        return
    came = s.v
    s.x += s.v * (s.next_phase - s.phase)
    s.phase = s.next_phase
    if s.goal == IMPACT:
        meet_stop(s, recording.impacts)
    elif s.goal == SAMPLE:
        row = s.n_steps // s.stride - 1
        spare = recording.modes[SPARE]
        copied(spare, recording.modes[NOW])
        mean, _ = between_kicks(recording.shaking, min(s.n_steps + 1, s.noise_size))
        drift_modes(0, spare, interval(s.h, 0.5 * s.h, None), c, mean)
        samples = recording.samples
        samples[row, 2] = dot(c.e, spare, 0, 0)
        samples[row, 3] = dot(c.e, spare, len(c.k), 0)
        samples[row, 4] = p.v / s.volts
        n = len(c.k)
        for j in range(n):
            recording.coordinates[row, 0, j] = spare[j * BATCH]
            recording.coordinates[row, 1, j] = spare[(n + j) * BATCH]
        recording.charge[row] = p.smooth
    else:
        make_modal_kick(s, p, recording, c)
    next_target(s, recording.impacts)
    s.turned = 1 if came * s.v <= 0.0 else 0


def begin_modes(s, modes, shaking, c):
    """Begin a run, in plain Python: the first half of a kick, and the plan of the first drift."""
    _, a = between_kicks(shaking, 0)
    kick_modes(0, modes[NOW], 0.0, 0.5 * s.h, c, a)
    mean, _ = between_kicks(shaking, 1)
    plan_drift(s, modes, mean, c)
