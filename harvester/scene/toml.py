"""Scenes from scene files (TOML), and what is wrong with a file in one line."""

import difflib
import tomllib
from pathlib import Path
from typing import Any

from harvester.errors import InputError, invalid, names_arguments, shown
from harvester.machine import files
from harvester.scene.physical import FILES
from harvester.scene.scene import Scene

MOST_BYTES = 16384  # of a scene file; a scene takes less than a thousand


@names_arguments
def loads(text: str, folder: Path | None = None) -> Scene:
    """Read a scene from the text of a scene file; relative paths of its netlist and records start at ``folder``.

    >>> import harvester as hv
    >>> hv.loads("nondimensional = { beta = 0.05 }").nondimensional.beta
    0.05
    """
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # no TOML; a number too long for Python; nested too deep
        raise InputError(f"scene must be TOML, but {str(error).splitlines()[0]}") from None
    load: Any = tables.get("load")
    netlist: Any = load.get("netlist") if isinstance(load, dict) else None
    if folder is not None and isinstance(netlist, str) and ("/" in netlist or netlist.endswith(".cir")):
        tables["load"] = {**load, "netlist": str((folder / netlist).absolute())}
    excitation: Any = tables.get("excitation")
    if folder is not None and isinstance(excitation, dict):
        tables["excitation"] = {**excitation, **_files_beside(excitation, folder)}
    return Scene(**tables)


def _files_beside(excitation: dict[str, Any], folder: Path) -> dict[str, str]:
    """The absolute paths of an excitation's files, which must be in the scene's folder."""
    paths = {}
    for key in FILES:
        if isinstance(name := excitation.get(key), str):
            try:
                path = (folder / name).resolve()
                inside = path.is_relative_to(folder.resolve())
            except (RuntimeError, ValueError):  # links in a circle; a NUL
                inside = False
            if not inside:
                raise invalid(f"excitation.{key}", "be in the folder of the scene file", name)
            paths[key] = str(path)
    return paths


@names_arguments
def load(path: str | Path) -> Scene:
    """Read a scene from a scene file.

    >>> import harvester as hv
    >>> hv.load("nowhere/plate.toml")
    Traceback (most recent call last):
    harvester.errors.InputError: scene must be a file, but there is no 'nowhere/plate.toml': ...

    Raises
    ------
    InputError
        where the file cannot be read, is no TOML, or says something that no scene can have.
    """
    name, path = str(path), Path(path)
    try:
        data = files.read(name, "scene", MOST_BYTES)
    except InputError as error:
        if not isinstance(error.__context__, FileNotFoundError) or not name:
            raise
        beside = {p.stem: p.name for p in path.parent.glob("*.toml")}
        near = difflib.get_close_matches(path.stem, beside, n=1)
        hint = f": did you mean {beside[near[0]]!r}?" if near else ": 'harvester new FILE.toml' makes one"
        raise InputError(f"scene must be a file, but there is no {shown(name)}{hint}") from None
    try:
        return loads(data.decode(), path.parent)
    except UnicodeDecodeError:
        raise InputError(f"scene must be UTF-8 text, but {shown(name)} is not") from None
