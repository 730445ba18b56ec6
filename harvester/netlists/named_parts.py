"""Parts by their names: a netlist may name a diode, transistor or chip of netlists/parts without a model of its own."""

import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from harvester.netlists.allowed import allowed_lines
from harvester.netlists.read_lines import Line, read_lines
from harvester.netlists.subcircuits import header_of


def with_parts(lines: list[Line], folder: Path) -> list[Line]:
    """The lines of a netlist, and those of every part of ``folder`` that it names and does not define itself.

    A part is a model or a subcircuit; one that needs another brings that along.
    """
    defined = {name for name, _ in _definitions(lines)}
    parts = {name: body for name, body in _parts(folder).items() if name not in defined}
    found: list[Line] = []
    new = lines
    while new:
        named = {word.lower() for line in new for word in re.findall(r"[\w.]+", line.text)}
        new = [line for name in sorted(named & parts.keys()) for line in parts.pop(name)]
        found += new
    return [*lines, *found]


def part_names(folder: Path) -> list[str]:
    """The names of all parts, in lower case."""
    return sorted(_parts(folder))


@cache
def _parts(folder: Path) -> dict[str, list[Line]]:
    """The lines of every part by its name."""
    files = sorted(folder.glob("*.lib"))
    return dict(one for path in files for one in _definitions(list(allowed_lines(read_lines(path)))))


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
