"""An element of a load circuit as everything reads it: its nodes in the whole circuit, and its values.

`harvester.netlists.written_out` makes them of a netlist; engine `compiled` makes its equations of
them, and the text that ngspice gets is written from them (`harvester.netlists.for_ngspice`), so
that both compute the circuit that was read here.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from harvester.errors import CannotServeError
from harvester.netlists.expression_tree import Node, with_leaves

GROUND = ("0", "gnd")
PIEZO = "p"  # node of the first electrode in the whole circuit; the second is "0"
ROOM = 27.0  # degrees Celsius, of the circuit and of models, unless they state another one
INSIDE = "xload."  # what the names of all other nodes and of the elements begin with in ngspice


@dataclass(frozen=True)
class ModelCard:
    """A model card: its name in the whole circuit, the type such as ``d``, its numbers and its words by their names."""

    name: str
    kind: str
    values: Mapping[str, float] = field(default_factory=dict)
    words: tuple[str, ...] = ()

    def value(self, *names: str, default: float = 0.0) -> float:
        """A parameter that has several names."""
        return next((self.values[name] for name in names if name in self.values), default)


@dataclass(frozen=True)
class CircuitPart:
    """An element, its subcircuits written out.

    name
        as ``x1.d2``, in lower case.
    nodes
        in the whole circuit: `PIEZO`, ``0``, or a name as ``x1.a``; those that control an E, G or S
        come last.
    value
        the value of a resistor, capacitor, inductor or source, or the gain of a controlled one, as
        a constant; that of a B source as a tree, whose leaves name nodes and elements of the whole
        circuit.
    form
        ``i`` or ``v`` of a B source, ``c`` or ``q`` of a capacitor whose value is a function, ``l``
        of such an inductor; for a source that changes with time the name of its waveform, such as
        ``sin``.
    model
        of a semiconductor, a switch, or a resistor of a model.
    others
        the elements that an F, H, K or W names.
    options
        numbers by the names of their keys, such as ``m``, how many are side by side.
    waveform
        the numbers of a source that changes with time.
    word
        ``on`` or ``off`` of a switch.
    line
        the file and the line of its text.
    """

    name: str
    nodes: tuple[str, ...]
    value: Node | None = None
    form: str = ""
    model: ModelCard | None = None
    others: tuple[str, ...] = ()
    options: Mapping[str, float] = field(default_factory=dict)
    waveform: tuple[float, ...] = ()
    word: str = ""
    line: str = ""
    kind: str = ""

    @property
    def where(self) -> str:
        """The element, as an error names it."""
        return f"netlist element {self.name}"

    @property
    def path(self) -> str:
        """That of its subcircuit, as ``x1.``; "" of the load circuit itself."""
        return self.name[: self.name.rfind(".") + 1]

    @property
    def multiplicity(self) -> float:
        """How many of it are side by side."""
        return self.options.get("m", 1.0)

    @property
    def number(self) -> float | None:
        """Its value, if that is a constant."""
        return self.value.value if self.value is not None and self.value.is_constant else None

    @property
    def effective_value(self) -> float | None:
        """The resistance, capacitance or inductance, all that are side by side.

        None if it has none.

            R scale/m,    C scale m,    L scale/m

        It is None for an element whose model or own temperature decides.
        """
        decided_elsewhere = {"temp", "dtemp"} & self.options.keys() or (
            self.model is not None and self.model.value("tnom", "tref", default=ROOM) != ROOM
        )
        if self.number is None or self.form or decided_elsewhere:
            return None
        number = self.number * self.options.get("scale", 1.0)
        return number * self.multiplicity if self.kind == "c" else number / self.multiplicity

    @property
    def nodes_read(self) -> frozenset[str]:
        """The nodes whose voltages its function reads; a voltage of one node alone is against ground."""
        leaves = self.value.leaves if self.value is not None else set[Node]()
        return frozenset(
            name for leaf in leaves if leaf.operation == "v" for name in (*leaf.names, "0")[:2]
        )

    @property
    def in_ngspice(self) -> str:
        """Its name in ngspice, with the letter of its kind."""
        return f"{self.kind}.{INSIDE}{self.name}"

    def renamed(self, names: Mapping[str, str]) -> "CircuitPart":
        """The element with other names of some nodes, also in its function."""

        def leaf(node: Node) -> Node:
            if node.operation != "v":
                return node
            return Node("v", names=tuple(names.get(name, name) for name in node.names))

        value = None if self.value is None else with_leaves(self.value, leaf)
        return replace(self, nodes=tuple(names.get(node, node) for node in self.nodes), value=value)


class UnservedError(CannotServeError):
    """A compiled circuit does not have this element, or this form of it."""


def unserved(part: CircuitPart, why: str) -> UnservedError:
    """The error of an element that is not supported."""
    return UnservedError(f"{part.where} {why}")


def by_name(parts: Iterable[CircuitPart]) -> dict[str, CircuitPart]:
    """The elements by their names."""
    return {part.name: part for part in parts}
