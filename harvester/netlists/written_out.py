"""The elements of a load circuit with their values: all subcircuits written out, all parameters in place.

A name has the meaning that it has in ngspice: a call's value precedes a .param of the subcircuit,
that before a default of its header; any other name is the caller's, up to the netlist's own
(as ngspice's stack of dictionaries). A model is that of the element's own subcircuit, or one
outside of all; functions likewise.  A call's m multiplies the letters that ngspice
multiplies (inpcom.c, `inp_fix_subckt_multiplier`).

Long because scopes, calls and elements are read together.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from harvester.errors import InputError, invalid, shown, unknown
from harvester.netlists.element_lines import Element
from harvester.netlists.expression import BRACES, SOURCES, Language, resolved
from harvester.netlists.expression_tree import Node, constant, with_leaves
from harvester.netlists.ltspice import ideal_current
from harvester.netlists.model_lines import OF_LETTER, is_ideal
from harvester.netlists.named_elements import check_names
from harvester.netlists.netlist import Body, ParsedNetlist
from harvester.netlists.part import GROUND, INSIDE, CircuitPart, ModelCard

MOST_ELEMENTS = 10_000  # of the load, its inner subcircuits written out
DEEPEST = 100  # calls of a subcircuit within another
_MULTIPLIED = frozenset("rcldqmjfgi")
_FUNCTIONS = ("i", "v", "c", "q", "l")  # forms whose values are trees of voltages and currents
LEAST, MOST = 1e-30, 1e30  # of a number that a circuit may have, other than 0


@dataclass
class Scope:
    """The meaning of the names in a subcircuit.

    ``outer`` is that of the caller, ``whole`` that outside of all.
    """

    body: Body
    given: Mapping[str, float] = field(default_factory=dict)
    outer: "Scope | None" = None
    whole: "Scope | None" = None
    known: dict[str, float] = field(default_factory=dict)
    evaluating: list[str] = field(default_factory=list)
    cards: dict[str, ModelCard] = field(default_factory=dict)

    def value(self, name: str) -> float | None:
        """The value of a name; None if it has none.

        Raises InputError for parameters that need each other.
        """
        if name in self.given:
            return self.given[name]
        if name in self.known:
            return self.known[name]
        tree = self.body.parameters.get(name, self.body.defaults.get(name))
        if tree is None or (
            self.evaluating and self.evaluating[-1] == name
        ):  # r={r} is the caller's
            return None if self.outer is None else self.outer.value(name)
        where = f"parameter {name} of netlist {self.body.line.where or 'cards'}"
        if name in self.evaluating:
            raise InputError(f"{where} must not need its own value")
        self.evaluating.append(name)
        self.known[name] = self.number(tree, where)
        self.evaluating.pop()
        return self.known[name]

    def function(self, name: str) -> tuple[tuple[str, ...], str] | None:
        """The arguments and the text of a function."""
        if name in self.body.functions:
            return self.body.functions[name]
        return None if self.whole is None else self.whole.function(name)

    def tree(self, tree: Node, where: str, language: Language) -> Node:
        """A tree with its names' values; raises InputError if too many need each other in turn."""
        try:
            return resolved(tree, where, language, self.value, self.function)
        except RecursionError:
            raise InputError(
                f"{where} must need fewer parameters that need each other in turn"
            ) from None

    def number(self, tree: Node, where: str) -> float:
        """The number of an expression in braces.

        Raises InputError if it has none, or one that no circuit has.
        """
        node = self.tree(tree, where, BRACES)
        if not node.is_constant or not math.isfinite(node.value):
            raise InputError(f"{where} must give a finite number, but does not")
        if node.value != 0.0 and not LEAST <= abs(node.value) <= MOST:
            raise invalid(where, f"have numbers from {LEAST:g} to {MOST:g}", node.value)
        return node.value

    def model(self, name: str, element: Element) -> ModelCard:
        """The model that an element names: that of its subcircuit, or one outside of all."""
        if name in self.cards:
            return self.cards[name]
        if (model := self.body.model(name)) is None:
            if self.whole is None:
                raise InputError(
                    f"{element.where} must name a model of the netlist, but {shown(name)} is not one"
                )
            return self.whole.model(name, element)
        where = f"model {name} of netlist {model.line.where}"
        values = {key: self.number(tree, where) for key, tree in model.trees.items()}
        self.cards[name] = ModelCard(name, model.kind, values, model.words)
        return self.cards[name]


