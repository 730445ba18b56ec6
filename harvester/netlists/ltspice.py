"""Constructs of LTspice that ngspice refuses or leaves out, as elements that both have.

    D(Ron= Roff= Vfwd= Vrev= Rrev=)
        i = v/Roff + (1/Ron - 1/Roff) (v - Vfwd)^+ - (1/Rrev - 1/Roff) (-v - Vrev)^+
    C a b 10u Rser=0.1 Lser=2n
        the capacitor from a, in series with a resistor and an inductor
    L a b 10m Rser=20
        the inductor from a, in series with a resistor; a source V alike
    limit(x, a, b)
        min(max(x, min(a, b)), max(a, b))

ngspice refuses each of them or leaves its keys out; limit has two arguments there, and draws a
random number.  If both programs read a text differently, such as ``4k7``, ngspice's meaning is kept
(`harvester.netlists.unintended` warns).

Source: LTspice 24's help, "D. Diode", "C. Capacitor", "L. Inductor" and "B. Arbitrary Behavioral
Voltage or Current Sources".
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from harvester.netlists.element_lines import Element
from harvester.netlists.expression_tree import Node, constant, operation
from harvester.netlists.part import CircuitPart

SERIES = ("rser", "lser")  # keys of what is in series with a capacitor, an inductor or a source
RON, ROFF = 1.0, 1e12  # ohm, of an ideal diode without these keys
INNER = "#"  # behind the name of an element: a node within it


def parts_of(element: Element) -> Iterator[Element]:
    """The element, and those of its keys Rser and Lser, in series behind its second node."""
    if element.kind not in "clv" or not set(SERIES) & element.options.keys():
        yield element
        return
    name = element.name
    options = dict(element.options)
    given = {key: tree for key in SERIES if (tree := options.pop(key, None)) is not None}
    series = {
        key: tree for key, tree in given.items() if not (tree.is_constant and tree.value == 0.0)
    }
    if not series:
        yield replace(element, options=options)
        return
    inner = [f"{name.lower()}{INNER}{k + 1}" for k in range(len(series))]
    nodes = [*inner, element.nodes[1]]
    yield replace(element, nodes=(element.nodes[0], nodes[0]), options=options)
    several = {"m": options["m"]} if "m" in options else {}
    for k, (key, tree) in enumerate(series.items()):
        made = f"{key.capitalize()}_{name}"
        yield Element(element.line, made, (nodes[k], nodes[k + 1]), tree, options=several)


def inner_nodes(parts: Iterable[CircuitPart]) -> dict[str, str]:
    """The nodes that `parts_of` has made, each with the outer node of its voltage at no current."""
    named = [(part, part.name[len(part.path) :].partition("_")[0]) for part in parts]
    several = Counter(
        (part.path, part.line) for part, _ in named
    )  # which an element and its series share
    outer: dict[str, str] = {}
    for key in reversed(SERIES):
        for part, begin in named:
            if begin == key and several[part.path, part.line] > 1:
                outer[part.nodes[0]] = outer.get(part.nodes[1], part.nodes[1])
    return outer


def ideal_current(nodes: tuple[str, ...], model: Mapping[str, float]) -> Node:
    """The current of an ideal diode from its first node to its second: three straight lines."""
    voltage = Node("v", names=nodes[:2])
    on, off = 1.0 / model.get("ron", RON), 1.0 / model.get("roff", ROFF)
    current = operation("*", constant(off), voltage)
    above = operation("uramp", operation("-", voltage, constant(model.get("vfwd", 0.0))))
    current = operation("+", current, operation("*", constant(on - off), above))
    if "vrev" not in model:
        return current
    back = 1.0 / model.get("rrev", model.get("ron", RON))
    below = operation(
        "uramp", operation("-", operation("negative", voltage), constant(model["vrev"]))
    )
    return operation("-", current, operation("*", constant(back - off), below))
