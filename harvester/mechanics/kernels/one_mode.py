"""The answers of one mode, and of loads on any mechanics, to `harvester.mechanics.kernels.driver`.

With an ideal circuit a step of many trajectories is three loops: the rare events, an impact or a
switching, and then the events of every step, the flow through the diodes, and the kick.
"""

from typing import Any, NamedTuple

from harvester.arrays import Floats
from harvester.mechanics.kernels.circuit_control_variates import add_circuit_features
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients, Impacts, State
from harvester.mechanics.kernels.compiled import version_of
from harvester.mechanics.kernels.control_variates import add_martingales
from harvester.mechanics.kernels.driver import (
    add_load_sample,
    add_sample,
    add_to_controls,
    aside,
    beside,
    conductance,
    coordinates,
    draw,
    draw_once,
    drift_all,
    drift_all_aside,
    drifted,
    end_draw,
    energy_of,
    kicked,
    load_aside,
    load_at,
    noted,
    oscillator,
    other_variate,
    put,
    read,
    speed,
    state_at,
    unnamed,
)
from harvester.mechanics.kernels.equation_of_motion import friction, impulse, is_damped, withheld
from harvester.mechanics.kernels.ideal_circuit import (
    IdealCircuit,
    Store,
    conducted,
    fly,
    until_last_event,
)
from harvester.mechanics.kernels.noise import draw_two_noises
from harvester.mechanics.kernels.offset_stops import kick_at_stops, move
from harvester.mechanics.kernels.shaking import last_acceleration, shaken


class IdealLoad(NamedTuple):
    """An ideal ``circuit``, its present state, and room for U at samples, shape (n, 2)."""

    circuit: Any
    store: Store
    charge: Floats | None  # among many trajectories None


class Driven(NamedTuple):
    """A state of mass and circuit that `drift_all` has drifted already, and its impacts."""

    s: State
    store: Store
    number: float
    energy: float


@version_of(oscillator, c=Coefficients)
def _oscillator(c):
    return c


@version_of(coordinates, c=Coefficients)
def _coordinates(c):
    return 1


@version_of(drifted, c=Coefficients, load=None)
def _with_resistor(s, z, d, c, a, load):
    s1, did = move(s, d, c, a)
    return s1, load, did


@version_of(drifted, c=Coefficients, load=IdealLoad)
def _with_ideal(s, z, d, c, a, load):
    s1, store, did = fly(s, load.store, d, c, load.circuit, a)
    return s1, IdealLoad(load.circuit, store, load.charge), did


@version_of(drifted, c=Coefficients, load=Driven)
def _driven(s, z, d, c, a, load):
    return load.s, load, Impacts(0.0, 0.0, load.number, load.energy)


@version_of(kicked, c=Coefficients)
def _kicked(s, z, xi, h, c, a, other=None):
    return State(s.x, kick_at_stops(s, xi, h, c, a, other), s.V)


@version_of(beside, c=Coefficients)
def _beside(s, z, room, c):
    return s


@version_of(read, c=Coefficients)
def _read(s, z, c):
    return s.x, s.v, s.V


@version_of(speed, c=Coefficients)
def _speed(s, z, c):
    return s.v


@version_of(unnamed, c=Coefficients)
def _unnamed(s, c):
    return s[:]


@version_of(state_at, c=Coefficients)
def _state_at(i, z, c):
    return State(z[i], z[BATCH + i], z[2 * BATCH + i])


@version_of(put, c=Coefficients)
def _put(i, z, s, c):
    z[i] = s.x
    z[BATCH + i] = s.v
    z[2 * BATCH + i] = s.V


@version_of(add_sample, c=Coefficients)
def _add_sample(i, sums, s, z, mid, z_mid, c):
    sums[0 * BATCH + i] += 0.5 * (s.V + mid.V)
    sums[1 * BATCH + i] += s.V * s.V
    sums[2 * BATCH + i] += mid.V * mid.V
    sums[3 * BATCH + i] += 0.5 * (s.x + mid.x)
    sums[4 * BATCH + i] += s.x * s.x
    sums[5 * BATCH + i] += mid.x * mid.x
    sums[6 * BATCH + i] += mid.v * mid.v
    sums[7 * BATCH + i] += 0.5 * (s.x * s.V + mid.x * mid.V)
    sums[8 * BATCH + i] += mid.v * mid.V
    if is_damped(c):
        sums[9 * BATCH + i] += friction(mid.x, mid.v, c) * mid.v * mid.v
    if c.inertia is not None:
        sums[9 * BATCH + i] += withheld(mid.x, c)


@version_of(aside, load=None)
@version_of(aside, load=IdealLoad)
def _aside(load):
    return load


@version_of(noted, load=None)
def _none_noted(load, mid, row):
    return None


