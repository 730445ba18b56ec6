"""A netlist's lines: continued lines joined, comments taken out, included files in place; nothing follows .end."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from harvester.errors import InputError, invalid, unknown
from harvester.machine import files

MOST_BYTES = 262_144  # of a netlist with all that it includes
# one of which every file of a netlist has
KNOWN = (".subckt", ".model", ".param", ".include", ".inc", ".lib")
FLAT = (".title", ".end")  # or one of these, a flat netlist


@dataclass(frozen=True)
class Line:
    """A line with its continuations, without comments, and where it stands (file and line number)."""

    where: str
    text: str

    @property
    def word(self) -> str:
        """Its first word, in lower case: the card, or the element's name."""
        return self.text.split(maxsplit=1)[0].lower()


def read_lines(path: Path) -> Iterator[Line]:
    """Yield the lines of a netlist and of the files that it includes, in the order in which ngspice reads them.

    Raises InputError for a file that cannot be read or is no netlist, without its text, which may
    be a secret; for more than `MOST_BYTES` in all, for a command to ngspice inside a comment, and
    for an include from outside the netlist's folder.
    """
    yield from _lines_of(path, path.parent.resolve(), (), [MOST_BYTES])


def _lines_of(path: Path, root: Path, chain: tuple[Path, ...], left: list[int]) -> Iterator[Line]:
    """Yield the lines of a file that the files ``chain`` include; ``left`` holds the bytes that may still be read."""
    yield from _with_included(
        _joined_lines(path, left, included=bool(chain)), path, root, chain, left
    )


def _with_included(
    lines: list[Line], path: Path, root: Path, chain: tuple[Path, ...], left: list[int]
) -> Iterator[Line]:
    """Yield lines of the file ``path``, and in place of those that name a file or a section of one what is in it."""
    reading = (*chain, path.resolve())
    for line in lines:
        words = line.text.split()
        if line.word in (".include", ".inc"):
            yield from _lines_of(
                _included_file(line.text, line, path, root, reading), root, reading, left
            )
        elif line.word == ".lib" and len(words) > 2:
            named = line.text.strip().rpartition(words[-1])[0]
            library = _included_file(named, line, path, root, ())
            name = words[-1].strip("\"'").lower()
            if (section_path := library / name) in chain:
                raise invalid(f"netlist {line.where}", "include no section within itself", name)
            section = _section(_joined_lines(library, left, included=True), name, line, library)
            yield from _with_included(section, library, root, (*reading, section_path), left)
        elif line.word == ".lib":
            raise InputError(
                f"netlist {line.where} must name a file and a section of it, .lib FILE SECTION (a file without "
                f"sections: .include FILE), but is {line.text[:60]!r}"
            )
        else:
            yield line


def _section(lines: list[Line], name: str, reference: Line, library: Path) -> list[Line]:
    """The lines of a library between ``.lib NAME`` and ``.endl``."""
    sections: dict[str, list[Line]] = {}
    current: list[Line] | None = None
    for line in lines:
        words = line.text.split()
        if line.word == ".lib" and len(words) == 2:
            current = sections.setdefault(words[1].strip("\"'").lower(), [])
        elif line.word == ".endl":
            current = None
        elif current is not None:
            current.append(line)
    if not sections:
        raise InputError(
            f"netlist {reference.where} must name a file with sections, but {library.name} has none: .include it"
        )
    if name not in sections:
        raise unknown(f"section of {library.name} in netlist {reference.where}", name, sections)
    return sections[name]


def _joined_lines(path: Path, left: list[int], included: bool) -> list[Line]:
    """The lines of one file with their continuations, without comments and, unless it is included, its title."""
    lines: list[Line] = []
    for number, raw in enumerate(_text(path, left).split("\n"), 1):
        where = f"{path.name} line {number}"
        _check_no_command(raw.strip(), where, number)
        text = re.split(r";|//|(?:^|[\s,])\$", raw)[0].strip()
        if (
            not text
            or text.startswith("*")
            or (number == 1 and not included and not text.startswith("."))
        ):
            continue  # the first line of a netlist is its title
        if lines and lines[-1].word == ".end" and not included:
            raise InputError(
                f"netlist {where} must not follow .end, as some versions of ngspice read it"
            )
        if text.startswith("+"):
            if not lines:
                raise InputError(
                    f"netlist {where} must begin with + only to continue a line, but there is none"
                )
            lines[-1] = Line(lines[-1].where, f"{lines[-1].text} {text[1:].strip()}".strip())
        else:
            lines.append(Line(where, text))
    if lines:
        _check_is_netlist(lines, path, (*KNOWN, *(() if included else FLAT)))
    return lines


def _check_is_netlist(lines: list[Line], path: Path, words: tuple[str, ...]) -> None:
    if not any(line.word in words for line in lines):
        raise InputError(
            f"netlist {path.name} must have a line {', '.join(KNOWN[:-1])}, but has none: is it a netlist?"
        )


def _check_no_command(text: str, where: str, number: int) -> None:
    """Refuse the two comments that ngspice takes for commands."""
    if text.startswith("*#") or (number == 1 and text.lower().startswith("*ng_script")):
        raise InputError(f"netlist {where} must run no command, but does")


def _text(path: Path, left: list[int]) -> str:
    """The text of a file; takes its size from the bytes ``left``."""
    data = files.read(path, "load.netlist", MOST_BYTES)
    left[0] -= len(data)
    if left[0] < 0:
        raise InputError(
            f"netlist {path.name} must have at most {MOST_BYTES} bytes with all that it includes"
        )
    try:
        text = data.decode().replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise InputError(f"netlist {path.name} must be text (UTF-8), but is not") from None
    for number, line in enumerate(text.split("\n"), 1):
        if not line.replace("\t", " ").isprintable():
            raise InputError(
                f"netlist {path.name} line {number} must be printable text, but is not"
            )
    return text


def _included_file(text: str, line: Line, path: Path, root: Path, chain: tuple[Path, ...]) -> Path:
    """The file that the ``text`` of a line names, inside the netlist's folder ``root`` and not yet being read."""
    name = text.split(maxsplit=1)[1].strip().strip("\"'") if " " in text else ""
    must = "include a file in the netlist's folder (copy it there, and name it without a folder)"
    try:
        target = (path.parent / name).resolve(strict=True)
    except (OSError, RuntimeError, ValueError):
        raise invalid(f"netlist {line.where}", must, name) from None
    if not target.is_relative_to(root) or not target.is_file() or not name:
        raise invalid(f"netlist {line.where}", must, name)
    if target in chain:
        raise invalid(f"netlist {line.where}", "include no file within itself", name)
    return target
