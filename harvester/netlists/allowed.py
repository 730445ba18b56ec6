"""Netlists as untrusted text: every line read and checked against lists of what is allowed.

ngspice can run shell commands (``.control``, lines that begin with ``*#``), read files (``.include``, ``.lib``,
XSPICE models) and write them (CIDER models, the logs of BSIM models).  None of this comes through.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from harvester.errors import InputError, invalid, shown

MOST_BYTES = 262_144  # of a netlist with all that it includes
MOST_ELEMENTS = 10_000  # of the load, its inner subcircuits written out

_ELEMENTS = "rclkdqjmswvibefghxt"  # first letters; no a: XSPICE models read files
_DEFINITIONS = (".subckt", ".ends", ".model", ".param", ".include")
_BENCH = (".tran", ".options", ".option", ".print", ".plot", ".meas", ".measure", ".save", ".ic", ".title", ".end")
_MODELS = ("r", "c", "l", "d", "npn", "pnp", "njf", "pjf", "nmos", "pmos", "vdmos", "vdmosn", "vdmosp", "sw", "csw")
_MOS_LEVELS = ("1", "2", "3", "6")  # the others write log files
# external: a source that the lock-step drives.  trnoise, trrandom: no seed.  file: a file, or a model that has one.
_WORDS = re.compile(r"\b(external|port|trnoise|trrandom|\w*file\w*|shell|system)\b", re.IGNORECASE)
_CHARACTERS = re.compile(r"[\w\s.,:+\-*/^=<>!?&|(){}\[\]']*", re.ASCII)
_NAME = re.compile(r"(?<![\w.])[a-z_]\w*", re.IGNORECASE | re.ASCII)
_QUANTITIES = {"pi", "e", "c", "kelvin", "echarge", "boltz", "planck", "i", "time", "temper", "hertz", "yes", "no"}
_QUANTITIES |= {"true", "false", "tc1", "tc2", "temp", "dtemp", "m", "gmin"}


@dataclass(frozen=True)
class Line:
    """A line with its continuations, without comments, and where it stands (file and line number)."""

    where: str
    text: str

    @property
    def word(self) -> str:
        """Its first word, in lower case: the card, or the element's name."""
        return self.text.split(maxsplit=1)[0].lower()


def read_lines(path: Path, root: Path, chain: tuple[Path, ...], left: list[int]) -> list[Line]:
    """A file's lines, checked, those of the files that it includes in place; ``left`` bytes may still be read."""
    here = path.name
    lines: list[Line] = []
    for number, raw in enumerate(_text(path, left).split("\n"), 1):
        where = f"{here} line {number}"
        bare = raw.strip()
        if bare.startswith("*#") or (number == 1 and bare.lower().startswith("*ng_script")):
            raise invalid(f"netlist {where}", "run no command", bare[:60])
        text = re.split(r";|//|(?:^|[\s,])\$", raw)[0].strip()
        if not text or text.startswith("*") or (number == 1 and not chain and not text.startswith(".")):
            continue  # the first line of a netlist is its title
        if text.startswith("+"):
            if not lines:
                raise invalid(f"netlist {where}", "begin with + only to continue a line", bare[:60])
            lines[-1] = Line(lines[-1].where, f"{lines[-1].text} {text[1:].strip()}".strip())
        else:
            lines.append(Line(where, text))
    whole: list[Line] = []
    for line in lines:
        if line.word in (".include", ".inc"):
            whole += read_lines(
                _included(line, path, root, (*chain, path.resolve())), root, (*chain, path.resolve()), left
            )
        else:
            _check_line(line)
            whole.append(line)
    return whole


