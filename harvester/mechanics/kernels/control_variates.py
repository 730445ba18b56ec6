"""Functions of a path's own states from which sums of mean exactly zero are made: controls of every mean.

With the generator L of the motion and any phi(x, x', V), Ito's formula gives over a time T

    phi(end) - phi(begin) = integral of L phi dt + integral of sqrt(2 N) dphi/dv dW

so that with L phi = E[f] - f the error of f's time average is spanned by sums of two kinds, both
of mean zero:

    martingale   sum over kicks of g sqrt(N) xi, with g of the states before the noise xi   (`add_martingales`)
    boundary     h(end) - h(begin) of a stationary path                                     (`boundary`)

The former have mean zero at every step, with impacts and every spring, for xi is independent of
the past. (Assaraf and Caffarel, Phys. Rev. Lett. 83, 4682, 1999; Henderson and Glynn, Math.
Oper. Res. 27, 253, 2002.)
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import forced

MARTINGALES = 9


@forced
def energy(x, v, c):
    """Energy v^2/2 + linear x^2/2 + alpha2 x^3/3 + alpha x^4/4, of the terms present.

    Linear None is 1.
    """
    double = x * x
    if c.linear is not None:
        double *= c.linear
    if c.alpha2 is not None:
        double += (2.0 / 3.0) * c.alpha2 * x * x * x
    if c.alpha is not None:
        double += 0.5 * c.alpha * x * x * x * x
    if c.softening is not None:
        double -= (2.0 / 3.0) * c.softening * x * x * abs(x)
    return 0.5 * (v * v + double)


@forced
def add_martingales(i, before, sums, controls, c):
    """Add the noise of two steps of lane i to its martingales.

    Rows of V stay zero if it has no load.

    before: states x, v, V ahead of both, shape (3, BATCH).  sums: over both of v sqrt(N) xi, with
    the v just before each kick, and of sqrt(N) xi, shape (2, BATCH).  g is v {1, sqrt E, E, E^2, x,
    V} and {x, sqrt E, V}: a kick's own v, because the stop reverses it, and the factors that vary
    less but once for both.
    """
    x = before[0, i]
    V = before[2, i]
    p = sums[0, i]
    q = sums[1, i]
    E = energy(x, before[1, i], c)
    root = math.sqrt(abs(E))
    controls[0 * BATCH + i] += p
    controls[1 * BATCH + i] += p * root
    controls[2 * BATCH + i] += p * E
    controls[3 * BATCH + i] += p * E * E
    controls[4 * BATCH + i] += p * x
    controls[5 * BATCH + i] += q * x
    controls[6 * BATCH + i] += q * root
    if c.mu is not None:
        controls[7 * BATCH + i] += p * V
        controls[8 * BATCH + i] += q * V


# On arrays the uncompiled function does the same.
_energy = energy.py_func  # type: ignore[attr-defined]


def boundary(states: Floats, eqs: Equations) -> Floats:
    """The functions h of states, shape (3, n) or longer: E, sqrt E, E^2 and x v, shape (4, n)."""
    x, v = states[:2]
    of_state = _energy(x, v, eqs)
    return np.array([of_state, np.sqrt(np.abs(of_state)), of_state**2, x * v])
