"""The equations near rest, linearised: their load as damping and stiffness, their matrix, their modes.

x'' - c1 x' + x + beta V = x sqrt(2 N2) dW/dt,   x'+ = -r x'- at x = 0,   V' + mu V = x'
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations

Override = Floats | float | None  # an argument in place of the equations' own; None: theirs


def with_overrides(
    eqs: Equations, mu: Override, n2: Override, r: Override
) -> tuple[Floats, Floats, Floats | None]:
    """The arguments mu, N2 and r as arrays of one shape.

    None: that of the equations, if no load is mu = 0.
    """
    mu, n2 = eqs.mu or 0.0 if mu is None else mu, eqs.n2 or 0.0 if n2 is None else n2
    r = eqs.restitution if r is None else r
    m, n, stop = np.broadcast_arrays(mu, n2, 1.0 if r is None else r)
    return 1.0 * m, 1.0 * n, None if r is None else 1.0 * stop


def coupled(eqs: Equations, mu: Override) -> bool:
    """Whether there is a load, so that V acts on the mass with a memory of its own."""
    return bool(eqs.beta) and (bool(eqs.mu) or (mu is not None and bool(np.any(mu))))


def load(eqs: Equations, m: Floats, r: Floats | None) -> tuple[Floats, Floats]:
    """The load's stiffness and damping, as (w^2, c1 - C) with w^2 = 1 + K, weakened by the stop (`share`)."""
    beta, c1 = eqs.beta or 0.0, eqs.c1 or 0.0
    if not beta:
        return np.ones_like(m), np.full_like(m, c1)
    w2 = np.full_like(m, 1.0 + beta)
    if np.any(m):  # without a load V = x
        for _ in range(200):  # contracts by (w^2 - 1)/w^2 or better
            w2 = 1.0 + beta * share(m / np.sqrt(w2), r) * w2 / (m**2 + w2)
    return w2, c1 - beta * share(m / np.sqrt(w2), r) * m / (m**2 + w2)


def share(m: Floats, r: Floats | None) -> Floats:
    """The fraction of the harmonic voltage that a stop leaves: chi = 1 - 4 m coth(pi m/2)/(pi (1 + m^2)), else 1."""
    return (
        np.ones_like(m)
        if r is None or not np.any(m)
        else 1.0 - 4.0 * m_coth(m) / (math.pi * (1.0 + m * m))
    )


def m_coth(m: Floats) -> Floats:
    """The product m coth(pi m/2), 2/pi at m = 0."""
    m = np.maximum(m, 1e-150)
    return np.asarray(m / np.tanh(0.5 * math.pi * m))


def log(r: Floats) -> Floats:
    """The logarithm ln r, large and negative but finite for r = 0."""
    return np.asarray(np.log(np.maximum(r, 1e-300)))


def matrix(eqs: Equations, m: Floats) -> Floats:
    """Matrix of the flow of (x, x', V), shape (..., 3, 3)."""
    a = np.zeros((*m.shape, 3, 3))
    a[..., 0, 1] = a[..., 2, 1] = 1.0
    a[..., 1, 0] = -1.0
    a[..., 1, 1] = eqs.c1 or 0.0
    a[..., 1, 2] = -(eqs.beta or 0.0)
    a[..., 2, 2] = -m
    return a


def modes(eqs: Equations, m: Floats) -> tuple[Floats, Floats]:
    """Re lambda_i and Re (l_v x_i)^2 of every mode, shape (..., 3)."""
    values, right = np.linalg.eig(matrix(eqs, m))
    left = np.linalg.inv(right)
    return values.real, ((left[..., :, 1] * right[..., 0, :]) ** 2).real
