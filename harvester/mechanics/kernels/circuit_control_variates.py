"""Controls as of `harvester.mechanics.kernels.control_variates`, of a device with any load circuit and its states.

With the voltage V of the piezo and U of the load's smoothing capacitor (0 without one), E the
energy of the mass and W = |E| + beta V^2/2,

    martingale   g = v, v U, v sqrt W, V, v U^2, V sqrt W, v x, x sqrt W, v V
    boundary     h = U^2 sqrt W, U, W, U^2, sqrt W, |V| U, x v, x V, V^2

in the order of their worth, as measured on a bridge with and without a stop and on a parallel SSHI:
a fit to few entries uses the first.
"""

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.control_variates import energy
from harvester.mechanics.kernels.equation_of_motion import intensity
from harvester.mechanics.kernels.shaken_control_variates import shaken_path_controls


@forced
def all_energy(x, v, V, c):
    """W of mass and piezo."""
    W = abs(energy(x, v, c))
    if c.beta is not None:
        W += 0.5 * c.beta * V * V
    return W


@forced
def add_circuit_features(i, s, U, xi, controls, c):
    """Add the noise xi of a kick of trajectory i, with the states before it, to its martingales, shape (9, BATCH)."""
    x, v, V = s
    root = np.sqrt(all_energy(x, v, V, c))
    if c.n2 is not None or c.n12 is not None:
        xi *= np.sqrt(intensity(x, c))
    add_weighted_noise(i, x, v, V, U=U, root=root, xi=xi, controls=controls)


@forced
def add_weighted_noise(i, x, v, V, U, root, xi, controls):
    """Add a noise that acts on the speed v, times each of the weights g, ``root`` being sqrt W."""
    controls[0 * BATCH + i] += v * xi
    controls[1 * BATCH + i] += v * U * xi
    controls[2 * BATCH + i] += v * root * xi
    controls[3 * BATCH + i] += V * xi
    controls[4 * BATCH + i] += v * U * U * xi
    controls[5 * BATCH + i] += V * root * xi
    controls[6 * BATCH + i] += v * x * xi
    controls[7 * BATCH + i] += x * root * xi
    controls[8 * BATCH + i] += v * V * xi


# On arrays the uncompiled functions do the same.
_intensity, _energy = intensity.py_func, energy.py_func  # type: ignore[attr-defined]


def _all_energy(x: Floats, v: Floats, V: Floats, eqs: Equations) -> Floats:
    beta = 0.0 if eqs.beta is None else eqs.beta
    return np.asarray(np.abs(_energy(x, v, eqs)) + 0.5 * beta * V * V)


def circuit_boundary(states: Floats, eqs: Equations) -> Floats:
    """The functions h of states (x, v, V, U), shape (4, ...) or longer: shape (9, ...)."""
    x, v, V, U = states[:4]
    return boundary_functions(x, v, V, U, _all_energy(x, v, V, eqs))


def boundary_functions(x: Floats, v: Floats, V: Floats, U: Floats, W: Floats) -> Floats:
    """The functions h of arrays of one shape: shape (9, ...)."""
    root = np.sqrt(W)
    return np.array([U * U * root, U, W, U * U, root, np.abs(V) * U, x * v, x * V, V * V])


def path_controls(
    eqs: Equations, states: Floats, noise: Floats, length: float, filtered: Floats | None = None
) -> Floats:
    """Both kinds of sums of consecutive blocks of a recorded path, over their ``length``: shape (blocks, 18 or 26).

    ``states``, shape (4, blocks, n + 1), are (x, v, V, U) before each kick of a block, and before
    the one after it; ``noise``, shape (blocks, n), the variates of its kicks; ``filtered`` as of
    `shaken_path_controls`.
    """
    x, v, V, U = states[:, :, :-1]
    root = np.sqrt(_all_energy(x, v, V, eqs))
    if eqs.n2 is not None or eqs.n12 is not None:
        noise = noise * np.sqrt(_intensity(x, eqs))
    weights = (v, v * U, v * root, V, v * U * U, V * root, v * x, x * root, v * V)
    martingales = np.array([(weight * noise).sum(axis=1) for weight in weights])
    change = circuit_boundary(states[:, :, -1], eqs) - circuit_boundary(states[:, :, 0], eqs)
    if filtered is not None:
        martingales = np.vstack([martingales, shaken_path_controls(states[:, :, :-1], filtered)])
    return interleaved(martingales, change).T / length


def interleaved(martingales: Floats, change: Floats) -> Floats:
    """Columns of both kinds in turn, in the order of their worth: shape (18, n) of two of (9, n).

    Further ones last.
    """
    both = len(change)
    in_turn = np.stack([martingales[:both], change], axis=1).reshape(2 * both, -1)
    return np.vstack([in_turn, martingales[both:]])
