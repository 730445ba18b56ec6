"""The kernel of the ensemble: a block of trajectories side by side, advanced with their sums.

The innermost loop runs over the lanes of a block, so that the compiler turns it into vector
instructions; each lane keeps its own state and its own random generator.
"""

from harvester.mechanics.compiled import kernel
from harvester.mechanics.noise import shuffle, two_variates
from harvester.mechanics.step import drift, friction, kick, relaxation

LANES = 64

# Rows of the sums of one lane.  At a reading, x and V are taken at the kick and in mid-drift:
# their errors of order h^2 have opposite signs.
SUMS = ("V", "V2_kick", "V2_mid", "x", "x2_kick", "x2_mid", "v2", "xV", "vV", "fv2", "impacts", "impact_v2")


@kernel
def advance(x, v, V, s0, s1, sums, readings, pairs, h, mu, r, alpha, beta, c1, c2, c3, n1, n2, n12):
    """Advance a block by ``readings`` times ``2 * pairs`` steps of length h and add up its moments.

    x, v, V, s0, s1: shape (LANES,), state and generator, changed in place (state after a kick).
    sums: shape (len(SUMS), LANES), added to.  Coefficients that are None are absent effects.
    """
    e, g = relaxation(h, mu)
    e_half, g_half = relaxation(0.5 * h, mu)
    for _ in range(readings):
        for _ in range(pairs):
            for i in range(LANES):
                xi1 = xi2 = 0.0
                if n1 is not None or n2 is not None:
                    bits, s0[i], s1[i] = shuffle(s0[i], s1[i])
                    xi1, xi2 = two_variates(bits)
                xi, vi, Vi, hit = drift(x[i], v[i], V[i], h, e, g, mu, r)
                vi = kick(xi, vi, Vi, xi1, h, alpha, beta, c1, c2, c3, n1, n2, n12)
                if r is not None:
                    sums[10, i] += 1.0 if hit > 0.0 else 0.0
                    sums[11, i] += hit * hit
                xi, vi, Vi, hit = drift(xi, vi, Vi, h, e, g, mu, r)
                vi = kick(xi, vi, Vi, xi2, h, alpha, beta, c1, c2, c3, n1, n2, n12)
                if r is not None:
                    sums[10, i] += 1.0 if hit > 0.0 else 0.0
                    sums[11, i] += hit * hit
                x[i], v[i], V[i] = xi, vi, Vi
        for i in range(LANES):
            xm, vm, Vm, _hit = drift(x[i], v[i], V[i], 0.5 * h, e_half, g_half, mu, r)
            sums[0, i] += 0.5 * (V[i] + Vm)
            sums[1, i] += V[i] * V[i]
            sums[2, i] += Vm * Vm
            sums[3, i] += 0.5 * (x[i] + xm)
            sums[4, i] += x[i] * x[i]
            sums[5, i] += xm * xm
            sums[6, i] += vm * vm
            sums[7, i] += 0.5 * (x[i] * V[i] + xm * Vm)
            sums[8, i] += vm * Vm
            sums[9, i] += friction(xm, c1, c2, c3) * vm * vm
