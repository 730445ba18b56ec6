"""The functions of a stage's solver: the limit of a junction's step, and the solution of linear equations.

`solve_tape` is a whole solver, for circuits with so many junctions that straight lines would take
long to compile: it reads a circuit from its numbers.
"""

import math

from numba import carray, types  # type: ignore[attr-defined]

from harvester.circuits.junctions import diode
from harvester.circuits.pointers import data
from harvester.mechanics.kernels.compiled import inlined

MOST_ITERATIONS = 60
# iterations after which most go a part of the way only, as they may go round between two branches
DAMPED = 12
ALMOST = 1.0 - 1e-15  # below 1, as far as an inverse function is computed
LARGEST = 1e9  # factor of an elimination, in equations of like size
# beyond DAMPED iterations every fourth goes the whole way; the others leave this share of it
EACH = 4
HELD = 0.7
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
    """Which segment of a table x0, y0, x1, y1, ... that begins at p[first] x is in.

    The first and last continue.
    """
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


@inlined
def combined(p, at, x, out, count):
    """Write sums of x into out: on the tape p, for each its number of terms, and their places and weights."""
    for k in range(count):
        terms = int(p[at])
        at += 1
        total = 0.0
        for _ in range(terms):
            total += p[at + 1] * x[int(p[at])]
            at += 2
        out[k] = total


@inlined
def added(p, at, values, out, count):
    """Add multiples of values to out, the other way round than `combined`."""
    for k in range(count):
        terms = int(p[at])
        at += 1
        for _ in range(terms):
            out[int(p[at])] += p[at + 1] * values[k]
            at += 2


@inlined
def eliminated(p, at, work, d, n):
    """Eliminate by the pivots of the tape p; whether all factors are within their limits."""
    b = work[:n]
    matrix = work[n:]
    safe = True
    for _ in range(n):
        row = int(p[at])
        d[row] = 1.0 / matrix[int(p[at + 1])]
        others = int(p[at + 2])
        at += 3
        for _ in range(others):
            other = int(p[at])
            factor = matrix[int(p[at + 1])] * d[row]
            safe &= abs(factor) < p[at + 2]
            count = int(p[at + 3])
            at += 4
            for _ in range(count):
                matrix[int(p[at])] -= factor * matrix[int(p[at + 1])]
                at += 2
            b[other] -= factor * b[row]
    return safe


@inlined
def substituted(p, at, work, d, z, n):
    """Write the solution of eliminated equations into z."""
    matrix = work[n:]
    for _ in range(n):
        row = int(p[at])
        column = int(p[at + 1])
        count = int(p[at + 2])
        at += 3
        total = work[row]
        for _ in range(count):
            total -= matrix[int(p[at])] * z[int(p[at + 1])]
            at += 2
        z[column] = total * d[row]


@inlined
def copied(values, out, count):
    """Write the first values into out.

    An assignment of slices would need functions of Python to fail with.
    """
    for k in range(count):
        out[k] = values[k]


@inlined
def cleared(out, count):
    """Write 0 into the first of out."""
    for k in range(count):
        out[k] = 0.0


@inlined
def assembled(p, r, Y, slopes, currents, work):
    """Write the right side of an iteration into work, and then its matrix."""
    n = len(r)
    many = len(slopes)
    copied(r, work, n)
    cleared(work[n:], n * n)
    added(p, int(p[5]), currents, work, many)
    at = int(p[6])
    entries = int(p[at])
    for k in range(at + 1, at + 1 + entries):
        work[n + int(p[k])] = Y[int(p[k])]
    added(p, int(p[7]), slopes, work[n:], many)


@inlined
def solve_tape(y, r, Y, p, q, work, rate):
    """Newton's method on a circuit of junctions, as the generated lines of `harvester.circuits.newton`.

    The tape p begins with its length, the numbers of unknowns and of junctions, and the places of
    its parts (`harvester.circuits.newton.Solver`).
    """
    n = len(y)
    many = len(q)
    b = work[:n]
    room = work[n + n * n :]
    d = room[:n]
    z = room[n : 2 * n]
    rows = carray(data(room[2 * n :]), (10, many))
    w = rows[0]
    u = rows[1]
    v = rows[2]
    tangent = rows[3]
    charge = rows[4]
    current = rows[5]
    slope = rows[6]
    excess = rows[7]
    stored = rows[8]
    capacitance = rows[9]
    combined(p, int(p[3]), y, w, many)
    cleared(tangent, many)
    cleared(charge, many)
    failed = -1
    near = False
    for iteration in range(MOST_ITERATIONS):
        failed = -1
        for k in range(many):
            at = int(p[4]) + 16 * k
            i, g, stored[k], capacitance[k] = diode(
                w[k],
                saturation=p[at],
                n=p[at + 1],
                breakdown=p[at + 2],
                reverse=p[at + 3],
                capacitance=p[at + 4],
                built_in=p[at + 5],
                grading=p[at + 6],
                forward=p[at + 7],
                transit=p[at + 8],
            )
            current[k] = i + rate * stored[k]
            slope[k] = g + rate * capacitance[k]
            size = abs(current[k])
            is_on = abs(current[k] - tangent[k]) <= RELATIVE * size + p[at + 14]
            if failed == -1 and not (is_on and size <= p[at + 15]):
                failed = k
            excess[k] = current[k] - slope[k] * w[k]
        if near and failed == -1:
            copied(charge, q, many)
            copied(b, y, n)
            return iteration
        assembled(p, r, Y, slope, excess, work)
        if eliminated(p, int(p[8]), work, d, n):
            substituted(p, int(p[9]), work, d, z, n)
            copied(z, b, n)
        else:
            assembled(p, r, Y, slope, excess, work)
            if not solve_dense(carray(data(work[n:]), (n, n)), b, n):
                return -1
        near = iteration < DAMPED or iteration % EACH == 0
        held = 0.0 if near else HELD
        copied(w, u, many)
        combined(p, int(p[3]), b, v, many)
        for k in range(many):
            at = int(p[4]) + 16 * k + 9
            near_to = limited(
                v[k],
                u[k],
                thermal=p[at],
                knee=p[at + 1],
                breakdown=p[at + 2],
                reverse=p[at + 3],
                reverse_knee=p[at + 4],
            )
            w[k] = near_to + held * (u[k] - near_to)
            near &= w[k] == v[k]
            tangent[k] = current[k] + slope[k] * (w[k] - u[k])
            charge[k] = stored[k] + capacitance[k] * (v[k] - u[k])
    return -2 - failed if failed != -1 else -1