@dataclass(frozen=True)
class _Call:
    """The call of a subcircuit: its path, its outer nodes by its terminals' names, and its m."""

    path: str
    outer: Mapping[str, str]
    ground: str
    everywhere: frozenset[str]
    m: float = 1.0

    def node(self, name: str) -> str:
        """The node of the whole circuit that a name means."""
        if name in self.outer:
            return self.outer[name]
        if name in GROUND:
            return self.ground
        return INSIDE + name if name in self.everywhere else INSIDE + self.path + name


def written_out(
    netlist: ParsedNetlist,
    load: Body,
    outer: Mapping[str, str],
    ground: str,
    given: Mapping[str, float],
    overridden: Mapping[str, float],
) -> tuple[CircuitPart, ...]:
    """The elements of the subcircuit ``load`` in their order.

    ``outer`` are the nodes of the whole circuit by the names that its lines have for them,
    ``ground`` is that of node 0; ``given`` are values of its parameters and ``overridden`` those of
    its elements, by their names in lower case.

    Raises InputError for values that cannot be computed, names that are not known, calls with other
    nodes than the subcircuit has or within themselves, and too many elements.
    """
    whole = Scope(netlist.outside)
    scope = whole if load is netlist.outside else Scope(load, given, whole, whole)
    call = _Call("", outer, ground, frozenset(netlist.settings.everywhere))
    parts = list[CircuitPart]()
    for part in _inside(netlist, scope, call, whole, (load.name.lower(),)):
        parts.append(part)
        if len(parts) > MOST_ELEMENTS:
            raise InputError(
                f"netlist {netlist.file} must have at most {MOST_ELEMENTS} elements, but has more"
            )
    check_names(parts)
    values = {name: constant(value) for name, value in overridden.items()}
    return tuple(replace(part, value=values.get(part.name, part.value)) for part in parts)


def settings_of(netlist: ParsedNetlist) -> dict[str, float]:
    """The temperatures that a netlist sets (degrees Celsius), by the names of ngspice's options."""
    scope = Scope(netlist.outside)
    return {
        name: scope.number(tree, f"option {name} of netlist {netlist.file}")
        for name, tree in netlist.settings.options.items()
    }


def initial_of(netlist: ParsedNetlist) -> dict[str, float]:
    """The voltages (V) of a netlist's .ic cards, by the names of its nets."""
    scope = Scope(netlist.outside)
    return {
        name: scope.number(tree, f".ic of netlist {netlist.file}")
        for name, tree in netlist.settings.initial.items()
    }


def _inside(
    netlist: ParsedNetlist, scope: Scope, call: _Call, whole: Scope, chain: tuple[str, ...]
) -> Iterator[CircuitPart]:
    """The elements of one call of a subcircuit, and of the calls within.

    ``chain`` are the subcircuits around it.
    """
    for element in scope.body.elements:
        if element.kind == "x":
            yield from _called(netlist, element, scope, call, whole, chain)
        else:
            yield _part(element, scope, call)


def _called(
    netlist: ParsedNetlist,
    element: Element,
    scope: Scope,
    call: _Call,
    whole: Scope,
    chain: tuple[str, ...],
) -> Iterator[CircuitPart]:
    """The elements of the subcircuit that an X line calls."""
    where, name = element.where, element.model
    if (body := netlist.subcircuits.get(name)) is None:
        raise invalid(where, "call a subcircuit of this netlist", name)
    body.check()
    if name in chain:
        raise invalid(where, "call no subcircuit within itself", name)
    if len(chain) > DEEPEST:
        raise InputError(f"{where} must call at most {DEEPEST} subcircuits one within another")
    if call.m != 1.0:
        raise invalid(
            where, "call no subcircuit in one that is called with m", element.line.text[:60]
        )
    if len(element.nodes) != len(body.terminals):
        raise InputError(
            f"{where} must give {len(body.terminals)} nodes to {name}, but gives {len(element.nodes)}"
        )
    outer = dict(zip(body.terminals, map(call.node, element.nodes), strict=True))
    for terminal in GROUND:
        if outer.pop(terminal, call.ground) != call.ground:
            raise invalid(
                where,
                f"connect pin {terminal} of {name} to ground, as which ngspice reads it",
                name,
            )
    given = _given(element, body, scope)
    m = given.pop("m", 1.0)
    inner = replace(call, path=f"{call.path}{element.name.lower()}.", outer=outer, m=m)
    yield from _inside(netlist, Scope(body, given, scope, whole), inner, whole, (*chain, name))


