"""What acts on the device from outside: the acceleration of its base and the current that its electrodes give.

    a(t) = a + slope (t - since) + F cos(Omega t) + record       nondimensional, of the mass relative to the base
    V' = x' - mu V - current

A mass's equation of motion has no time of its own: kicks take a at their own time.
"""

import math
from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.equation_of_motion import drift, is_damped, kick, spring
from harvester.mechanics.kernels.intervals import interval

SHORT = 0.01  # mu h, up to which Simpson's rule gives the loss in a load to 1e-11


class Outside(NamedTuple):
    """What acts from outside; None is absent.  ``record`` has accelerations ``spacing`` apart, repeated for ever."""

    a: float
    slope: float
    since: float
    drive: float | None = None
    drive_frequency: float | None = None
    current: float | None = None
    spacing: float | None = None


class Motion(NamedTuple):
    """A state at the time t, with the energies so far: what shaking gave, what load and damping took."""

    x: float
    v: float
    V: float
    t: float
    work: float
    load: float
    damping: float


@inlined
def acceleration(t, outside, record):
    """The shaking's acceleration at the time t."""
    a = outside.a + outside.slope * (t - outside.since)
    if outside.drive is not None:
        a += outside.drive * math.cos(outside.drive_frequency * t)
    if record is not None:
        place = t / outside.spacing
        whole = math.floor(place)
        k = int(whole) % len(record)
        after = record[k + 1] if k + 1 < len(record) else record[0]
        a += record[k] + (place - whole) * (after - record[k])
    return a


@inlined
def dissipated(V, V1, v, t, mu):
    """The integral of mu V^2 over a drift at constant speed that takes V to V1, as V' = v - mu V."""
    if mu is None:
        return 0.0
    if abs(mu * t) < SHORT:
        half = interval(t, 0.5 * t, mu)
        middle = half.e * V + half.g * v
        return mu * t * (V * V + 4.0 * middle * middle + V1 * V1) / 6.0
    return v * (v * t - (V1 - V)) / mu - 0.5 * (V1 * V1 - V * V)


@inlined
def pushed(m, h, c, outside, record):
    """The motion after the forces of a time h have acted at fixed x, half of the current before and half after."""
    V, load = m.V, m.load
    if outside.current is not None:
        V -= 0.5 * h * outside.current
    a = acceleration(m.t, outside, record)
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
    return Motion(m.x, v, V, m.t, m.work + a * between, load, damping)


@inlined
def flown(m, h, c):
    """The motion after a drift of a time h, without stops."""
    s, _ = drift(State(m.x, m.v, m.V), interval(h, h, c.mu), c.mu, None)
    return Motion(
        s.x, s.v, s.V, m.t + h, m.work, m.load + dissipated(m.V, s.V, m.v, h, c.mu), m.damping
    )


@inlined
def held(m, h, c, outside):
    """The motion of a mass that rests on a stop for a time h, in which its voltage goes on."""
    given = 0.0 if outside.current is None else 0.5 * h * outside.current
    before = Motion(m.x, 0.0, m.V - given, m.t, m.work, m.load, m.damping)
    after = flown(before, h, c)
    load = after.load + given * (before.V + after.V)
    return Motion(m.x, 0.0, after.V - given, after.t, m.work, load, m.damping)
