"""The values of operations on numbers, as ngspice's B sources and braces compute them."""

import bisect
import math
from collections.abc import Callable

MOST = 227.955  # of an exponent; beyond, exp is 1e99


def constant_of(name: str, *x: float) -> float:
    """The value of an operation; infinite or nan if there is none."""
    try:
        return float(_VALUES[name](*x))
    except (OverflowError, ZeroDivisionError, ValueError):
        return math.nan


def piecewise(x: float, *points: float) -> float:
    """A table x0, y0, x1, y1, ... at x, on with the last slopes beyond its ends."""
    knots = points[::2]
    values = points[1::2]
    k = min(max(bisect.bisect_right(knots, x) - 1, 0), len(knots) - 2)
    return values[k] + (values[k + 1] - values[k]) / (knots[k + 1] - knots[k]) * (x - knots[k])


_VALUES: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "%": math.fmod,
    "negative": lambda a: -a,
    "not": lambda a: a == 0.0,
    "or": lambda a, b: bool(a) or bool(b),
    "and": lambda a, b: bool(a) and bool(b),
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "?": lambda c, a, b: a if c else b,
    "abs": abs,
    "exp": math.exp,
    "ln": math.log,
    "log10": math.log10,
    "sqrt": math.sqrt,
    "sqr": lambda a: a * a,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "asinh": math.asinh,
    "acosh": math.acosh,
    "atanh": math.atanh,
    "u": lambda a: 0.5 if a == 0.0 else float(a > 0.0),
    "u2": lambda a: min(max(a, 0.0), 1.0),
    "uramp": lambda a: max(a, 0.0),
    "sgn": lambda a: (a > 0.0) - (a < 0.0),
    "gt0": lambda a: a > 0.0,
    "lt0": lambda a: a < 0.0,
    "ge0": lambda a: a >= 0.0,
    "le0": lambda a: a <= 0.0,
    "eq0": lambda a: a == 0.0,
    "ne0": lambda a: a != 0.0,
    "floor": math.floor,
    "ceil": math.ceil,
    "int": math.trunc,
    "nint": round,
    "min": min,
    "max": max,
    "power": math.pow,
    "pow": lambda a, b: abs(a) ** b,
    "pwr": lambda a, b: math.copysign(abs(a) ** b, a),
    "pwl": piecewise,
}
