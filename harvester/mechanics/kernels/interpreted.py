"""A compiled function built again from its source: interpreted, or compiled to exactly the same arithmetic."""

import types
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
from numba.core.dispatcher import Dispatcher


@cache
def interpreted(function: Any) -> Any:
    """The function, and those that it calls, as plain Python."""
    return _rebuilt(function, interpreted)


@cache
def strict(function: Any) -> Any:
    """The function, and those that it calls, compiled as written: no reordered sums, no fused multiply-add.

    It rounds as Python does, so that a path of ngspice, whose iterations amplify a last digit to its
    tolerance, is the same to all digits with compiled and with interpreted callbacks.
    """
    return numba.njit(error_model="numpy", fastmath=False)(_rebuilt(function, strict))


def _rebuilt(function: Any, again: Callable[[Any], Any]) -> types.FunctionType:
    plain = function.py_func
    known = plain.__globals__
    inner = {name: known[name] for name in plain.__code__.co_names if isinstance(known.get(name), Dispatcher)}
    given = {**known, **{name: again(one) for name, one in inner.items()}}
    return types.FunctionType(plain.__code__, given, plain.__name__, plain.__defaults__, plain.__closure__)
