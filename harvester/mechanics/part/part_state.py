"""The state of a device that is advanced from outside, as an array of floats, and its report."""

import math
from enum import IntEnum
from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import inlined, version_of
from harvester.mechanics.kernels.equation_of_motion import kick, spring
from harvester.mechanics.kernels.offset_stops import lower_stop
from harvester.mechanics.kernels.one_mode import IdealLoad
from harvester.mechanics.kernels.stored_energy import contact_energy, spring_energy
from harvester.mechanics.part.outside_forces import PartMotion

BEGIN, ADVANCE, STOPPING, JUMP, READ = range(5)
DONE, EVENT, FAILED, UNSOLVED = range(4)
SLACK = 1e-9  # of a step, by which a time may miss a point of the grid
SHORT_KICK = 1e-6  # the length of a kick that measures the force


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
    STEPS = 15
    BEGUN = 16
    NOW = 17
    P = 18
    Q = 19
    BEFORE = 20
    AFTER = 21
    COUNTS = 22  # of a netlist: the integral of its load's V^2, its steps, those that failed
    DELIVERED = 25  # by an ideal circuit, over beta
    DRAINED = 26
    SIZE = 27  # behind it is the state of a netlist


class OUT(IntEnum):
    """Places of the report of `READ`, nondimensional."""

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
    DELIVERED = 16
    DRAINED = 17
    SIZE = 18


@inlined
def with_pulls(c):
    """The coefficients with the spring's accelerations at the stops, if those are used."""
    pull = None
    high = None
    if c.gap is not None:
        pull = spring(0.0 - c.gap, c)
    if c.high is not None:
        high = -spring(c.high, c)
    return Coefficients(
        mu=c.mu,
        r=c.r,
        alpha=c.alpha,
        beta=c.beta,
        c1=c.c1,
        c2=c.c2,
        c3=c.c3,
        cv=c.cv,
        n1=c.n1,
        n2=c.n2,
        n12=c.n12,
        linear=c.linear,
        alpha2=c.alpha2,
        softening=c.softening,
        inertia=c.inertia,
        gamma=c.gamma,
        gap=c.gap,
        pull=pull,
        high=c.high,
        r_high=c.r_high,
        pull_high=high,
        k=c.k,
        c=c.c,
    )


@inlined
def loaded(w):
    """The motion of a state."""
    return PartMotion(x=w[0], v=w[1], V=w[2], t=w[3], work=w[4], load=w[5], damping=w[6])


@inlined
def kept(w, m):
    """Keep a motion; whether it is finite."""
    w[0], w[1], w[2], w[3], w[4], w[5], w[6] = m
    return math.isfinite(m.x) and math.isfinite(m.v) and math.isfinite(m.V)


class DrawnLoad(NamedTuple):
    """The voltage U at the load resistance, and mu = 1/(R Cp w0).

    ``store`` is the voltage of a circuit's capacitor, and ``delivered`` the energy in the load of a
    netlist over beta, so far.
    """

    U: float
    mu: float
    store: float
    delivered: float


def load_of(m, c, load):
    """The `DrawnLoad` that a motion has now."""


@version_of(load_of, load=None)
def _resistor(m, c, load):
    if c.mu is None:
        return DrawnLoad(m.V, 0.0, 0.0, 0.0)
    return DrawnLoad(m.V, c.mu, 0.0, 0.0)


@version_of(load_of, load=IdealLoad)
def _ideal(m, c, load):
    U = load.store.U
    return DrawnLoad(U, load.circuit.mu, U, 0.0)


@inlined
def is_on_stop(m, c):
    """Whether the mass is at rest on a rigid stop."""
    on_stop = False
    if c.r is not None:
        on_stop = m.v == 0.0 and m.x == lower_stop(c)
    if c.high is not None:
        on_stop = on_stop or (m.v == 0.0 and m.x == c.high)
    return on_stop


@inlined
def report(out, m, quiet, c, load, a):
    """Fill the report as far as a motion, its load and the excitation ``a`` determine it.

    The force on the base is minus the mass times its acceleration in space: at rest on a stop that
    is the base's, which is -a.
    """
    drawn = load_of(m, c, load)
    beta = 0.0 if c.beta is None else c.beta
    current = drawn.mu * drawn.U
    out[0] = m.x
    out[1] = m.v
    out[2] = m.V
    out[3] = current
    out[4] = beta * current * drawn.U
    inner = (kick(State(m.x, m.v, m.V), 0.0, SHORT_KICK, quiet) - m.v) / SHORT_KICK
    if c.k is not None and m.x + c.gap < 0.0:
        inner -= c.k * (m.x + c.gap) + c.c * m.v
    out[8] = a if is_on_stop(m, c) else -inner
    out[10] = m.work
    out[11] = beta * m.load
    out[12] = m.damping
    electrical = 0.5 * beta * m.V * m.V
    out[14] = 0.5 * m.v * m.v + spring_energy(m.x, c) + contact_energy(m.x, c) + electrical
    out[15] = drawn.store
    out[16] = beta * drawn.delivered
    return 0
