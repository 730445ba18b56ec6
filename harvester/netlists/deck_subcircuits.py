"""The piezo of a deck as a subcircuit of two pins: an equivalent circuit with its own source."""

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set

from harvester.errors import InputError
from harvester.netlists.deck_device import DeckDevice, find_piezo, is_vibration, nets_of
from harvester.netlists.element_lines import Element, read_element
from harvester.netlists.flat import net_of
from harvester.netlists.read_lines import Line


def bodies_of(lines: Iterable[Line]) -> dict[str, list[Line]]:
    """The lines of each subcircuit, from its head to its end, by its name in lower case."""
    bodies: dict[str, list[Line]] = {}
    inside: list[Line] = []
    for line in lines:
        if line.word == ".subckt" or inside:
            inside.append(line)
        if line.word == ".ends" and inside:
            bodies[inside[0].text.lower().split()[1]] = inside
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
        yield DeckDevice((first, second), (call,), device.capacitors or (*across,))


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


def _between(element: Element, pins: Sequence[str]) -> bool:
    return {net_of(node) for node in element.nodes[:2]} == {net_of(pin) for pin in pins}
