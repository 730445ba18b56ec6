"""The kernel of many trajectories: a batch of them side by side, advanced with the sums of their moments.

The innermost loops run over the trajectories of a batch, so that the compiler turns them into
vector instructions; each trajectory keeps its own state and its own random generator.  With a
resistor a step is one loop.  With a circuit (`harvester.mechanics.kernels.ideal_circuit`) it is
three: the rare events, an impact or a switching, and then the events of every step, the flow
through the diodes, and the kick.

`conductance`, `draw` and `end_draw` depend on the load, and have a version for a resistor
(``circuit`` is None) and one for an `IdealCircuit`, as in `harvester.mechanics.kernels.driver`.
The kernels contain the loops of a resistor themselves: in functions these round otherwise, and are
slower.

Long because the one step of all ensembles is compiled as a whole.
"""

from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats, Words
from harvester.mechanics.kernels.circuit_control_variates import add_circuit_features
from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import forced, kernel, version_of
from harvester.mechanics.kernels.control_variates import add_martingales
from harvester.mechanics.kernels.equation_of_motion import (
    drift_at_stop,
    friction,
    impulse,
    is_damped,
    withheld,
)
from harvester.mechanics.kernels.ideal_circuit import (
    IdealCircuit,
    Store,
    conducted,
    until_last_event,
)
from harvester.mechanics.kernels.intervals import drifts, interval
from harvester.mechanics.kernels.noise import draw_noise, draw_two_noises
from harvester.mechanics.kernels.offset_stops import kick_at_stops, move
from harvester.mechanics.kernels.shaken_control_variates import shake_and_add
from harvester.mechanics.kernels.shaking import last_acceleration, shaken

# rows of the mass: x, x', V, and the voltage of the storage; a circuit's state is below them
MASS_ROWS = 4
BATCH = 64

# Rows of the sums of one trajectory.  A sample has x and V at the kick and in mid-drift: their
# errors of order h^2 have opposite signs.  The last row is of a circuit only.
SUMS = (
    "V",
    "V2_kick",
    "V2_mid",
    "x",
    "x2_kick",
    "x2_mid",
    "v2",
    "xV",
    "vV",
    "fv2",
    "impacts",
    "impact_loss",
    "driven",
)
IDEAL_SUMS = (*SUMS, "load")


class Batch(NamedTuple):
    """The arrays that a kernel changes: states after a kick, words of generators, sums; shapes (BATCH,), (rows, BATCH).

    U and m are the states of a circuit (`Store`); ``controls``, shape (`martingales`, BATCH), are
    those of `harvester.mechanics.kernels.control_variates`.  None: nothing of them is compiled.
    """

    x: Floats
    v: Floats
    V: Floats
    s0: Words
    s1: Words
    sums: Floats | None = None
    controls: Floats | None = None
    U: Floats | None = None
    m: Floats | None = None


class Schedule(NamedTuple):
    """``samples`` times ``stride`` steps.

    A draw of random bits is the noise of two steps, and ``stride`` even; or of one step, after
    ``doublings`` of it.  By ngspice's rule the state is that of a sample in mid-drift, at which
    ngspice has ``landed``, and continues from there.  A circuit's own kernel advances the first
    ``moving`` trajectories of a batch, and no others.
    """

    samples: int
    stride: int
    doublings: int
    landed: bool = False
    moving: int = BATCH


@forced
def _drift_and_add_impacts(i, sums, s, d, c, a):
    """Drift trajectory i to its next state, and add up its impacts."""
    if c.gap is None:  # the squared speed is as good as the energy (`loss_unit`), and costs less
        s1, speed = drift_at_stop(s, d, c, c.r, None, a)
        if c.r is not None:
            sums[10, i] += 1.0 if speed > 0.0 else 0.0
            sums[11, i] += speed * speed
        return s1
    s1, impacts = move(s, d, c, a)
    sums[10, i] += impacts.number
    sums[11, i] += impacts.energy
    return s1


