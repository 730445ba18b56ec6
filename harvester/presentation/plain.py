"""Any part of a result as plain data, as --json prints it: numbers, texts, lists and objects; and whether two agree."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.glossary import term
from harvester.uncertainty.value import Value, number


def plain(one: Any) -> Any:
    """What JSON can hold: a value with its errors, an array as a list; a number that is none is null."""
    if isinstance(one, Value):
        return number(one)
    if isinstance(one, Diagnostic | Exception):
        return str(one)
    if hasattr(one, "as_json"):
        return one.as_json()
    if isinstance(one, float) and not math.isfinite(one):
        return None
    if isinstance(one, np.ndarray | np.generic):
        return plain(one.tolist())
    return _parts(one)


def _parts(one: Any) -> Any:
    """What has parts, as a list or an object of these; anything else as it is."""
    if hasattr(one, "_asdict"):  # a NamedTuple
        one = one._asdict()
    elif dataclasses.is_dataclass(one):
        one = {field.name: getattr(one, field.name) for field in dataclasses.fields(one)}
    if isinstance(one, Mapping):
        return {_key(name): plain(part) for name, part in one.items()}
    if isinstance(one, list | tuple | set | frozenset):
        return [plain(part) for part in one]
    return one


def _key(name: Any) -> str:
    return f"{name:g}" if isinstance(name, float) else str(name)


def same(one: Any, other: Any) -> bool:
    """Whether two parts of results say the same, but for times of computing."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    first, second = _compared_parts(one), _compared_parts(other)
    if first is None or second is None or type(one) is not type(other):
        return bool(one == other)
    return first.keys() == second.keys() and all(same(part, second[name]) for name, part in first.items())


def _compared_parts(one: Any) -> dict[Any, Any] | None:
    """The parts of what has parts, by their names or places, but for times of computing."""
    found: dict[Any, Any] | None = None
    if dataclasses.is_dataclass(one):
        found = {field.name: getattr(one, field.name) for field in dataclasses.fields(one) if field.compare}
    elif isinstance(one, Mapping | list | tuple):
        found = dict(one) if isinstance(one, Mapping) else dict(enumerate(one))
    return found and {name: part for name, part in found.items() if term(str(name)).kind != "clock"}
