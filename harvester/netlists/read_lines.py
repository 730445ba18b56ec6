"""A netlist's lines: continued lines joined, comments removed, included files in place.

Nothing follows .end.

A file is read as UTF-8, as UTF-16 and else as cp1252, in which LTspice writes on Windows.
"""

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from harvester.errors import InputError, invalid, shown, unknown
from harvester.machine import files

MOST_BYTES = 262_144  # of a netlist with all that it includes
# one of which every file of a netlist has
DEEPEST = 100  # files that include each other in turn
KNOWN = (".subckt", ".model", ".param", ".include", ".inc", ".lib")
FLAT = (".title", ".end")  # or one of these, a flat netlist
INSIDE = "/./"  # in a path: the folder before it is the one that the netlist must not leave
# Signs of micro and ohm, and LTspice's between a letter and a name, as SPICE spells them.
_SPELT = str.maketrans(
    {"\u00b5": "u", "\u03bc": "u", "\u03a9": "ohm", "\u2126": "ohm", "\u00a7": "_"}
)


@dataclass(frozen=True)
class Line:
    """A line with its continuations, without comments, and its place (file and line number)."""

    where: str
    text: str
    included: bool = False  # in a file that another one includes

    @property
    def word(self) -> str:
        """Its first word, in lower case: the card, or the element's name."""
        return self.text.split(maxsplit=1)[0].lower()


DRIVES = ("v", "i")  # letters of the elements that drive a simulation


class DeckError(InputError):
    """A netlist has lines of a simulation by hand, which `harvester adopt` leaves out."""


def split_path(name: str) -> tuple[Path, Path]:
    """The path of a netlist, and the folder of its includes: its own, or that before ``/./``."""
    path = Path(name)
    folder, mark, _ = name.partition(INSIDE)
    return path, (Path(folder) if mark and folder else path.parent).resolve()


def read_lines(path: Path, root: Path | None = None, text: str | None = None) -> Iterator[Line]:
    """Yield the lines of a netlist and of the files that it includes, in the order in which ngspice reads them.

    ``root`` is the folder that includes must not leave; default: that of the netlist.  ``text`` is
    that of the netlist, if its file need not be there.

    Raises InputError for a file that cannot be read or is not a netlist, without its text, which
    may be a secret; for more than `MOST_BYTES` in all, for a command to ngspice inside a comment,
    and for an include from outside the folder.
    """
    root = (root or path.parent).resolve()
    left = [MOST_BYTES]
    yield from _with_included(_joined_lines(path, left, False, text), path, root, (), left)


def own_lines(path: Path) -> list[Line]:
    """The lines of a netlist itself; raises as `read_lines`."""
    return _joined_lines(path, [MOST_BYTES], included=False)


def included_lines(card: Line, path: Path) -> Iterator[Line]:
    """Yield the lines of the library that a card of the netlist ``path`` names.

    Raises as `read_lines`.
    """
    yield from _with_included([card], path, path.parent.resolve(), (), [MOST_BYTES])


def _lines_of(path: Path, root: Path, chain: tuple[Path, ...], left: list[int]) -> Iterator[Line]:
    """Yield the lines of a file that the files ``chain`` include.

    ``left`` holds the bytes that may still be read.
    """
    yield from _with_included(_joined_lines(path, left, included=True), path, root, chain, left)


def _with_included(
    lines: list[Line], path: Path, root: Path, chain: tuple[Path, ...], left: list[int]
) -> Iterator[Line]:
    """Yield lines of the file ``path``, and in place of those that name a file or a section of one its lines."""
    if len(chain) >= DEEPEST:
        raise InputError(
            f"netlist {path.name} must be at most {DEEPEST} files deep, but is deeper: include the "
            "last of them from the first"
        )
    reading = (*chain, path.resolve())
    for line in lines:
        named = library_of(line)
        if named is not None and not named.section:
            target = _included_file(named.file, line, path, root, reading)
            yield from _lines_of(target, root, reading, left)
        elif named is not None:
            library = _included_file(named.file, line, path, root, ())
            name = named.section
            if (section_path := library / name) in chain:
                raise invalid(f"netlist {line.where}", "include no section within itself", name)
            section = _section(_joined_lines(library, left, included=True), name, line, library)
            yield from _with_included(section, library, root, (*reading, section_path), left)
        elif line.word == ".endl":
            raise InputError(
                f"netlist {line.where} must have no .endl outside of a section: name a section of "
                "the file, .lib FILE SECTION"
            )
        else:
            yield line


