"""A NamedTuple of numbers read from plain memory, which a C program hands to a compiled step."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

TUPLES = (types.NamedTuple, types.NamedUniTuple)


def count(template: Any) -> int:
    """How many numbers a template has: its floats, those of NamedTuples inside included."""
    return len(names(template))


def names(template: Any, before: str = "") -> list[str]:
    """The names of a template's floats in their order in memory, such as ``parallel.kept``."""
    labels = []
    for name, value in zip(template._fields, template, strict=True):
        if isinstance(value, tuple):
            labels += names(value, f"{before}{name}.")
        elif isinstance(value, float):
            labels.append(before + name)
    return labels


def values(template: Any) -> list[float]:
    """The numbers of a template in their order in memory."""
    numbers = []
    for value in template:
        if isinstance(value, tuple):
            numbers += values(value)
        elif isinstance(value, float):
            numbers.append(value)
    return numbers


@intrinsic
def read_numbers(typingctx, template, pointer, first):
    """A NamedTuple like the template, its floats read from a pointer, from the ``first`` on.

    Values of other types, such as None and True, stay.
    """

    def codegen(context, builder, signature, args):
        index = 0

        def made(kind, given):
            nonlocal index
            parts = []
            for k, part in enumerate(kind.types if isinstance(kind, types.NamedTuple) else kind):
                if isinstance(part, TUPLES):
                    parts.append(made(part, builder.extract_value(given, k)))
                elif isinstance(part, types.Float):
                    at = builder.gep(
                        args[1], [builder.add(args[2], ir.Constant(ir.IntType(64), index))]
                    )
                    parts.append(builder.load(at))
                    index += 1
                else:
                    parts.append(builder.extract_value(given, k))
            return context.make_tuple(builder, kind, parts)

        return made(signature.args[0], args[0])

    return template(template, pointer, types.int64), codegen
