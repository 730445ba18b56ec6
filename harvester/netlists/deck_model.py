"""The piezo's own model in a deck: a subcircuit with its own source, and lines that name its nets and elements.

A board has neither these nets nor these elements.  Elements that read one of them, and nothing of
the board, are a measurement: they are left out with the elements that they feed.  An element that
acts on the board is refused, and so is a part that may be of that model at a piezo's source
(`harvester.netlists.deck_doubts`).
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import chain
from typing import NoReturn

from harvester.errors import InputError, invalid
from harvester.netlists.cards import PARAMETERS
from harvester.netlists.deck_capacitance import parameters_of
from harvester.netlists.deck_cards import names_of
from harvester.netlists.deck_device import DeckDevice, find_piezo, is_vibration, nets_of
from harvester.netlists.element_lines import Element, read_element
from harvester.netlists.flat import net_of
from harvester.netlists.read_lines import Line

_CALL = r"\((?:[^()]|\([^()]*\))*\)"
_START = re.compile(
    r"([vi])\(\s*([^\s(),]+)\s*\)\s*=\s*(?:\{[^}]*\}|'[^']*'|(?:[^\s,()]|" + _CALL + r")+)[\s,]*",
    re.I,
)


def bodies_of(lines: Iterable[Line]) -> dict[str, list[Line]]:
    """The lines of each subcircuit, from its head to its end, by its name in lower case.

    Raises InputError for a head without a name.
    """
    bodies: dict[str, list[Line]] = {}
    inside: list[Line] = []
    for line in lines:
        if line.word == ".subckt" or inside:
            inside.append(line)
        if line.word == ".ends" and inside:
            name = next(iter(names_of(inside[:1])))
            if not name:
                raise invalid(f"deck {inside[0].where}", "name its subcircuit", inside[0].text)
            bodies[name] = inside
            inside = []
    return bodies


def piezos(
    elements: Sequence[Element], bodies: Mapping[str, Sequence[Line]], models: Set[str]
) -> Iterator[DeckDevice]:
    """The calls of subcircuits of two pins that vibrate by themselves, as piezos at their nets.

    The capacitor between the pins is the piezo's.
    """
    spelt = {net.lower(): net for net in nets_of(elements)}
    for call in elements:
        body = bodies.get(call.model.lower(), ()) if call.kind == "x" else ()
        pins = _pins(body[0]) if body else ()
        inner = _elements(body, models) if len(pins) == len(call.nodes) == 2 else []
        if not any(map(is_vibration, inner)):
            continue
        try:
            device = find_piezo(inner, (pins[0], pins[1]), call.model)
        except InputError:  # a pin without an element
            continue
        across = (each for each in inner if each.kind == "c" and _between(each, pins))
        first, second = (spelt.get(node, node) for node in call.nodes)
        capacitors = device.capacitors or (*across,)
        yield DeckDevice((first, second), (call,), capacitors, parameters=_parameters_inside(body))


def _parameters_inside(body: Iterable[Line]) -> dict[str, str]:
    """The texts of the parameters of a subcircuit, those of its cards before those of its head."""
    cards = (line for line in body if line.word in (".subckt", *PARAMETERS))
    return dict(chain.from_iterable(parameters_of(card.text).items() for card in cards))


def _pins(head: Line) -> tuple[str, ...]:
    """The pins of the head of a subcircuit, in lower case."""
    words = head.text.lower().split()[2:]
    return tuple(word for word in words if "=" not in word and word != "params:")


def _elements(body: Sequence[Line], models: Set[str]) -> list[Element]:
    return [read_element(line, models) for line in body[1:-1] if not line.word.startswith(".")]


def without_body(device: DeckDevice, elements: Sequence[Element]) -> str:
    """The name of the subcircuit of a piezo that nothing else calls; "" if there is none."""
    [call] = device.drives
    others = [each for each in elements if each is not call and each.model == call.model]
    return "" if others else call.model.lower()


def nets_inside(
    calls: Iterable[Element], bodies: Mapping[str, Sequence[Line]], models: Set[str]
) -> set[str]:
    """The nets to which elements inside of called subcircuits are connected, but for the pins.

    Those of the subcircuits that these call are among them.
    """
    nets = set[str]()
    names = [each.model.lower() for each in calls if each.kind == "x"]
    for name in names:
        if not (body := bodies.get(name)):
            continue
        inner = _elements(body, models)
        nets |= set[str]().union(*map(_connected, inner)) - {*map(net_of, _pins(body[0]))}
        more = (each.model.lower() for each in inner if each.kind == "x")
        names += [other for other in more if other not in names]
    return nets


def _between(element: Element, pins: Sequence[str]) -> bool:
    return {net_of(node) for node in element.nodes[:2]} == {net_of(pin) for pin in pins}


class Removed:
    """The nets and the elements that a board no longer has, in lower case."""

    def __init__(
        self, gone: Iterable[Element], left: Iterable[Element], nets: Iterable[str]
    ) -> None:
        self.elements = set[str]()
        self.nets = set[str]()
        self.add(gone)
        self.nets -= {*map(net_of, nets)}.union(*map(_connected, left))

    def add(self, elements: Iterable[Element]) -> None:
        """Count also elements that are left out, and their nets."""
        for element in elements:
            self.elements.add(element.name.lower())
            self.nets |= _connected(element) - {"0"}

    def read_by(self, element: Element) -> str:
        """A net or an element that an element reads, the first one in their order; "" for none."""
        trees = [tree for tree in (element.value, *element.waveform) if tree is not None]
        leaves = [leaf for tree in trees for leaf in tree.leaves]
        nets = [("v", net) for net in element.nodes[len(element.current_nodes) :]]
        names = [("i", name) for name in element.others]
        read = [(leaf.operation, name) for leaf in leaves for name in leaf.names]
        return min((name for kind, name in nets + names + read if self.has(kind, name)), default="")

    def has(self, kind: str, name: str) -> bool:
        """Whether a voltage v of a net, or a current i of an element, is of these."""
        return {"v": net_of(name) in self.nets, "i": name.lower() in self.elements}.get(kind, False)


@dataclass(frozen=True)
class ModelReaders:
    """Elements that measure the piezo's own model: a reader of the part ``read``, and those that it feeds."""

    reader: Element
    read: str
    elements: tuple[Element, ...]

    def refuse(self, otherwise: str = "") -> NoReturn:
        """Raise InputError, as one of the elements acts on the board, with another remedy."""
        raise InputError(
            f"deck {self.reader.line.where} must not read {self.read}, a part of the "
            "piezo's own model, which the scene's device replaces, but is "
            f"{self.reader.line.text[:60]}: write it with the nets of the board{otherwise}"
        )


