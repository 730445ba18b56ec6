"""The acceleration of one trajectory under excitation that is not a white noise, kick by kick.

The filters are those of `harvester.mechanics.kernels.shaking`, whose trajectories run side by side.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import invalid
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.shaking import drawn_record, filter_of, filter_start


@kernel
def _filter_path(xi, p, q, f, out):
    """Fill ``out``, shape (3, n), as `filtered` does, from variates of shape (2, n)."""
    for k in range(out.shape[1]):
        out[0, k] = p
        out[1, k] = q
        out[2, k] = f.l11 * xi[0, k]
        p1 = f.a11 * p + f.l11 * xi[0, k]
        q1 = 0.0
        if f.a12 is not None:
            p1 += f.a12 * q
            q1 = f.a21 * p + f.a22 * q + f.l21 * xi[0, k] + f.l22 * xi[1, k]
        p, q = p1, q1


def filtered(eqs: Equations, h: float, steps: int, rng: np.random.Generator) -> Floats:
    """States (p, q) of the filter of coloured noise at the times 0, h, ..., steps h, and the new part of p's next step.

    Shape (3, steps + 1); the first row is the `forcing` of the same ``rng``, but for a sinusoid
    with it.
    """
    return _filtered(filter_start(eqs, h, 1, rng)[:2, 0], eqs, h, steps, rng)


def _filtered(
    start: Floats, eqs: Equations, h: float, steps: int, rng: np.random.Generator
) -> Floats:
    """`filtered` from a first state (p, q)."""
    out = np.empty((3, steps + 1))
    p, q = start
    # a longer path begins as a shorter one
    xi = np.ascontiguousarray(rng.standard_normal((steps + 1, 2)).T)
    _filter_path(xi, p, q, filter_of(eqs, h), out)
    return out


def coarse_forcing(
    eqs: Equations, h: float, steps: int, rng: np.random.Generator | None = None
) -> Floats | None:
    """The `forcing` at steps of h of the one in steps of h/2: for the coarse member of a Richardson pair."""
    gain = 1.0 if eqs.coloured is None else filter_of(eqs, h, coarse=True).gain or 1.0
    fine = forcing(eqs, 0.5 * h, 2 * steps, rng, gain)
    return None if fine is None else np.ascontiguousarray(fine[::2])


def forcing(
    eqs: Equations, h: float, steps: int, rng: np.random.Generator | None = None, gain: float = 1.0
) -> Floats | None:
    """Accelerations other than white noise at the times 0, h, ..., steps h, shape (steps + 1,).

    None if there are none.

    ``rng`` draws the phase, the place in the record, or the noise; without it both are the first.
    Coloured noise is multiplied by ``gain``.

    Raises InputError for random excitation without a generator.
    """
    if eqs.coloured is not None or eqs.density is not None:
        if rng is None:
            raise invalid("forcing", "be given if coloured noise shakes the mass", None)
        if eqs.density is not None:
            return drawn_record(eqs, h, rng).at(h * np.arange(steps + 1, dtype=np.float64), h)
        start = filter_start(eqs, h, 1, rng)[:, 0]
        noise = np.asarray(gain * _filtered(start[:2], eqs, h, steps, rng)[0])
        return (
            noise
            if eqs.drive is None
            else noise + _sinusoid(eqs, h, steps, math.atan2(start[3], start[2]))
        )
    if eqs.drive is not None:
        return _sinusoid(eqs, h, steps, 0.0 if rng is None else rng.uniform(0.0, 2.0 * math.pi))
    if eqs.record is not None:
        begin = 0.0 if rng is None else rng.uniform(0.0, eqs.record.period)
        return eqs.record.at(begin + h * np.arange(steps + 1, dtype=np.float64), h)
    return None


def _sinusoid(eqs: Equations, h: float, steps: int, phase: float) -> Floats:
    """The accelerations of the excitation, which begins with a phase."""
    assert eqs.drive is not None and eqs.drive_frequency is not None
    return np.asarray(eqs.drive * np.cos(eqs.drive_frequency * h * np.arange(steps + 1) + phase))
