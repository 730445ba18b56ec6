"""A netlist as it is read, once: subcircuits with their elements, models, parameters and functions, and its settings.

Everything else reads this: which circuit is the load (`harvester.netlists.load_circuit`), the
meaning of a board's nets (`harvester.netlists.flat`), and the elements with their values
(`harvester.netlists.written_out`).  The text itself is not passed on: the text for ngspice is
written from the understood content.

Lines of a subcircuit that nobody calls, and models that nobody names, are not read beyond their
names.
"""

import re
from collections.abc import Iterable, Set
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path

from harvester.errors import InputError, invalid
from harvester.netlists.cards import BOARD, DEFINITIONS, PARAMETERS, Settings
from harvester.netlists.element_lines import Element, read_element
from harvester.netlists.expression import BRACES, SOURCES
from harvester.netlists.expression_tree import Node
from harvester.netlists.ltspice import parts_of
from harvester.netlists.model_lines import WrittenModel, model_name, read_model
from harvester.netlists.read_lines import DRIVES, DeckError, Line, own_lines, read_lines
from harvester.netlists.words import Words, assignments, parameter_value

_RESERVED = frozenset({*BRACES.functions, *SOURCES.constants, "pwl", "time", "temper", "hertz"})
_ELEMENTS = "rclkdqjmswvibefghtx"
_CHARACTERS = re.compile(r"[\w\s.,:+\-*/^=<>!?&|(){}\[\]'\"%~#]*", re.ASCII)


@dataclass
class Body:
    """The lines of a subcircuit, or those outside of all: name, terminals, parameters with their defaults, and lines.

    The default None is that of a parameter that the scene must give.
    """

    name: str = ""
    terminals: tuple[str, ...] = ()
    defaults: dict[str, Node | None] = field(default_factory=dict)
    # of the parameters, by their names in lower case
    spelling: dict[str, str] = field(default_factory=dict)
    line: Line = field(default_factory=lambda: Line("", ".subckt"))
    lines: list[Line] = field(default_factory=list)
    cards: dict[str, Line] = field(default_factory=dict)  # of models, by name
    parameters: dict[str, Node] = field(default_factory=dict)
    functions: dict[str, tuple[tuple[str, ...], str]] = field(default_factory=dict)
    parameter_lines: list[Line] = field(default_factory=list)
    known: Set[str] = frozenset()  # names of all models that its elements may name
    trouble: InputError | None = None  # of the first of its lines that cannot be read

    def check(self) -> None:
        """Raise the error of a subcircuit that is used, but has a line that cannot be read."""
        if self.trouble is not None:
            raise self.trouble

    @cached_property
    def elements(self) -> list[Element]:
        """Its elements; raises as `check` and `read_element`, and for two of one name."""
        self.check()
        elements: dict[str, Element] = {}
        for line in self.lines:
            for element in parts_of(read_element(line, self.known)):
                name = element.name.lower()
                if name in elements:
                    raise invalid(element.where, "have a name that no other element has", name)
                elements[name] = element
        return list(elements.values())

    @cache  # noqa: B019, as a netlist is read once
    def model(self, name: str) -> WrittenModel | None:
        """A model of its own; raises as `read_model`."""
        if name not in self.cards:
            return None
        _check_characters(self.cards[name])
        return read_model(self.cards[name])

    def __hash__(self) -> int:
        return id(self)

    def add(self, line: Line) -> None:
        """Add a line other than a card of the bench."""
        where = f"netlist {line.where}"
        if line.word == ".model":
            if (name := model_name(line)) in self.cards:
                raise invalid(where, "have a name that no other model has", name)
            self.cards[name] = line
        elif line.word in PARAMETERS:
            self.parameter_lines.append(line)
            for name, tree in assignments(line.text.lower()[len(line.word) :], where).items():
                if name in self.parameters:
                    raise invalid(where, f"set {name} once, of which ngspice uses the last", name)
                self.parameters[_free(name, where)] = tree
        elif line.word == ".func":
            match = re.match(
                r"\.func\s+(\w+)\s*\(([^()]*)\)\s*=?\s*(.*)$", line.text.lower(), re.DOTALL
            )
            if match is None:
                raise invalid(where, "define a function, as .func f(x) {2*x}", line.text[:60])
            name = _free(match[1], where)
            names = tuple(part.strip() for part in match[2].split(",") if part.strip())
            if name in self.functions or name in SOURCES.functions:
                raise invalid(where, "define a function that there is not yet", name)
            self.functions[name] = names, match[3].strip().strip("{}'\"")
        else:
            self.lines.append(line)


