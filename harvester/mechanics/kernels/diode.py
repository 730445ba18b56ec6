"""The charge that a diode lets through under a voltage of constant slope, in closed form, for loops over lanes.

Shockley's ideal diode passes leak (exp(w/n) - 1) at a voltage w.  If the voltage would change from
w0 to w1 on its own in a time t, and a charge q through the diode lowers it by (1 + g) q, the
equation is one of Bernoulli's:

    w' = (w1 - w0)/t - (1 + g) leak exp(w/n)
    (1 + g) q = n ln(1 + (1 + g) leak t/n <exp(w/n)>),   <> the mean along the way from w0 to w1

(the reverse current -leak is the caller's).  For n -> 0 this is the ideal diode with the threshold
n ln(i/leak) at a current i.  Exponential and logarithm are polynomials without a branch or a
library call, so that loops vectorise.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import int64, types
from numba.extending import intrinsic

from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.equation_of_motion import decayed

_LOG2E, _LN2 = 1.4426950408889634, 0.6931471805599453
_LN2_HIGH, _LN2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10
_ROOT2, _LN_ROOT2 = 1.4142135623730951, 0.34657359027997264
_MANTISSA = (1 << 52) - 1
_EXPONENT_OF_1 = 1023 << 52
FAR = 600.0  # exponents beyond this are followed linearly, as their exponential would overflow


@intrinsic
def _bits(_context: Any, x: Any) -> Any:
    """The 64 bits of a float as an integer."""
    return types.int64(types.float64), lambda _c, builder, _s, args: builder.bitcast(
        args[0], ir.IntType(64)
    )


@intrinsic
def _number(_context: Any, bits: Any) -> Any:
    """The float of 64 bits: inverse of `_bits`."""
    return types.float64(types.int64), lambda _c, builder, _s, args: builder.bitcast(
        args[0], ir.DoubleType()
    )


@forced
def exponential(z):
    """The exponential exp(z) to 1e-13 for z from -700 to 700.

    Outside, the value at the end of that range.
    """
    z = min(max(z, -700.0), 700.0)
    k = np.int32(z * _LOG2E + 1100.5) - np.int32(1100)  # rounded: the argument is positive
    r = (z - k * _LN2_HIGH) - k * _LN2_LOW
    r2 = r * r
    even = 1.0 + r2 * (
        1.0 / 2 + r2 * (1.0 / 24 + r2 * (1.0 / 720 + r2 * (1.0 / 40320 + r2 * (1.0 / 3628800))))
    )
    odd = 1.0 + r2 * (1.0 / 6 + r2 * (1.0 / 120 + r2 * (1.0 / 5040 + r2 * (1.0 / 362880))))
    return (even + r * odd) * _number(int64(_EXPONENT_OF_1) + (int64(k) << int64(52)))


@forced
def logarithm(y):
    """The logarithm ln(y) of a normal y > 0, to 1e-13 (absolute).

    ln(2^e m) = e ln 2 + ln sqrt(2) + 2 artanh((m - sqrt(2))/(m + sqrt(2))), 1 <= m < 2.
    """
    bits = _bits(y)
    e = np.int32(bits >> int64(52)) - np.int32(1023)
    m = _number((bits & int64(_MANTISSA)) | int64(_EXPONENT_OF_1))
    s = (m - _ROOT2) / (m + _ROOT2)
    z = s * s
    tail = z * (
        1.0 / 3
        + z
        * (
            1.0 / 5
            + z * (1.0 / 7 + z * (1.0 / 9 + z * (1.0 / 11 + z * (1.0 / 13 + z * (1.0 / 15)))))
        )
    )
    return e * _LN2 + (_LN_ROOT2 + 2.0 * (s + s * tail))


@forced
def share(z):
    """Mean of exp(-s) for s from 0 to z: (1 - exp(-z))/z, 1 at z = 0."""
    return decayed(z) / z if z > 1e-12 else 1.0


@forced
def lowered(w0, w1, t, n, leak):
    """By how much a diode keeps w below w1 in a time t: n ln(1 + leak t/n <exp(w/n)>)."""
    top = max(w0, w1) / n
    mean = exponential(min(top, FAR)) * share(abs(w1 - w0) / n)
    return max(n * logarithm(1.0 + leak * t / n * mean), 0.0) + n * max(top - FAR, 0.0)
