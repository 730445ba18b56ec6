"""Cards of a deck that a board has otherwise: steps, as sweeps of a scene, and libraries.

Libraries are the files that a deck names; models of the package are there as well.
"""

import math
import re
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from harvester.errors import InputError, invalid
from harvester.netlists.cards import PARAMETERS
from harvester.netlists.element_lines import Element
from harvester.netlists.expression import plain_number
from harvester.netlists.load_circuit import netlist_folder
from harvester.netlists.model_lines import model_name
from harvester.netlists.netlist import part_names
from harvester.netlists.read_lines import Line
from harvester.netlists.words import tokens_of
from harvester.presentation.diagnostic import Diagnostic, note, warning

MOST = 50  # values of a list; a step with more is left out with a warning


@dataclass(frozen=True)
class ParameterStep:
    """A stepped parameter or other quantity in lower case, and its values as --vary reads them."""

    name: str
    values: str
    text: str

    def offered(
        self,
        texts: dict[Line, str],
        parameters: dict[str, str],
        elements: Sequence[Element],
        load: Element,
        store: Element | None,
    ) -> Diagnostic:
        """The sweep that does the same, or a warning without one.

        The board's lines ``texts`` get the parameter's value in place of its name, if one element
        alone has it.
        """
        braces = (f"{{{self.name}}}", f"'{self.name}'", self.name)
        users = [e for e in elements if set(braces) & set(tokens_of(e.line.text.lower())[3:])]
        name = re.escape(self.name)
        definition = rf"\b{name}\s*=\s*(\{{[^}}]*\}}|'[^']*'|\S+)"
        others = [
            line
            for line, text in texts.items()
            if re.search(
                rf"\b{name}\b",
                re.sub(definition, "", text.lower()) if line.word in PARAMETERS else text.lower(),
            )
            and line not in [user.line for user in users]
        ]
        if len(users) != 1 or others or self.name not in parameters:
            return warning("deck_step_left_out", text=self.text)
        if not self.values:
            return warning("deck_step_too_long", text=self.text, most=MOST)
        user = users[0]
        value = parameters[self.name].strip("{}'")
        if plain_number(value) is None:
            return warning("deck_step_left_out", text=self.text)
        pattern = rf"(\{{\s*{name}\s*\}}|'{name}'|\b{name}\b(?!\s*=))"
        head, _, rest = texts[user.line].partition(user.nodes[1])
        texts[user.line] = head + user.nodes[1] + re.sub(pattern, value, rest, flags=re.IGNORECASE)
        key = {load.name: "R", store.name if store else "": "C"}.get(user.name, user.name)
        return note("deck_step", text=self.text, key=f"load.parameters.{key}", values=self.values)


def read_step(line: Line) -> ParameterStep:
    """The step of a .step card: a list, or a range by its increment or its points of a decade."""
    words = [word.lower() for word in line.text.split()[1:]]
    form = words.pop(0) if words[:1] and words[0] in ("dec", "oct", "lin") else "lin"
    if words[:1] == ["param"]:
        words.pop(0)
    if not words:
        must = "step a parameter, as .step param R list 1k 2k"
        raise invalid(f"deck {line.where}", must, line.text[:60])
    name = words[0]
    rest = words[1:]
    if rest[:1] == ["list"]:
        some = [plain_number(word) for word in rest[1:]]
        values = "" if None in some else ",".join(map(_text, some))
        return ParameterStep(name, values, line.text[:60])
    numbers = [number for word in rest if (number := plain_number(word)) is not None]
    values = _range(form, numbers) if len(numbers) == len(rest) == 3 else ""
    return ParameterStep(name, values, line.text[:60])


def step_values(line: Line) -> list[str]:
    """The words of a .step card behind the name; that of a model's parameter is NPN QX(VAF)."""
    model = re.match(
        r"\.step\s+(?:(?:dec|oct|lin)\s+)?\S+\s+[^\s()]+\s*\([^()]*\)", line.text, re.I
    )
    name = re.match(r"\.step\s+(?:(?:dec|oct|lin)\s+)?(?:param\s+)?\S+", line.text, re.I)
    head = model or name
    return tokens_of(line.text[head.end() :]) if head else []


def _range(form: str, numbers: Sequence[float]) -> str:
    """The values of a range as --vary reads them; "" for an empty or long one.

    lin: first + k by.  dec and oct: first base^(k/by) with base 10 and 2, which --vary spaces alike
    from end to end if the ends differ tenfold.  The last one is at most ``last``.
    """
    first, last, by = numbers
    if form == "lin":
        count = math.floor((last - first) / by + 1e-9) + 1 if by else 0
        values = [first + k * by for k in range(min(count, MOST + 1))]
    elif 0.0 < first < last and by >= 1.0:
        base = 10.0 if form == "dec" else 2.0
        steps = by * math.log(last / first, base)
        count = math.floor(steps + 1e-9) + 1
        if last >= 10.0 * first and abs(steps - round(steps)) < 1e-9:
            return f"{_text(first)}:{_text(last)}:{count}"
        values = [first * base ** (k / by) for k in range(min(count, MOST + 1))]
    else:
        values = []
    return ",".join(map(_text, values)) if 1 < len(values) <= MOST else ""


def _text(number: float | None) -> str:
    """A number with as many digits as it has, up to twelve."""
    short = f"{number:.6g}"
    return short if float(short) == number else f"{number:.12g}"


def names_of(lines: Iterable[Line]) -> Iterator[str]:
    """The names of the models and subcircuits that lines define."""
    for line in lines:
        if line.word == ".model":
            yield model_name(line)
        elif line.word == ".subckt":
            yield [*line.text.lower().split(), ""][1]


def beside(path: Path, name: str) -> Path | None:
    """The file that a deck names, in its folder or below it: by its path, or by its name alone."""
    folder = path.parent.resolve()
    last = re.split(r"[\\/]", name)[-1]
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
            f"deck {line.where} must name a library in the deck's folder, but {last} is not there, "
            f"and {', '.join(lost)} is needed of it: copy {last} there, or write "
            "its .model card or its .subckt into the deck"
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


def check_form(path: Path) -> None:
    """Refuse drawings, of which the netlist is to be exported."""
    ways = {
        ".asc": "in LTspice: View > SPICE Netlist, then File > Save As",
        ".kicad_sch": f"kicad-cli sch export netlist --format spice -o {path.stem}.cir {path.name}",
    }
    if (how := ways.get(path.suffix.lower())) is not None:
        raise InputError(f"DECK must be a netlist, but {path.name} is a drawing; export it: {how}")