@forced
def _kick_and_add_work(i, sums, s, xi, other, h, c, a):
    """Kick trajectory i, and add up the work of excitation other than white noise: its velocity."""
    v1 = kick_at_stops(s, xi, h, c, a, other)
    if a is not None:
        sums[12, i] += 0.5 * h * a * (s.v + v1)
    return v1


@forced
def _step(i, s, xi, xi2, sums, accelerations, d, c, shaker):
    """Make one step of trajectory i with a resistor, and add up its impacts and its work.

    Returns its state, the velocity just before the kick, and the increment by the noise, over
    sqrt(2 h).
    """
    a, a1 = shaken(i, accelerations, shaker)
    s = _drift_and_add_impacts(i, sums, s, d, c, a)
    v1 = _kick_and_add_work(i, sums, s, xi, other=xi2, h=d.h, c=c, a=a1)
    if c.n1 is None and c.n2 is None:
        return State(s.x, v1, s.V), s.v, 0.0
    return State(s.x, v1, s.V), s.v, impulse(s.x, xi, 0.5, c, xi2)


@forced
def _drift_with_circuit(x, v, V, U, m, did, accelerations, d, c, circuit, shaker):
    """Drift all trajectories under the first row of ``accelerations``.

    ``did``, shape (4, BATCH), gets in its last two rows the number of impacts and the energy that
    they dissipated.
    """
    if c.r is None and c.gap is None and circuit.hysteresis is None:
        for i in range(BATCH):
            x[i] += d.t * v[i]
            V[i], U[i] = conducted(V[i], U[i], v[i], d.t, circuit)
        return
    for i in range(BATCH):
        a, _ = shaken(i, accelerations, shaker)
        s, store, leg, impacts = until_last_event(
            State(x[i], v[i], V[i]), Store(U[i], m[i]), d, c, circuit, a
        )
        x[i] = s.x
        v[i] = s.v
        V[i] = s.V
        U[i] = store.U
        m[i] = store.m
        did[0, i] = leg.v
        did[1, i] = leg.t
        did[2, i] = impacts.number
        did[3, i] = impacts.energy
    for i in range(BATCH):
        V[i], U[i] = conducted(V[i], U[i], did[0, i], did[1, i], circuit)


@forced
def add_sample(i, sums, s, mid, c):
    """Add up the states s at a kick and ``mid`` in the drift after it."""
    sums[0, i] += 0.5 * (s.V + mid.V)
    sums[1, i] += s.V * s.V
    sums[2, i] += mid.V * mid.V
    sums[3, i] += 0.5 * (s.x + mid.x)
    sums[4, i] += s.x * s.x
    sums[5, i] += mid.x * mid.x
    sums[6, i] += mid.v * mid.v
    sums[7, i] += 0.5 * (s.x * s.V + mid.x * mid.V)
    sums[8, i] += mid.v * mid.V
    if is_damped(c):
        sums[9, i] += friction(mid.x, mid.v, c) * mid.v * mid.v
    if c.inertia is not None:
        sums[9, i] += withheld(mid.x, c)


@forced
def _to_mid_drift(b, room, did, accelerations, half, c, circuit, shaker):
    """Fill ``room`` with the states of all trajectories half a step after their kick."""
    for i in range(BATCH):  # an assignment of rows would compile the text of its errors, in 2.6 s
        room[0, i] = b.x[i]
        room[1, i] = b.v[i]
        room[2, i] = b.V[i]
        room[3, i] = b.U[i]
        room[4, i] = b.m[i]
        if shaker is not None:
            accelerations[0, i] = last_acceleration(i, shaker)
    _drift_with_circuit(
        room[0],
        room[1],
        room[2],
        room[3],
        m=room[4],
        did=did,
        accelerations=accelerations,
        d=half,
        c=c,
        circuit=circuit,
        shaker=shaker,
    )


