"""The kernel of many trajectories with a load circuit of `harvester.mechanics.rectifiers.circuit`.

As in `harvester.mechanics.kernels.lanes`, a block of trajectories side by side.  What happens now and then, an impact
or a switching, is done lane by lane; what happens at every step, the flow through the diodes, in a loop that the
compiler turns into vector instructions.
"""

import numpy as np

from harvester.mechanics.kernels.circuit_features import add_circuit_features
from harvester.mechanics.kernels.compiled import inlined, kernel
from harvester.mechanics.kernels.equation_of_motion import friction, kick
from harvester.mechanics.kernels.lanes import LANES, SUMS
from harvester.mechanics.kernels.noise import draw_noise
from harvester.mechanics.rectifiers.circuit import conducted, until_free

IDEAL_SUMS = (*SUMS, "load")


@inlined
def _drift(x, v, V, U, m, left, hit, h, r, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece):
    """Drift all lanes by h; ``left`` is scratch, ``hit`` gets the speeds of impacts."""
    if r is None and play is None:
        for i in range(LANES):
            x[i] += h * v[i]
            V[i], U[i] = conducted(V[i], U[i], v[i], h, mu, kappa, n, leak, loss, bridge, doubler)
        return
    for i in range(LANES):
        x[i], v[i], V[i], U[i], m[i], left[i], hit[i] = until_free(
            x[i], v[i], V[i], U[i], m[i], h, r, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece
        )
    for i in range(LANES):
        V[i], U[i] = conducted(V[i], U[i], v[i], left[i], mu, kappa, n, leak, loss, bridge, doubler)


@kernel
def advance_ideal(
    x, v, V, U, m, s0, s1, sums, readings, stride, coarse, h,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
    r, alpha, beta, c1, c2, c3, n1, n2, n12, controls=None,
):  # fmt: skip
    """Advance a block by ``readings`` times ``stride`` steps of length h and add up its moments.

    x, v, V, U, m, s0, s1: shape (LANES,), changed in place (state after a kick); sums: shape (len(IDEAL_SUMS), LANES),
    added to.  The noise is that of `harvester.mechanics.kernels.lanes.advance`.  controls: shape (9, LANES), added to
    (`harvester.mechanics.kernels.circuit_features`); None: nothing of it is compiled.
    """
    left, hit, mid = np.zeros(LANES), np.zeros(LANES), np.zeros((5, LANES))
    noise, steps = np.zeros((2, LANES)), 1 if coarse else 2
    for _ in range(readings):
        for k in range(stride):
            _drift(
                x, v, V, U, m, left, hit, h, r, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece
            )
            if r is not None:
                for i in range(LANES):
                    sums[10, i] += 1.0 if hit[i] > 0.0 else 0.0
                    sums[11, i] += hit[i] * hit[i]
            if k % steps == 0:
                draw_noise(noise, s0, s1, coarse)
            for i in range(LANES):
                xi = noise[k % steps, i]
                if controls is not None:
                    add_circuit_features(i, x[i], v[i], V[i], U[i], xi, controls, alpha, beta, n1, n2, n12)
                v[i] = kick(x[i], v[i], V[i], xi, h, alpha, beta, c1, c2, c3, n1, n2, n12)
        mid[0], mid[1], mid[2], mid[3], mid[4] = x, v, V, U, m
        _drift(
            mid[0], mid[1], mid[2], mid[3], mid[4], left, hit, 0.5 * h, r,
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
def mid_drift_ideal(state, out, h, r, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece):
    """Go from states after a kick, shape (blocks, 5, LANES), to x, v, V half a step later: shape (3, blocks LANES)."""
    left, hit = np.zeros(LANES), np.zeros(LANES)
    for k in range(len(state)):
        mid = state[k].copy()
        x, v, V, U, m = mid[0], mid[1], mid[2], mid[3], mid[4]
        _drift(
            x, v, V, U, m, left, hit, 0.5 * h, r,
            mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
        )  # fmt: skip
        for i in range(LANES):
            out[0, k * LANES + i], out[1, k * LANES + i], out[2, k * LANES + i] = x[i], v[i], V[i]
