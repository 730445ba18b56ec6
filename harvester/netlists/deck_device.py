"""The piezo of a deck: the elements that a scene's device replaces, and its two nets.

These forms are known: a current source with a capacitor across it; a voltage source in series with
a capacitor, with nothing else between them; a sine, or a function of the time, between the nets; a
source with its mass, spring and damper as L, C and R in series (the motional branch of a
cantilever); a subcircuit of two pins that holds one of these
(`harvester.netlists.deck_model`).
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from itertools import chain

from harvester.errors import InputError, unknown
from harvester.netlists.element_lines import Element
from harvester.netlists.flat import net_of
from harvester.netlists.words import tokens_of

Nets = tuple[str, str]


@dataclass(frozen=True)
class DeckDevice:
    """The piezo of a deck: its two nets, the sources that drive it, and its capacitors.

    ``motion`` are the elements of its motional branch, in series with the source, and sources of
    0 V that measure currents of the piezo's own model.  ``parameters`` are the texts of the
    parameters of its subcircuit.
    """

    nets: Nets
    drives: tuple[Element, ...] = ()
    capacitors: tuple[Element, ...] = ()
    motion: tuple[Element, ...] = ()
    parameters: Mapping[str, str] = field(default_factory=dict)

    @property
    def elements(self) -> tuple[Element, ...]:
        """All elements that a scene's device replaces."""
        return (*self.drives, *self.capacitors, *self.motion)


def find_piezo(elements: Sequence[Element], terminals: Nets | None, file: str) -> DeckDevice:
    """The piezo of a deck; ``terminals`` are its nets, if they are known.

    Raises InputError if no element or several may be it; it lists them.
    """
    if terminals is not None:
        return _at(elements, terminals, file)
    spelt = {net_of(net): net for net in nets_of(elements)}
    merged: dict[frozenset[str], DeckDevice] = {}
    moving = [device for device in _branches(elements) if any(e.kind == "l" for e in device.motion)]
    for device in moving or _still(elements):
        key = frozenset(map(net_of, device.nets))
        first, second = (spelt.get(net_of(net), net) for net in _ground_last(device.nets))
        known = merged.get(key, DeckDevice((first, second)))
        drives = (*known.drives, *device.drives)
        capacitors = distinct((*known.capacitors, *device.capacitors))
        motion = distinct((*known.motion, *device.motion))
        merged[key] = DeckDevice(known.nets, drives, tuple(capacitors), tuple(motion))
    if len(merged) == 1:
        return next(iter(merged.values()))
    nets = ", ".join(nets_of(elements)[:30])
    if not nets:
        raise InputError(
            f"deck {file} must be a circuit, but has no element outside of subcircuits"
        )
    give = f"give the piezo's two nets by `terminals` A,B; the nets are {nets}"
    if not merged:
        raise InputError(
            f"deck {file} must have a source in the piezo's place, but has none: {give}"
        )
    several = "; ".join(
        f"{device.drives[0].name} at {','.join(device.nets)}" for device in merged.values()
    )
    raise InputError(
        f"deck {file} must have one source in the piezo's place, but several may be it "
        f"({several}): {give}"
    )


def _still(elements: Sequence[Element]) -> list[DeckDevice]:
    """The devices without a moving mass.

    A pulse may be that of a load if another source vibrates.
    """
    sure = _sure(elements)
    if any(is_vibration(drive) for device in sure for drive in device.drives):
        return sure
    return [*sure, *_direct(elements)]


def _two_nets(elements: Sequence[Element], terminals: Nets, file: str) -> Nets:
    """Two different nets of a deck, as they are spelt there."""
    known = {net_of(net): net for net in nets_of(elements)}
    for net in terminals:
        if net_of(net) not in known:
            raise unknown(f"net of `terminals` in deck {file}", net, known.values())
    first, second = (known[net_of(net)] for net in terminals)
    if first == second:
        raise InputError(f"`terminals` must be two different nets, but both are {first}")
    return first, second


