"""Any part of a result as plain data, as --json prints it: numbers, texts, lists and objects; and whether two agree."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.glossary import term
from harvester.uncertainty.value import Value, number


def plain(content: Any) -> Any:
    """What JSON can hold: a value with its errors, an array as a list; an invalid number is null."""
    if isinstance(content, Value):
        return number(content)
    if isinstance(content, Diagnostic | Exception):
        return str(content)
    if hasattr(content, "as_json"):
        return content.as_json()
    if isinstance(content, float) and not math.isfinite(content):
        return None
    if isinstance(content, np.ndarray | np.generic):
        return plain(content.tolist())
    return _parts(content)


def _parts(content: Any) -> Any:
    """What has parts, as a list or an object of these; anything else as it is."""
    if hasattr(content, "_asdict"):  # a NamedTuple
        content = content._asdict()
    elif dataclasses.is_dataclass(content):
        content = {
            field.name: getattr(content, field.name) for field in dataclasses.fields(content)
        }
    if isinstance(content, Mapping):
        return {_key(name): plain(part) for name, part in content.items()}
    if isinstance(content, list | tuple | set | frozenset):
        return [plain(part) for part in content]
    return content


def _key(name: Any) -> str:
    return f"{name:g}" if isinstance(name, float) else str(name)


def same(content: Any, other: Any) -> bool:
    """Whether two parts of results say the same, but for times of computing."""
    if isinstance(content, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(content, other, equal_nan=content.dtype.kind == "f")
    first, second = _compared_parts(content), _compared_parts(other)
    if first is None or second is None or type(content) is not type(other):
        return bool(content == other)
    return first.keys() == second.keys() and all(
        same(part, second[name]) for name, part in first.items()
    )


def _compared_parts(content: Any) -> dict[Any, Any] | None:
    """The parts of what has parts, by their names or places, but for times of computing."""
    parts: dict[Any, Any] | None = None
    if dataclasses.is_dataclass(content):
        parts = {
            field.name: getattr(content, field.name)
            for field in dataclasses.fields(content)
            if field.compare
        }
    elif isinstance(content, Mapping | list | tuple):
        parts = dict(content) if isinstance(content, Mapping) else dict(enumerate(content))
    return parts and {name: part for name, part in parts.items() if term(str(name)).kind != "clock"}
