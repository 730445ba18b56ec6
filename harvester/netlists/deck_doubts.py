"""Parts at a piezo's source that may be of its own model: a board that kept them would count them a second time."""

from collections.abc import Mapping, Sequence, Set
from itertools import product

from harvester.errors import InputError
from harvester.netlists.deck_device import (
    DeckDevice,
    branch_end,
    connected,
    distinct,
    is_across,
    is_ammeter,
    is_current,
    without,
)
from harvester.netlists.element_lines import Element
from harvester.netlists.flat import net_of

LEAST_PROBE = 1e6  # least resistance of a resistor that may only measure (Ohm)


def refuse_doubtful(device: DeckDevice, elements: Sequence[Element], file: str) -> None:
    """Raise InputError if elements at a piezo that was searched for may be of its own model.

    A board that kept them would count them a second time.
    """
    _refuse_series(device, elements, file)
    _refuse_half(device, elements, file)
    _refuse_probe(device, elements, file)
    _refuse_signal(device, elements, file)


def _refuse_signal(device: DeckDevice, elements: Sequence[Element], file: str) -> None:
    """Refuse a source that feeds nothing and only controls others, which are the piezo's own model.

    The harvester in its place would be amplified without a limit.
    """
    nets = {*map(net_of, device.nets)} - {"0"}
    others = without(elements, device.elements)
    fed = any(nets & {*map(net_of, each.current_nodes)} for each in others)
    if device.capacitors or fed:
        return
    readers = [each for each in others if nets & _controls(each)]
    if readers:
        drive = device.drives[0]
        names = ", ".join(each.name for each in readers)
        raise InputError(
            f"deck {file} must have the piezo's source at its nets, but {drive.name} only controls "
            f"{names}: write {readers[0].name} as a source with the waveform of {drive.name}, and "
            f"leave out {drive.name}"
        )


def _controls(element: Element) -> Set[str]:
    """The nets whose voltages control an element."""
    nets = element.nodes[len(element.current_nodes) :]
    leaves = [] if element.value is None else element.value.leaves
    read = [name for leaf in leaves if leaf.operation == "v" for name in leaf.names]
    return {net_of(net) for net in (*nets, *read)}


def _refuse_series(device: DeckDevice, elements: Sequence[Element], file: str) -> None:
    """Refuse a source or a motional branch in series with one part, which may be of the piezo's own model."""
    if device.capacitors:
        return
    if is_current(device.drives[0]):
        _refuse_behind(device, elements, file)
        return
    for net in map(net_of, device.nets):
        at = [e for e in connected(elements).get(net, []) if e not in device.elements]
        if net == "0" or len(at) != 1:
            continue
        [part] = at
        if part.kind in "rlc" or is_ammeter(part):
            raise InputError(
                f"deck {file} must have a source at the piezo's nets, but {part.name} is in series "
                f"with {device.drives[0].name}: give the piezo's two nets by `terminals` A,B"
            )
        if part.kind in "veh" or (part.kind == "b" and not is_current(part)):
            raise InputError(
                f"deck {file} must have a source at the piezo's nets, but the source {part.name} is "
                f"in series with {device.drives[0].name}: write the piezo's own model as one source "
                "with its mass, spring and damper as L, C and R in series, and its capacitor"
            )


def _refuse_behind(device: DeckDevice, elements: Sequence[Element], file: str) -> None:
    """Refuse a current source in series with parts, behind which is its capacitor.

    Large resistors at the source may only measure, and the capacitor may have ammeters in series.
    """
    drive = device.drives[0]
    near = [each for net in device.nets for each in connected(elements)[net_of(net)]]
    at = connected(without(elements, _large(near)))
    branches = [branch_end(drive, net, at, kinds="rl") for net in device.nets]
    parts = [part for _, before in branches for part in before]
    ends = [(net_of(net), net_of(end)) for net, (end, _) in zip(device.nets, branches, strict=True)]
    behind = [each for each in elements if each.kind == "c" and _is_between(each, ends, at)]
    if parts and behind:
        names = ", ".join(part.name for part in distinct(parts))
        verb = "is" if len(parts) == 1 else "are"
        raise InputError(
            f"deck {file} must have the piezo's capacitor at its current source, but {names} {verb} "
            f"between {drive.name} and {behind[0].name}: leave out {names}, whose voltage does not "
            f"change the current, or give {','.join(device.nets)} by `terminals` if "
            f"{behind[0].name} is of the board"
        )


