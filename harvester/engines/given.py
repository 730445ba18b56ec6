"""Options that are given as a number or as a text: ``within="1%"``, ``budget="30s"``; held as numbers."""

from collections.abc import Callable
from typing import Any, overload

from harvester.errors import InputError, shown


class Given:
    """An optional field of an engine that reads a text when it is set; None where it is left out."""

    def __init__(self, read: Callable[[str], float]) -> None:
        self._read, self._name = read, ""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, engine: None, owner: type) -> None: ...

    @overload
    def __get__(self, engine: object, owner: type) -> float | None: ...

    def __get__(self, engine: Any, owner: type) -> float | None:
        value: float | None = None if engine is None else vars(engine)[self._name]
        return value

    def __set__(self, engine: object, value: float | str | None) -> None:
        if isinstance(value, str):
            try:
                value = self._read(value)
            except ValueError as error:
                raise InputError(f"`{self._name}` {error}, but is {shown(value)}") from None
        vars(engine)[self._name] = value


def held(value: float | str | None) -> float | None:
    """What a `Given` field gives, which mypy, in a frozen dataclass, takes for what it may be set to."""
    assert not isinstance(value, str)
    return value
