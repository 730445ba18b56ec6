"""Steps of a parameter in a deck (.step), as sweeps of a scene."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from harvester.errors import invalid
from harvester.netlists.element_lines import Element
from harvester.netlists.expression import plain_number
from harvester.netlists.read_lines import Line
from harvester.netlists.words import tokens_of
from harvester.presentation.diagnostic import Diagnostic, note, warning

MOST = 25  # values of a list; more are a range with so many points


@dataclass(frozen=True)
class ParameterStep:
    """A stepped parameter, or another quantity, in lower case, and its values as --vary reads them."""

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

        The board's lines ``texts`` get the parameter's value in place of its name, if one element alone has it.
        """
        braces = (f"{{{self.name}}}", f"'{self.name}'", self.name)
        users = [e for e in elements if set(braces) & set(tokens_of(e.line.text.lower())[3:])]
        others = [
            line
            for line, text in texts.items()
            if re.search(rf"\b{re.escape(self.name)}\b", text.lower())
            and not line.word.startswith(".param")
            and line not in [user.line for user in users]
        ]
        if len(users) != 1 or others or self.name not in parameters or not self.values:
            return warning("deck_step_left_out", text=self.text)
        user, value = users[0], parameters[self.name].strip("{}'")
        if plain_number(value) is None:
            return warning("deck_step_left_out", text=self.text)
        pattern = rf"(\{{\s*{re.escape(self.name)}\s*\}}|'{re.escape(self.name)}'|\b{re.escape(self.name)}\b(?!\s*=))"
        head, _, rest = texts[user.line].partition(user.nodes[1])
        texts[user.line] = head + user.nodes[1] + re.sub(pattern, value, rest, flags=re.IGNORECASE)
        key = {load.name: "R", store.name if store else "": "C"}.get(user.name, user.name)
        return note("deck_step", text=self.text, key=f"load.parameters.{key}", values=self.values)


def read_step(line: Line) -> ParameterStep:
    """The step of a .step card: a list, or a range by its increment or by points of a decade or an octave."""
    words = [word.lower() for word in line.text.split()[1:]]
    form = words.pop(0) if words[:1] and words[0] in ("dec", "oct", "lin") else "lin"
    if words[:1] == ["param"]:
        words.pop(0)
    if not words:
        must = "step a parameter, as .step param R list 1k 2k"
        raise invalid(f"deck {line.where}", must, line.text[:60])
    name, rest = words[0], words[1:]
    if rest[:1] == ["list"]:
        return ParameterStep(name, ",".join(map(_number, rest[1:])), line.text[:60])
    numbers = [number for word in rest if (number := plain_number(word)) is not None]
    values = _range(form, *numbers) if len(numbers) == len(rest) == 3 else ""
    return ParameterStep(name, values, line.text[:60])


def _range(form: str, first: float, last: float, by: float) -> str:
    """The values of a range as --vary reads them; "" for an empty or long one."""
    if form == "lin":
        count = math.floor((last - first) / by + 1e-9) + 1 if by else 0
        return ",".join(f"{first + k * by:.6g}" for k in range(count)) if 1 < count <= MOST else ""
    if not (0.0 < first < last and by >= 1.0):
        return ""
    count = round(by * math.log(last / first, 10.0 if form == "dec" else 2.0)) + 1
    return f"{first:.6g}:{last:.6g}:{count}"


def _number(text: str) -> str:
    """A number of SPICE as a plain one."""
    value = plain_number(text)
    return "" if value is None else f"{value:.6g}"
