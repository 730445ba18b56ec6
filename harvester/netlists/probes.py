"""What to look at in a load circuit: the voltage of a node, the current through an element, the power that it takes.

    store       the voltage of the capacitor Csmooth
    v(a), v(a,b)  the voltage of node a against ground, or against node b (V); a net of a flat netlist by its name there
    i(d1)       the current through an element, from its first node to its second (A)
    p(d1)       the power that it takes, v i; p(load) is that of Rload (W)

A node or an element inside a called subcircuit x1 is x1.a, or x1.d2.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, unknown
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.read_lines import GROUND, NODES, Line
from harvester.netlists.subcircuits import header_of, joined, split_subcircuits

STORE = "store"
FORM = "be store, v(NODE), v(NODE,NODE), i(ELEMENT) or p(ELEMENT)"
MANY = 100
# The names of currents in ngspice, where they are not `i`, and kinds whose power ngspice itself knows.
_CURRENTS = {"d": "id", "i": "current", "q": "ic", "m": "id", "j": "id"}
_OF_NGSPICE = "qmj"


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
            terminals = [name.lower() for name in header_of(inner[0]).terminals]
            if len(call) != len(terminals) + 1:
                raise InputError(
                    f"netlist: '{line.text}' must give {len(terminals)} nodes to {call[-1]}, but gives {len(call) - 1}"
                )
            there = dict(zip(terminals, map(node, call[:-1]), strict=True))
            yield from _inside(inner, bodies, f"{path}{name}.", there)


@dataclass(frozen=True)
class Probe:
    """A quantity of the circuit as ngspice's vectors: (v(plus) - v(minus)) times ``factor``; "" is left out.

    ``unit`` is V, A or W; ``plus`` and ``minus`` are nodes of the whole circuit ("" is ground), ``factor`` the vector
    of a current, or of a power.
    """

    name: str
    unit: str
    plus: str = ""
    minus: str = ""
    factor: str = ""

    @property
    def vectors(self) -> tuple[str, ...]:
        """The names of ngspice's vectors that it is made of."""
        return tuple(vector for vector in (self.plus, self.minus, self.factor) if vector)

    def values(self, series: Mapping[str, Floats]) -> Floats:
        """Its values (in its ``unit``) from the vectors of a run by name, all of shape (n,)."""
        voltage = series["time"] * 0.0
        if self.plus:
            voltage = voltage + series[self.plus]
        if self.minus:
            voltage = voltage - series[self.minus]
        if not self.factor:
            return voltage
        factor = series[self.factor]
        return voltage * factor if self.plus or self.minus else factor


def read_probes(texts: Iterable[str], load: LoadCircuit) -> tuple[Probe, ...]:
    """The probes that texts name in a load circuit, each once.

    Raises InputError for a text of another form, and an unknown node or element, with the nearest match.
    """
    distinct = {text.strip().lower(): None for text in texts}
    if len(distinct) > MANY:
        raise invalid("`probe`", f"be given at most {MANY} times", len(distinct))
    there = elements(load)
    return tuple(_read(text, load, there) for text in distinct)


def element_powers(load: LoadCircuit) -> dict[str, list[Probe]]:
    """The power that each element of a load circuit takes, by its name: of a called subcircuit, all that is in it.

    Rload and Csmooth, which are not a part of the circuit's losses, and transmission lines, whose power ngspice does
    not tell, are left out.
    """
    parts: dict[str, list[Probe]] = {}
    for element in elements(load):
        if element.name not in ("rload", "csmooth") and element.kind != "t":
            parts.setdefault(element.part, []).append(_of_element("p", element.name, element, load))
    return parts


def _read(text: str, load: LoadCircuit, there: list[Element]) -> Probe:
    if text == STORE:
        return _store(load)
    name = r"([\w.+/~-]+)"
    match = re.fullmatch(rf"([vip])\(\s*{name}\s*(?:,\s*{name}\s*)?\)", text)
    if match is None or (match[1] != "v" and match[3]):
        raise invalid("`probe`", FORM, text)
    kind, first, second = match.groups()
    name = f"{kind}({first}{',' + second if second else ''})"
    if kind == "v":
        nodes = {node for element in there for node in element.nodes} | {*load.terminals, *GROUND}
        plus, minus = (_vector(_node(name, nodes, load), load) for name in (first, second or "0"))
        return Probe(name, "V", plus, minus)
    named = {element.name: element for element in there}
    first = load.renamed.get(first, first)
    if first == "load" and "load" not in named:
        first = "rload"
    if first not in named:
        raise unknown(f"element of netlist {load.name}", first, named)
    return _of_element(kind, name, named[first], load)


def _store(load: LoadCircuit) -> Probe:
    """The voltage of the storage capacitor."""
    if not load.smoothing_nodes:
        raise InputError(
            f"`probe` store must be the capacitor Csmooth of the netlist, but {load.name} has none: name a node or an "
            "element, such as p(load)"
        )
    plus, minus = (_vector(node, load) for node in load.smoothing_nodes)
    return Probe(STORE, "V", plus, minus)


def _node(name: str, nodes: set[str], load: LoadCircuit) -> str:
    """The node of a name, which may be that of a flat netlist's net, with or without its slash."""
    for candidate in (name, load.nets.get(name), load.nets.get(f"/{name}")):
        if candidate in nodes:
            return candidate
    raise unknown(f"node of netlist {load.name}", name, sorted(nodes))


def _of_element(kind: str, name: str, element: Element, load: LoadCircuit) -> Probe:
    """The probe of an element's current (``kind`` i) or power (p)."""
    path = f"@{element.kind}.xload.{element.name}"
    if element.kind == "t":
        raise invalid("`probe`", "be of an element whose current ngspice tells, not a transmission line", name)
    if kind == "i":
        return Probe(name, "A", factor=f"{path}[{_CURRENTS.get(element.kind, 'i')}]")
    if element.kind in _OF_NGSPICE:
        return Probe(name, "W", factor=f"{path}[p]")
    plus, minus = (_vector(node, load) for node in element.nodes)
    return Probe(name, "W", plus, minus, f"{path}[{_CURRENTS.get(element.kind, 'i')}]")


def _vector(node: str, load: LoadCircuit) -> str:
    """The vector of a node of the load in the whole circuit, where its second terminal is ground."""
    ground = f"xload.{load.ground}" if load.ground else ""
    outer = {load.terminals[0]: "p", load.terminals[1]: ""} | dict.fromkeys(GROUND, ground)
    return outer.get(node, f"xload.{node}")
