"""Top Lyapunov exponents that are exact: any noise without the load, any load without noise."""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.stability.linearised import (
    Override,
    coupled,
    load,
    log,
    matrix,
    modes,
    with_overrides,
)
from harvester.equations.coefficients import Equations


def decoupled(
    c1: Floats | float, stiffness: Floats | float, n2: Floats | float, r: Override = None
) -> Floats:
    """Exponent lambda of x'' - c1 x' + W^2 x = x noise, with a stop or without, exact for any noise and restitution.

        lambda = c1/2 + I_(1/2)/(2 I_(-1/2)) + J ln r,   J = s/(sqrt(2 pi) I_(-1/2)) impacts in a unit of time,
        I_k = int_0^inf u^k exp[-(2/s^2)(q u + u^3/12)] du,   q = W^2 - c1^2/4,   s^2 = 2 N2

    By quadrature over y = sqrt(u), in which the trapezoidal rule converges faster than any power.
    """
    q, n2 = np.broadcast_arrays(np.asarray(stiffness - 0.25 * np.square(c1)), np.maximum(n2, 1e-30))
    # Beyond y either power of the exponent has cut the integrand to e^-40 (for q < 0: the sixth
    # alone).
    sixth = (480.0 * n2) ** (1 / 6)
    square = np.sqrt(40.0 * n2 / np.maximum(np.abs(q), 1e-30))
    top = np.where(
        q > 0.0, np.minimum(sixth, square), np.maximum(2.0**0.2 * sixth, (24.0 * np.abs(q)) ** 0.25)
    )
    y = top[..., None] * np.linspace(0.0, 1.0, 401)
    exponent = -(q[..., None] * y**2 + y**6 / 12.0) / n2[..., None]
    peak = exponent.max(axis=-1)
    weight = np.exp(exponent - peak[..., None])
    weight[..., 0] *= 0.5
    value = 0.5 * c1 + 0.5 * (weight * y**2).sum(axis=-1) / weight.sum(axis=-1)
    if r is None:
        return np.asarray(value)
    impacts = np.sqrt(n2 / math.pi) * np.exp(-peak) / (2.0 * weight.sum(axis=-1) * y[..., 1])
    return np.asarray(value + impacts * log(np.asarray(r)))


def noiseless(eqs: Equations) -> float | None:
    """The exact exponent lambda without noise: from the fixed point of the map from one impact to the next.

    From (x, x', V) = (0, 1, q) the linear flow leads to the next impact after a time T, and it back
    to (0, v, V'), q' = V'/v; at q' = q, lambda = ln(v)/T.  Without a stop: the rightmost eigenvalue.
    None if the mass leaves the stop for good, or q settles on nothing.
    """
    # most of the seconds that a formula takes would be its loading
    from scipy.optimize import brentq

    m, _, r = with_overrides(eqs, None, 0.0, None)
    if not coupled(eqs, None):
        w2, damping = load(eqs, m, r)
        return float(decoupled(damping, w2, 0.0, r))
    if r is None:
        return float(modes(eqs, m)[0].max())
    values, right = np.linalg.eig(matrix(eqs, m))
    left = np.linalg.inv(right)
    q = 0.0
    growth = float(values.real.max())  # taken out of the flow, so that no exponential overflows
    values = values - growth
    times = np.linspace(0.0, 8.0 * math.pi, 1601)[1:]
    for _ in range(2000):
        start = left @ np.array([0.0, 1.0, q])

        def state(t: Floats | float, row: int, start: Floats = start) -> Floats:
            return np.asarray(np.real(np.exp(np.multiply.outer(t, values)) @ (right[row] * start)))

        below = np.flatnonzero(state(times, 0) < 0.0)
        if not len(below) or below[0] == 0:
            return None
        period = brentq(state, times[below[0] - 1], times[below[0]], args=(0,), xtol=1e-14)
        v = float(-r * state(period, 1))
        if v <= 0.0:
            return None
        before = q
        q = float(state(period, 2)) / v
        if abs(q - before) <= 1e-12 * (1.0 + abs(q)):
            return float(math.log(v) / period) + growth
    return None
