"""A device on a grid of steps that begins at time 0: for noise, compliant stops and circuits.

The grid is that of the package's ensembles and paths (`harvester.mechanics.trace`): a kick at each
point, half a kick at the first, and a drift between them with any number of impacts.  A time
between two points is reached by a part of the drift, from the point before: whatever the
communication steps, the trajectory is the same to the last digit.
"""

from typing import NamedTuple

from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import inlined, version_of
from harvester.mechanics.kernels.driver import aside, drifted
from harvester.mechanics.kernels.equation_of_motion import (
    carried,
    friction,
    is_damped,
    kick,
    spring,
)
from harvester.mechanics.kernels.ideal_circuit import Store
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.offset_stops import kick_at_stops, wall_of
from harvester.mechanics.kernels.one_mode import IdealLoad
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.part.outside_forces import (
    Outside,
    PartMotion,
    acceleration,
    at,
    at_time,
    dissipated,
)
from harvester.mechanics.part.part_noise import begin_noise, filtered, shaker_of, step_noise, white
from harvester.mechanics.part.part_state import (
    ADVANCE,
    DONE,
    EVENT,
    FAILED,
    READ,
    SLACK,
    STOPPING,
    UNSOLVED,
    is_on_stop,
    kept,
    loaded,
    report,
)

STEP = 0.2  # of the package's default step: the energy of an impact between two kicks is then right
RESOLVED = 0.15  # a step times the frequency, at most: 1.5 of the package's default steps


class Gridded(NamedTuple):
    """A device with a step h: coefficients without stops and with them, and a noise filter."""

    h: float
    quiet: Coefficients
    c: Coefficients
    outside: Outside
    filter: Filter | None


class Spent(NamedTuple):
    """Energies over beta: in a circuit's load resistance, and lost in its diodes and inductor."""

    load: float
    lost: float


class Flight(NamedTuple):
    """A motion with its load, and the effect of the stops since the last point of the grid."""

    m: PartMotion
    load: IdealLoad | None
    number: float
    time: float
    speed: float
    energy: float
    impulse: float
    spent: Spent


def with_store(load, w):
    """The load with the storage capacitor of the state."""


@version_of(with_store, load=None)
def _without_store(load, w):
    return None


@version_of(with_store, load=IdealLoad)
def _with_store(load, w):
    return IdealLoad(load.circuit, Store(w[7], w[8]), None)


def keep_store(load, w):
    """Keep the storage capacitor of the load in the state."""


@version_of(keep_store, load=None)
def _keep_nothing(load, w):
    return 0


@version_of(keep_store, load=IdealLoad)
def _keep_store(load, w):
    w[7] = load.store.U
    w[8] = load.store.m
    return 0


def is_solved(load):
    """Whether the equations of the load were solved in all steps but a few."""


@version_of(is_solved, load=None)
@version_of(is_solved, load=IdealLoad)
def _in_closed_form(load):
    return True


def load_energy(m, before, end, t, c):
    """The energy out of the piezo in a drift of t from m, which has the ``end`` of `drifted`."""


@version_of(load_energy, before=None)
def _resistor_energy(m, before, end, t, c):
    if c.mu is None:
        return 0.0
    s1, _, did = end
    if did.number == 0.0:
        return dissipated(m.V, s1.V, m.v, t, c.mu)
    first = max(min(did.time, t), 0.0)
    V = carried(m.V, m.v * first, first, c.mu)
    return dissipated(m.V, V, m.v, first, c.mu) + dissipated(V, s1.V, s1.v, t - first, c.mu)


@version_of(load_energy, before=IdealLoad)
def _circuit_energy(m, before, end, t, c):
    return out_of_piezo(m, end, t, c)


@inlined
def out_of_piezo(m, end, t, c):
    """The energy out of the piezo into a circuit in a drift of t from m to its ``end``, over beta.

    It is the work of the mass against the voltages of the kicks at both ends, with the speeds of
    both, less the growth of V^2/2. An impact without white noise adds the work of the voltage at
    the stop (`harvester.mechanics.kernels.equation_of_motion.push`) along the rest of the way. A
    switch acts in the same drift, so that V has another sign on the way back.
    """
    s1, _, did = end
    work = 0.5 * t * (m.V * m.v + s1.V * s1.v)
    if c.r is not None and c.n1 is None and did.number > 0.0:
        at_stop = m.V - (m.x - wall_of(did.speed, c))
        work += at_stop * (s1.x - m.x - 0.5 * t * (m.v + s1.v))
    return work - 0.5 * (s1.V * s1.V - m.V * m.V)


def spent(m, before, end, t, c):
    """The energies over beta of an ideal circuit in a drift of t: `Spent`; 0 for another load."""


@version_of(spent, before=None)
def _nothing_spent(m, before, end, t, c):
    return Spent(0.0, 0.0)


@version_of(spent, before=IdealLoad)
def _circuit_spent(m, before, end, t, c):
    circuit = before.circuit
    U = before.store.U
    U1 = end[1].store.U
    given = circuit.mu * 0.5 * (U * U + U1 * U1) * t
    grown = 0.5 * circuit.kappa * (U1 * U1 - U * U)
    return Spent(given, out_of_piezo(m, end, t, c) - given - grown)


