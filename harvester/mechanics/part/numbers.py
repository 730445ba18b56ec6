"""A NamedTuple of numbers read from plain memory: what a C program hands to a compiled step."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

TUPLES = (types.NamedTuple, types.NamedUniTuple)


def count(template: Any) -> int:
    """How many numbers a template has: its floats, those of NamedTuples inside included."""
    return len(names(template))


def names(template: Any, before: str = "") -> list[str]:
    """The names of a template's floats in the order in which they are read, such as ``parallel.kept``."""
    found = []
    for name, value in zip(template._fields, template, strict=True):
        if isinstance(value, tuple):
            found += names(value, f"{before}{name}.")
        elif isinstance(value, float):
            found.append(before + name)
    return found


def values(template: Any) -> list[float]:
    """The numbers of a template in the order in which they are read."""
    found = []
    for value in template:
        found += (
            values(value)
            if isinstance(value, tuple)
            else [value]
            if isinstance(value, float)
            else []
        )
    return found


@intrinsic
def read_numbers(typingctx, template, pointer, first):
    """A NamedTuple of the type of the template, its floats read from a pointer to floats, from the ``first`` on.

    What is None stays None, and what is True stays True.
    """

    def codegen(context, builder, signature, args):
        place = 0

        def made(kind, given):
            nonlocal place
            parts = []
            for k, part in enumerate(kind.types if isinstance(kind, types.NamedTuple) else kind):
                if isinstance(part, TUPLES):
                    parts.append(made(part, builder.extract_value(given, k)))
                elif isinstance(part, types.Float):
                    at = builder.gep(
                        args[1], [builder.add(args[2], ir.Constant(ir.IntType(64), place))]
                    )
                    parts.append(builder.load(at))
                    place += 1
                else:
                    parts.append(builder.extract_value(given, k))
            return context.make_tuple(builder, kind, parts)

        return made(signature.args[0], args[0])

    return template(template, pointer, types.int64), codegen
