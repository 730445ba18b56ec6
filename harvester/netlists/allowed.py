"""What a netlist may hold: every line is untrusted text, checked against lists of what is allowed.

ngspice can run shell commands (``.control``, lines that begin with ``*#``), read files (``.include``, ``.lib``,
XSPICE models) and write them (CIDER models, the logs of BSIM models).  None of this comes through.

What netlists/parts holds is checked in the same way: a netlist may name a diode, transistor or chip of netlists/parts
without a model of its own.
"""

import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from harvester.errors import InputError, invalid, shown
from harvester.netlists.read_lines import Line, read_lines
from harvester.netlists.subcircuits import BENCH, DEFINITIONS, header_of, joined, set_parameters

MOST_ELEMENTS = 10_000  # of the load, its inner subcircuits written out
DEEPEST = 100  # calls of a subcircuit within another

_ELEMENTS = "rclkdqjmswvibefghxt"  # first letters; no a: XSPICE models read files
_MODELS = ("r", "c", "l", "d", "npn", "pnp", "njf", "pjf", "nmos", "pmos", "vdmos", "vdmosn", "vdmosp", "sw", "csw")
_MOS_LEVELS = ("1", "2", "3", "6")  # the others write log files
# external: a source that the lock-step drives.  trnoise, trrandom: no seed.  file: a file, or a model that has one.
_WORDS = re.compile(r"\b(external|port|trnoise|trrandom|\w*file\w*|shell|system)\b", re.IGNORECASE)
_DRAWN = re.compile(r"\b(agauss|gauss|aunif|unif|limit)\s*\(", re.IGNORECASE)  # ngspice draws a number, without a seed
_CHARACTERS = re.compile(r"[\w\s.,:+\-*/^=<>!?&|(){}\[\]']*", re.ASCII)
_NAME = re.compile(r"(?<![\w.])[a-z_]\w*", re.IGNORECASE | re.ASCII)
_QUANTITIES = {"pi", "e", "c", "kelvin", "echarge", "boltz", "planck", "i", "time", "temper", "hertz", "yes", "no"}
_QUANTITIES |= {"true", "false", "tc1", "tc2", "temp", "dtemp", "m", "gmin"}


def allowed_lines(lines: Iterable[Line]) -> Iterator[Line]:
    """Yield the lines as they come, each after its check.

    Raises InputError at the first line that is not allowed.
    """
    for line in lines:
        _check_line(line)
        yield line


def _check_line(line: Line) -> None:
    """Refuse what could run a command, reach a file, or talk to the lock-step."""
    where, word = f"netlist {line.where}", line.word
    if word.startswith("."):
        if word not in DEFINITIONS + BENCH:
            flat = "of a flat netlist, such as KiCad's, load.terminals in a scene names the piezo's nets"
            cards = f"have only the cards {', '.join(DEFINITIONS)} (and a bench to run it by hand; {flat})"
            raise invalid(where, cards, word)
        if word in BENCH:
            return  # never given to ngspice; inside a subcircuit `split_subcircuits` refuses it
    elif word[0] not in _ELEMENTS:
        raise invalid(where, f"begin with a card or one of the elements {_ELEMENTS.upper()}", word)
    if not _CHARACTERS.fullmatch(line.text):
        wrong = next(letter for letter in line.text if not _CHARACTERS.fullmatch(letter))
        raise invalid(where, "have no such character outside a comment", wrong)
    if line.text.count("{") != line.text.count("}") or line.text.count("'") % 2:
        raise invalid(where, "close its braces and quotes", line.text[:60])
    if word == "rload" and re.search(r"\b[vi]\s*\(|\b(time|temper|hertz)\b", line.text, re.IGNORECASE):
        raise invalid(where, "give Rload a constant resistance", line.text[:60])
    if match := _WORDS.search(line.text):
        raise invalid(where, "name no file, no command and no random or external source", match[0])
    if match := _DRAWN.search(line.text):
        remedy = "(harvester tolerance --vary draws parts from a seed)"
        raise invalid(where, f"use no function that draws a random number {remedy}", match[1])
    if word == ".model":
        _check_model(where, line.text.lower())


def _check_model(where: str, text: str) -> None:
    """Refuse a model that could read or write files."""
    tokens = re.split(r"[\s(]+", text)
    kind = tokens[2] if len(tokens) > 2 else ""
    if kind not in _MODELS:
        raise invalid(where, f"have a model of one of the types {', '.join(_MODELS)}", kind)
    if kind in ("nmos", "pmos"):
        for level in re.findall(r"level[\s=,(]*([^\s=,()]*)", text):
            if level not in _MOS_LEVELS:
                raise invalid(where, f"have a MOSFET model of level {', '.join(_MOS_LEVELS)}", level)


