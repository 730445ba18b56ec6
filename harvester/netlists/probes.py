"""The probes of a load circuit: the voltage of a node, the current through an element, its power.

    store       the voltage of the capacitor Csmooth
    v(a), v(a,b)  the voltage of node a against ground, or against node b (V); a net of a flat netlist by its name there
    i(d1)       the current through an element, from its first node to its second (A)
    p(d1)       the power that it dissipates, v i; p(load) is that of Rload (W)

A node or an element inside a called subcircuit x1 is x1.a, or x1.d2.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, unknown
from harvester.netlists.part import GROUND, INSIDE, PIEZO, CircuitPart, by_name

if TYPE_CHECKING:
    from harvester.netlists.load_circuit import LoadCircuit

STORE = "store"
FORM = "be store, v(NODE), v(NODE,NODE), i(ELEMENT) or p(ELEMENT)"
MANY = 100
# The names of currents in ngspice, where they are not `i`, and kinds whose power ngspice itself
# knows.
_CURRENTS = {"d": "id", "i": "current", "q": "ic", "m": "id", "j": "id"}
_OF_NGSPICE = "qmj"


@dataclass(frozen=True)
class Probe:
    """A quantity of the circuit as ngspice's vectors: (v(plus) - v(minus)) times ``factor``; "" is left out.

    ``unit`` is V, A or W; ``plus`` and ``minus`` are nodes of the whole circuit ("" is ground),
    ``factor`` the vector of a current, or of a power.
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


def read_probes(texts: Iterable[str], load: "LoadCircuit") -> tuple[Probe, ...]:
    """The probes that texts name in a load circuit, each once.

    Raises InputError for a text of another form, and an unknown node or element, with the nearest
    match.
    """
    distinct: dict[str, str] = {}
    for text in texts:
        distinct.setdefault(text.strip().lower(), text.strip())
    if len(distinct) > MANY:
        raise invalid("`probe`", f"be given at most {MANY} times", len(distinct))
    return tuple(_read(text, load, typed) for text, typed in distinct.items())


def element_powers(load: "LoadCircuit") -> dict[str, list[Probe]]:
    """The power of each element of a load circuit, by its name: for a called subcircuit, all that is in it.

    Rload and Csmooth, which are not a part of the circuit's losses, couplings of inductors, which
    dissipate nothing, and transmission lines, whose power ngspice does not report, are left out.
    """
    parts: dict[str, list[Probe]] = {}
    for part in load.parts:
        if part.name not in ("rload", "csmooth") and part.kind not in "kt":
            parts.setdefault(part.name.partition(".")[0], []).append(
                _of_element("p", part.name, part)
            )
    return parts


def _read(text: str, load: "LoadCircuit", typed: str) -> Probe:
    """The probe of a text in lower case; a net keeps the ``typed`` letters of its schematic."""
    if text == STORE:
        return _store(load)
    name = r"([\w.+/~-]+)"
    match = re.fullmatch(rf"([vip])\(\s*{name}\s*(?:,\s*{name}\s*)?\)", text)
    if match is None or (match[1] != "v" and match[3]):
        must = f"{FORM}, such as v({typed})" if re.fullmatch(name, text) else FORM
        raise invalid("`probe`", must, typed)
    kind, first, second = match.groups()
    name = f"{kind}({first}{',' + second if second else ''})"
    if kind == "v":
        plus, minus = (_vector(_node(name, load)) for name in (first, second or "0"))
        return Probe(f"v{''.join(typed[1:].split())}", "V", plus, minus)
    named = {name: part for name, part in by_name(load.parts).items() if part.kind != "k"}
    first = load.renamed.get(first, first)
    if first == "load" and "load" not in named:
        first = "rload"
    if first not in named:
        raise unknown(f"element of netlist {load.name}", first, named)
    return _of_element(kind, name, named[first])


def _store(load: "LoadCircuit") -> Probe:
    """The voltage of the storage capacitor."""
    if not load.smoothing_nodes:
        raise InputError(
            f"`probe` store must be the capacitor Csmooth of the netlist, but {load.name} has none: name a node or an "
            "element, such as p(load)"
        )
    plus, minus = map(_vector, load.smoothing_nodes)
    return Probe(STORE, "V", plus, minus)


def _node(name: str, load: "LoadCircuit") -> str:
    """The node of a name: that of a terminal, of a flat netlist's net, with or without its slash, or one inside."""
    if name in GROUND:
        return load.ground
    there = {node for part in load.parts for node in part.nodes} | {PIEZO, "0"}
    for candidate in (load.names.get(name), load.names.get(f"/{name}"), INSIDE + name):
        if candidate in there:
            return candidate
    inside = [node.removeprefix(INSIDE) for node in there if node.startswith(INSIDE)]
    raise unknown(f"node of netlist {load.name}", name, sorted({*inside, *load.names, *GROUND}))


def _of_element(kind: str, name: str, part: CircuitPart) -> Probe:
    """The probe of an element's current (``kind`` i) or power (p)."""
    if part.kind == "t":
        raise invalid(
            "`probe`",
            "be of an element whose current ngspice reports, not a transmission line",
            name,
        )
    current = f"@{part.in_ngspice}[{_CURRENTS.get(part.kind, 'i')}]"
    if kind == "i":
        return Probe(name, "A", factor=current)
    if part.kind in _OF_NGSPICE:
        return Probe(name, "W", factor=f"@{part.in_ngspice}[p]")
    plus, minus = map(_vector, part.nodes[:2])
    return Probe(name, "W", plus, minus, current)


def _vector(node: str) -> str:
    """The vector of a node of the whole circuit; the second terminal is ground, which has none."""
    return "" if node == "0" else node
