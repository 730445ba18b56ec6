"""Which files ngspice is made of: read from its own Makefile.am files, so that no list of ours can miss one."""

import re
from collections.abc import Iterator
from pathlib import Path

# What Debian's options set; everything else that a Makefile.am asks for is off.
WANTED = {
    "XSPICE_WANTED",
    "CIDER_WANTED",
    "NUMDEV_WANTED",
    "PSS_WANTED",
    "SP_WANTED",
    "SHARED_MODULE",
    "NO_X",
    "NO_HELP",
}
_SOURCES = {".c", ".cpp", ".y"}


def sources(src: Path) -> list[Path]:
    """The files of the library, from the folder ``src`` of ngspice; those for Bison too."""
    words = _variables(src / "Makefile.am")
    libraries = [*words["libngspice_la_LIBADD"], *words["DYNAMIC_DEVICELIBS"]]
    found = [src / name for name in words["libngspice_la_SOURCES"]]
    for name in (one for one in libraries if one.endswith(".la")):
        path = src / name
        variable = path.stem.replace("-", "_") + "_la_SOURCES"
        found += [path.parent / one for one in _variables(path.parent / "Makefile.am")[variable]]
    return [path for path in found if path.suffix in _SOURCES]


def _variables(makefile: Path) -> dict[str, list[str]]:
    """The words of each variable of a Makefile.am, under the conditions that hold."""
    words: dict[str, list[str]] = {}
    for line in _that_hold(
        makefile.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    ):
        if found := re.match(r"(\w+)\s*(\+?)=(.*)", line):
            words.setdefault(found[1], []).extend(found[3].partition("#")[0].split())
    return words


def _that_hold(text: str) -> Iterator[str]:
    """The lines that stand under no condition of automake which is false."""
    holds: list[bool] = []
    for line in text.splitlines():
        if found := re.match(r"if (!?)(\w+)", line):
            holds.append((found[2] in WANTED) != (found[1] == "!"))
        elif re.match(r"else\b", line):
            holds[-1] = not holds[-1]
        elif re.match(r"endif\b", line):
            holds.pop()
        elif all(holds):
            yield line
