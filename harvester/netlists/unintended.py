"""Values of a netlist that are right in SPICE, but probably unintended: warnings, as data.

The meaning in SPICE is kept: the 7 of ``4k7`` is a unit, ``1M`` is a milliohm and ``0.47F`` is in
femtofarad.

Source: ngspice manual, section 2.1.3 (scale factors); LTspice 24's help, "General Structure and
Conventions".
"""

import contextlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence

from harvester.errors import InputError
from harvester.netlists.element_lines import Element
from harvester.netlists.expression import SUFFIXES, plain_number
from harvester.netlists.netlist import Body, ParsedNetlist
from harvester.netlists.part import PIEZO, CircuitPart
from harvester.netlists.read_lines import Line
from harvester.netlists.words import tokens_of
from harvester.presentation.diagnostic import Diagnostic, Number, warning

# From the least to the most of resistances (ohm), capacitances (F) and inductances (H) on boards.
TYPICAL = {"r": (1e-4, 1e14), "c": (1e-15, 1e4), "l": (1e-10, 1e5)}
UNITS = {"r": "ohm", "c": "F", "l": "H", "v": "V", "i": "A"}
LEAST_LOAD = 0.01  # ohm
LEAST_STORE = 1e-12  # F
SMALL = 1.0  # ohm, below which a resistance with a capital M was meant in megohm
SAME = 1.5  # times the piezo's capacitance, and a part of it: a capacitor across it may be its own
_DEVICES = "qmjt"  # letters of elements with current in every node
_INSIDE = re.compile(r"(\d+\.?\d*|\.\d+)(meg|[tgkmunpfrv])(\d+)([a-z]*)", re.IGNORECASE)
_MEGA = re.compile(r"(\d+\.?\d*|\.\d+)M(?!eg|EG|il|IL)(ohm)?s?", re.ASCII)
_FARAD = re.compile(r"(\d+\.?\d*|\.\d+)F(arad)?s?")
_POINTS = "rv"  # units in place of the point
_POWERS = SUFFIXES | dict.fromkeys(_POINTS, 0)


def unintended_values(
    netlist: ParsedNetlist, load: Body, parts: Sequence[CircuitPart], capacitance: float | None
) -> tuple[Diagnostic, ...]:
    """Warnings of texts in a netlist's file, then of element values.

    ``load`` is the body of the load circuit and ``capacitance`` (F) the piezo's. Libraries are
    others', so that only lines of the netlist's file count.
    """
    warnings = _of_texts(netlist, load)
    # as they are written
    names = {element.name.lower(): _first_word(element.line) for element in load.elements}
    for part in parts:
        odd = _of_value(part, names.get(part.name, part.name), capacitance)
        if part.name not in warnings and odd is not None:
            warnings[part.name] = odd
    return (*warnings.values(), *_antiparallel(parts), *_without_return(parts, names))


def _of_texts(netlist: ParsedNetlist, load: Body) -> dict[str, Diagnostic]:
    """Warnings of texts, by load elements or by lines of subcircuits and parameters."""
    warnings: dict[str, Diagnostic] = {}
    for element in load.elements:
        for remark in unintended_texts(element):
            warnings.setdefault(element.name.lower(), remark)
    inside = [body for body in netlist.subcircuits.values() if _is_own(netlist, body.line)]
    for body in inside:
        if body is load:
            continue
        with contextlib.suppress(InputError):  # of a subcircuit that nobody calls
            for element in body.elements:
                for remark in unintended_texts(element):
                    warnings.setdefault(element.line.where, remark)
    for body in (netlist.outside, *inside):
        for line in (body.line, *body.parameter_lines):
            if _is_own(netlist, line):
                warnings |= {f"{line.where}{remark}": remark for remark in _of_pairs(line)}
    return warnings


def _is_own(netlist: ParsedNetlist, line: Line) -> bool:
    """Whether a line is in the file of the netlist itself."""
    return line.where.startswith(f"{netlist.file} ")


def _first_word(line: Line) -> str:
    return line.text.split(maxsplit=1)[0]