@kernel
def advance(b, schedule, h, circuit, c, shaker, update):
    """Advance a `Batch` by a `Schedule` of steps and add up its moments.

    h is the step, ``update`` how the voltage is carried along
    (`harvester.mechanics.kernels.intervals`), c the coefficients, and ``shaker`` the
    `harvester.mechanics.kernels.shaking.Filter` of the batch, its states changed in place.  If
    there is external and parametric noise, each has a draw with a resistor (`impulse`).
    """
    x = b.x
    v = b.v
    V = b.V
    sums = b.sums
    whole, half = drifts(h, c.mu, update)
    noise = np.zeros((2, BATCH))
    other = np.zeros((2, BATCH))
    kick_sums = np.zeros((2, BATCH))
    accelerations, filtered = np.zeros((2, BATCH)), np.zeros((2, BATCH))
    before = np.zeros((3, BATCH))
    mid = np.zeros((5, BATCH))
    did = np.zeros((4, BATCH))
    landed = schedule.landed
    coarse = schedule.doublings > 0
    steps = 1 if schedule.doublings > 0 else 2
    for _ in range(schedule.samples):
        for first in range(0, schedule.stride, steps):
            draw(
                b,
                noise,
                other,
                before,
                schedule.doublings,
                kick_sums=kick_sums,
                c=c,
                circuit=circuit,
                update=update,
            )
            for k in range(steps):
                shake_and_add(b, filtered, accelerations, coarse, shaker, conductance(c, circuit))
                if update.weight is not None:
                    _step_by_ngspice_rule(
                        b, k, noise, half if landed and first + k == 0 else whole, c
                    )
                elif circuit is None:
                    for i in range(BATCH):
                        (x[i], v[i], V[i]), v_kicked, kicked = _step(
                            i,
                            State(x[i], v[i], V[i]),
                            noise[k, i],
                            other[k, i],
                            sums=sums,
                            accelerations=accelerations,
                            d=whole,
                            c=c,
                            shaker=shaker,
                        )
                        if b.controls is not None:
                            kick_sums[0, i] += v_kicked * kicked
                            kick_sums[1, i] += kicked
                else:
                    _step_with_circuit(
                        b, did, accelerations, noise[k], whole, c=c, circuit=circuit, shaker=shaker
                    )
            end_draw(b, before, kick_sums, c, circuit)
        landed = True
        if circuit is None:
            for i in range(BATCH):
                s = State(x[i], v[i], V[i])
                if update.weight is None:
                    s_mid, _ = move(s, half, c, last_acceleration(i, shaker))
                else:
                    s_mid = _drift_and_add_impacts(i, sums, s, half, c, None)
                    x[i], v[i], V[i] = s_mid
                add_sample(i, sums, s, s_mid, c)
        else:
            _add_samples_with_circuit(
                b, mid, did, accelerations, half, c=c, circuit=circuit, shaker=shaker
            )


@forced
def _step_with_circuit(b, did, accelerations, variates, d, c, circuit, shaker):
    """Make one step of all trajectories with a circuit, on one row of the noise."""
    x = b.x
    v = b.v
    V = b.V
    U = b.U
    _drift_with_circuit(
        x,
        v,
        V,
        U,
        m=b.m,
        did=did,
        accelerations=accelerations,
        d=d,
        c=c,
        circuit=circuit,
        shaker=shaker,
    )
    _add_impacts(b.sums, did, c)
    for i in range(BATCH):
        xi = variates[i]
        if b.controls is not None:
            add_circuit_features(i, State(x[i], v[i], V[i]), U[i], xi, b.controls, c)
        _, a = shaken(i, accelerations, shaker)
        vi = v[i]
        v[i] = _kick_and_add_work(i, b.sums, State(x[i], vi, V[i]), xi, other=None, h=d.h, c=c, a=a)