def _text(path: Path, left: list[int]) -> str:
    """The text of a regular file."""
    if path.exists() and not path.is_file():
        raise invalid("load.netlist", "be a readable file (it is none)", str(path))
    try:
        with path.open("rb") as file:
            data = file.read(left[0] + 1)
    except OSError as error:
        raise invalid("load.netlist", f"be a readable file ({error.strerror})", str(path)) from None
    left[0] -= len(data)
    if left[0] < 0:
        raise InputError(f"netlist {path.name} must have at most {MOST_BYTES} bytes with all that it includes")
    try:
        text = data.decode().replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise InputError(f"netlist {path.name} must be text (UTF-8), but is not") from None
    for number, line in enumerate(text.split("\n"), 1):
        if not line.replace("\t", " ").isprintable():
            raise invalid(f"netlist {path.name} line {number}", "be printable text", line[:60])
    return text


def _included(line: Line, path: Path, root: Path, chain: tuple[Path, ...]) -> Path:
    """The file that an .include names, inside the netlist's folder and not yet being read."""
    name = line.text.split(maxsplit=1)[1].strip().strip("\"'") if " " in line.text else ""
    must = "include a file in the netlist's folder"
    try:
        target = (path.parent / name).resolve(strict=True)
    except (OSError, RuntimeError, ValueError):
        raise invalid(f"netlist {line.where}", must, name) from None
    if not target.is_relative_to(root) or not target.is_file() or not name:
        raise invalid(f"netlist {line.where}", must, name)
    if target in chain:
        raise invalid(f"netlist {line.where}", "include no file within itself", name)
    return target


def _check_line(line: Line) -> None:
    """Refuse what could run a command, reach a file, or talk to the lock-step."""
    where, word = f"netlist {line.where}", line.word
    if word.startswith("."):
        if word not in _DEFINITIONS + _BENCH:
            raise invalid(where, f"have only the cards {', '.join(_DEFINITIONS)} (and a bench to run it by hand)", word)
        if word in _BENCH:
            return  # never given to ngspice; inside a subcircuit `parts` refuses it
    elif word[0] not in _ELEMENTS:
        raise invalid(where, f"begin with a card or one of the elements {_ELEMENTS.upper()}", word)
    if not _CHARACTERS.fullmatch(line.text):
        wrong = next(letter for letter in line.text if not _CHARACTERS.fullmatch(letter))
        raise invalid(where, "have no such character outside a comment", wrong)
    if line.text.count("{") != line.text.count("}") or line.text.count("'") % 2:
        raise invalid(where, "close its braces and quotes", line.text[:60])
    if word == "rload" and re.search(r"\b[vi]\s*\(|\b(time|temper|hertz)\b", line.text, re.IGNORECASE):
        raise invalid(where, "give Rload a constant resistance", line.text[:60])
    if found := _WORDS.search(line.text):
        raise invalid(where, "name no file, no command and no random or external source", found[0])
    if word == ".model":
        _check_model(where, line.text.lower())


def _check_model(where: str, text: str) -> None:
    """Only models that neither read nor write files."""
    tokens = re.split(r"[\s(]+", text)
    kind = tokens[2] if len(tokens) > 2 else ""
    if kind not in _MODELS:
        raise invalid(where, f"have a model of one of the types {', '.join(_MODELS)}", kind)
    if kind in ("nmos", "pmos"):
        for level in re.findall(r"level[\s=,(]*([^\s=,()]*)", text):
            if level not in _MOS_LEVELS:
                raise invalid(where, f"have a MOSFET model of level {', '.join(_MOS_LEVELS)}", level)


def parts(file: str, lines: Iterable[Line]) -> tuple[dict[str, list[Line]], list[Line]]:
    """Subcircuits by name (in lower case) and the lines outside of them."""
    subcircuits: dict[str, list[Line]] = {}
    outside: list[Line] = []
    current: list[Line] | None = None
    for line in lines:
        if line.word == ".subckt":
            if current is not None:
                raise invalid(f"netlist {line.where}", "begin no subcircuit inside another", line.text[:60])
            name = header_of(line)[0].lower()
            if name in subcircuits:
                raise invalid(f"netlist {line.where}", "have a subcircuit name of its own", name)
            subcircuits[name] = current = [line]
        elif line.word == ".ends":
            if current is None:
                raise invalid(f"netlist {line.where}", "end a subcircuit", ".ends without .subckt")
            current.append(line)
            current = None
        elif current is None:
            outside.append(line)
        else:
            if line.word in _BENCH:
                raise invalid(
                    f"netlist {line.where}", f"have only the cards {', '.join(_DEFINITIONS)} inside", line.word
                )
            current.append(line)
    if current is not None or not subcircuits:
        raise invalid(f"netlist {file}", "hold a subcircuit, .subckt to .ends", "no end" if current else "none")
    return subcircuits, outside


