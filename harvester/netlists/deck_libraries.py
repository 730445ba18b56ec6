"""Libraries of a deck: the files that it names, the models that it needs of them, and the models of the package."""

import re
from collections.abc import Iterable, Iterator, Sequence, Set
from pathlib import Path

from harvester.errors import InputError
from harvester.netlists.expression import plain_number
from harvester.netlists.load_circuit import netlist_folder
from harvester.netlists.model_lines import model_name
from harvester.netlists.netlist import part_names
from harvester.netlists.read_lines import Line
from harvester.netlists.words import tokens_of
from harvester.presentation.diagnostic import Diagnostic, note, warning


def names_of(lines: Iterable[Line]) -> Iterator[str]:
    """The names of the models and subcircuits that lines define."""
    for line in lines:
        if line.word == ".model":
            yield model_name(line)
        elif line.word == ".subckt":
            yield [*line.text.lower().split(), ""][1]


def beside(path: Path, name: str) -> Path | None:
    """The file that a deck names, in its folder or below it: by its path, or else by its last part alone."""
    folder, last = path.parent.resolve(), re.split(r"[\\/]", name)[-1]
    for candidate in (folder / name.replace("\\", "/"), folder / last):
        try:
            target = candidate.resolve()
        except (OSError, RuntimeError, ValueError):
            continue
        if target.is_file() and target.is_relative_to(folder):
            return target
    return None


def on_libraries(
    missing: Sequence[tuple[Line, str]], texts: Iterable[Line], models: Set[str]
) -> Iterator[Diagnostic]:
    """Remarks on libraries that are not there; raises InputError for models that nobody has."""
    packaged = set(part_names(netlist_folder() / "parts"))
    named = {name for line in texts for name in _needed(line) if name not in models}
    lost = sorted(named - packaged) if missing else []
    if lost:
        line, name = missing[0]
        last = re.split(r"[\\/]", name)[-1]
        raise InputError(
            f"deck {line.where} must name a library in the deck's folder, but {last} is not there, and "
            f"{', '.join(lost)} is needed of it: copy {last} there, or write a .model card into the deck"
        )
    for _, name in missing:
        yield note("deck_library", library=re.split(r"[\\/]", name)[-1])
    if used := sorted(named & packaged):
        yield warning("deck_own_model", models=", ".join(used))


def _needed(line: Line) -> Iterator[str]:
    """The models or the subcircuit that an element's line names."""
    if line.word[0] in "dqjmsw":
        words = [word for word in tokens_of(line.text.lower()) if plain_number(word) is None]
        count = {"d": 3, "q": 4, "j": 4, "m": 5, "s": 5, "w": 4}[line.word[0]]
        tokens = tokens_of(line.text.lower())
        yield tokens[count] if len(tokens) > count and line.word[0] != "m" else words[-1]
    elif line.word[0] == "x":
        plain = [
            word for word in line.text.lower().split() if "=" not in word and word != "params:"
        ]
        yield plain[-1]
