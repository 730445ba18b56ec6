"""The elements of a load circuit, its inner subcircuits written out: their names, and the nodes that they connect."""

from collections.abc import Iterator
from dataclasses import dataclass

from harvester.errors import InputError
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.read_lines import Line
from harvester.netlists.subcircuits import header_of, joined, split_subcircuits
from harvester.netlists.syntax import GROUND, NODES


@dataclass(frozen=True)
class Element:
    """An element: its name and nodes in lower case, those in a subcircuit x1 as ``x1.d2``; ground is ``0``."""

    name: str
    nodes: tuple[str, ...]

    @property
    def kind(self) -> str:
        """The letter of its kind: d is a diode."""
        return self.name.rpartition(".")[2][0]

    @property
    def part(self) -> str:
        """The name of the element of the load circuit itself that it is, or that it is in."""
        return self.name.partition(".")[0]


def elements(load: LoadCircuit) -> list[Element]:
    """The elements of a load circuit in their order; couplings of coils, which take nothing, are left out."""
    lines = [Line("load", text) for text in load.text.splitlines()]
    bodies, _ = split_subcircuits("load", [line for line in lines if line.text])
    return list(_inside(bodies[load.name.lower()], bodies, "", {}))


def _inside(body: list[Line], bodies: dict[str, list[Line]], path: str, outer: dict[str, str]) -> Iterator[Element]:
    """The elements of one call of a subcircuit; ``outer`` are the nodes without, by the name of the terminal."""

    def node(name: str) -> str:
        return "0" if name in GROUND else outer.get(name, path + name)

    for line in body:
        text = joined(line.text.lower())
        name, *call = text.split()
        if name[0] in NODES:
            words = text.replace("(", " ").replace(")", " ").replace(",", " ").split()[1:]
            yield Element(path + name, tuple(map(node, words[: NODES[name[0]]])))
        elif name[0] == "x":
            call = [word for word in call if "=" not in word and word != "params:"]
            inner = bodies[call[-1]]
            terminals = [one.lower() for one in header_of(inner[0]).terminals]
            if len(call) != len(terminals) + 1:
                raise InputError(
                    f"netlist: '{line.text}' must give {len(terminals)} nodes to {call[-1]}, but gives {len(call) - 1}"
                )
            there = dict(zip(terminals, map(node, call[:-1]), strict=True))
            yield from _inside(inner, bodies, f"{path}{name}.", there)