def _at(elements: Sequence[Element], terminals: Nets, file: str) -> DeckDevice:
    """The piezo between two nets: sources, alone or in series with a capacitor, and capacitors."""
    first, second = _two_nets(elements, terminals, file)
    there = {net_of(first), net_of(second)}
    devices = [
        device
        for device in (*_sure(elements), *_direct(elements), *_branches(elements, there))
        if set(map(net_of, device.nets)) == there
    ]
    # Also a constant source, as of an analysis of small signals.
    across = [element for element in elements if is_across(element, there)]
    sources = [element for element in across if element.kind in "vi"]
    drives = distinct([*chain.from_iterable(each.drives for each in devices), *sources])
    motion = distinct(chain.from_iterable(each.motion for each in devices))
    inner = distinct(chain.from_iterable(each.capacitors for each in devices))
    if drives and not inner:
        inner = [element for element in across if element.kind == "c"]
    return DeckDevice((first, second), tuple(drives), without(inner, motion), tuple(motion))


def without(elements: Iterable[Element], others: Sequence[Element]) -> tuple[Element, ...]:
    """The elements that are not among others."""
    return tuple(each for each in elements if each not in others)


def distinct(elements: Iterable[Element]) -> list[Element]:
    """The elements, each once."""
    return list({element.name.lower(): element for element in elements}.values())


def _sure(elements: Sequence[Element]) -> list[DeckDevice]:
    """Current sources with a capacitor across them, and voltage sources in series with one."""
    devices: list[DeckDevice] = []
    degree = Counter(net_of(node) for element in elements for node in set(element.current_nodes))
    capacitors = [element for element in elements if element.kind == "c"]
    for drive in filter(_drives, elements):
        if is_current(drive):
            devices += _parallel(drive, elements)
        else:
            nets = set(map(net_of, drive.nodes[:2]))
            devices += _in_series(drive, (c for c in capacitors if not is_across(c, nets)), degree)
    return devices


def _parallel(drive: Element, elements: Sequence[Element]) -> Iterator[DeckDevice]:
    """A current source with capacitors across it; each may have sources of 0 V in series.

    These measure the currents of the source and of the capacitors.
    """
    at = connected(elements)
    ends: list[str] = []
    meters: list[Element] = []
    for node in drive.nodes[1::-1]:
        end, parts = branch_end(drive, node, at, kinds="")
        ends.append(end)
        meters += parts
    nets = {*map(net_of, ends)}
    capacitors: list[Element] = []
    for each in elements:
        if each.kind != "c":
            continue
        first, before = branch_end(each, each.nodes[0], at, nets, kinds="")
        second, behind = branch_end(each, each.nodes[1], at, nets, kinds="")
        if {net_of(first), net_of(second)} == nets:
            capacitors.append(each)
            meters += (*before, *behind)
    if capacitors and len(nets) == 2:
        first, second = ends
        yield DeckDevice((first, second), (drive,), tuple(capacitors), tuple(distinct(meters)))


def _in_series(
    drive: Element, capacitors: Iterable[Element], degree: Mapping[str, int]
) -> Iterator[DeckDevice]:
    """A voltage source with a capacitor at one of its nodes, to which nothing else is connected."""
    for inner, outer in (drive.nodes[:2], drive.nodes[1::-1]):
        if net_of(inner) == "0" or degree[net_of(inner)] != 2:
            continue
        for each in capacitors:
            if inner in each.nodes:
                other = each.nodes[1] if each.nodes[0] == inner else each.nodes[0]
                yield DeckDevice((other, outer), (drive,), (each,))


def _branches(elements: Sequence[Element], ends: Set[str] = frozenset()) -> Iterator[DeckDevice]:
    """Voltage sources in series with a motional branch: an R, or several of R, L and C.

    It may have sources of 0 V, which measure its current.  It ends at the nets ``ends`` at the latest.
    """
    at = connected(elements)
    for drive in filter(_drives, elements):
        if is_current(drive):
            continue
        first, before = branch_end(drive, drive.nodes[0], at, ends)
        second, behind = branch_end(drive, drive.nodes[1], at, ends)
        motion = (*before, *behind)
        if first == second or [each.kind for each in motion] in ([], ["c"]):
            continue
        nets = {net_of(first), net_of(second)}
        across = without((e for e in elements if e.kind == "c" and is_across(e, nets)), motion)
        alone = [each for each in motion if each.kind != "v"]
        if _is_capacitor(alone):
            across = tuple(each for each in alone if each.kind == "c")
            motion = without(motion, across)
        yield DeckDevice((first, second), (drive,), across, motion)


