"""Controls as of `harvester.mechanics.kernels.control_variates`, of coloured noise, whose filter has its own noise.

The new part in a step of the filter's p, which nothing before foretells, makes martingales as the
kicks of white noise do: sums of g times that, of mean zero at every step, with

    g = x, v, V, A, A cos 2 theta, A sin 2 theta, p, q   of x = A cos theta, v = A sin theta, the filter's (p, q)

all before the step: a force that lasts turns along with the motion, and past a stop twice as often.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.control_variates import MARTINGALES
from harvester.mechanics.kernels.shaking import shake

SHAKEN = 8


def martingales(coloured: bool) -> int:
    """How many rows of martingales there are where noise is new from step to step: those of white noise come first."""
    return MARTINGALES + SHAKEN if coloured else MARTINGALES


@forced
def shake_and_add(z, n, controls, states, accelerations, coarse, shaker, mu):
    """Shake a batch as `shake` does, and add the new part in the filter to its controls, if both are there.

    z are the states of n coordinates (`harvester.mechanics.kernels.driver`), and ``states`` is room
    of shape (2, BATCH); ``mu`` None: without a load, whose voltage counts.
    """
    if shaker is None:
        return
    if controls is None or shaker.l11 is None:
        shake(accelerations, coarse, shaker)
    else:
        for i in range(
            BATCH
        ):  # an assignment of rows would compile the text of its errors, in 2.6 s
            states[0, i], states[1, i] = shaker.p[i], shaker.q[i]
        shake(accelerations, coarse, shaker)
        for i in range(BATCH):
            p, q = states[0, i], states[1, i]
            _add(
                i,
                z[i],
                z[n * BATCH + i],
                z[2 * n * BATCH + i],
                p=p,
                q=q,
                new=shaker.p[i] - _foreseen(p, q, coarse, shaker),
                controls=controls,
                mu=mu,
            )


@forced
def _foreseen(p, q, coarse, f):
    """The value of p but for noise, after one step of the filter or two ``coarse`` ones."""
    if f.a12 is None:
        return f.a11 * f.a11 * p if coarse else f.a11 * p
    once = f.a11 * p + f.a12 * q
    return f.a11 * once + f.a12 * (f.a21 * p + f.a22 * q) if coarse else once


@forced
def _add(i, x, v, V, p, q, new, controls, mu):
    size = math.sqrt(x * x + v * v) + 1e-300
    controls[MARTINGALES * BATCH + i] += x * new
    controls[(MARTINGALES + 1) * BATCH + i] += v * new
    if mu is not None:
        controls[(MARTINGALES + 2) * BATCH + i] += V * new
    controls[(MARTINGALES + 3) * BATCH + i] += size * new
    controls[(MARTINGALES + 4) * BATCH + i] += (x * x - v * v) / size * new
    controls[(MARTINGALES + 5) * BATCH + i] += 2.0 * x * v / size * new
    controls[(MARTINGALES + 6) * BATCH + i] += p * new
    controls[(MARTINGALES + 7) * BATCH + i] += q * new


def shaken_path_controls(states: Floats, filtered: Floats) -> Floats:
    """The same sums of consecutive blocks of a recorded path, shape (8, blocks).

    ``states``, shape (4, blocks, n), are (x, v, V, ...) before each step, ``filtered``, shape (3,
    blocks, n), the filter's (p, q) there and the new part of its next step
    (`harvester.mechanics.kernels.forcing.filtered`).
    """
    x, v, V = states[:3]
    p, q, new = filtered
    size = np.hypot(x, v) + 1e-300
    weights = (x, v, V, size, (x * x - v * v) / size, 2.0 * x * v / size, p, q)
    return np.array([(weight * new).sum(axis=1) for weight in weights])
