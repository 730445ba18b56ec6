"""The effect of several modes on a load circuit in a drift: the charge sum s_j y_j, its course, and its controls.

A circuit sees the charge alone, in units of theta l: in a drift a straight line, broken at a point
at which a stop is met.
"""

import math
from typing import NamedTuple

from harvester.mechanics.kernels.circuit_control_variates import add_weighted_noise
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.ideal_circuit import Store, conducted, followed
from harvester.mechanics.kernels.offset_stops import wall_of
from harvester.mechanics.modes.modal_step import dot, drift_modes, energy_of_modes


class Course(NamedTuple):
    """The charge in a drift: its start, the ``wall`` that it reaches at the time ``first``, and its end.

    Without an impact the wall is its start, and ``first`` 0.
    """

    begin: float
    wall: float
    first: float
    end: float


@forced
def drift_with_course(i, z, d, c, a):
    """Drift lane i of modes by the interval d: the `Impacts`, and the `Course` of the charge."""
    n = len(c.k)
    begin = dot(c.s, z, 0, i)
    rate = dot(c.s, z, n, i)
    wall = begin
    first = 0.0
    if c.contact is None:
        did = drift_modes(i, z, d, c, a)
    else:
        w = dot(c.phi, z, 0, i)
        speed = dot(c.phi, z, n, i)
        did = drift_modes(i, z, d, c, a)
        if did.number > 0.0:
            first = did.time
            wall = begin + first * rate + c.sm * (wall_of(did.speed, c.contact) - w - first * speed)
    return did, Course(begin, wall, first, dot(c.s, z, 0, i))


@forced
def drift_with_ideal(i, z, store, d, c, a, circuit):
    """The same with an ideal circuit: its `Store` after the drift, and the `Impacts`."""
    voltage = 2 * len(c.k) * BATCH + i
    V = z[voltage]
    did, course = drift_with_course(i, z, d, c, a)
    w = (course.end - course.wall) / (d.t - course.first) if d.t > course.first else 0.0
    V, store, leg = followed(
        course.begin, course.wall, course.first, w, t=d.t, V=V, store=store, circuit=circuit
    )
    z[voltage], U = conducted(V, store.U, leg.v, leg.t, circuit)
    return Store(U, store.m), did


@forced
def add_modal_features(i, z, U, xi, controls, c):
    """Add the noise of a kick to the martingales of one mode, whose speed is that along which the noise acts."""
    n = len(c.k)
    V = z[2 * n * BATCH + i]
    energy = energy_of_modes(i, z, c)
    if c.oscillator.beta is not None:
        energy += 0.5 * c.oscillator.beta * V * V
    add_weighted_noise(
        i,
        dot(c.s, z, 0, i),
        dot(c.g, z, n, i),
        V,
        U=U,
        root=math.sqrt(abs(energy)),
        xi=xi,
        controls=controls,
    )