@version_of(noted, load=IdealLoad)
def _ideal_noted(load, mid, row):
    load.charge[row, 0] = load.store.U
    load.charge[row, 1] = mid.store.U


@version_of(load_at, load=None)
def _no_load(i, z, c, load, driven):
    return None


@version_of(load_aside, load=None)
def _no_load_aside(i, z, mid, c, load):
    return None


@version_of(load_at, c=Coefficients, load=IdealCircuit)
def _ideal_at(i, z, c, load, driven):
    store = Store(z[3 * BATCH + i], z[4 * BATCH + i])
    return Driven(state_at(i, z, c), store, driven[2, i], driven[3, i])


@version_of(load_aside, c=Coefficients, load=IdealCircuit)
def _ideal_aside(i, z, mid, c, load):
    store = Store(mid[3 * BATCH + i], mid[4 * BATCH + i])
    return Driven(state_at(i, mid, c), store, 0.0, 0.0)


@version_of(energy_of, c=Coefficients, load=None)
def _square_of_speed(did, c, load):
    if c.gap is None and c.r is not None:  # as good as the energy (`loss_unit`), and costs less
        return did.speed * did.speed
    return did.energy


@version_of(add_load_sample, load=IdealCircuit)
def _add_ideal_sample(i, sums, z, mid, c, load):
    stored = z[(2 * coordinates(c) + 1) * BATCH + i]
    sums[13 * BATCH + i] += 0.5 * load.mu * (stored * stored + mid.store.U * mid.store.U)


@version_of(drift_all, c=Coefficients, load=IdealCircuit)
def _fly_all(z, driven, accelerations, d, c, load, shaker):
    if c.r is None and c.gap is None and load.hysteresis is None:
        for i in range(BATCH):
            v = z[BATCH + i]
            z[i] += d.t * v
            z[2 * BATCH + i], z[3 * BATCH + i] = conducted(
                z[2 * BATCH + i], z[3 * BATCH + i], v, d.t, load
            )
        return
    for i in range(BATCH):
        a, _ = shaken(i, accelerations, shaker)
        held = Store(z[3 * BATCH + i], z[4 * BATCH + i])
        s, store, leg, impacts = until_last_event(state_at(i, z, c), held, d, c, load, a)
        put(i, z, s, c)
        z[3 * BATCH + i] = store.U
        z[4 * BATCH + i] = store.m
        driven[0, i] = leg.v
        driven[1, i] = leg.t
        driven[2, i] = impacts.number
        driven[3, i] = impacts.energy
    for i in range(BATCH):
        z[2 * BATCH + i], z[3 * BATCH + i] = conducted(
            z[2 * BATCH + i], z[3 * BATCH + i], driven[0, i], driven[1, i], load
        )


@version_of(drift_all_aside, c=Coefficients, load=IdealCircuit)
def _fly_all_aside(z, mid, driven, accelerations, d, c, load, shaker):
    for i in range(5 * BATCH):
        mid[i] = z[i]
    if shaker is not None:
        for i in range(BATCH):
            accelerations[0, i] = last_acceleration(i, shaker)
    drift_all(mid, driven, accelerations, d, c, load, shaker=shaker)


@version_of(conductance, load=None)
def _of_resistor(c, load):
    return oscillator(c).mu


@version_of(draw, c=Coefficients, load=None)
def _draw_for_resistor(b, z, noise, other, before, kick_sums, doublings, c, load, update):
    if c.n1 is not None and c.n2 is not None and update.weight is None:
        draw_two_noises(noise, other, b.s0, b.s1, doublings)
    else:
        draw_once(b, noise, doublings, c)
    if b.controls is not None:
        for i in range(BATCH):
            before[0, i] = z[i]
            before[1, i] = z[BATCH + i]
            before[2, i] = z[2 * BATCH + i]
            kick_sums[0, i] = kick_sums[1, i] = 0.0


@version_of(other_variate, c=Coefficients, load=None)
def _variate_of_resistor(k, i, other, c, load, update):
    if c.n1 is not None and c.n2 is not None and update.weight is None:
        return other[k, i]
    return None


@version_of(add_to_controls, c=Coefficients, load=None)
def _add_to_draw(i, z, s, xi, other, kick_sums, controls, c, load):
    kick = impulse(s.x, xi, 0.5, c, other)
    kick_sums[0, i] += s.v * kick
    kick_sums[1, i] += kick


@version_of(end_draw, c=Coefficients, load=None)
def _end_martingales(controls, before, kick_sums, c, load):
    if controls is not None:
        for i in range(BATCH):
            add_martingales(i, before, kick_sums, controls, c)


@version_of(add_to_controls, c=Coefficients)
def _add_features(i, z, s, xi, other, kick_sums, controls, c, load):
    add_circuit_features(i, s, z[3 * BATCH + i], xi, controls, c)
