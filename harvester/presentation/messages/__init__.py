"""The sentence of every diagnostic, once, by its code.

Each file of this folder has the ``MESSAGES`` of the subpackages that it is named after: a text with
the names of its numbers in braces, or a function of them if the sentence depends on them;
``{seconds!t}`` is a time with its unit, ``{error!p}`` a fraction in per cent, and ``{error:.1%}``
one with so many decimals.  An argument of
Python is in backticks, such as `within`; a command prints it as --within.
"""

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from string import Formatter
from typing import Any, TypeAlias

from harvester.uncertainty.value import duration, in_percent

Message: TypeAlias = str | Callable[..., str]


@cache
def catalogue() -> Mapping[str, Message]:
    """All messages by their codes; each code is defined in one file only."""
    messages: dict[str, Message] = {}
    for file in iter_modules(__path__):
        some: dict[str, Message] = getattr(import_module(f"{__name__}.{file.name}"), "MESSAGES", {})
        assert not messages.keys() & some.keys(), messages.keys() & some.keys()
        messages |= some
    return messages


def sentence(code: str, numbers: Mapping[str, float | int | str | bool | None]) -> str:
    """The sentence of a code with its numbers.

    >>> sentence("restitution_untested", {"restitution": 0.2, "least": 0.3})
    'the error was not measured for a restitution coefficient of 0.2, below 0.3'
    """
    message = catalogue()[code]
    return (
        _Sentence().vformat(message, (), numbers)
        if isinstance(message, str)
        else message(**numbers)
    )


class _Sentence(Formatter):
    """Puts numbers into a text."""

    def convert_field(self, value: Any, conversion: Any) -> Any:
        """A time (s) for ``!t``, such as 20 ms or 4 min 3 s, and a percentage for ``!p``.

        Other conversions as always.
        """
        if conversion == "t":
            return duration(value)
        return in_percent(value) if conversion == "p" else super().convert_field(value, conversion)

    def format_field(self, value: Any, format_spec: str) -> Any:
        """A percentage with a space, such as 12 % for ``:.0%``; other formats as always."""
        if format_spec.endswith("%"):
            return in_percent(value, format_spec[:-1] + "f")
        return super().format_field(value, format_spec)