@inlined
def flight(m, load, t, a, grid):
    """The first t of the drift of a step; ``a`` is the excitation's mean over it."""
    d = interval(grid.h, t, grid.c.mu)
    end = drifted(State(m.x, m.v, m.V), None, d, grid.c, a, load)
    s1, load1, did = end
    energy = load_energy(m, load, end, t, grid.c)
    work = m.work
    if grid.c.r is not None and grid.c.n1 is None and did.number > 0.0:
        # Kicks count the work along straight lines to either side, of which an impact leaves a part
        work += a * (s1.x - m.x - 0.5 * t * (m.v + s1.v))
    m1 = PartMotion(
        x=s1.x, v=s1.v, V=s1.V, t=m.t + t, work=work, load=m.load + energy, damping=m.damping
    )
    return Flight(
        m=m1,
        load=load1,
        number=did.number,
        time=did.time,
        speed=did.speed,
        energy=did.energy,
        impulse=s1.v - m.v,
        spent=spent(m, load, end, t, grid.c),
    )


@inlined
def struck(m, h, a, xi, other, grid):
    """The motion after a kick of a length h, half of the current before; work includes noise's."""
    c = grid.c
    current = grid.outside.current
    V = m.V
    load = m.load
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
    return PartMotion(
        x=m.x, v=v, V=V, t=m.t, work=m.work + work, load=load, damping=m.damping + lost
    )


@inlined
def shown(m, load, t, a, grid):
    """The flight of t after a point of the grid, its velocity at that time; 0 at rest on a stop."""
    f = flight(m, aside(load), t, a, grid)
    v = kick(State(f.m.x, f.m.v, f.m.V), 0.0, t - 0.5 * grid.h, grid.quiet, a)
    if is_on_stop(f.m, grid.c):
        v = 0.0
    return Flight(
        m=at(f.m, f.m.x, v),
        load=f.load,
        number=f.number,
        time=f.time,
        speed=f.speed,
        energy=f.energy,
        impulse=f.impulse,
        spent=f.spent,
    )


@inlined
def advanced(w, words, until, stopping, load, grid):
    """Advance to the time ``until``, or ``stopping`` to the next impact."""
    h = grid.h
    f = grid.filter
    outside = grid.outside
    m = loaded(w)
    load = with_store(load, w)
    if w[16] == 0.0:
        w[16] = 1.0
        begin_noise(w, words, f)
        a = acceleration(m.t, outside) + filtered(w, f)
        m = struck(m, 0.5 * h, a, 0.0, None, grid)
    shaker = shaker_of(f, w, words)
    while True:
        before = filtered(w, f)
        now = acceleration(m.t, outside)
        end = (w[15] + 1.0) * h
        whole = end <= until + SLACK * h
        if stopping:
            drift = interval(h, h, grid.c.mu)
            _, _, coming = drifted(State(m.x, m.v, m.V), None, drift, grid.c, now + before, None)
            when = m.t + max(coming.time, 0.0)
            if coming.number > 0.0 and w[17] + SLACK * h < when <= until:
                w[17] = when
                keep_store(load, w)
                return EVENT if kept(w, m) else FAILED
        if not whole:
            break
        after = acceleration(end, outside) + step_noise(w, shaker)
        step = flight(m, load, h, 0.5 * (now + before + after), grid)
        w[9] += step.energy
        w[10] += step.impulse
        w[11] += step.number
        w[25] += step.spent.load
        w[26] += step.spent.lost
        if step.number > 0.0:
            w[12] = m.t + step.time
            w[13] = step.speed
        xi, other = white(words, grid.c)
        load = step.load
        m = at_time(struck(step.m, h, after, xi, other, grid), end)
        w[15] += 1.0
    w[17] = until
    keep_store(load, w)
    if not kept(w, m):  # no circuit has a solution at an infinite motion
        return FAILED
    return DONE if is_solved(load) else UNSOLVED


@inlined
def gridded_part(task, w, words, out, until, load, grid):
    """Advance, or report."""
    if task == ADVANCE or task == STOPPING:  # noqa: PLR1714, SIM109 - as numba needs it
        return advanced(w, words, until, task == STOPPING, load, grid)
    if task == READ:
        m = loaded(w)
        load = with_store(load, w)
        if w[16] == 0.0:
            report(out, m, grid.quiet, grid.c, load, acceleration(m.t, grid.outside))
            out[5] = 0.0
            out[6] = 0.0
            out[7] = 0.0
            out[9] = 0.0
            out[13] = 0.0
            out[17] = 0.0
            return DONE
        noise = filtered(w, grid.filter)
        a = acceleration(m.t, grid.outside) + noise
        now = shown(m, load, max(w[17] - m.t, 0.0), a, grid)
        a = acceleration(now.m.t, grid.outside) + noise
        report(out, now.m, grid.quiet, grid.c, now.load, a)
        hit = now.number > 0.0
        out[5] = w[11] + now.number
        out[6] = m.t + now.time if hit else w[12]
        out[7] = now.speed if hit else w[13]
        out[9] = w[10] + now.impulse
        out[13] = w[9] + now.energy
        beta = 0.0 if grid.c.beta is None else grid.c.beta
        out[16] += beta * (w[25] + now.spent.load)
        out[17] = beta * (w[26] + now.spent.lost)
    return DONE