def _given(element: Element, body: Body, scope: Scope) -> dict[str, float]:
    """The values of a call for the parameters of a subcircuit, and m."""
    where = element.where
    given = dict[str, float]()
    for key, tree in element.options.items():
        if key != "m" and key not in body.defaults and key not in body.parameters:
            raise unknown(
                f"parameter of subcircuit {body.name} in {where}",
                key,
                [*body.defaults, *body.parameters],
            )
        names = {leaf.names[0] for leaf in tree.leaves if leaf.operation == "name"}
        if also := names & ({*element.options, *body.defaults, *body.parameters} - {key}):
            raise invalid(
                where,
                f"give {key} without {min(also)}, which ngspice reads as the called one",
                body.name,
            )
        given[key] = scope.number(tree, f"{where}, {key},")
    for key, default in body.defaults.items():
        if default is None and key not in given:
            raise invalid(
                where, f"give {key} of {body.name}, which has no default", element.line.text[:60]
            )
    return given


def _part(element: Element, scope: Scope, call: _Call) -> CircuitPart:
    """An element of a call of a subcircuit."""
    kind = element.kind
    where = element.where
    path = call.path
    name = f"{path}{element.name.lower()}"

    def leaf(node: Node) -> Node:
        if node.operation == "i":
            return Node("i", names=(path + node.names[0],))
        if node.operation != "v":
            return node
        names = tuple(map(call.node, node.names))
        if len(names) == 1 and call.ground != "0":
            names += (call.ground,)
        return Node("v", names=names)

    value: Node | None = None
    if element.value is not None and element.form in _FUNCTIONS:
        value = with_leaves(scope.tree(element.value, where, SOURCES), leaf)
        if value.is_constant and not math.isfinite(value.value):
            raise InputError(f"{where} must give a finite number, but does not")
    elif element.value is not None:
        value = constant(scope.number(element.value, where))
    options = {key: scope.number(tree, f"{where}, {key},") for key, tree in element.options.items()}
    if call.m != 1.0 and kind in _MULTIPLIED:
        if "m" in options:
            raise invalid(
                where,
                "have no m of its own in a subcircuit that is called with m",
                element.line.text[:60],
            )
        options["m"] = call.m
    if not options.get("m", 1.0) > 0.0:
        raise InputError(
            f"{where}, m, must be above 0, as so many elements are side by side, but is "
            f"{options['m']:g}: delete the line of an absent element"
        )
    model = _model(element, scope)
    form = element.form
    if (current := _ideal(element, model)) is not None:
        value = with_leaves(current, leaf)
        form = "i"
        model = None
    return CircuitPart(
        name=name,
        nodes=tuple(map(call.node, element.nodes)),
        value=value,
        form=form,
        model=model,
        others=tuple(path + other for other in element.others),
        options=options,
        waveform=tuple(scope.number(tree, where) for tree in element.waveform),
        word=element.word,
        line=element.line.where,
        kind="b" if form in ("i", "v") else kind,
    )


def _ideal(element: Element, model: ModelCard | None) -> Node | None:
    """The current of an ideal diode; None of another element.

    Raises InputError for resistances that are not above 0, voltages below 0, and keys but m.
    """
    if model is None or model.kind != "d" or not is_ideal(model.values):
        return None
    for key, number in model.values.items():
        if number < 0.0 or (number == 0.0 and key.startswith("r")):
            least = "above 0" if key.startswith("r") else "at least 0"
            raise invalid(f"{element.where}, model {model.name}, {key},", f"be {least}", number)
    if more := element.options.keys() - {"m"}:
        raise invalid(element.where, "have an ideal diode with no key but m", min(more))
    return ideal_current(element.nodes, model.values)


def _model(element: Element, scope: Scope) -> ModelCard | None:
    """The model of an element, which is of a type that belongs to its letter."""
    if not element.model:
        return None
    card = scope.model(element.model, element)
    if card.kind not in OF_LETTER[element.kind]:
        must = f"have a model of the type {' or '.join(OF_LETTER[element.kind])}"
        raise invalid(element.where, must, f"{card.name} of the type {card.kind}")
    if element.kind in "rcl" and scope.value(element.model) is not None:
        raise invalid(
            element.where, "name a model that no parameter has the name of", element.model
        )
    return card
