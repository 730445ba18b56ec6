"""Node 0 of a flat netlist, in vendors' subcircuits too, as a node of the board: a pin more for what refers to it."""

import re
from collections.abc import Set

from harvester.errors import InputError
from harvester.netlists.read_lines import Line, net_of, places_of_nodes
from harvester.netlists.subcircuits import header_of, joined

COMMON = "board_ground"
VOLTAGE = re.compile(r"\bv\(\s*([^(),\s]+)\s*(?:,\s*([^(),\s]+)\s*)?\)", re.IGNORECASE)


def referred(body: list[Line], inner: list[list[Line]], models: Set[str]) -> tuple[list[Line], list[list[Line]]]:
    """Body and subcircuits in which node 0 is the board's ground: a pin more for each subcircuit that refers to it."""
    bodies = {header_of(body[0]).name.lower(): [_without_ground_pin(line, body[0]) for line in body] for body in inner}
    needing: set[str] = set()
    while True:
        more = {name for name, lines in bodies.items() if any(_refers(line, models, needing) for line in lines[1:])}
        if more <= needing:
            break
        needing |= more
    changed = []
    for name, lines in bodies.items():
        new = [_grounded(line, models, needing) for line in lines[1:]] if name in needing else lines[1:]
        words = joined(lines[0].text).split()
        if name in needing:
            words.insert(2 + len(header_of(lines[0]).terminals), COMMON)
        changed.append([Line(lines[0].where, " ".join(words)), *new])
    return [_grounded(line, models, needing) for line in body], changed


def _without_ground_pin(line: Line, header: Line) -> Line:
    """A line of a subcircuit whose pin is called gnd, which ngspice would take for node 0, with another name for it."""
    if "gnd" not in (terminal.lower() for terminal in header_of(header).terminals):
        return line
    return Line(line.where, re.sub(r"(?<![\w.])gnd(?![\w.])", "gnd_pin", line.text, flags=re.IGNORECASE))


def _refers(line: Line, models: Set[str], needing: Set[str]) -> bool:
    """Whether an element of a subcircuit refers to node 0, or calls one that does."""
    return not line.word.startswith(".") and _grounded(line, models, needing).text != joined(line.text)


def _grounded(line: Line, models: Set[str], needing: Set[str]) -> Line:
    """An element with the board's ground in place of node 0, and as a pin more of the subcircuits that need it."""
    if line.word.startswith("."):
        return line
    tokens = joined(line.text).split()
    nodes = places_of_nodes(line, tokens, models)
    if line.word[0] in "eghf" and len(tokens) > 3 and tokens[3].lower().startswith("poly"):
        raise InputError(
            f"netlist {line.where} must give its polynomial as a B source, as the board's ground is no electrode of "
            "the piezo"
        )
    new = [COMMON if k in nodes and net_of(token) == "0" else token for k, token in enumerate(tokens)]
    rest = len(nodes) + 1
    new = [*new[:rest], *(VOLTAGE.sub(_against_ground, token) for token in new[rest:])]
    if line.word[0] == "x" and tokens[len(nodes) + 1].lower() in needing:
        new.insert(len(nodes) + 1, COMMON)
    return Line(line.where, " ".join(new))


def _against_ground(match: re.Match[str]) -> str:
    """A voltage of an expression, against the board's ground where it is against node 0."""
    first, second = (None if name is None else COMMON if net_of(name) == "0" else name for name in match.groups())
    return f"v({first},{second or COMMON})"
