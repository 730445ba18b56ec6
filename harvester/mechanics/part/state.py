"""The state of a device that is advanced from outside, as an array of floats, and what it reports."""

import math
from enum import IntEnum

from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import kick, spring
from harvester.mechanics.kernels.offset_stops import lower_stop
from harvester.mechanics.part.forces import Motion, acceleration

BEGIN, ADVANCE, STOPPING, JUMP, READ = range(5)
DONE, EVENT, FAILED = range(3)
SLACK = 1e-9  # of a step, by which a time may miss a point of the grid
SHORT_KICK = 1e-6  # the length of a kick that tells the force


class W(IntEnum):
    """Places of the state in its array."""

    X = 0
    SPEED = 1
    VOLTAGE = 2
    TIME = 3
    WORK = 4
    LOAD = 5
    DAMPING = 6
    STORE = 7
    FOLLOWER = 8
    LOST = 9
    IMPULSE = 10
    HITS = 11
    HIT_TIME = 12
    HIT_SPEED = 13
    PENDING = 14
    KICKS = 15
    BEGUN = 16
    NOW = 17
    P = 18
    Q = 19
    BEFORE = 20
    AFTER = 21
    SIZE = 24


class OUT(IntEnum):
    """Places of what `READ` reports, nondimensional."""

    DISPLACEMENT = 0
    VELOCITY = 1
    VOLTAGE = 2
    CURRENT = 3
    POWER = 4
    IMPACTS = 5
    IMPACT_TIME = 6
    IMPACT_SPEED = 7
    FORCE = 8
    IMPULSE = 9
    WORK = 10
    LOAD = 11
    DAMPING = 12
    LOST = 13
    STORED = 14
    STORE = 15
    SIZE = 16


@inlined
def potential(x, c):
    """Energy of the spring and of a compliant stop."""
    energy = 0.5 * x * x
    if c.linear is not None:
        energy *= c.linear
    if c.alpha2 is not None:
        energy += c.alpha2 * x * x * x / 3.0
    if c.alpha is not None:
        energy += 0.25 * c.alpha * x * x * x * x
    if c.k is not None:
        depth = min(x + c.gap, 0.0)
        energy += 0.5 * c.k * depth * depth
    return energy


@inlined
def with_pulls(c):
    """The coefficients with what the spring does at the stops, where that is used."""
    pull, high = None, None
    if c.gap is not None:
        pull = spring(0.0 - c.gap, c)
    if c.high is not None:
        high = -spring(c.high, c)
    return Coefficients(
        c.mu, c.r, c.alpha, c.beta, c.c1, c.c2, c.c3, c.cv, c.n1, c.n2, c.n12, c.linear, c.alpha2, c.gap, pull, c.high,
        c.r_high, high, c.k, c.c,
    )  # fmt: skip


@inlined
def loaded(w):
    """The motion of a state."""
    return Motion(w[0], w[1], w[2], w[3], w[4], w[5], w[6])


@inlined
def kept(w, m):
    """Keep a motion; whether it is finite."""
    w[0], w[1], w[2], w[3], w[4], w[5], w[6] = m
    return math.isfinite(m.x) and math.isfinite(m.v) and math.isfinite(m.V)


@inlined
def shown_energy(m, U, c, circuit):
    """What is stored: kinetic energy, springs, the piezo, and the circuit's capacitor."""
    energy = 0.5 * m.v * m.v + potential(m.x, c)
    if c.beta is not None:
        energy += 0.5 * c.beta * m.V * m.V
        if circuit is not None:
            energy += 0.5 * c.beta * circuit.kappa * U * U
    return energy


@inlined
def report(out, m, U, quiet, c, circuit, outside, record):
    """Fill what follows from a motion alone.

    The force on the base is minus the mass times its acceleration, that of a mass at rest on a stop included.
    """
    at_load, mu = m.V, 0.0
    if circuit is not None:
        at_load, mu = U, circuit.mu
    elif c.mu is not None:
        mu = c.mu
    beta = 0.0 if c.beta is None else c.beta
    current = mu * at_load
    out[0], out[1], out[2], out[3] = m.x, m.v, m.V, current
    out[4] = beta * current * at_load
    a = acceleration(m.t, outside, record)
    inner = (kick(State(m.x, m.v, m.V), 0.0, SHORT_KICK, quiet) - m.v) / SHORT_KICK
    if c.k is not None and m.x + c.gap < 0.0:
        inner -= c.k * (m.x + c.gap) + c.c * m.v
    on_stop = False
    if c.r is not None:
        on_stop = m.v == 0.0 and m.x == lower_stop(c)
    if c.high is not None:
        on_stop = on_stop or (m.v == 0.0 and m.x == c.high)
    out[8] = -a if on_stop else -inner
    out[10], out[11], out[12] = m.work, beta * m.load, m.damping
    out[14], out[15] = shown_energy(m, U, c, circuit), U
    return 0
