"""The paper's method: fixed-step fourth-order Runge-Kutta, the noise held over the step, in vectorised NumPy.

The stop acts between steps: x < 0 becomes x = -r x, x' = -r x', and V follows the displacement.
"""

import numpy as np
from common import PAPER, counts

SIZE = 8192  # trajectories at a time: the fastest of 512 to 16384


def averages(h, n, burn_in, duration, seed, e=PAPER):
    """Time average of V^2 of each trajectory."""
    every, readings = counts(h, duration)
    skipped = counts(h, burn_in)[1] if burn_in else 0
    rng = np.random.default_rng(seed)
    return np.concatenate(
        [_block(h, min(SIZE, n - k), every, skipped, readings, rng, e) for k in range(0, n, SIZE)]
    )


def _slope(y, white, e):
    x, v, V = y
    x2 = x * x
    friction = (e.c3 * x2 - e.c2) * x2 - e.c1
    noise = np.sqrt(2.0 * (e.n1 + e.n2 * x2)) * white
    return np.stack([v, noise - friction * v - (1.0 + e.alpha * x2) * x - e.beta * V, v - e.mu * V])


def _block(h, n, every, skipped, readings, rng, e):
    y = np.zeros((3, n))
    total = np.zeros(n)
    for k in range(skipped + readings):
        for _ in range(every):
            white = rng.standard_normal(n) / np.sqrt(h)
            k1 = _slope(y, white, e)
            k2 = _slope(y + 0.5 * h * k1, white, e)
            k3 = _slope(y + 0.5 * h * k2, white, e)
            k4 = _slope(y + h * k3, white, e)
            y += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
            hit = np.flatnonzero(y[0] < 0.0)
            if hit.size:
                y[2, hit] -= (1.0 + e.restitution) * y[0, hit]
                y[:2, hit] *= -e.restitution
        if k >= skipped:
            total += y[2] * y[2]
    return total / readings
