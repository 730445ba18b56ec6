"""The terms of junctions and transistors in the equations of their circuit: ngspice's models of level 1.

With F(v, n) = exp(v/n) - 1 above -3 n, and -1 below, n = N k T/e, and voltages of a p type counted
the other way:

    bipolar   Ic = (I - J)/qb - J/Br - Isc F(vbc, nc)       I = Is F(vbe, nf),  J = Is F(vbc, nr)
              Ib = I/Bf + Ise F(vbe, ne) + J/Br + Isc F(vbc, nc)
              q1 = 1/(1 - vbc/Vaf - vbe/Var),  qb = q1 (1 + sqrt(1 + 4 q1 (I/Ikf + J/Ikr)))/2
    MOSFET    Id = Kp W/(L - 2 Ld) (1 + lambda vds) (g^2/2 for g < vds, else vds (g - vds/2)),  g = vgs - Vto - ... > 0
    JFET      Id = beta (1 + lambda vds) (g^2 for g < vds, else vds (2 g - vds)),  g = vgs - Vto > 0

A body at another voltage than the source adds gamma (sqrt(phi - vbs) - sqrt(phi)) to Vto.  For vds
< 0 drain and source change places.  Charges are those of the junctions, Tf I and Tr J.

Left out: how Tf grows with current (Xtf, Vtf, Itf) and its phase, and Cjs; a MOSFET's Meyer
capacitances (Tox).

Source: ngspice's bjtload.c, mos1load.c and jfetload.c; Gummel, Poon, Bell Syst. Tech. J. 49, 827,
1970; Shichman, Hodges, IEEE J. Solid-State Circuits 3, 285, 1968.
"""

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass

from harvester.circuits.junctions import THERMAL
from harvester.circuits.semiconductors import area_of, model_of
from harvester.circuits.system import GMIN, Diode, Function, Junction, Row, System
from harvester.errors import InputError
from harvester.netlists.expression import SOURCES, read
from harvester.netlists.expression_tree import Node, constant, with_leaves
from harvester.netlists.part import CircuitPart, ModelCard, unserved

_BIPOLAR = {
    *(
        "is",
        "bf",
        "nf",
        "vaf",
        "va",
        "ikf",
        "ik",
        "ise",
        "ne",
        "br",
        "nr",
        "var",
        "vb",
        "ikr",
        "isc",
        "nc",
        "rb",
    ),
    *(
        "re",
        "rc",
        "cje",
        "vje",
        "pe",
        "mje",
        "me",
        "cjc",
        "vjc",
        "pc",
        "mjc",
        "mc",
        "xcjc",
        "fc",
        "tf",
        "tr",
    ),
    *("xtf", "vtf", "itf", "ptf"),
}
_MOSFET = {
    *(
        "vto",
        "vt0",
        "kp",
        "gamma",
        "phi",
        "lambda",
        "rd",
        "rs",
        "is",
        "cbd",
        "cbs",
        "pb",
        "mj",
        "fc",
        "ld",
    ),
    *("cgso", "cgdo", "cgbo"),
}
_JFET = {"vto", "vt0", "beta", "lambda", "rd", "rs", "is", "cgs", "cgd", "pb", "fc"}
_FIELD = """vds < 0 ? -(backward > 0 ? beta*(1 - slope*vds)*(backward < -vds ? half*backward*backward
                                        : -vds*(2*half*backward + half*vds)) : 0)
    : (forward > 0 ? beta*(1 + slope*vds)*(forward < vds ? half*forward*forward
                                        : vds*(2*half*forward - half*vds)) : 0)"""


def _tree(text: str, names: Mapping[str, float | Node]) -> Node:
    """The tree of one of the models' own formulas, of trees and numbers by their names."""

    def leaf(node: Node) -> Node:
        value = names[node.names[0]]
        return value if isinstance(value, Node) else constant(value)

    return with_leaves(read(text, "a model", SOURCES), leaf)


@dataclass(frozen=True)
class Layer:
    """The stored charge of a junction: Cjo (F), Vj (V), M, Fc, and the transit time Tt (s) of its current."""

    capacitance: float = 0.0
    built_in: float = 1.0
    grading: float = 0.5
    forward: float = 0.5
    transit: float = 0.0


def behind(system: System, node: str, inner: str, resistance: float) -> str:
    """The node ``inner`` behind a series resistance (ohm) from a node, which is the node itself if that is 0."""
    if not resistance > 0.0:
        return node
    row = system.across(node, inner)
    system.add(row, row, 1.0 / resistance)
    system.series.append(row)
    return inner


def add_junction(
    system: System, row: Row, limits: Junction, layer: Layer, shunt: float = GMIN
) -> Node:
    """Add a junction across a ``row`` of voltages, with a parallel ``shunt`` (S); the leaf of its voltage."""
    if not row:
        return constant(0.0)
    system.add_leak(row, shunt)
    v = system.input(row, limits)
    _add_current(system, v, row, limits, layer)
    return v


