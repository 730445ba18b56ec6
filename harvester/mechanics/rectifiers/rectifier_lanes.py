"""The kernel of many trajectories with a load circuit of `harvester.mechanics.rectifiers.circuit`.

As in `harvester.mechanics.kernels.lanes`, a block of trajectories side by side.  What happens now and then, an impact
or a switching, is done lane by lane; what happens at every step, the flow through the diodes, in a loop that the
compiler turns into vector instructions.
"""

import numpy as np

from harvester.mechanics.kernels.circuit_control_variates import add_circuit_features
from harvester.mechanics.kernels.compiled import forced, kernel
from harvester.mechanics.kernels.equation_of_motion import friction
from harvester.mechanics.kernels.lanes import LANES, SUMS
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.kernels.shaken_control_variates import shake_and_add
from harvester.mechanics.kernels.shaking import last_acceleration, shaken
from harvester.mechanics.rectifiers.circuit import advance_to_last_event, conducted

IDEAL_SUMS = (*SUMS, "load")


@forced
def _drift(
    x, v, V, U, m, scratch, accelerations, h, t, r, beta, n1, stops, shaker,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
):  # fmt: skip
    """Drift all lanes by the first t of a step h, with the first row of ``accelerations``.

    ``scratch``, shape (4, LANES), gets what impacts did in its last two rows: their number and the energy they took.
    """
    if r is None and stops is None and play is None:
        for i in range(LANES):
            x[i] += t * v[i]
            V[i], U[i] = conducted(V[i], U[i], v[i], t, mu, kappa, n, leak, loss, bridge, doubler)
        return
    for i in range(LANES):
        a, _ = shaken(i, accelerations, shaker)
        x[i], v[i], V[i], U[i], m[i], scratch[0, i], scratch[1, i], _, _, scratch[2, i], scratch[3, i] = (
            advance_to_last_event(
                x[i], v[i], V[i], U[i], m[i], h, t, r, beta, n1, stops, a,
                mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
            )
        )  # fmt: skip
    for i in range(LANES):
        V[i], U[i] = conducted(V[i], U[i], scratch[0, i], scratch[1, i], mu, kappa, n, leak, loss, bridge, doubler)


@kernel
def advance_ideal(
    x, v, V, U, m, s0, s1, sums, readings, stride, coarse, h,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
    r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, shaker, controls=None,
):  # fmt: skip
    """Advance a block by ``readings`` times ``stride`` steps of length h and add up its moments.

    x, v, V, U, m, s0, s1: shape (LANES,), changed in place (state after a kick); sums: shape (len(IDEAL_SUMS), LANES),
    added to.  Noise and shaking are those of `harvester.mechanics.kernels.lanes.advance`.  controls, added to: shape
    (`martingales`, LANES), of `harvester.mechanics.kernels.circuit_control_variates`; None: nothing of it is compiled.
    """
    scratch, mid, filtered = np.zeros((4, LANES)), np.zeros((5, LANES)), np.zeros((2, LANES))
    noise, accelerations, steps = np.zeros((2, LANES)), np.zeros((2, LANES)), 1 if coarse else 2
    for _ in range(readings):
        for k in range(stride):
            if (n1 is not None or n2 is not None) and k % steps == 0:
                draw_noise(noise, s0, s1, coarse)
            shake_and_add(x, v, V, filtered, accelerations, coarse, shaker, controls, mu)
            _drift(
                x, v, V, U, m, scratch, accelerations, h, h, r, beta, n1, stops, shaker,
                mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
            )  # fmt: skip
            if r is not None or stops is not None:
                for i in range(LANES):
                    sums[10, i] += scratch[2, i]
                    sums[11, i] += scratch[3, i]
            for i in range(LANES):
                xi = noise[k % steps, i]
                if controls is not None:
                    add_circuit_features(i, x[i], v[i], V[i], U[i], xi, controls, alpha, beta, n1, n2, n12)
                _, a = shaken(i, accelerations, shaker)
                vi = v[i]
                v[i] = kick_at_stops(
                    x[i], vi, V[i], xi, h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a
                )
                if shaker is not None:
                    sums[12, i] += 0.5 * h * a * (vi + v[i])
        for i in range(LANES):  # an assignment of rows would compile the text of its errors, in 2.6 s
            mid[0, i], mid[1, i], mid[2, i], mid[3, i], mid[4, i] = x[i], v[i], V[i], U[i], m[i]
            accelerations[0, i] = accelerations[1, i]
        _drift(
            mid[0], mid[1], mid[2], mid[3], mid[4], scratch, accelerations, h, 0.5 * h, r, beta, n1, stops, shaker,
            mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
        )  # fmt: skip
        for i in range(LANES):
            xi, Vi, Ui, xm, vm, Vm, Um = x[i], V[i], U[i], mid[0, i], mid[1, i], mid[2, i], mid[3, i]
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
            sums[13, i] += 0.5 * mu * (Ui * Ui + Um * Um)


@kernel
def mid_drift_ideal(
    state, out, h, r, beta, n1, stops, shaker,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
):  # fmt: skip
    """Go from the states of a block after a kick, shape (5, LANES), to x, v, V half a step later: shape (3, LANES)."""
    mid, scratch, accelerations = state.copy(), np.zeros((4, LANES)), np.zeros((2, LANES))
    if shaker is not None:
        for i in range(LANES):
            accelerations[0, i] = last_acceleration(i, shaker)
    x, v, V, U, m = mid[0], mid[1], mid[2], mid[3], mid[4]
    _drift(
        x, v, V, U, m, scratch, accelerations, h, 0.5 * h, r, beta, n1, stops, shaker,
        mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
    )  # fmt: skip
    for i in range(LANES):
        out[0, i], out[1, i], out[2, i] = x[i], v[i], V[i]