def _free(name: str, where: str) -> str:
    """A name that ngspice does not mistake for one of its own."""
    if name in _RESERVED:
        raise invalid(where, "give names that ngspice does not mistake for its own", name)
    return name


@dataclass
class ParsedNetlist:
    """A netlist: the part outside of subcircuits, these by their names, and all settings."""

    file: str
    outside: Body = field(default_factory=Body)
    subcircuits: dict[str, Body] = field(default_factory=dict)
    settings: Settings = field(default_factory=Settings)
    drives_bench: bool = False  # a source is outside of the subcircuits, in a bench


def read_netlist(
    path: Path,
    library: Path | None = None,
    board: bool = False,
    root: Path | None = None,
    text: str | None = None,
) -> ParsedNetlist:
    """The netlist of a file with its included files, and with the parts of a ``library`` (a folder) that it may name.

    ``board`` states that the elements outside of subcircuits are the circuit; else they are a
    bench, which stays out.  Included files are below the folder ``root``; default: that of the
    file. ``text`` is that of the file, if it need not be there.

    Raises InputError, in one line, for anything that no netlist here may have.
    """
    try:
        lines = list(read_lines(path, root, text))
    except DeckError as missing:  # a library that is not there, which adopt leaves out of a bench
        if text is not None or _has_bench(own_lines(path)):
            raise
        raise InputError(str(missing)) from None
    if not board and not any(line.word in (".subckt", ".ends") for line in lines):
        error = InputError(
            f"netlist {path.name} must hold a subcircuit (.subckt to .ends), or be a board with load.terminals, "
            "the piezo's two nets, but has no subcircuit, and no terminals are given"
        )
        # with a source it is a simulation, of which a board can be made
        raise DeckError(str(error)) if any(line.word[:1] in DRIVES for line in lines) else error
    try:
        netlist = _parsed(path.name, lines, board)
    except DeckError as refused:
        if _has_bench(lines):
            raise
        has_commands = any(line.word == ".control" for line in lines)
        more = ", and all lines from .control to .endc" if has_commands else ""
        raise InputError(f"{refused}: leave out the line{more}") from None
    if library is not None:
        _add_parts(netlist, _parts(library))
    known = frozenset(netlist.outside.cards)
    for body in (netlist.outside, *netlist.subcircuits.values()):
        body.known = known | frozenset(body.cards)
    return netlist


def part_names(library: Path) -> list[str]:
    """The names of all parts of a library, in lower case."""
    parts = _parts(library)
    return sorted([*parts.outside.cards, *parts.subcircuits])


@cache
def _parts(library: Path) -> ParsedNetlist:
    lines = [line for path in sorted(library.glob("*.lib")) for line in read_lines(path)]
    return _parsed("parts", lines, board=False)


def _add_parts(netlist: ParsedNetlist, parts: ParsedNetlist) -> None:
    """Add the parts that a netlist does not define itself: one is there under its name, model or subcircuit."""
    defined = netlist.outside.cards.keys() | netlist.subcircuits.keys()
    netlist.outside.cards |= {
        name: line for name, line in parts.outside.cards.items() if name not in defined
    }
    for name, body in parts.subcircuits.items():
        if name not in defined:
            netlist.subcircuits[name] = replace(body)


def _parsed(file: str, lines: Iterable[Line], board: bool) -> ParsedNetlist:
    """The netlist of lines."""
    netlist = ParsedNetlist(file)
    current: Body | None = None
    within = 0  # how many subcircuits are begun inside the current one
    for line in lines:
        if line.word == ".subckt" and current is None:
            current = _begun(netlist, line)
        elif line.word == ".ends" and current is None:
            raise invalid(f"netlist {line.where}", "end a subcircuit", ".ends without .subckt")
        elif line.word == ".ends" and not within:
            current = None
        elif current is None:
            _add(netlist, netlist.outside, line, board, inside=False)
        else:
            within += {".subckt": 1, ".ends": -1}.get(line.word, 0)
            try:
                _add(netlist, current, line, board, inside=True)
            except InputError as error:
                if not line.included:
                    raise
                current.trouble = (
                    current.trouble or error
                )  # a library's, which matters if it is used
    if current is not None:
        raise invalid(f"netlist {file}", "hold a subcircuit, .subckt to .ends", "no end")
    return netlist