def _is_between(
    element: Element, ends: Sequence[tuple[str, ...]], at: Mapping[str, list[Element]]
) -> bool:
    """Whether an element, with its ammeters, is between a net of the first end and one of the second."""
    outer = {net for pair in ends for net in pair}
    nets = {net_of(branch_end(element, node, at, outer, kinds="")[0]) for node in element.nodes}
    return nets in [{*pair} for pair in product(*ends)]


def _large(elements: Sequence[Element]) -> list[Element]:
    """The resistors that may only measure."""
    return [each for each in elements if _is_large(each)]


def _is_large(element: Element) -> bool:
    """Whether it is a resistor that may only measure."""
    value = element.value
    large = value is not None and value.is_constant and value.value >= LEAST_PROBE
    return element.kind == "r" and large


def _refuse_probe(device: DeckDevice, elements: Sequence[Element], file: str) -> None:
    """Refuse a voltage source and its capacitor with elements between them that may only measure."""
    drives = device.drives
    if device.capacitors or device.motion or is_current(drives[0]):
        return
    nets = {*map(net_of, device.nets)}
    for net in nets - {"0"}:
        others = without(connected(elements)[net], drives)
        series = [each for each in others if each.kind == "c" and not is_across(each, nets)]
        probes = without(others, series)
        if not (series and all(_is_probe(each, nets) for each in probes)):
            series, probes = _behind_parts(drives[0], net, nets, others, elements)
        if len(series) == 1 and probes:
            names = ", ".join(each.name for each in probes)
            raise InputError(
                f"deck {file} must have nothing else between {drives[0].name} and the piezo's "
                f"capacitor {series[0].name}, but {names} are there: leave out those that only "
                f"measure, or give {','.join(device.nets)} by `terminals` if {series[0].name} is of "
                "the board"
            )


def _behind_parts(
    drive: Element, net: str, nets: Set[str], others: Sequence[Element], elements: Sequence[Element]
) -> tuple[list[Element], tuple[Element, ...]]:
    """A capacitor behind ammeters and resistors in series with a source, and those with its probes."""
    beside = [each for each in others if each.kind == "r" and _is_probe(each, nets)]
    at = connected(without(elements, beside))
    end, parts = branch_end(drive, net, at, kinds="rc")
    series = [each for each in parts if each.kind == "c" and net_of(end) not in nets]
    return series, (*beside, *without(parts, series)) if beside else ()


def _is_probe(element: Element, nets: Set[str]) -> bool:
    """Whether an element at a voltage source between two nets may only measure."""
    if element.kind == "r":
        return _is_large(element) or is_across(element, {*nets})
    return element.kind == "x" or is_ammeter(element)


def _refuse_half(device: DeckDevice, elements: Sequence[Element], file: str) -> None:
    """Refuse a motional branch that ends at its mass, as a probe between mass and spring ends it."""
    kinds = {each.kind for each in device.motion}
    if device.capacitors or "l" not in kinds or "c" in kinds:
        return
    ends = {*map(net_of, device.nets)} - {"0"}
    others = without((e for net in ends for e in connected(elements)[net]), device.elements)
    names = ", ".join(each.name for each in distinct(others)) or "no elements"
    raise InputError(
        f"deck {file} must have a mass, a spring and a damper as L, C and R in series, with nothing "
        f"else between them, but {names} are at the end of {device.motion[-1].name}: leave out those "
        "that only measure"
    )
