"""The functions of a stage's solver: the limit of a junction's step, and the solution of linear equations."""

import math

from numba import types

from harvester.mechanics.kernels.compiled import inlined

MOST_ITERATIONS = 60
# iterations after which most go a part of the way only, as they may go round between two branches
DAMPED = 12
ALMOST = 1.0 - 1e-15  # below 1, as far as an inverse function is computed
LARGEST = 1e9  # factor of an elimination, in equations of like size
RELATIVE = 1e-6  # of a current or voltage, that its function and its tangent may differ by
_POINTER = types.CPointer(types.float64)
# y, right side, Y, arguments, states of switches, charges, workspace; 1/tau: iterations; where they
# do not converge -2 less the number of the first function that is not near its tangent, and -1
# where there is none such
SIGNATURE = types.int64(*7 * [_POINTER], types.float64)


@inlined
def limited(v, w, thermal, knee, breakdown, reverse, reverse_knee):
    """The voltage of a junction to continue from, after w, where Newton's tangent leads to v.

    Beyond the knee t, or beyond w if that is larger, it is t + n ln(1 + (v - t)/n): that of the
    tangent's current.
    """
    t = max(w, knee)
    if v > t:
        return t + thermal * math.log1p((v - t) / thermal)
    if v < -breakdown:
        t = max(-w - breakdown, reverse_knee)
        beyond = -v - breakdown
        if beyond > t:
            return -breakdown - t - reverse * math.log1p((beyond - t) / reverse)
    return v


@inlined
def power_slope(a, b):
    """The derivative of |a|^b by a, over b."""
    return math.copysign(max(abs(a), 1e-300) ** (b - 1.0), a)


@inlined
def table_segment(x, p, first, points):
    """Which segment of a table x0, y0, x1, y1, ... that begins at p[first] x is in; the first and last continue."""
    low = 0
    high = points - 2
    while low < high:
        middle = (low + high + 1) // 2
        if x < p[first + 2 * middle]:
            high = middle - 1
        else:
            low = middle
    return first + 2 * low


@inlined
def table_slope(x, p, first, points):
    """The slope of a table at x."""
    k = table_segment(x, p, first, points)
    return (p[k + 3] - p[k + 1]) / (p[k + 2] - p[k])


@inlined
def table_at(x, p, first, points):
    """The value of a table at x."""
    k = table_segment(x, p, first, points)
    return p[k + 1] + (p[k + 3] - p[k + 1]) / (p[k + 2] - p[k]) * (x - p[k])


@inlined
def fudged(b):
    """The divisor b, which ngspice keeps away from 0."""
    return b + math.copysign(1e-32, b)


@inlined
def solve_dense(J, x, n):
    """Solve J x = b by Gauss with pivots from each column, shape (n, n); x holds b, and then the solution.

    Returns whether there is one.
    """
    for k in range(n):
        best = k
        size = abs(J[k, k])
        for i in range(k + 1, n):
            if abs(J[i, k]) > size:
                best = i
                size = abs(J[i, k])
        if not size > 1e-300:
            return False
        if best != k:
            for j in range(k, n):
                J[k, j], J[best, j] = J[best, j], J[k, j]
            x[k], x[best] = x[best], x[k]
        inverse = 1.0 / J[k, k]
        for i in range(k + 1, n):
            if J[i, k] != 0.0:
                factor = J[i, k] * inverse
                for j in range(k + 1, n):
                    J[i, j] -= factor * J[k, j]
                x[i] -= factor * x[k]
        J[k, k] = inverse
    for k in range(n - 1, -1, -1):
        total = x[k]
        for j in range(k + 1, n):
            total -= J[k, j] * x[j]
        x[k] = total * J[k, k]
    return True
