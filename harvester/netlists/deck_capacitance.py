"""The capacitance of a deck's piezo: names have the values that they have in the deck.

In a subcircuit, a call's value precedes a .param card, that before a default of the head; any other
name is the deck's (as in `harvester.netlists.written_out`).
"""

import contextlib
import re
from collections.abc import Mapping

from harvester.errors import InputError, invalid
from harvester.netlists.deck_device import DeckDevice
from harvester.netlists.element_lines import Element
from harvester.netlists.expression_tree import Node, constant, with_leaves
from harvester.netlists.words import parameter_value
from harvester.quantities.units import SYMBOLS

DEEPEST = 100  # parameters that need each other in turn


def parameters_of(text: str) -> dict[str, str]:
    """The texts of the parameters that a card sets, by their names in lower case."""
    pairs = re.findall(
        r"(\w+)\s*=(?!=)\s*((?:\{[^}]*\}|'[^']*'|\"[^\"]*\"|(?!\s*,?\s*\w+\s*=(?!=))[^{}'\"])+)",
        text,
    )
    return {name.lower(): value.strip().rstrip(",").strip() for name, value in pairs}


def capacitance_of(device: DeckDevice, parameters: Mapping[str, str]) -> str:
    """The sum of the capacitances (F), as a scene's number with a prefix.

    Each is C scale m, times m of the call of its subcircuit.  ``parameters`` are the texts of the
    deck's parameters by name.  It is "" without a capacitor, and if a value is not known, as that
    of a function of the netlist.

    Raises InputError for a capacitance that is not finite and above 0.
    """
    deck = _Names(parameters)
    call = next((each for each in device.drives if each.kind == "x"), None)
    given = {} if call is None else {key: deck.value(tree) for key, tree in call.options.items()}
    times = given.pop("m", 1.0)
    names = deck if call is None else _Names(device.parameters, given, deck)
    total = 0.0
    for each in device.capacitors:
        value = _product(names, each)
        if value is None or times is None:
            return ""
        if not 0.0 < value * times < float("inf"):
            must = "have a finite capacitance above 0 F"
            raise invalid(f"{each.name} of deck {each.line.where}", must, f"{value * times:g}")
        total += value * times
    if not device.capacitors:
        return ""
    power = max((p for p in SYMBOLS if p <= 0 and 10.0**p <= total * (1 + 1e-9)), default=-15)
    return f"{total / 10.0**power:.12g}{SYMBOLS[power]}"


def _product(names: "_Names", capacitor: Element) -> float | None:
    """C scale m of a capacitor (F); None if one of them is not known."""
    options = (capacitor.options.get(key, constant(1.0)) for key in ("scale", "m"))
    product = 1.0
    for tree in (capacitor.value, *options):
        value = None if tree is None else names.value(tree)
        if value is None:
            return None
        product *= value
    return product


def _has_call(tree: Node) -> bool:
    """Whether a tree has a function of the netlist."""
    return tree.operation == "call" or any(map(_has_call, tree.arguments))


class _Names:
    """The values of names: those of a call, and others by their texts."""

    def __init__(
        self,
        texts: Mapping[str, str],
        given: Mapping[str, float | None] | None = None,
        outer: "_Names | None" = None,
    ) -> None:
        self.outer = outer
        self.sought: list[str] = []
        self.texts = texts
        self.values = dict(given or {})

    def value(self, tree: Node) -> float | None:
        """The value of a tree; None if it is not known."""
        if _has_call(tree):
            return None
        whole = with_leaves(tree, self._leaf)
        return whole.value if whole.is_constant else None

    def _leaf(self, node: Node) -> Node:
        value = self._named(node.names[0]) if node.operation == "name" else None
        return node if value is None else constant(value)

    def _named(self, name: str) -> float | None:
        if name in self.values:
            return self.values[name]
        if name not in self.texts or self.sought[-1:] == [name]:  # c={c} is the deck's
            return None if self.outer is None else self.outer._named(name)
        if name in self.sought or len(self.sought) == DEEPEST:
            return None
        self.sought.append(name)
        value = None
        # an error is the board's, which refuses the card if it has it
        with contextlib.suppress(InputError):
            value = self.value(parameter_value(self.texts[name].lower(), name))
        self.sought.pop()
        self.values[name] = value
        return value
