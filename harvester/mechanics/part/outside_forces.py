"""Actions from outside: the acceleration of the base, and a current at the electrodes.

    a(t) = a + slope (t - since) + F cos(Omega t) + record       nondimensional, of the mass
    V' = x' - mu V - current

A mass's equation of motion has no time of its own: kicks use a at their own time.
"""

import math
from typing import NamedTuple

from harvester.arrays import Floats
from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import drift, is_damped, kick, spring
from harvester.mechanics.kernels.intervals import interval

SHORT = 0.01  # mu h, up to which Simpson's rule gives the loss in a load to 1e-11


class Outside(NamedTuple):
    """Actions from outside, None if absent.

    ``record`` has accelerations ``spacing`` apart, repeated for ever.
    """

    a: float
    slope: float
    since: float
    drive: float | None = None
    drive_frequency: float | None = None
    current: float | None = None
    spacing: float | None = None
    record: Floats | None = None


class PartMotion(NamedTuple):
    """A state at the time t, with the energies so far: excitation, load and damping."""

    x: float
    v: float
    V: float
    t: float
    work: float
    load: float
    damping: float


@inlined
def at(m, x, v):
    """The same motion at the displacement x with the velocity v."""
    return PartMotion(x=x, v=v, V=m.V, t=m.t, work=m.work, load=m.load, damping=m.damping)


@inlined
def at_time(m, t):
    """The same motion at the time t, without the rounding of its sum of steps."""
    return PartMotion(x=m.x, v=m.v, V=m.V, t=t, work=m.work, load=m.load, damping=m.damping)


@inlined
def acceleration(t, outside):
    """The excitation's acceleration at the time t."""
    a = outside.a + outside.slope * (t - outside.since)
    if outside.drive is not None:
        a += outside.drive * math.cos(outside.drive_frequency * t)
    if outside.record is not None:
        index = t / outside.spacing
        whole = math.floor(index)
        k = int(whole) % len(outside.record)
        last = k + 1 == len(outside.record)
        after = outside.record[0 if last else k + 1]
        a += outside.record[k] + (index - whole) * (after - outside.record[k])
    return a


@inlined
def dissipated(V, V1, v, t, mu):
    """The integral of mu V^2 over a drift at constant speed from V to V1, as V' = v - mu V."""
    if mu is None:
        return 0.0
    if abs(mu * t) < SHORT:
        half = interval(t, 0.5 * t, mu)
        middle = half.e * V + half.g * v
        return mu * t * (V * V + 4.0 * middle * middle + V1 * V1) / 6.0
    return v * (v * t - (V1 - V)) / mu - 0.5 * (V1 * V1 - V * V)


@inlined
def pushed(m, h, c, outside):
    """The motion after the forces of a time h at fixed x; half of the current acts before them."""
    V = m.V
    load = m.load
    if outside.current is not None:
        V -= 0.5 * h * outside.current
    a = acceleration(m.t, outside)
    v = kick(State(m.x, m.v, V), 0.0, h, c, a)
    between = 0.5 * h * (m.v + v)
    damping = m.damping
    if is_damped(c):
        force = spring(m.x, c) + a
        if c.beta is not None:
            force -= c.beta * V
        damping += between * force - 0.5 * (v * v - m.v * m.v)
    if outside.current is not None:
        load += h * outside.current * V
        V -= 0.5 * h * outside.current
    work = m.work + a * between
    return PartMotion(x=m.x, v=v, V=V, t=m.t, work=work, load=load, damping=damping)


@inlined
def flown(m, h, c):
    """The motion after a drift of a time h, without stops."""
    s, _ = drift(State(m.x, m.v, m.V), interval(h, h, c.mu), c.mu, None)
    load = m.load + dissipated(m.V, s.V, m.v, h, c.mu)
    return PartMotion(x=s.x, v=s.v, V=s.V, t=m.t + h, work=m.work, load=load, damping=m.damping)


@inlined
def held(m, h, c, outside):
    """The motion of a mass at rest on a stop for a time h; its voltage changes."""
    given = 0.0 if outside.current is None else 0.5 * h * outside.current
    V = m.V - given
    before = PartMotion(x=m.x, v=0.0, V=V, t=m.t, work=m.work, load=m.load, damping=m.damping)
    after = flown(before, h, c)
    load = after.load + given * (V + after.V)
    V = after.V - given
    return PartMotion(x=m.x, v=0.0, V=V, t=after.t, work=m.work, load=load, damping=m.damping)