def header_of(line: Line) -> tuple[str, list[str], dict[str, str | None]]:
    """Name, terminals and parameters of a .subckt line; a parameter that must be given has the default None."""
    tokens = _joined(line.text).split()[1:]
    split = next((k for k, token in enumerate(tokens) if token.lower() == "params:" or "=" in token), len(tokens))
    plain = tokens[:split]
    if not plain:
        raise invalid(f"netlist {line.where}", "have a name", line.text[:60])
    pairs = [token.partition("=") for token in tokens[split:] if token.lower() != "params:"]
    return plain[0], plain[1:], {name: value if equals else None for name, equals, value in pairs}


def _joined(text: str) -> str:
    """A line without blanks around = and within expressions, so that its tokens are its words."""
    text = re.sub(r"\{[^}]*\}|'[^']*'", lambda found: re.sub(r"\s+", "", found[0]), text)
    return re.sub(r"\s*=\s*", "=", text)


def defined(lines: Iterable[Line]) -> Iterator[str]:
    """Names of the parameters that .param cards set."""
    for line in lines:
        if line.word == ".param":
            yield from (name.lower() for name in re.findall(r"(\w+)\s*=(?!=)", line.text))


def check_names(subcircuits: dict[str, list[Line]], outside: list[Line]) -> None:
    """Every name in an expression of a subcircuit is a parameter with a value, or ngspice's own."""
    common = _QUANTITIES | set(defined(outside))
    for body in subcircuits.values():
        known = common | {name.lower() for name in header_of(body[0])[2]} | set(defined(body))
        for line in body:
            text = line.text.lower()
            expressions = re.findall(r"\{([^}]*)\}|'([^']*)'", text)
            if line.word[0] == "b" and "=" in text:
                expressions.append((text.split("=", 1)[1], ""))
            for expression in ("".join(pair) for pair in expressions):
                bare = re.sub(r"\b[vi]\s*\([^)]*\)", " ", expression)
                for found in _NAME.finditer(bare):
                    if found[0] not in known and not re.match(r"\s*[(=]", bare[found.end() :]):
                        raise InputError(
                            f"netlist {line.where} must use parameters that have a value, "
                            f"but {shown(found[0])} has none: give it on the .subckt line"
                        )


def check_size(subcircuits: dict[str, list[Line]], load: str) -> None:
    """Calls of subcircuits end, and the load with all of them written out is of a sensible size."""
    sizes: dict[str, int] = {}

    def size(name: str, line: Line | None, within: tuple[str, ...]) -> int:
        if line is not None and name not in subcircuits:
            raise invalid(f"netlist {line.where}", "call a subcircuit of this netlist", name)
        if line is not None and name in within:
            raise invalid(f"netlist {line.where}", "call no subcircuit within itself", name)
        if name not in sizes:
            sizes[name] = 0
            for inner in subcircuits[name]:
                sizes[name] += size(_called(inner), inner, (*within, name)) if inner.word[0] == "x" else 1
        return sizes[name]

    if size(load, None, ()) > MOST_ELEMENTS:
        raise InputError(f"netlist subcircuit {load} must have at most {MOST_ELEMENTS} elements, but has {sizes[load]}")


def _called(line: Line) -> str:
    """Name of the subcircuit that an X line calls."""
    plain = [token for token in _joined(line.text).lower().split() if "=" not in token and token != "params:"]
    return plain[-1]
