"""The elements of a load circuit as lines for ngspice: no subcircuit, no parameter and no expression in braces is left.

The netlist that ngspice runs is the one that was read here.  Nodes and elements have the names that
ngspice gives them when it writes a subcircuit called Xload out, so that vectors are called as ever
(``@r.xload.rload[p]``, ``xload.a``).
"""

from collections.abc import Iterator, Mapping, Sequence

from harvester.netlists.expression_tree import Node
from harvester.netlists.part import INSIDE, CircuitPart, ModelCard

RELTOL = 1e-4  # ngspice's relative tolerance, unless another is asked for
RELTOL_OF_JUDGE = 1e-5  # the same where ngspice judges another engine
# of the piezo's capacitance, from each node to ground, which are tried in turn where ngspice does
# not converge: diodes without one of their own leave a node between them that nothing holds while
# both block
SHUNTS = 0.0, 1e-5, 1e-4

_INFIX = {
    "and": "&&",
    "or": "||",
    **{sign: sign for sign in ("+", "-", "*", "/", "<", ">", "<=", ">=", "==", "!=")},
}
_PREFIX = {"negative": "-", "not": "!"}
_KEY = {"v": "dc ", "i": "dc "}  # before a value
_KEY_BESIDE_MODEL = {"c": "c=", "l": "inductance="}  # before one behind a model
_LINEAR = "fg"  # whose m is multiplied here: ngspice takes it for a coefficient of a polynomial


def lines_for_ngspice(
    parts: Sequence[CircuitPart], starts: Mapping[str, float] | None = None
) -> list[str]:
    """The lines of elements and of the models that they name.

    ``starts`` are voltages (V) that capacitors begin with, by the elements' names, in place of
    their own.
    """
    names: dict[str, str] = {}
    cards: list[str] = []
    kinds = {part.name: part.kind for part in parts}
    elements: list[str] = []
    for part in parts:
        model = "" if part.model is None else _model_name(part.model, names, cards)
        options = dict(part.options)
        if starts and part.name in starts:
            options["ic"] = starts[part.name]
        elements.append(_line(part, model, options, kinds))
    return [*elements, *cards]


def _model_name(card: ModelCard, names: dict[str, str], cards: list[str]) -> str:
    """The name of a model in the whole deck, to whose ``cards`` it is added when it is first named."""
    values = "".join(
        f" {key}={value!r}"
        for key, value in sorted(card.values.items(), key=lambda pair: pair[0] != "level")
    )
    words = "".join(f" {word}" for word in card.words)
    text = f"{card.kind}({(words + values).strip()})"
    if text not in names:
        names[text] = f"model{len(names) + 1}"
        cards.append(f".model {names[text]} {text}")
    return names[text]


def _line(
    part: CircuitPart, model: str, options: Mapping[str, float], kinds: Mapping[str, str]
) -> str:
    """The line of an element; ``kinds`` are the letters of all elements by their names."""
    words = [part.in_ngspice, *part.nodes, *_middle(part, model, kinds)]
    hidden = {"m"} if part.kind in _LINEAR else set()
    pairs = [f"{key}={value!r}" for key, value in options.items() if key not in hidden]
    return " ".join([*words, *([part.word] if part.word else []), *pairs])


def _middle(part: CircuitPart, model: str, kinds: Mapping[str, str]) -> Iterator[str]:
    """The text between the nodes of an element and its options."""
    value, kind = part.value, part.kind
    yield from (f"{kinds[other]}.{INSIDE}{other}" for other in part.others)
    if model:
        yield model
    if value is not None and kind == "b":
        yield f"{part.form}={text_of(value, kinds)}"
    elif value is not None and kind in "cl" and part.form:
        yield f"{part.form}='{text_of(value, kinds)}'"
    elif value is not None:
        gain = value.value * part.multiplicity if kind in _LINEAR else value.value
        yield f"{_KEY_BESIDE_MODEL.get(kind, '') if model else _KEY.get(kind, '')}{gain!r}"
        if part.form:
            yield f"{part.form}({' '.join(map(repr, part.waveform))})"


def text_of(tree: Node, kinds: Mapping[str, str]) -> str:
    """The text of a function as a B source has it, every operation in parentheses."""
    operation = tree.operation
    inner = [text_of(argument, kinds) for argument in tree.arguments]
    if operation == "constant":
        return repr(tree.value) if tree.value >= 0.0 else f"({tree.value!r})"
    if operation == "v":
        return f"v({','.join(tree.names)})"
    if operation == "i":
        return f"i({kinds[tree.names[0]]}.{INSIDE}{tree.names[0]})"
    if operation in _INFIX:
        return f"({inner[0]} {_INFIX[operation]} {inner[1]})"
    if operation in _PREFIX:
        return f"({_PREFIX[operation]}{inner[0]})"
    if operation == "?":
        return f"({inner[0]} ? {inner[1]} : {inner[2]})"
    if operation == "pwl":
        points = [repr(point.value) for point in tree.arguments[1:]]
        return f"pwl({', '.join([inner[0], *points])})"
    return operation if not inner else f"{operation}({', '.join(inner)})"