def _add_current(system: System, v: Node, row: Row, of: Junction, layer: Layer) -> None:
    """Add a current of a junction whose voltage is limited already."""
    arguments = of.saturation, of.thermal, of.breakdown, of.reverse, *astuple(layer)
    system.diodes.append(Diode(v.index, arguments, row))


def _across(system: System, first: str, second: str, reversed_: bool) -> Row:
    """The row of the voltage from one node to another, the other way round for a p type."""
    return system.across(second, first) if reversed_ else system.across(first, second)


@dataclass(frozen=True)
class _Side:
    """A junction of a bipolar transistor: its letter, its direction, and the names and usual values of its card."""

    letter: str
    direction: str
    gain: str
    usual_gain: float
    leak: str
    usual_leak: float


_SIDES = {
    "be": _Side("e", "f", "bf", 100.0, "ise", 1.5),
    "bc": _Side("c", "r", "br", 1.0, "isc", 2.0),
}


def bipolar(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a bipolar transistor of Gummel and Poon."""
    model = model_of(part, ("npn", "pnp"), _BIPOLAR)
    area = area_of(part)
    known = model.value
    p_type = model.kind == "pnp"
    nodes = zip("cbe", part.nodes[:3], strict=True)
    if {"areab", "areac"} & part.options.keys():
        raise unserved(part, "has an area of its base or collector")
    c, b, e = (
        behind(system, node, f"{part.name}#{pin}", known(f"r{pin}") / area) for pin, node in nodes
    )
    rows = {"be": _across(system, b, e, p_type), "bc": _across(system, b, c, p_type)}
    if not all(rows.values()):
        raise unserved(part, "has its base connected to its collector or emitter: take a diode")
    names: dict[str, float | Node] = {}
    for (pair, side), name in zip(_SIDES.items(), "fr", strict=True):
        names[pair], names[name] = _base_junction(part, system, model, rows[pair], side, area)
    share = known("xcjc", default=1.0)
    outer = _across(system, part.nodes[1], c, p_type)
    if share < 1.0 and outer:
        limits = Junction(known("nr", default=1.0) * THERMAL, 0.0)
        add_junction(
            system, outer, limits, _layer(model, _SIDES["bc"], (1.0 - share) * area, 0.0), 0.0
        )
    early = known("vaf", "va"), known("var", "vb")
    knees = known("ikf", "ik") * area, known("ikr") * area
    names |= {name: 1.0 / v if v else 0.0 for name, v in zip("ghkl", (*early, *knees), strict=True)}
    names["q"] = _tree("1/(1 - bc*g - be*h)", names) if any(early) else constant(1.0)
    if any(knees):
        names["q"] = _tree("q*(1 + sqrt(max(1 + 4*q*(f*k + r*l), 0)))/2", names)
    row = _across(system, c, e, p_type)
    if row:
        system.add_leak(row)
        system.functions.append(Function(_tree("(f - r)/q", names), row))


def _layer(model: ModelCard, side: _Side, area: float, transit: float) -> Layer:
    """The stored charge of a junction of a bipolar transistor."""
    known, letter = model.value, side.letter
    return Layer(
        known(f"cj{letter}") * area,
        built_in=known(f"vj{letter}", f"p{letter}", default=0.75),
        grading=known(f"mj{letter}", f"m{letter}", default=0.33),
        forward=min(known("fc", default=0.5), 0.9999),
        transit=transit,
    )


def _base_junction(
    part: CircuitPart, system: System, model: ModelCard, row: Row, side: _Side, area: float
) -> tuple[Node, Node]:
    """Add a junction of a bipolar transistor with its leakage: its voltage, and the current that it controls."""
    known = model.value
    # by which ngspice multiplies Is twice there
    again = part.options.get("area", 1.0) if side.letter == "c" else 1.0
    saturation = known("is", default=1e-16) * area * again
    thermal = known(f"n{side.direction}", default=1.0) * THERMAL
    gain = known(side.gain, default=side.usual_gain)
    inside = known("xcjc", default=1.0) if side.letter == "c" else 1.0
    v = system.input(row, Junction(thermal, saturation))
    system.add_leak(row, GMIN / gain)
    layer = _layer(model, side, inside * area, gain * known(f"t{side.direction}"))
    _add_current(system, v, row, Junction(thermal, saturation / gain), layer)
    if leaked := known(side.leak) * area:
        _add_current(
            system,
            v,
            row,
            Junction(known(f"n{side.letter}", default=side.usual_leak) * THERMAL, leaked),
            Layer(),
        )
    names: dict[str, float | Node] = {"v": v, "n": thermal, "i": saturation}
    return v, _tree("v > -3*n ? i*(exp(v/n) - 1) : -i", names)


def mosfet(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a MOSFET of Shichman and Hodges."""
    if len(part.nodes) < 4:
        raise unserved(part, "has a model of the type vdmos, a vertical MOSFET")
    model = model_of(part, ("nmos", "pmos"), _MOSFET)
    known = model.value
    p_type = model.kind == "pmos"
    options = part.options
    many, width = options.get("m", 1.0), options.get("w", 1e-4)
    length = options.get("l", 1e-4) - 2.0 * known("ld")
    if not min(many, width, length) > 0.0:
        raise InputError(f"{part.where} must have W, M and L - 2 Ld above 0")
    d, g, s, body = part.nodes[:4]
    d, s = (
        behind(system, node, f"{part.name}#{pin}", known(f"r{pin}") / many)
        for node, pin in ((d, "d"), (s, "s"))
    )
    phi = known("phi", default=0.6)
    sign = -1.0 if p_type else 1.0
    gamma = known("gamma")
    bulk = Junction(THERMAL, known("is", default=1e-14) * many)
    names: dict[str, float | Node] = {
        "beta": known("kp", default=2e-5) * width / length * many, "half": 0.5, "slope": known("lambda"),
        "vto": sign * known("vto", "vt0"), "gamma": gamma, "phi": phi, "root": math.sqrt(phi),
    }  # fmt: skip
    for pin, node, capacitance in (("d", d, known("cbd")), ("s", s, known("cbs"))):
        across = _across(system, body, node, p_type)
        layer = Layer(
            capacitance * many,
            built_in=known("pb", default=0.8),
            grading=known("mj", default=0.5),
            forward=known("fc", default=0.5),
        )
        names["b" + pin] = add_junction(system, across, bulk, layer)
        overlap = system.across(g, node)
        _add_capacitor(system, f"{part.name}#{pin}", overlap, known(f"cg{pin}o") * width * many)
    _add_capacitor(system, f"{part.name}#b", system.across(g, body), known("cgbo") * length * many)
    raised = (
        "- gamma*((vb < 0 ? sqrt(max(phi - vb, 0)) : max(root - vb/(2*root), 0)) - root)"
        if gamma
        else ""
    )
    _add_channel(part, system, (d, g, s), p_type, names, raised)


def jfet(part: CircuitPart, system: System, parts: Mapping[str, CircuitPart]) -> None:
    """Add a JFET of Shichman and Hodges."""
    model = model_of(part, ("njf", "pjf"), _JFET)
    area = area_of(part)
    known = model.value
    p_type = model.kind == "pjf"
    d, g, s = part.nodes[:3]
    d, s = (
        behind(system, node, f"{part.name}#{pin}", known(f"r{pin}") / area)
        for node, pin in ((d, "d"), (s, "s"))
    )
    gate = Junction(THERMAL, known("is", default=1e-14) * area)
    built_in = known("pb", default=1.0)
    for pin, node in (("d", d), ("s", s)):
        layer = Layer(known(f"cg{pin}") * area, built_in, forward=known("fc", default=0.5))
        add_junction(system, _across(system, g, node, p_type), gate, layer)
    if channel := _across(system, d, s, p_type):
        system.add_leak(channel)
    names = {"beta": known("beta", default=1e-4) * area, "half": 1.0, "slope": known("lambda")}
    _add_channel(
        part, system, (d, g, s), p_type, {**names, "vto": known("vto", "vt0", default=-2.0)}, ""
    )


def _add_channel(
    part: CircuitPart,
    system: System,
    nodes: tuple[str, str, str],
    p_type: bool,
    names: dict[str, float | Node],
    raised: str,
) -> None:
    """Add the current of a channel from drain to source; ``raised`` is the text for a body at a voltage vb."""
    d, g, s = nodes
    row = _across(system, d, s, p_type)
    if not row:
        return

    def leaf(first: str, second: str) -> Node:
        across = _across(system, first, second, p_type)
        return system.input(across) if across else constant(0.0)

    names = {**names, "vds": leaf(d, s), "gs": leaf(g, s), "gd": leaf(g, d)}
    for name, gate, body in (("forward", "gs", "bs"), ("backward", "gd", "bd")):
        here = {**names, "vg": names[gate], "vb": names.get(body, constant(0.0))}
        names[name] = _tree(f"vg - vto {raised}", here)
    system.functions.append(Function(_tree(_FIELD, names), row))


def _add_capacitor(system: System, name: str, row: Row, capacitance: float) -> None:
    """Add a capacitance (F) across a row of voltages, if there is one."""
    if row and capacitance > 0.0:
        system.add_charge(
            name, row, {k: v * capacitance for k, v in row.items()}, 1.0 / capacitance
        )
