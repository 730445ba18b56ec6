"""Values of a netlist that are right in SPICE, but probably unintended: warnings, as data.

The meaning in SPICE is kept: the 7 of ``4k7`` is a unit, ``1M`` is a milliohm and ``0.47F`` is in
femtofarad.

Source: ngspice manual, section 2.1.3 (scale factors); LTspice 24's help, "General Structure and
Conventions".
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from harvester.netlists.element_lines import Element
from harvester.netlists.expression import SUFFIXES, plain_number
from harvester.netlists.part import PIEZO, CircuitPart
from harvester.netlists.words import tokens_of
from harvester.presentation.diagnostic import Diagnostic, Number, warning

# From the least to the most of resistances (ohm), capacitances (F) and inductances (H) on boards.
TYPICAL = {"r": (1e-4, 1e14), "c": (1e-15, 1e4), "l": (1e-10, 1e5)}
UNITS = {"r": "ohm", "c": "F", "l": "H"}
LEAST_LOAD = 0.01  # ohm
LEAST_STORE = 1e-12  # F
SMALL = 1.0  # ohm, below which a resistance with a capital M was meant in megohm
SAME = 1.5  # times the piezo's capacitance, and a part of it: a capacitor across it may be its own
_DEVICES = "qmj"  # letters of elements with current in every node
_INSIDE = re.compile(r"(\d+\.?\d*|\.\d+)(meg|[tgkmunpfr])(\d+)([a-z]*)", re.IGNORECASE)
_MEGA = re.compile(r"(\d+\.?\d*|\.\d+)M(?!eg|EG|il|IL)(ohm)?s?", re.ASCII)
_FARAD = re.compile(r"(\d+\.?\d*|\.\d+)F(arad)?s?")
_POWERS = SUFFIXES | {"r": 0}


def unintended_values(
    elements: Iterable[Element], parts: Sequence[CircuitPart], capacitance: float | None
) -> tuple[Diagnostic, ...]:
    """Warnings of the texts of a load circuit's lines, then of the values of its elements.

    ``capacitance`` (F) is the piezo's.
    """
    warnings: dict[str, Diagnostic] = {}
    names: dict[str, str] = {}  # as they are written
    for element in elements:
        names[element.name.lower()] = element.line.text.split(maxsplit=1)[0]
        for remark in _of_text(element):
            warnings.setdefault(element.name.lower(), remark)
    for part in parts:
        odd = _of_value(part, names.get(part.name, part.name), capacitance)
        if part.name not in warnings and odd is not None:
            warnings[part.name] = odd
    return (*warnings.values(), *_antiparallel(parts), *_without_return(parts, names))


def _of_text(element: Element) -> Iterator[Diagnostic]:
    """Warnings of numbers that other programs read differently, or whose unit is a scale factor."""
    kind = element.kind
    if kind not in UNITS:
        return
    named = {"element": element.line.text.split(maxsplit=1)[0], "line": element.line.where}
    for text in tokens_of(element.line.text)[1 + len(element.nodes) :]:
        value = plain_number(text)
        if value is None:
            continue
        numbers: dict[str, Number] = {**named, "text": text, "value": value, "unit": UNITS[kind]}
        if (match := _INSIDE.fullmatch(text)) is not None and match[3].strip("0"):
            power = _POWERS[match[2].lower()]
            meant = f"{match[1].rstrip('.')}.{match[3]}" if "." not in match[1] else match[1]
            suffix = "" if match[2].lower() == "r" else match[2]
            other = float(f"{meant}e{power}")
            yield warning("digits_behind_suffix", **numbers, other=other, write=f"{meant}{suffix}")
        elif kind == "r" and (match := _MEGA.fullmatch(text)) is not None and value < SMALL:
            yield warning("mega_or_milli", **numbers, write=f"{match[1]}Meg")
        elif kind == "c" and (match := _FARAD.fullmatch(text)) is not None:
            yield warning("farad_or_femto", **numbers, write=match[1])


def _of_value(part: CircuitPart, name: str, capacitance: float | None) -> Diagnostic | None:
    """A warning of an element out of the usual, or of a capacitor that is probably the piezo's."""
    number = part.number
    if part.kind not in TYPICAL or number is None or number == 0.0 or part.form:
        return None
    low, high = TYPICAL[part.kind]
    low = {"rload": LEAST_LOAD, "csmooth": LEAST_STORE}.get(part.name, low)
    numbers: dict[str, Number] = {"element": name, "line": part.line, "value": number}
    if not low <= abs(number) <= high:
        return warning("unusual_element", **numbers, unit=UNITS[part.kind], low=low, high=high)
    across = part.kind == "c" and set(part.nodes) == {PIEZO, "0"}
    if across and capacitance and abs(math.log(abs(number) / capacitance)) <= math.log(SAME):
        return warning("piezo_capacitance_twice", **numbers, capacitance=capacitance)
    return None


def _antiparallel(parts: Sequence[CircuitPart]) -> Iterator[Diagnostic]:
    """A warning of two diodes from an electrode to the store in both directions."""
    diodes = [part for part in parts if part.kind == "d"]
    store = next((set(part.nodes) for part in parts if part.name == "csmooth"), set())
    for k, first in enumerate(diodes):
        for second in diodes[k + 1 :]:
            nodes = set(first.nodes)
            back = first.nodes[:2] == second.nodes[1::-1]
            if back and nodes & {PIEZO, "0"} and nodes & (store - {PIEZO, "0"}):
                yield warning("antiparallel_diodes", first=first.name, second=second.name)


def _without_return(parts: Sequence[CircuitPart], names: Mapping[str, str]) -> Iterator[Diagnostic]:
    """A warning of diodes that no direct current can pass, as the piezo and capacitors block it on its way back.

    The mean currents of a periodic response circulate through all elements but capacitors, so that a diode
    passes one only if its cathode leads back to its anode.
    """
    ways: dict[str, set[str]] = {}
    for part in parts:
        nodes = part.nodes if part.kind in _DEVICES else part.nodes[:2]
        if part.kind == "d":
            ways.setdefault(nodes[0], set()).add(nodes[1])
        elif part.kind != "c":
            for node in nodes:
                ways.setdefault(node, set()).update(nodes)
    diodes = [part for part in parts if part.kind == "d"]
    blocked = [part.name for part in diodes if part.nodes[0] not in _reached(part.nodes[1], ways)]
    if blocked:
        listed = ", ".join(names.get(name, name) for name in blocked)
        yield warning("no_return_path", names=listed, count=len(blocked))


def _reached(node: str, ways: Mapping[str, set[str]]) -> set[str]:
    """The nodes to which ``ways`` lead from one, with itself."""
    reached = {node}
    left = [node]
    while left:
        new = ways.get(left.pop(), set()) - reached
        reached |= new
        left.extend(new)
    return reached