def _is_capacitor(parts: Iterable[Element]) -> bool:
    """Whether parts in series are the piezo's capacitor and resistors, without a mass."""
    kinds = [each.kind for each in parts]
    return kinds.count("c") == 1 and {*kinds} <= {"r", "c"}


def connected(elements: Iterable[Element]) -> dict[str, list[Element]]:
    """The elements at each net."""
    at: dict[str, list[Element]] = {}
    for element in elements:
        for net in {net_of(node) for node in element.current_nodes}:
            at.setdefault(net, []).append(element)
    return at


def branch_end(
    drive: Element,
    node: str,
    at: Mapping[str, list[Element]],
    ends: Set[str] = frozenset(),
    kinds: str = "rlc",
) -> tuple[str, list[Element]]:
    """The net at the end of an element's branch from one of its nodes on, and its other elements.

    These are of the given kinds, or sources of 0 V.
    """
    parts: list[Element] = []
    last = drive
    while net_of(node) not in {"0", *ends} and len(there := at[net_of(node)]) == 2:
        nearest = next(each for each in there if each is not last)
        is_part = nearest.kind in tuple(kinds) or is_ammeter(nearest)
        if not is_part or nearest in parts or len(set(nearest.nodes)) != 2:
            break
        parts.append(nearest)
        last = nearest
        first, second = nearest.nodes
        node = second if net_of(first) == net_of(node) else first
    return node, parts


def _direct(elements: Sequence[Element]) -> list[DeckDevice]:
    """Sines and functions of the time, between whose nodes the piezo is; clocks drive switches."""
    drives = [element for element in elements if _drives(element)]
    sines = [element for element in drives if is_vibration(element)]
    return [DeckDevice(_pair(drive.nodes), (drive,)) for drive in sines]


def _drives(element: Element) -> bool:
    """Whether a source changes with time, or is one of an analysis of small signals."""
    small = element.kind in "vi" and " ac " in f"{element.line.text.lower()} ".replace("\t", " ")
    return (element.kind in "vi" and bool(element.form)) or small or _is_function(element)


def is_vibration(element: Element) -> bool:
    """Whether a source is a sine or a function of the time; a pulse may be a clock."""
    return (element.kind in "vi" and element.form == "sin") or _is_function(element)


def _is_function(element: Element) -> bool:
    """Whether it is a B source that depends on the time alone."""
    if element.kind != "b" or element.value is None:
        return False
    return {leaf.operation for leaf in element.value.leaves} - {"name"} == {"time"}


def is_supply(source: Element) -> bool:
    """Whether a source supplies something; one of 0 V measures a current."""
    value = source.value
    return bool(source.form) or value is None or not (value.is_constant and value.value == 0.0)


def is_ammeter(element: Element) -> bool:
    """Whether it is a source of 0 V, which measures a current."""
    return element.kind == "v" and not is_supply(element) and not _drives(element)


def is_current(element: Element) -> bool:
    """Whether an element drives a current."""
    return element.kind == "i" or (element.kind == "b" and element.form == "i")


def is_across(element: Element, nets: set[str]) -> bool:
    """Whether an element is between two nets."""
    return set(map(net_of, element.nodes[:2])) == nets


def _ground_last(nets: Nets) -> Nets:
    """The two nets, the second of which is ground if one is."""
    return (nets[1], nets[0]) if net_of(nets[0]) == "0" else nets


def _pair(nodes: Sequence[str]) -> Nets:
    return nodes[0], nodes[1]


def nets_of(elements: Iterable[Element]) -> list[str]:
    """The nets as they are spelt, each once, in their order."""
    nets: dict[str, str] = {}
    for element in elements:
        written = tokens_of(element.line.text)[1 : 1 + len(element.nodes)]
        for net in written:
            if net.lower() in element.nodes:
                nets.setdefault(net_of(net), net)
    return list(nets.values())