@forced
def _add_samples_with_circuit(b, mid, did, accelerations, half, c, circuit, shaker):
    """Add up a sample of all trajectories with a circuit, and its load's power."""
    _to_mid_drift(b, mid, did, accelerations, half=half, c=c, circuit=circuit, shaker=shaker)
    for i in range(BATCH):
        s = State(b.x[i], b.v[i], b.V[i])
        s_mid = State(mid[0, i], mid[1, i], mid[2, i])
        stored = b.U[i]
        stored_mid = mid[3, i]
        b.sums[13, i] += 0.5 * circuit.mu * (stored * stored + stored_mid * stored_mid)
        add_sample(i, b.sums, s, s_mid, c)


@forced
def _step_by_ngspice_rule(b, k, noise, d, c):
    """Make one step of all trajectories with a resistor by ngspice's rule, on row k of the noise."""
    x = b.x
    v = b.v
    V = b.V
    for i in range(BATCH):
        s = _drift_and_add_impacts(i, b.sums, State(x[i], v[i], V[i]), d, c, None)
        x[i] = s.x
        v[i] = kick_at_stops(s, noise[k, i], d.h, c)
        V[i] = s.V


@forced
def _add_impacts(sums, did, c):
    """Add up the results of impacts in a drift with a circuit."""
    if c.r is not None or c.gap is not None:
        for i in range(BATCH):
            sums[10, i] += did[2, i]
            sums[11, i] += did[3, i]


def conductance(c, circuit):
    """The conductance of the load; None for an open circuit."""


def draw(b, noise, other, before, doublings, kick_sums, c, circuit, update):
    """Draw the noise of two steps, or of a doubled one, and begin the controls that are of a draw.

    With a resistor there may be a parametric noise next to the external one.
    """


def end_draw(b, before, kick_sums, c, circuit):
    """Add the sums of a draw's kicks to the controls."""


@version_of(conductance, circuit=None)
def _of_resistor(c, circuit):
    return c.mu


@version_of(conductance, circuit=IdealCircuit)
def _of_circuit(c, circuit):
    return circuit.mu


@version_of(draw, circuit=None)
def _draw_for_resistor(b, noise, other, before, doublings, kick_sums, c, circuit, update):
    if c.n1 is not None and c.n2 is not None and update.weight is None:
        draw_two_noises(noise, other, b.s0, b.s1, doublings)
    elif c.n1 is not None or c.n2 is not None:
        draw_noise(noise, b.s0, b.s1, doublings)
    if b.controls is not None:
        for i in range(BATCH):
            before[0, i] = b.x[i]
            before[1, i] = b.v[i]
            before[2, i] = b.V[i]
            kick_sums[0, i] = kick_sums[1, i] = 0.0


@version_of(draw, circuit=IdealCircuit)
def _draw_for_circuit(b, noise, other, before, doublings, kick_sums, c, circuit, update):
    if c.n1 is not None or c.n2 is not None:
        draw_noise(noise, b.s0, b.s1, doublings)


@version_of(end_draw, circuit=None)
def _end_martingales(b, before, kick_sums, c, circuit):
    if b.controls is not None:
        for i in range(BATCH):
            add_martingales(i, before, kick_sums, b.controls, c)


@version_of(end_draw, circuit=IdealCircuit)
def _end_features(b, before, kick_sums, c, circuit):
    return None


@kernel
def mid_drift(b, out, h, c, circuit=None, shaker=None):
    """Go from the states after a kick to x, v and V half a step later, shape (3, BATCH)."""
    half = interval(h, 0.5 * h, c.mu)
    if circuit is None:
        for i in range(BATCH):
            s = State(b.x[i], b.v[i], b.V[i])
            (out[0, i], out[1, i], out[2, i]), _ = move(s, half, c, last_acceleration(i, shaker))
    else:
        room = np.zeros((5, BATCH))
        did = np.zeros((4, BATCH))
        accelerations = np.zeros((2, BATCH))
        _to_mid_drift(b, room, did, accelerations, half=half, c=c, circuit=circuit, shaker=shaker)
        for i in range(BATCH):
            out[0, i] = room[0, i]
            out[1, i] = room[1, i]
            out[2, i] = room[2, i]
