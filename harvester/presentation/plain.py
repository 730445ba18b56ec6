"""Any part of a result as plain data, as --json prints it: numbers, texts, lists and objects."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from harvester.presentation.diagnostic import Diagnostic
from harvester.uncertainty.value import Value, number


def plain(one: Any) -> Any:
    """What JSON can hold: a value with its errors, an array as a list; a number that is none is null."""
    if isinstance(one, Value):
        return number(one)
    if isinstance(one, Diagnostic):
        return str(one)
    if isinstance(one, Exception):
        return str(one)
    if hasattr(one, "as_json"):
        return one.as_json()
    if hasattr(one, "_asdict"):  # a NamedTuple
        return plain(one._asdict())
    if isinstance(one, Mapping):
        return {_key(name): plain(part) for name, part in one.items()}
    if isinstance(one, np.ndarray):
        return plain(one.tolist())
    if isinstance(one, list | tuple | set | frozenset):
        return [plain(part) for part in one]
    if isinstance(one, np.generic):
        return plain(one.item())
    if isinstance(one, float) and not math.isfinite(one):
        return None
    if dataclasses.is_dataclass(one):
        return {field.name: plain(getattr(one, field.name)) for field in dataclasses.fields(one)}
    return one


def _key(name: Any) -> str:
    return f"{name:g}" if isinstance(name, float) else str(name)
