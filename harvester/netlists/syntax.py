"""What the words of a netlist mean: numbers as ngspice writes them, and which words of an element are its nodes."""

import re
from collections.abc import Set

from harvester.errors import invalid
from harvester.netlists.read_lines import Line
from harvester.quantities.units import PREFIXES

# How many of the first words after an element's name are nodes that its current passes, by the letter of its kind.
NODES = dict.fromkeys("rclvibdswefgh", 2) | {"j": 3, "q": 3, "m": 4, "t": 4}
GROUND = ("0", "gnd")
_SUFFIXES = {"meg" if prefix == "M" else prefix.lower(): power for prefix, power in PREFIXES.items()}
_NO_CONTROL_NODES = ("poly", "value", "table", "vol", "cur", "{", "'")  # forms of E and G sources


def ngspice_number(text: str) -> float | None:
    """A number as ngspice writes it (2.2k, 5Meg, 1u); None for anything else."""
    match = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(meg|[tgkmunpf])?[a-z]*", text.strip().lower())
    return None if match is None else float(match[1]) * 10.0 ** _SUFFIXES[match[2] or ""]


def net_of(name: str) -> str:
    """The name of a net in lower case; ground is 0."""
    return "0" if name.lower() in GROUND else name.lower()


def places_of_nodes(line: Line, tokens: list[str], models: Set[str]) -> range:
    """Which words of an element are its nodes, those that only control it included; ``models`` are the names of models.

    Raises InputError where it has too few words.
    """
    count = _count_of_nodes(line.word[0], tokens, models)
    if len(tokens) <= count:
        raise invalid(f"netlist {line.where}", f"give {count} nodes to {tokens[0][:20]}", line.text[:60])
    return range(1, count + 1)


def _count_of_nodes(kind: str, tokens: list[str], models: Set[str]) -> int:
    """How many nodes an element of a kind has."""
    words = [one.lower() for one in tokens]
    if kind == "x":
        plain = next((k for k, one in enumerate(words) if "=" in one or one == "params:"), len(words))
        return plain - 2
    if kind == "q":  # a model as its fifth word makes the fourth its substrate
        return 4 if len(words) > 5 and words[4] not in models and words[5] in models else NODES[kind]
    if kind == "m":
        return 3 if len(words) > 4 and words[4] in models else 4
    return 4 if kind in "egs" and _names_a_node(words[3:4]) else NODES.get(kind, 0)


def _names_a_node(word: list[str]) -> bool:
    """Whether the fourth word of an E, G or S is a node that controls it, and no other form's beginning."""
    return bool(word) and not word[0].startswith(_NO_CONTROL_NODES) and "=" not in word[0]
