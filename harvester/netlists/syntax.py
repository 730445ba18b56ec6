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
    kind, count = line.word[0], NODES.get(line.word[0], 0)
    if kind == "x":
        plain = next((k for k, one in enumerate(tokens) if "=" in one or one.lower() == "params:"), len(tokens))
        count = plain - 2
    elif (
        (
            kind in "egs"
            and len(tokens) > 3
            and not tokens[3].lower().startswith(_NO_CONTROL_NODES)
            and "=" not in tokens[3]
        )
        or (kind == "q" and len(tokens) > 5 and tokens[4].lower() not in models and tokens[5].lower() in models)
        or (kind == "m" and not (len(tokens) > 4 and tokens[4].lower() in models))
    ):
        count = 4
    elif kind == "m":
        count = 3
    if len(tokens) <= count:
        raise invalid(f"netlist {line.where}", f"give {count} nodes to {tokens[0][:20]}", line.text[:60])
    return range(1, count + 1)