def unintended_texts(element: Element) -> Iterator[Diagnostic]:
    """Warnings of numbers that other programs read differently, or whose unit is a scale factor."""
    kind = element.kind
    if kind == "x":
        yield from _of_pairs(element.line)
    if kind not in UNITS:
        return
    named = {"element": _first_word(element.line), "line": element.line.where, "unit": UNITS[kind]}
    for text in tokens_of(element.line.text)[1 + len(element.nodes) :]:
        if (odd := unintended_number(text, named)) is not None:
            yield odd
            continue
        value = plain_number(text)
        if value is None:
            continue
        numbers: dict[str, Number] = {**named, "text": text, "value": value}
        if kind == "r" and (match := _MEGA.fullmatch(text)) is not None and value < SMALL:
            yield warning("mega_or_milli", **numbers, write=f"{match[1]}Meg")
        elif kind == "c" and (match := _FARAD.fullmatch(text)) is not None:
            yield warning("farad_or_femto", **numbers, write=match[1])


def _of_pairs(line: Line) -> Iterator[Diagnostic]:
    """The same of values behind names, in a .param card, a subcircuit's header or its call, whose unit is not known."""
    words = tokens_of(line.text)
    for name, sign, text in zip(words, words[1:], words[2:], strict=False):
        named: dict[str, Number] = {"element": name, "line": line.where, "unit": ""}
        if sign != "=":
            continue
        if (odd := unintended_number(text, named)) is not None:
            yield odd
        elif (match := _MEGA.fullmatch(text)) is not None:
            value = plain_number(text, mil=False)
            yield warning("mega_or_milli", **named, text=text, value=value, write=f"{match[1]}Meg")


def unintended_number(text: str, named: Mapping[str, Number]) -> Diagnostic | None:
    """A warning of a number such as ``4k7``, of the element, line and unit that are ``named``.

    None of another.
    """
    digits = _digits_inside(text)
    return None if digits is None else warning("digits_behind_suffix", **named, **digits)


def _digits_inside(text: str) -> dict[str, Number] | None:
    """The numbers of a text such as ``4k7``, whose 7 SPICE reads as a unit; None of another."""
    value = plain_number(text)
    match = _INSIDE.fullmatch(text)
    if value is None or match is None or not match[3].strip("0"):
        return None
    letter = match[2].lower()
    meant = f"{match[1].rstrip('.')}.{match[3]}" if "." not in match[1] else match[1]
    suffix = "" if letter in _POINTS else match[2]
    other = float(f"{meant}e{_POWERS[letter]}")
    return {"text": text, "value": value, "other": other, "write": f"{meant}{suffix}"}


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
    """A warning of two diodes from an electrode to the storage capacitor in both directions."""
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

    The mean currents of a periodic response circulate through all elements but capacitors, so that
    a diode passes one only if its cathode leads back to its anode.
    """
    ways = _ways(parts)
    diodes = [part for part in parts if part.kind == "d"]
    blocked = [part.name for part in diodes if part.nodes[0] not in _reached(part.nodes[1], ways)]
    if blocked:
        listed = ", ".join(names.get(name, name) for name in blocked)
        yield warning("no_return_path", names=listed, count=len(blocked))


def _ways(parts: Sequence[CircuitPart]) -> dict[str, set[str]]:
    """The nodes to which elements pass a direct current from each node."""
    ways: dict[str, set[str]] = {}
    others = {node for part in parts if part.kind != "d" for node in part.nodes} | {PIEZO, "0"}
    for part in parts:
        nodes = part.nodes if part.kind in _DEVICES else part.nodes[:2]
        # back to back at a node of their own, diodes are there for their breakdown
        breaks = part.model is not None and "bv" in part.model.values and set(nodes) - others
        if part.kind == "d" and not breaks:
            ways.setdefault(nodes[0], set()).add(nodes[1])
        elif part.kind != "c":
            for node in nodes:
                ways.setdefault(node, set()).update(nodes)
    return ways


def _reached(node: str, ways: Mapping[str, set[str]]) -> set[str]:
    """The nodes to which ``ways`` lead from one, with itself."""
    reached = {node}
    left = [node]
    while left:
        new = ways.get(left.pop(), set()) - reached
        reached |= new
        left.extend(new)
    return reached
