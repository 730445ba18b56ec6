"""Netlists that have no solution, or none that can be computed: one line each, which names the element."""

from collections.abc import Iterable, Iterator

from harvester.circuits.stamps import stamp
from harvester.circuits.system import System
from harvester.errors import InputError
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.part import INSIDE, CircuitPart, UnservedError

MOST_NODES = 150
# kinds that connect no nodes: a current source forces its current through the others
_NO_PATH = "ik"
_SOURCES = "veh"  # kinds that set the voltage between their nodes


class _Groups:
    """Nodes joined step by step (union-find)."""

    def __init__(self) -> None:
        self.parent: dict[str, str] = {}

    def of(self, node: str) -> str:
        """The group of a node, by the name of one of its nodes."""
        while (above := self.parent.setdefault(node, node)) != node:
            node = above
        return node

    def join(self, first: str, second: str) -> bool:
        """Join the groups of two nodes; whether they were apart."""
        a, b = self.of(first), self.of(second)
        self.parent[a] = b
        return a != b


def check_solvable(load: LoadCircuit) -> None:
    """As `check_parts`, whatever engine computes the circuit."""
    check_parts(load.parts)


def check_size(parts: Iterable[CircuitPart]) -> None:
    """Raise UnservedError for too many nodes."""
    nodes: set[str] = set()
    for part in parts:
        nodes.update(part.nodes)
        if len(nodes) > MOST_NODES:
            raise UnservedError(
                f"{part.where} is the first beyond {MOST_NODES} nodes, which a compiled circuit may have"
            )


def check_parts(parts: Iterable[CircuitPart]) -> None:
    """Raise InputError for elements without a path to the piezo, loops of voltage sources."""
    paths, sources = _Groups(), _Groups()
    paths.join("p", "0")
    parts = list(parts)
    for part in parts:
        if part.kind not in _NO_PATH:
            for other in part.nodes[1:]:
                paths.join(part.nodes[0], other)
        if sets_voltage(part) and not sources.join(*part.nodes[:2]):
            raise InputError(
                f"{part.where} must not close a loop of voltage sources, but does: put a resistor in series"
            )
        if sources.of("p") == sources.of("0"):
            raise InputError(
                f"{part.where} must not set the piezo's voltage, but does: leave the source out, as the device drives "
                "the netlist"
            )
    for part in parts:
        for node in part.nodes:
            if paths.of(node) != paths.of("0"):
                raise InputError(
                    f"{part.where} must have a path to the piezo, but its node {node.removeprefix(INSIDE)!r} has none: "
                    "connect it by an element"
                )


def sets_voltage(part: CircuitPart) -> bool:
    """Whether an element is a voltage source."""
    return part.kind in _SOURCES or (part.kind == "b" and part.form == "v")


def unserved_parts(
    parts: dict[str, CircuitPart], capacitance: float = 1e-8
) -> Iterator[tuple[str, str]]:
    """Every element, and why compiled circuits do not have it; "" if they do."""
    for name, part in parts.items():
        try:
            stamp(part, System(capacitance), parts)
        except InputError as error:
            yield name, str(error).removeprefix(f"{part.where} ")
        else:
            yield name, ""