def _has_bench(lines: Iterable[Line]) -> bool:
    """Whether elements are outside of subcircuits, of which `harvester adopt` can make a board."""
    depth = 0
    for line in lines:
        depth += {".subckt": 1, ".ends": -1, ".control": 1, ".endc": -1}.get(line.word, 0)
        if depth == 0 and not line.word.startswith("."):
            return True
    return False


def _add(netlist: ParsedNetlist, body: Body, line: Line, board: bool, inside: bool) -> None:
    """Add a line to a body, or the settings of a card to the netlist."""
    if line.word not in (
        *BOARD,
        ".model",
    ):  # the former's text goes nowhere, the latter is read if it is named
        _check_characters(line)
    if line.word in (".subckt", ".ends"):
        raise invalid(f"netlist {line.where}", "begin no subcircuit inside another", line.text[:60])
    if line.word.startswith(".") and line.word not in (*DEFINITIONS, *PARAMETERS):
        netlist.settings.add(line, board, inside)
    elif inside or board or line.word.startswith("."):
        body.add(line)
    else:
        netlist.drives_bench |= line.word[:1] in DRIVES


def _begun(netlist: ParsedNetlist, line: Line) -> Body:
    """The subcircuit that a .subckt line begins, which is added to the netlist."""
    _check_characters(line)
    body = _header(line)
    if (name := body.name.lower()) in netlist.subcircuits:
        raise invalid(f"netlist {line.where}", "have a subcircuit name of its own", name)
    netlist.subcircuits[name] = body
    return body


def _check_characters(line: Line) -> None:
    """Refuse a line that begins with no element's letter, and signs that no netlist needs."""
    where = f"netlist {line.where}"
    if not line.word.startswith(".") and line.word[0] not in _ELEMENTS:
        raise invalid(
            where, f"begin with a card or one of the elements {_ELEMENTS.upper()}", line.word
        )
    if not _CHARACTERS.fullmatch(line.text):
        wrong = next(letter for letter in line.text if not _CHARACTERS.fullmatch(letter))
        raise invalid(where, "have no such character outside a comment", wrong)
    if (
        line.text.count("{") != line.text.count("}")
        or line.text.count("'") % 2
        or line.text.count('"') % 2
    ):
        raise invalid(where, "close its braces and quotes", line.text[:60])


def _header(line: Line) -> Body:
    """A subcircuit from its .subckt line."""
    where = f"netlist {line.where}"
    spelt = Words(line, line.text[len(line.word) :])
    words = Words(line, line.text.lower()[len(line.word) :])
    if not words.alone:
        raise invalid(where, "have a name", line.text[:60])
    mark = words.alone.index("params:") if "params:" in words.alone else len(words.alone)
    plain = words.alone[:mark]
    wanting = words.alone[mark + 1 :]
    spelling = {name.lower(): name for name in (*spelt.alone, *spelt.pairs)}
    defaults: dict[str, Node | None] = {
        key: parameter_value(text, where) for key, text in words.pairs.items()
    }
    defaults |= dict.fromkeys(wanting)
    spelt_keys = {key: spelling[key] for key in defaults}
    body = Body(spelt.alone[0], tuple(plain[1:]), defaults, spelt_keys, line)
    try:
        _check_header(body, where)
    except InputError as error:
        body.trouble = error  # which matters if it is used
    return body


def _check_header(body: Body, where: str) -> None:
    """Refuse parameters that have names of ngspice's, and terminals of one name."""
    for name in body.defaults:
        _free(name, where)
        if name == "m":
            must = "have no parameter m, by which ngspice counts how many are side by side"
            raise invalid(where, must, body.line.text[:60])
    if len(set(body.terminals)) < len(body.terminals):
        raise invalid(where, "name each terminal once", body.line.text[:60])
