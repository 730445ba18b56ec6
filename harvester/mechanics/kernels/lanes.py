"""The kernel of many trajectories: a block of them side by side, advanced with the sums of their moments.

The innermost loop runs over the lanes of a block, so that the compiler turns it into vector
instructions; each lane keeps its own state and its own random generator.
"""

import numpy as np

from harvester.mechanics.kernels.compiled import forced, kernel
from harvester.mechanics.kernels.control_variates import add_features
from harvester.mechanics.kernels.equation_of_motion import drift_at_stop, friction, impulse, relaxation
from harvester.mechanics.kernels.noise import draw_noise, draw_two_noises
from harvester.mechanics.kernels.offset_stops import kick_at_stops, move
from harvester.mechanics.kernels.shaken_control_variates import shake_and_add
from harvester.mechanics.kernels.shaking import last_acceleration, shaken

LANES = 64

# Rows of the sums of one lane.  At a reading, x and V are taken at the kick and in mid-drift:
# their errors of order h^2 have opposite signs.
SUMS = ("V", "V2_kick", "V2_mid", "x", "x2_kick", "x2_mid", "v2", "xV", "vV", "fv2", "impacts", "impact_loss", "driven")


@forced
def _step(
    i, x, v, V, xi, other, sums, accelerations,
    h, e, g, line, mu, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, shaker,
):  # fmt: skip
    """Make one step of lane i, and add up its impacts, and the work of shaking other than white noise.

    Returns its x, v and V, the v just before the kick, and what the noise added to it, over sqrt(2 h).
    """
    a, a1 = shaken(i, accelerations, shaker)
    if stops is None:  # the squared speed is as good as the energy (`loss_unit`), and costs less
        x, v, V, speed = drift_at_stop(x, v, V, h, h, e, g, mu, r, beta, n1, None, a, line)
        if r is not None:
            sums[10, i] += 1.0 if speed > 0.0 else 0.0
            sums[11, i] += speed * speed
    else:
        (x, v, V), (_, _, impacts, lost) = move(x, v, V, h, h, e, g, mu, r, beta, n1, stops, a, line)
        sums[10, i] += impacts
        sums[11, i] += lost
    v1 = kick_at_stops(x, v, V, xi, h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a1, other)
    if shaker is not None:
        sums[12, i] += 0.5 * h * a1 * (v + v1)
    if n1 is None and n2 is None:
        return x, v1, V, v, 0.0
    return x, v1, V, v, impulse(x, xi, 0.5, n1, n2, n12, other)


@kernel
def advance(
    x, v, V, s0, s1, sums, readings, stride, coarse,
    h, mu, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, shaker,
    controls=None, line=None, line_half=None,
):  # fmt: skip
    """Advance a block by ``readings`` times ``stride`` steps of length h and add up its moments.

    x, v, V, s0, s1: shape (LANES,), state and generator, changed in place (state after a kick).
    sums: shape (len(SUMS), LANES), added to.  Coefficients that are None are absent effects.
    shaker: as of `shaken`, its states changed in place.  controls: shape (`martingales`, LANES), added to
    (`harvester.mechanics.kernels.control_variates`); None: nothing of it is compiled.
    line, line_half: as `harvester.mechanics.kernels.impact_voltage.lines` gives them.

    A draw of random bits is the noise of two steps, and ``stride`` even; or of one step that is ``coarse``.  Where
    there is noise of the force and of the stiffness, each has a draw (`impulse`).
    """
    e, g = relaxation(h, mu)
    e_half, g_half = relaxation(0.5 * h, mu)
    other = np.zeros((2, LANES))
    noise, kicks, accelerations = np.zeros((2, LANES)), np.zeros((2, LANES)), np.zeros((2, LANES))
    before, filtered = np.zeros((3, LANES)), np.zeros((2, LANES))
    steps = 1 if coarse else 2
    for _ in range(readings):
        for _ in range(stride // steps):
            if n1 is not None and n2 is not None:
                draw_two_noises(noise, other, s0, s1, coarse)
            elif n1 is not None or n2 is not None:
                draw_noise(noise, s0, s1, coarse)
            if controls is not None:
                for i in range(LANES):  # an assignment of rows would compile the text of its errors, in 2.6 s
                    before[0, i], before[1, i], before[2, i] = x[i], v[i], V[i]
                    kicks[0, i] = kicks[1, i] = 0.0
            for k in range(steps):
                shake_and_add(x, v, V, filtered, accelerations, coarse, shaker, controls, mu)
                for i in range(LANES):
                    x[i], v[i], V[i], v_kicked, kicked = _step(
                        i, x[i], v[i], V[i], noise[k, i], other[k, i], sums, accelerations,
                        h, e, g, line, mu, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, shaker,
                    )  # fmt: skip
                    if controls is not None:
                        kicks[0, i] += v_kicked * kicked
                        kicks[1, i] += kicked
            if controls is not None:
                for i in range(LANES):
                    add_features(i, before, kicks, controls, mu, alpha, linear, alpha2)
        for i in range(LANES):
            xi, vi, Vi = x[i], v[i], V[i]
            (xm, vm, Vm), _ = move(
                xi, vi, Vi, h, 0.5 * h, e_half, g_half, mu, r, beta, n1, stops, last_acceleration(i, shaker), line_half
            )
            sums[0, i] += 0.5 * (Vi + Vm)
            sums[1, i] += Vi * Vi
            sums[2, i] += Vm * Vm
            sums[3, i] += 0.5 * (xi + xm)
            sums[4, i] += xi * xi
            sums[5, i] += xm * xm
            sums[6, i] += vm * vm
            sums[7, i] += 0.5 * (xi * Vi + xm * Vm)
            sums[8, i] += vm * Vm
            if c1 is not None or c2 is not None or c3 is not None:
                sums[9, i] += friction(xm, c1, c2, c3) * vm * vm


@kernel
def mid_drift(state, out, h, mu, r, beta, n1, stops, shaker):
    """Go from the states after a kick to those half a step later, shapes (3, LANES)."""
    e, g = relaxation(0.5 * h, mu)
    for i in range(LANES):
        x, v, V = state[0, i], state[1, i], state[2, i]
        (out[0, i], out[1, i], out[2, i]), _ = move(
            x, v, V, h, 0.5 * h, e, g, mu, r, beta, n1, stops, last_acceleration(i, shaker)
        )
