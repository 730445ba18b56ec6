"""A circuit over one drift of the mass: implicit steps of second order, shorter if something happens.

A step of length d is two stages of tau = g d with the same matrices, g = 1 - 1/sqrt(2) (Alexander's
SDIRK2, L-stable):

    stage 1    from z0 to z1          stage 2    from z0 + (1 - g)/g (z1 - z0) to z2, the end

With it the stages give the difference of a first order, z2 - z0 - (z1 - z0)/g.  A step that changes
a charge by too much of its size, closes or opens a switch, or does not converge is made again in
parts: the steps are h/2^k.  If a switch changes all the time it chatters, and the time is left out as
that of a step that does not converge.  The current of the piezo carries exactly the charge theta (x1 - x0) of
each step, so that an impact within one is averaged; it is one of h/64 at most, as a rectifier sees
the peak of the voltage at contact.

Source: Alexander, SIAM J. Numer. Anal. 14, 1006, 1977.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import carray, from_dtype, types  # type: ignore[attr-defined]

from harvester.circuits.pointers import POINTER, call_solver, data, pointer
from harvester.mechanics.kernels.compiled import c_function, inlined

GAMMA = 1.0 - np.sqrt(0.5)
LEVELS = 18  # lengths of steps, from h to h/2^17
FINEST = 1 << (LEVELS - 1)  # shortest steps in one of length h
# level of the steps in which an impact is averaged: a rectifier sees the voltage at contact
IMPACT = 6
GIVEN_UP = 1 << (LEVELS - 5)  # shortest steps that are left out if one does not converge
# changes of switches in so many: beyond them a switch chatters, which no step resolves
MOST_CHANGES = GIVEN_UP // 32
CHATTERS = 1000.0  # in place of the solver's return value, plus the number of the switch
FADING = 2e-4  # of a charge's size, a step
# quantities that are told beside the charges: voltages of the piezo, the storage capacitor and the
# load
N_VOLTAGES = 3
DID = 4  # numbers of what a drift did, and of what did not converge last
ROOMS = 7  # rows of the workspace
MOST = 1e-3  # of the steps, that may fail
NEVER = 1e300  # the error of a step that did not converge


# A compiled circuit as kernels take it: addresses of the solver, of the stages' Y, R and O by
# levels, of the solver's arguments, of the switches' thresholds, shape (2, switches), and of what 1
# of each charge is in V; the numbers of unknowns, charges (linear ones, and all) and switches; the
# least size of a charge (V), the largest error of a step over it, theta l (C), and the seconds of a
# step h; and the address of a log of its own steps (`logged`), or 0.
AT = ("solver_at", "Y_at", "R_at", "O_at", "p_at", "thresholds_at", "volts_at", "log_at")
COUNTS = ("n", "nz", "ns", "switches")
CIRCUIT = np.dtype(
    [(name, np.int64) for name in (*AT, *COUNTS)]
    + [(name, np.float64) for name in ("least", "tolerance", "charge", "seconds")],
    align=True,
)
_RECORD = types.CPointer(from_dtype(CIRCUIT))
FOLLOW = types.int64(_RECORD, POINTER, POINTER, *5 * [types.float64], types.int64)


class KernelCircuit(NamedTuple):
    """A compiled circuit on a device, as an argument of kernels.

    Its ``record``, the ``address`` of `follow`, the ``length`` of a row of the workspace, the index
    ``voltages_at`` of the voltages in a state, the ``volts`` of a nondimensional 1, and the load's
    power over its mean squared voltage.
    """

    record: Any
    address: Any
    length: Any
    voltages_at: Any
    volts: Any
    unit: Any


@inlined
def position_at(t, x, x1, wall, first, h):
    """The place of the mass at time t of a drift of length h from x to x1, which meets a stop at time ``first``."""
    if t < first:
        return x + (wall - x) * (t / first)
    return wall + (x1 - wall) * ((t - first) / (h - first)) if h > first else x1


@inlined
def stage(c, level, s, u, y, switches, after, voltages, r, work):
    """Make one stage: from the charges s to those ``after`` it, with the voltages y changed.

    Iterations, or -1.
    """
    n = c.n
    many = c.ns
    rows = c.nz + N_VOLTAGES + c.switches
    R = carray(pointer(c.R_at + 8 * level * n * (many + 2)), (n, many + 2))
    O = carray(pointer(c.O_at + 8 * level * rows * (n + many + 2)), (rows, n + many + 2))  # noqa: E741
    for i in range(n):
        total = R[i, many] * u + R[i, many + 1]
        for k in range(many):
            total += R[i, k] * s[k]
        r[i] = total
    rate = float(1 << level) / (GAMMA * c.seconds)
    Y = pointer(c.Y_at + 8 * level * n * n)
    iterations = call_solver(
        c.solver_at,
        data(y),
        data(r),
        Y=Y,
        p=pointer(c.p_at),
        s=data(switches),
        q=data(after[c.nz :]),
        work=data(work),
        rate=rate,
    )
    if iterations < 0:
        return iterations
    for i in range(rows):
        total = O[i, n + many] * u + O[i, n + many + 1]
        for k in range(n):
            total += O[i, k] * y[k]
        for k in range(many):
            total += O[i, n + k] * s[k]
        if i < c.nz:
            after[i] = total
        else:
            voltages[i - c.nz] = total
    return iterations


@inlined
def switched(thresholds, voltages, switches):
    """Whether a switch would change by the given quantities."""
    changes = False
    for k in range(len(switches)):
        control = voltages[N_VOLTAGES + k]
        changes = changes or (
            control < thresholds[1, k] if switches[k] != 0.0 else control > thresholds[0, k]
        )
    return changes


@inlined
def switch(thresholds, voltages, switches):
    """Close the switches above their threshold, and open those below: the last that changed, or -1."""
    last = -1
    for k in range(len(switches)):
        control = voltages[N_VOLTAGES + k]
        before = switches[k]
        if control > thresholds[0, k]:
            switches[k] = 1.0
        elif control < thresholds[1, k]:
            switches[k] = 0.0
        if switches[k] != before:
            last = k
    return last


@inlined
def error_of(c, volts, s, first, second, sizes):
    """The time-step error over the largest that it may have, from its charges before, between and after."""
    error = 0.0
    for k in range(c.nz):
        off = abs(second[k] - s[k] - (first[k] - s[k]) / GAMMA) * volts[k]
        error = max(error, off / (c.tolerance * max(sizes[k], c.least)))
        if not off < 1e300:  # nan, which max() passes over
            error = NEVER
    return error


@inlined
def step(c, level, s, u, y, switches, sizes, room, volts, thresholds):
    """Try a step of two stages from the charges s: its error, and the load's voltage after the first stage.

    The charges at its end are in the second row of ``room``, the reported quantities in the fourth.
    The third number is below 0 if a stage does not converge: the solver's return value.
    """
    middle = room[0]
    end = room[1]
    new = room[3]
    r = room[4]
    work = room[5]
    between = room[6]
    iterations = stage(
        c, level, s, u, y=y, switches=switches, after=middle, voltages=new, r=r, work=work
    )
    if iterations < 0:
        return NEVER, 0.0, iterations
    load_voltage = new[2]
    for k in range(c.ns):
        between[k] = s[k] + (1.0 - GAMMA) / GAMMA * (middle[k] - s[k])
    iterations = stage(
        c, level, between, u, y=y, switches=switches, after=end, voltages=new, r=r, work=work
    )
    if iterations < 0:
        return NEVER, load_voltage, iterations
    error = error_of(c, volts, s, middle, end, sizes)
    if error < NEVER and switched(thresholds, new, switches):
        return max(error, 4.0), load_voltage, iterations
    return error, load_voltage, iterations


@inlined
def copy(to, array):
    """Copy as many numbers as there is room for."""
    for k in range(len(to)):
        to[k] = array[k]


@inlined
def logged(c, seconds, state, count):
    """Add a step of a whole drift to a log: the number of its rows, the room for them, and rows of seconds and a state.

    For the state reached that are the charges, the unknowns that functions read, and the switches
    as they were before.
    """
    if c.log_at == 0 or count != FINEST:
        return
    head = carray(pointer(c.log_at), 2)
    width = 1 + c.ns + c.n + c.switches
    if head[0] < head[1]:
        row = carray(pointer(c.log_at + 8 * (2 + int(head[0]) * width)), width)
        row[0] = seconds
        copy(row[1:], state)
        head[0] += 1.0


@inlined
def counted(changes, changed, at):
    """The changes of switches up to ``at`` since the last multiple of `GIVEN_UP`.

    The last step changed one, or -1.
    """
    if at % GIVEN_UP == 0:
        return 0
    return changes + (1 if changed >= 0 else 0)


@inlined
def longer(level, error):
    """The level of the next step after one with an error."""
    if error < 0.04:
        return max(level - (2 if error < 0.0025 else 1), 0)
    return level


@c_function(FOLLOW, later=True)
def follow(circuit_at, state_at, room_at, x, x1, wall, first, h, count):
    """Advance a circuit by a drift of length h: ``count`` of the `FINEST` parts of a step.

    A state is its charges, the unknowns that functions read, the switches, the sizes of the linear
    charges (V) with the level, the reported quantities (the voltages of piezo, store and load, and
    the switches' controls), the results of this drift: the integral of the load's squared voltage
    (V^2 s), the steps, and those of them that failed, or changed a switch that chatters; and the
    solver's return value for the last one that failed, of any drift, or `CHATTERS`.
    """
    c = carray(circuit_at, 1)[0]
    ns = c.ns
    n = c.n
    nz = c.nz
    length = ns + n + c.switches + nz + 1 + N_VOLTAGES + c.switches + DID
    longest = max(length, n * n + 3 * n + 10 * ns)  # the solver's is `Solver.work`
    state = carray(state_at, length)
    room = carray(room_at, (ROOMS, longest))
    s = state[:ns]
    y = state[ns : ns + n]
    switches = state[ns + n : ns + n + c.switches]
    begin = ns + n + c.switches
    sizes = state[begin : begin + nz + 1]
    voltages = state[begin + nz + 1 : length - DID]
    end = room[1]
    trial = room[2]
    new = room[3]
    volts = carray(pointer(c.volts_at), nz)
    thresholds = carray(pointer(c.thresholds_at), (2, c.switches))
    kept = sizes[nz]  # a restored state may have any
    level = int(kept) if 0.0 <= kept < LEVELS else LEVELS - 1
    at = 0
    square = 0.0
    steps = 0
    failed = 0
    changes = 0
    unit = h / count
    before = position_at(0.0, x, x1, wall, first, h)
    while at < count:
        size = FINEST >> level
        while at % size != 0 or at + size > count:
            level += 1
            size = FINEST >> level
        if level < IMPACT and at * unit < first < (at + size) * unit * (1.0 - 1e-9):
            level += 1
            continue
        seconds = c.seconds / (1 << level)
        here = position_at((at + size) * unit, x, x1, wall, first, h)
        u = c.charge * (here - before) / seconds
        copy(trial[:n], y)
        steps += 1
        error, load_voltage, iterations = step(
            c,
            level,
            s,
            u,
            y=trial,
            switches=switches,
            sizes=sizes,
            room=room,
            volts=volts,
            thresholds=thresholds,
        )
        if error > 1.0 and level < LEVELS - 1:
            level = min(level + (2 if error > 16.0 else 1), LEVELS - 1)
            continue
        if not error < NEVER:
            # what does not converge at the shortest step is left as it was for a while, and told
            failed += 1
            state[length - 1] = iterations
            changes = 0
            at = min((at // GIVEN_UP + 1) * GIVEN_UP, count)
            before = position_at(at * unit, x, x1, wall, first, h)
            continue
        copy(s, end)
        copy(y, trial)
        copy(voltages, new)
        logged(c, seconds, state, count)
        for k in range(nz):
            sizes[k] = max(sizes[k] * (1.0 - FADING * size / FINEST), abs(s[k]) * volts[k])
        changed = switch(thresholds, voltages, switches)
        square += seconds * ((1.0 - GAMMA) * load_voltage * load_voltage + GAMMA * new[2] * new[2])
        at += size
        before = here
        changes = counted(changes, changed, at)
        if changes > MOST_CHANGES:
            failed += changes
            changes = 0
            state[length - 1] = CHATTERS + changed
            at = min((at // GIVEN_UP + 1) * GIVEN_UP, count)
            before = position_at(at * unit, x, x1, wall, first, h)
        level = longer(level, error)
    sizes[nz] = level
    state[length - DID] = square
    state[length - DID + 1] = steps
    state[length - DID + 2] = failed
    return steps