def check_names(subcircuits: dict[str, list[Line]], outside: list[Line]) -> None:
    """Refuse two elements or models of one name, and names without a value in expressions, but for ngspice's own."""
    for lines in (outside, *subcircuits.values()):
        _check_once(lines)
    common = _QUANTITIES | set(set_parameters(outside))
    for body in subcircuits.values():
        known = common | {name.lower() for name in header_of(body[0]).defaults} | set(set_parameters(body))
        for line in body:
            text = line.text.lower()
            expressions = re.findall(r"\{([^}]*)\}|'([^']*)'", text)
            if line.word[0] == "b" and "=" in text:
                expressions.append((text.split("=", 1)[1], ""))
            for expression in ("".join(pair) for pair in expressions):
                bare = re.sub(r"\b[vi]\s*\([^)]*\)", " ", expression)
                for match in _NAME.finditer(bare):
                    if match[0] not in known and not re.match(r"\s*[(=]", bare[match.end() :]):
                        raise InputError(
                            f"netlist {line.where} must use parameters that have a value, "
                            f"but {shown(match[0])} has none: give it on the .subckt line"
                        )


def _check_once(lines: list[Line]) -> None:
    """Refuse two elements, or two models, of one name: ngspice would take one of them."""
    before: set[tuple[str, str]] = set()
    for line in lines:
        kind, name = ("model", line.text.lower().split()[1]) if line.word == ".model" else ("element", line.word)
        if (kind, name) in before:
            raise invalid(f"netlist {line.where}", f"have a name that no other {kind} has", name)
        if name[0] != ".":
            before.add((kind, name))


def check_size(subcircuits: dict[str, list[Line]], load: str) -> None:
    """Refuse subcircuits that call themselves, and a load of too many elements or calls one within another."""
    sizes: dict[str, int] = {}

    def size(name: str, line: Line | None, within: tuple[str, ...]) -> int:
        """Count the elements of a subcircuit that a line calls within others."""
        if line is not None and name not in subcircuits:
            raise invalid(f"netlist {line.where}", "call a subcircuit of this netlist", name)
        if line is not None and name in within:
            raise invalid(f"netlist {line.where}", "call no subcircuit within itself", name)
        if line is not None and len(within) > DEEPEST:
            raise InputError(f"netlist {line.where} must call at most {DEEPEST} subcircuits one within another")
        if name not in sizes:
            sizes[name] = 0
            for inner in subcircuits[name]:
                sizes[name] += size(_called_by(inner), inner, (*within, name)) if inner.word[0] == "x" else 1
        return sizes[name]

    if size(load, None, ()) > MOST_ELEMENTS:
        raise InputError(f"netlist subcircuit {load} must have at most {MOST_ELEMENTS} elements, but has {sizes[load]}")


def _called_by(line: Line) -> str:
    """The name of the subcircuit that an X line calls."""
    return [token for token in joined(line.text).lower().split() if "=" not in token and token != "params:"][-1]


def with_parts(lines: list[Line], folder: Path) -> list[Line]:
    """The lines of a netlist, and those of every part of ``folder`` that it names and does not define itself.

    A part is a model or a subcircuit; one that needs another brings that along.
    """
    defined = {name for name, _ in _definitions(lines)}
    parts = {name: body for name, body in _parts(folder).items() if name not in defined}
    added: list[Line] = []
    new = lines
    while new:
        named = {word.lower() for line in new for word in re.findall(r"[\w.]+", line.text)}
        new = [line for name in sorted(named & parts.keys()) for line in parts.pop(name)]
        added += new
    return [*lines, *added]


def part_names(folder: Path) -> list[str]:
    """The names of all parts, in lower case."""
    return sorted(_parts(folder))


@cache
def _parts(folder: Path) -> dict[str, list[Line]]:
    """The lines of every part by its name."""
    files = sorted(folder.glob("*.lib"))
    return dict(definition for path in files for definition in _definitions(list(allowed_lines(read_lines(path)))))


def _definitions(lines: Iterable[Line]) -> Iterator[tuple[str, list[Line]]]:
    """The models and subcircuits that lines define: the name in lower case, and the lines."""
    body: list[Line] | None = None
    for line in lines:
        if line.word == ".subckt":
            body = []
        if body is not None:
            body.append(line)
        elif line.word == ".model":
            yield line.text.lower().split()[1], [line]
        if line.word == ".ends" and body:
            yield header_of(body[0]).name.lower(), body
            body = None
