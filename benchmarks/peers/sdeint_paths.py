"""sdeint: its Stratonovich Heun method, one trajectory after the other, in Python.

It knows no events, so it is asked for a stretch of steps at a time; at the first point behind the
stop the stretch is cut, the mass reflected, and the next one begins there.
"""

import math

import numpy as np
import sdeint
from common import PAPER, counts

STRETCH = 32  # steps asked for at a time: the fastest of 4 to 100


def averages(h, n, burn_in, duration, seed, e=PAPER):
    """Time average of V^2 of each trajectory."""
    every, readings = counts(h, duration)
    skipped = counts(h, burn_in)[1] if burn_in else 0
    rng = np.random.default_rng(seed)
    return np.array([_path(h, every, skipped, readings, rng, e) for _ in range(n)])


def _path(h, every, skipped, readings, rng, e):
    def drift(y, _t):
        x, v, V = y.tolist()
        x2 = x * x
        friction = (e.c3 * x2 - e.c2) * x2 - e.c1
        return np.array([v, -friction * v - (1.0 + e.alpha * x2) * x - e.beta * V, v - e.mu * V])

    def noise(y, _t):
        x = float(y[0])
        return np.array([[0.0], [math.sqrt(2.0 * (e.n1 + e.n2 * x * x))], [0.0]])

    y = np.zeros(3)
    steps = (skipped + readings) * every
    span = h * np.arange(STRETCH + 1)
    V = np.empty(steps)
    k = 0
    while k < steps:
        part = sdeint.stratHeun(drift, noise, y, span[: steps - k + 1], generator=rng)[1:]
        behind = part[:, 0] < 0.0
        m = int(behind.argmax()) + 1 if behind.any() else len(part)
        y = part[m - 1]
        if behind[m - 1]:
            y = np.array(
                [-e.restitution * y[0], -e.restitution * y[1], y[2] - (1.0 + e.restitution) * y[0]]
            )
        V[k : k + m] = part[:m, 2]
        V[k + m - 1] = y[2]
        k += m
    return (V[every - 1 :: every][skipped:] ** 2).mean()
