"""The values outside a model that its functions name: numba compiles them as constants."""

import types
from collections.abc import Hashable, Iterable, Iterator
from typing import Any

import numpy as np

from harvester.cosimulation.model_errors import FUNCTIONS


def values_named(of: Any, names: Iterable[str] = FUNCTIONS) -> tuple[Hashable, ...]:
    """The functions of a class and the globals and closures that they name, as a key of a cache."""
    seen = set[types.FunctionType]()
    return tuple(_key(getattr(of, name, None), seen) for name in names)


def _key(value: Any, seen: set[types.FunctionType]) -> Hashable:
    """A value as a part of a key: a function by its code and all values that it names."""
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, types.FunctionType):
        if value in seen:
            return value.__code__
        seen.add(value)
        return value.__code__, *((name, _key(inner, seen)) for name, inner in _named(value))
    if isinstance(value, tuple):
        return type(value), *(_key(part, seen) for part in value)
    if isinstance(value, bool | int | float | complex | str | None):
        return type(value), repr(value)
    if isinstance(value, np.generic):
        return type(value), value.tobytes()
    return _Same(value)


class _Same:
    """An object as a part of a key, which keeps it: the id of a deleted one may be reused."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def _named(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """The defaults, closures and globals of a function, and numbers of modules, by their names."""
    yield "defaults", function.__defaults__
    cells = function.__closure__ or ()
    for name, cell in zip(function.__code__.co_freevars, cells, strict=True):
        try:
            yield name, cell.cell_contents
        except ValueError:  # a name without a value yet
            continue
    names = _names(function.__code__)
    for name in names:
        if name not in function.__globals__:
            continue
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, types.ModuleType):
            yield from _numbers(name, value, names)


def _numbers(name: str, module: types.ModuleType, names: list[str]) -> Iterator[tuple[str, Any]]:
    """The numbers of a module, and of modules that it names, whose names are given."""
    modules = {module: name}
    left = [module]
    while left:
        at = left.pop()
        for part in names:
            inner = getattr(at, part, None)
            if isinstance(inner, types.ModuleType) and inner not in modules:
                modules[inner] = f"{modules[at]}.{part}"
                left.append(inner)
            elif isinstance(
                inner, bool | int | float | complex | str | tuple | np.ndarray | np.generic
            ):
                yield f"{modules[at]}.{part}", inner


def _names(code: types.CodeType) -> list[str]:
    """The names in a code, and in those of functions within it."""
    inner = [part for part in code.co_consts if isinstance(part, types.CodeType)]
    return [*code.co_names, *(name for part in inner for name in _names(part))]
