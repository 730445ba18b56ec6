"""A device on a grid of steps that begins at time 0: for noise, compliant stops and circuits of diodes and switches.

The grid is that of the package's ensembles and paths (`harvester.mechanics.kernels.path`): a kick at each point,
half a kick at the first, and a drift between them with as many impacts as it takes.  A time between two points is
reached by a part of the drift, from the point before: however a communication step divides the time, the path is the
same to the last digit.
"""

from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import (
    carried,
    friction,
    is_damped,
    kick,
    spring,
)
from harvester.mechanics.kernels.ideal_circuit import Store, fly
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.part.forces import Motion, dissipated


class Flight(NamedTuple):
    """A motion with the circuit's store, and what the stops did since the last point of the grid."""

    m: Motion
    store: Store
    number: float
    time: float
    speed: float
    energy: float
    impulse: float


@inlined
def flight(m, store, h, t, c, circuit, a):
    """The first t of the drift of a step h; ``a`` is the shaking's mean over it."""
    s1, store1, did = fly(State(m.x, m.v, m.V), store, interval(h, t, c.mu), c, circuit, a)
    load = m.load
    if circuit is not None:
        load += circuit.mu * 0.5 * (store.U * store.U + store1.U * store1.U) * t
    elif c.mu is not None:
        if did.number == 0.0:
            load += dissipated(m.V, s1.V, m.v, t, c.mu)
        else:
            first = max(min(did.time, t), 0.0)
            V = carried(m.V, m.v * first, first, c.mu)
            load += dissipated(m.V, V, m.v, first, c.mu) + dissipated(
                V, s1.V, s1.v, t - first, c.mu
            )
    m1 = Motion(s1.x, s1.v, s1.V, m.t + t, m.work, load, m.damping)
    return Flight(m1, store1, did.number, did.time, did.speed, did.energy, s1.v - m.v)


@inlined
def struck(m, h, c, a, xi, other, current):
    """The motion after a kick of a length h, half of the current before and half after; work includes noise's."""
    V, load = m.V, m.load
    if current is not None:
        V -= 0.5 * h * current
    v = kick_at_stops(State(m.x, m.v, V), xi, h, c, a, other)
    middle = 0.5 * (m.v + v)
    force = spring(m.x, c)
    if c.beta is not None:
        force -= c.beta * V
    lost = 0.0
    if is_damped(c):
        lost = h * friction(m.x, middle, c) * middle * middle
    work = 0.5 * (v * v - m.v * m.v) - h * force * middle + lost
    if v == 0.0 and m.v == 0.0:
        work = 0.0
    if current is not None:
        load += h * current * V
        V -= 0.5 * h * current
    return Motion(m.x, v, V, m.t, m.work + work, load, m.damping + lost)


@inlined
def at_time(m, store, h, t, quiet, c, circuit, mean, a):
    """What a flight of t after a point of the grid shows: the velocity is moved by a part of a kick to that time."""
    f = flight(m, store, h, t, c, circuit, mean)
    v = kick(State(f.m.x, f.m.v, f.m.V), 0.0, t - 0.5 * h, quiet, a)
    shown = Motion(f.m.x, v, f.m.V, f.m.t, f.m.work, f.m.load, f.m.damping)
    return Flight(shown, f.store, f.number, f.time, f.speed, f.energy, f.impulse)
