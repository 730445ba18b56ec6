"""Scenes from scene files (TOML), and the errors of a file in one line."""

import difflib
import os
import re
import shlex
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harvester.errors import InputError, invalid, names_arguments, shown
from harvester.machine import files
from harvester.scene.example_scenes import example_scenes
from harvester.scene.load import is_path
from harvester.scene.physical import FILES
from harvester.scene.scene import Scene

_NO_DIGIT = re.compile(r"""^([^"'#]*[=,\[]\s*)(\.\d+)""", re.MULTILINE)  # restitution = 0.9
DECKS = (".cir", ".net", ".sp", ".spice", ".ckt", ".asc", ".kicad_sch")  # files of netlists
MOST_BYTES = 16384  # of a scene file; a scene takes less than a thousand


@names_arguments
def loads(text: str, folder: Path | None = None) -> Scene:
    """Read a scene from the text of a scene file.

    Parameters
    ----------
    text : str
        TOML, with numbers in SI units and texts with their unit.
    folder : path, optional
        from which the paths of its netlist and recordings start, and which they must not leave;
        without it, paths are the caller's own: any, from the current folder.

    Returns
    -------
    Scene
        which holds SI units.

    Raises
    ------
    InputError
        for anything that is not TOML, or has a key or value that no scene can have.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.loads("nondimensional = { beta = 0.05 }").nondimensional.beta
    0.05
    """
    try:
        tables = tomllib.loads(text)
    except (
        ValueError,
        RecursionError,
    ) as error:  # no TOML; a number too long for Python; nested too deep
        short = _NO_DIGIT.search(text)
        hint = f": write 0{short[2]} for {short[2]}" if short else ""
        raise InputError(f"scene must be TOML, but {str(error).splitlines()[0]}{hint}") from None
    files_of = {
        "load": ("netlist",),
        "excitation": FILES,
        "node": ("trace",),
        "chip": ("efficiency_table",),
    }
    for table, keys in files_of.items():
        given: Any = tables.get(table)
        if folder is not None and isinstance(given, dict):
            tables[table] = {**given, **_files_beside(table, keys, given, folder)}
    return Scene(**tables)


def _files_beside(
    table: str, keys: Sequence[str], given: dict[str, Any], folder: Path
) -> dict[str, str]:
    """The absolute paths of a table's files, which must be in the scene's folder."""
    paths = {}
    for key in keys:
        name = given.get(key)
        if not isinstance(name, str) or (key == "netlist" and not is_path(name)):
            continue
        try:
            path = (folder / name).resolve()
        except (OSError, RuntimeError, ValueError):  # no path at all, or links in a circle
            path = None
        # Python 3.13 leaves a link as it is where links go in a circle; before, it was an error.
        if path is None or path.is_symlink() or not path.is_relative_to(folder.resolve()):
            raise invalid(
                f"{table}.{key}", "be in the folder of the scene file (copy it there)", name
            )
        below = path.relative_to(folder.resolve())
        # A netlist below the scene's folder may include what is beside it there.
        inside = key == "netlist" and len(below.parts) > 1
        paths[key] = f"{folder.resolve()}/./{below.as_posix()}" if inside else str(path)
    return paths


@names_arguments
def load(path: str | Path) -> Scene:
    """Read a scene from a scene file.

    Parameters
    ----------
    path : path
        of the file; its netlist and recordings must be in the file's folder or below it.

    Returns
    -------
    Scene
        which holds SI units.

    Raises
    ------
    InputError
        if the file cannot be read, is not TOML, or has a key or value that no scene can have.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.load("nowhere/plate.toml")
    Traceback (most recent call last):
    harvester.errors.InputError: scene must be a file, but there is no 'nowhere/plate.toml': ...
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"scene must be the path of a file, but is {shown(path)}")
    name, path = str(path), Path(path)
    if path.suffix.lower() in DECKS and path.is_file():
        adopt = shlex.join(["harvester", "adopt", name])
        raise InputError(
            f"scene must be a TOML file, but {shown(name)} is a netlist, which a scene's [load] "
            f"names; {adopt} makes a board of a simulation"
        )
    try:
        data = files.read(name, "scene", MOST_BYTES)
    except InputError as error:
        if not isinstance(error.__context__, FileNotFoundError) or not name:
            raise
        beside = {p.stem: p.name for p in path.parent.glob("*.toml")}
        near = difflib.get_close_matches(path.stem, beside, n=1)
        hint = ": 'harvester new FILE.toml' makes one"
        if near:
            hint = f": did you mean {beside[near[0]]!r}?"
        elif name in example_scenes():
            hint = f": it is an example, which 'harvester examples {name}' copies here"
        raise InputError(f"scene must be a file, but there is no {shown(name)}{hint}") from None
    try:
        return loads(data.decode("utf-8-sig"), path.parent)  # some editors begin a text with a mark
    except UnicodeDecodeError:
        raise InputError(f"scene must be UTF-8 text, but {shown(name)} is not") from None
