"""The kernel of many trajectories: a batch of them side by side, with the sums of their moments.

It is one for each mechanics with each load (`harvester.mechanics.kernels.driver`).  The innermost
loops run over the trajectories of a batch, so that the compiler turns them into vector
instructions; each trajectory keeps its own state and its own random generator.
"""

from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats, Words
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import forced, kernel
from harvester.mechanics.kernels.driver import (
    add_load_sample,
    add_sample,
    add_to_controls,
    beside,
    conductance,
    coordinates,
    draw,
    drift_all,
    drift_all_aside,
    drifted,
    end_draw,
    energy_of,
    is_given_up,
    kicked,
    load_aside,
    load_at,
    moving,
    oscillator,
    other_variate,
    put,
    put_load,
    read,
    speed,
    state_at,
)
from harvester.mechanics.kernels.intervals import drifts, interval
from harvester.mechanics.kernels.shaken_control_variates import shake_and_add
from harvester.mechanics.kernels.shaking import last_acceleration, shaken

# rows of the mass: x, x', V, and the voltage of the storage; a circuit's state is below them
MASS_ROWS = 4
IDEAL = 2  # rows of an ideal circuit: U and m

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
    """The arrays that a kernel changes: states after a kick, words of generators, sums.

    Shapes (rows, BATCH), (BATCH,).

    The rows of ``state`` are y, v and V, and U and m of an ideal circuit, or U of another.
    ``controls``, shape (`martingales`, BATCH), are those of
    `harvester.mechanics.kernels.control_variates`.  None: nothing of them is compiled.
    """

    state: Floats
    s0: Words
    s1: Words
    sums: Floats | None = None
    controls: Floats | None = None


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
def flat(rows):
    """Rows of trajectories, shape (rows, BATCH), as one of shape (rows x BATCH,); None of None.

    The compiler knows the distance of its rows, and compares places of two arrays but once.
    """
    if rows is None:
        return None
    return rows.reshape(-1)


@kernel
def advance(b, schedule, h, load, c, shaker, update):
    """Advance a `Batch` by a `Schedule` of steps and add up its moments: whether it ended early.

    h is the step, ``update`` how the voltage is carried along
    (`harvester.mechanics.kernels.intervals`), c the coefficients, ``load`` None for their own
    resistor, and ``shaker`` the `harvester.mechanics.kernels.shaking.Filter` of the batch, its
    states changed in place.  If there is external and parametric noise, each has a draw with a
    resistor (`harvester.mechanics.kernels.equation_of_motion.impulse`).
    """
    whole, half = drifts(h, oscillator(c).mu, update)
    n = coordinates(c)
    z = b.state.reshape(-1)
    sums = flat(b.sums)
    controls = flat(b.controls)
    mid = flat(np.zeros((2 * n + 1 + IDEAL, BATCH)))
    noise = np.zeros((2, BATCH))
    other = np.zeros((2, BATCH))
    accelerations = np.zeros((2, BATCH))
    filtered = np.zeros((2, BATCH))
    driven = np.zeros((4, BATCH))
    before = np.zeros((3, BATCH))
    kick_sums = np.zeros((2, BATCH))
    coarse = schedule.doublings > 0
    steps = 1 if coarse else 2
    landed = schedule.landed
    count = moving(schedule, load)
    ahead = schedule.samples * schedule.stride * count
    for _ in range(schedule.samples):
        for first in range(0, schedule.stride, steps):
            draw(
                b,
                z,
                noise,
                other,
                before,
                kick_sums,
                doublings=schedule.doublings,
                c=c,
                load=load,
                update=update,
            )
            for k in range(steps):
                d = whole
                if update.weight is not None and landed and first + k == 0:
                    d = half
                shake_and_add(
                    z,
                    n,
                    controls,
                    filtered,
                    accelerations,
                    coarse,
                    shaker=shaker,
                    mu=conductance(c, load),
                )
                drift_all(z, driven, accelerations, d, c, load, shaker=shaker)
                for i in range(count):
                    a, a1 = shaken(i, accelerations, shaker)
                    s, changed, did = drifted(
                        state_at(i, z, c), z, d, c, a, load_at(i, z, c, load, driven)
                    )
                    put_load(i, z, sums, changed, c, load)
                    xi = noise[k, i]
                    xi2 = other_variate(k, i, other, c, load, update)
                    if b.controls is not None:
                        add_to_controls(
                            i, z, s, xi, xi2, kick_sums, controls=controls, c=c, load=load
                        )
                    v = speed(s, z, c)
                    after = kicked(s, z, xi, h, c, a1, other=xi2)
                    put(i, z, after, c)
                    # sums come last: z would be read again after each
                    sums[10 * BATCH + i] += did.number
                    sums[11 * BATCH + i] += energy_of(did, c, load)
                    if shaker is not None:
                        sums[12 * BATCH + i] += 0.5 * h * a1 * (v + speed(after, z, c))
                ahead -= count
                if is_given_up(sums, load, ahead):
                    return True
            end_draw(controls, before, kick_sums, c, load)
        landed = True
        drift_all_aside(z, mid, driven, accelerations, half, c, load=load, shaker=shaker)
        for i in range(count):
            a = last_acceleration(i, shaker)
            s = state_at(i, z, c)
            s_mid, load_mid, did = drifted(
                beside(s, z, mid, c), mid, half, c, a, load_aside(i, z, mid, c, load)
            )
            add_sample(i, sums, s, z, s_mid, mid, c=c)
            add_load_sample(i, sums, z, load_mid, c, load)
            if update.weight is not None:  # ngspice lands there, and goes on
                sums[10 * BATCH + i] += did.number
                sums[11 * BATCH + i] += energy_of(did, c, load)
                put(i, z, s_mid, c)
    return False


@kernel
def mid_drift(b, out, h, c, load=None, shaker=None):
    """Go from the states after a kick to x, x' and V half a step later, shape (3, BATCH)."""
    half = interval(h, 0.5 * h, oscillator(c).mu)
    z = b.state.reshape(-1)
    mid = flat(np.zeros((2 * coordinates(c) + 1 + IDEAL, BATCH)))
    driven = np.zeros((4, BATCH))
    accelerations = np.zeros((2, BATCH))
    drift_all_aside(z, mid, driven, accelerations, half, c, load=load, shaker=shaker)
    for i in range(BATCH):
        a = last_acceleration(i, shaker)
        s = beside(state_at(i, z, c), z, mid, c)
        s_mid, _, _ = drifted(s, mid, half, c, a, load_aside(i, z, mid, c, load))
        out[0, i], out[1, i], out[2, i] = read(s_mid, mid, c)