class LibraryCard(NamedTuple):
    """An .include or a .lib card: a file, and a section in lower case; "" for the whole file."""

    file: str
    section: str


def library_of(line: Line) -> LibraryCard | None:
    """The file and the section of an .include or a .lib card; None of another line.

    A name with blanks is in quotes; a last word with a dot is of the name, unless that is in
    quotes.
    """
    if line.word not in (".include", ".inc", ".lib"):
        return None
    text = line.text[len(line.word) :].strip()
    match = re.fullmatch(r"(\"[^\"]*\"|'[^']*'|[^\"'].*?)\s+([^\"'\s]+)", text)
    if line.word == ".lib" and match and not (text[0] not in "\"'" and "." in match[2]):
        return LibraryCard(match[1].strip("\"'"), match[2].lower())
    return LibraryCard(text.strip("\"'"), "")


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


def _joined_lines(
    path: Path, left: list[int], included: bool, given: str | None = None
) -> list[Line]:
    """The lines of one file with their continuations, without comments and, unless it is included, its title."""
    lines: list[Line] = []
    for number, raw in enumerate(_text(path, left, given).split("\n"), 1):
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
                f"netlist {where} must not follow .end, as some versions of ngspice read it: "
                "delete it, or move .end"
            )
        if text.startswith("+"):
            if not lines:
                raise InputError(
                    f"netlist {where} must begin with + only to continue a line, but there is none"
                )
            continued = f"{lines[-1].text} {text[1:].strip()}".strip()
            lines[-1] = Line(lines[-1].where, continued, included)
        else:
            lines.append(Line(where, text, included))
    if lines:
        _check_is_netlist(lines, path, (*KNOWN, *(() if included else FLAT)))
    return lines


def _check_is_netlist(lines: list[Line], path: Path, words: tuple[str, ...]) -> None:
    if not any(line.word in words for line in lines):
        raise InputError(
            f"netlist {path.name} must have a line {', '.join(KNOWN[:-1])}"
            f"{' or .end' * ('.end' in words)}, but has none: is it a netlist?"
        )


def _check_no_command(text: str, where: str, number: int) -> None:
    """Refuse the two comments that ngspice reads as commands."""
    if text.startswith("*#") or (number == 1 and text.lower().startswith("*ng_script")):
        raise InputError(f"netlist {where} must run no command, but does")


def _text(path: Path, left: list[int], given: str | None = None) -> str:
    """The text of a file, or ``given`` in its place; subtracts its size from the bytes ``left``."""
    data = files.read(path, "load.netlist", MOST_BYTES) if given is None else given.encode()
    left[0] -= len(data)
    if left[0] < 0:
        raise InputError(
            f"netlist {path.name} must have at most {MOST_BYTES} bytes with all that it includes"
        )
    try:
        text = data.decode(_encoding(data)).replace("\r\n", "\n").translate(_SPELT)
    except UnicodeDecodeError:
        must = "be text (UTF-8, UTF-16 or cp1252)"
        raise InputError(f"netlist {path.name} must {must}, but is not") from None
    if "\n" not in text:  # as on old machines
        text = text.replace("\r", "\n")
    for number, line in enumerate(text.split("\n"), 1):
        if not line.replace("\t", " ").isprintable():
            raise InputError(
                f"netlist {path.name} line {number} must be printable text, but is not"
            )
    return text


def _encoding(data: bytes) -> str:
    """The encoding of a netlist's bytes; UTF-16 without a mark has a zero in every second one."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if data and 3 * data[first::2].count(0) > len(data):
            return encoding
    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _included_file(name: str, line: Line, path: Path, root: Path, chain: tuple[Path, ...]) -> Path:
    """The file that a line names, inside the folder ``root`` and not yet being read."""
    last = re.split(r"[\\/]", name)[-1]
    whose = "netlist's" if root == path.parent.resolve() else "scene's"
    remedy = "copy it there" + (f", and write .include {last}" if last != name else "")
    must = f"include a file in the {whose} folder ({remedy})"
    try:
        target = (path.parent / name.replace("\\", "/")).resolve(strict=True)
    except (OSError, RuntimeError, ValueError):
        raise DeckError(f"netlist {line.where} must {must}, but is {shown(name)}") from None
    if not target.is_relative_to(root) or not target.is_file() or not name:
        raise DeckError(f"netlist {line.where} must {must}, but is {shown(name)}")
    if target in chain:
        raise invalid(f"netlist {line.where}", "include no file within itself", name)
    return target