def measurements(
    left: Sequence[Element], removed: Removed, nets: Collection[str], shared: Set[str]
) -> list[ModelReaders]:
    """The measurements of the piezo's own model; their elements are added to ``removed``.

    Raises InputError if an element reads a part of that model and acts on the board, that is, on
    the electrodes ``nets`` or on a global net, one of ``shared``, which subcircuits read; and for
    a global net of that model.
    """
    for net in sorted(shared & removed.nets):
        raise InputError(
            f"`.global` must name nets of the board, but {net} is a part of the piezo's own model, "
            "which the scene's device replaces: write its subcircuits with the nets of the board"
        )
    board = {*map(net_of, nets), *shared} - {"0"}
    measuring: list[ModelReaders] = []
    kept = list(left)
    while readers := [element for element in kept if removed.read_by(element)]:
        reader = readers[0]
        group = ModelReaders(reader, removed.read_by(reader), tuple(_fed(reader, kept)))
        if any(board & _connected(element) for element in group.elements):
            group.refuse()
        measuring.append(group)
        removed.add(group.elements)
        kept = [element for element in kept if element not in group.elements]
    return measuring


def global_nets(lines: Iterable[Line]) -> set[str]:
    """The nets of .global cards."""
    cards = (line for line in lines if line.word == ".global")
    return {net_of(net) for card in cards for net in card.text.replace(",", " ").split()[1:]}


def _fed(reader: Element, elements: Iterable[Element]) -> list[Element]:
    """An element, and those to which its current flows by other nets than ground.

    The current of a coupling is that of its inductors.
    """
    rest = [element for element in elements if element is not reader]
    coupled = {name.lower() for name in reader.others} if reader.kind == "k" else set[str]()
    group = [reader, *(element for element in rest if element.name.lower() in coupled)]
    while True:
        nets = set[str]().union(*map(_connected, group)) - {"0"}
        more = [e for e in rest if e not in group and nets & _connected(e)]
        if not more:
            return group
        group += more


def _connected(element: Element) -> Set[str]:
    """The nets to which current of an element flows."""
    return set(map(net_of, element.current_nodes))


def shortened_starts(
    lines: Iterable[Line], removed: Removed
) -> Iterator[tuple[Line, str, list[str]]]:
    """Each .ic card with starting values of removed nets: the card, its text without them, and these.

    The text is empty if no other value is left.
    """
    for line in lines:
        if line.word != ".ic":
            continue
        lost = [m for m in _START.finditer(line.text) if removed.has(m[1].lower(), m[2])]
        text = line.text
        for match in reversed(lost):
            text = text[: match.start()] + text[match.end() :]
        if lost:
            is_empty = not text[len(line.word) :].strip(" ,\t")
            names = [match[0].rstrip(" ,\t") for match in lost]
            yield line, "" if is_empty else text.rstrip(" ,\t"), names
