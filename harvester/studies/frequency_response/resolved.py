"""Frequencies that resolve the peak of a response in closed form, of which a point costs next to nothing."""

from collections.abc import Callable, Sequence

import numpy as np

ACROSS = 9  # points from one half-power point to the other, for the curve


def resolved(power: Callable[[float], float], frequencies: Sequence[float]) -> list[float]:
    """The ascending frequencies, and with them that of the largest power, the half-power points, and some between.

    The largest power is sought between the neighbours of the best of ``frequencies``; a half-power point that is
    beyond them is left out.  ``power`` must be smooth, with one peak between two neighbours at most.
    """
    from scipy.optimize import brentq, minimize_scalar

    given = sorted(frequencies)
    values = [power(f) for f in given]
    top = int(np.argmax(values))
    if not values[top] > 0.0:
        return given
    ends = given[max(top - 1, 0)], given[min(top + 1, len(given) - 1)]
    found = minimize_scalar(lambda f: -power(f), bounds=ends, method="bounded", options={"xatol": 1e-9 * ends[1]})
    peak = float(found.x) if -found.fun > values[top] else given[top]
    half = 0.5 * max(-found.fun, values[top])
    edges = []
    for side in ([f for f in given[::-1] if f < peak], [f for f in given if f > peak]):
        inner = peak
        for outer in side:
            if power(outer) <= half:
                edges.append(float(brentq(lambda f: power(f) - half, inner, outer, xtol=1e-12 * peak)))
                break
            inner = outer
    between = np.linspace(edges[0], edges[1], ACROSS).tolist() if len(edges) == 2 else edges
    return sorted({*given, peak, *between})
