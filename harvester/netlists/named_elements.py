"""Elements that an element names, and nodes that its function reads: whether they are there, and of the right kind."""

from collections.abc import Mapping, Sequence, Set

from harvester.errors import InputError
from harvester.netlists.expression_tree import Node
from harvester.netlists.part import INSIDE, PIEZO, CircuitPart, by_name


def check_names(parts: Sequence[CircuitPart]) -> None:
    """Refuse elements that name others which are not there, or that ngspice refuses, and two couplings alike."""
    there = by_name(parts)
    coupled = set[frozenset[str]]()
    nodes = {node for part in parts for node in part.nodes} | {PIEZO, "0"}
    for part in parts:
        if part.kind == "k":
            _check_coupling(part, there, coupled)
        elif any(other not in there or there[other].kind != "v" for other in part.others):
            raise InputError(
                f"{part.where} must name a voltage source, of 0 V in series, of its subcircuit, but "
                f"{part.others[0]!r} is not one"
            )
        if part.value is not None:
            _check_function(part, part.value, there, nodes)


def _check_coupling(
    part: CircuitPart, there: Mapping[str, CircuitPart], coupled: set[frozenset[str]]
) -> None:
    """Refuse a coupling of other than plain inductors, of a pair among those ``coupled``, and factors above 1."""
    for other in part.others:
        if other not in there or there[other].kind != "l" or there[other].form:
            raise InputError(
                f"{part.where} must couple two inductors of its subcircuit, but {other!r} is not one"
            )
        if {"m", "scale"} & there[other].options.keys():
            raise InputError(
                f"{part.where} must couple inductors without m and scale, as ngspice reads them otherwise"
            )
    if frozenset(part.others) in coupled:
        raise InputError(
            f"{part.where} must couple two inductors once, of which ngspice adds the factors"
        )
    if part.number is not None and not abs(part.number) <= 1.0:
        raise InputError(f"{part.where} must have a factor from -1 to 1, but has {part.number:g}")
    coupled.add(frozenset(part.others))


def _check_function(
    part: CircuitPart, tree: Node, there: Mapping[str, CircuitPart], nodes: Set[str]
) -> None:
    """Refuse a function of a current that is not among the unknowns, or of a node that no element is connected to."""
    for leaf in tree.leaves:
        if leaf.operation == "i" and not (
            leaf.names[0] in there and has_current(there[leaf.names[0]])
        ):
            what = "name a voltage source or an inductor of its subcircuit"
            raise InputError(f"{part.where} must {what}, but {leaf.names[0]!r} is not one")
    if missing := sorted(part.nodes_read - nodes):
        node = missing[0].removeprefix(INSIDE)
        raise InputError(
            f"{part.where} must read nodes that elements are connected to, but {node!r} is not one"
        )


def has_current(part: CircuitPart) -> bool:
    """Whether the current of an element is an unknown of the equations, which functions may read."""
    return part.kind in "vleh" or (part.kind == "b" and part.form == "v")
