"""The scene file of a new device: readable, a comment a line, and exactly the scene that was asked for."""

import dataclasses
from pathlib import Path

import tomli_w

from harvester.devices.device import Entry, Tables
from harvester.equations.problem import Problem
from harvester.errors import InputError, shown
from harvester.machine import files
from harvester.netlists.read_lines import MOST_BYTES, read_lines
from harvester.scene.load import is_path
from harvester.scene.schema import DIRECTIVE, write_beside
from harvester.scene.toml import loads

WIDTH = 34  # where comments begin
TABLES = {
    "oscillator": "the mass on its spring",
    "piezo": "its coupling to the circuit",
    "stop": "without this table: no stop",
    "excitation": "motion of the base",
    "load": "load of the power",
}
EXAMPLES = {  # what a table that is left out might hold
    "stop": ["restitution = 0.96"],
    "excitation": ['acceleration_psd = "1e-5 g^2/Hz"'],
    "load": ['resistance = "1 Mohm"'],
}


def text(tables: Tables) -> str:
    """The text of the scene file that holds these tables."""
    lines = [DIRECTIVE]  # an editor's, which completes the keys that stand below
    lines += [
        "# Numbers are SI, texts carry their unit; a table or key that is left out is an effect that is absent."
    ]
    lines += ["# All keys, their units and meanings: harvester keys", ""]
    lines += [_line(entry) for entry in tables[""]]
    words = {name: "a further mode of vibration" for name in tables if name.startswith("mode.")}
    for table, word in (TABLES | words).items():
        entries = tables[table]
        name = "[[mode]]" if table in words else f"[{table}]"
        lines += ["", _commented(name if entries else f"# {name}", word)]
        lines += [_line(entry) for entry in entries] or [
            f"# {example}" for example in EXAMPLES.get(table, [])
        ]
    return "\n".join(lines).replace("\n\n\n", "\n\n") + "\n"


def _line(entry: Entry) -> str:
    """A line of the file."""
    value = tomli_w.dumps({entry.key: entry.value}).strip()
    if isinstance(entry.value, dict):
        pairs = ", ".join(
            tomli_w.dumps({name: number}).strip() for name, number in entry.value.items()
        )
        value = f"{entry.key} = {{ {pairs} }}"
    if isinstance(entry.value, list):
        items = (tomli_w.dumps({"x": item}).strip().removeprefix("x = ") for item in entry.value)
        value = f"{entry.key} = [{', '.join(items)}]"
    return _commented(value, entry.comment)


def _commented(line: str, comment: str) -> str:
    """A line with its comment, all of which begin in one column."""
    return f"{line:<{WIDTH}} # {comment}" if comment else line


def check(path: Path, force: bool) -> None:
    """Refuse a file that cannot be made.

    Raises InputError if it is there and not to be overwritten, or its folder cannot be made.
    """
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "a device, pipe or socket"
        raise InputError(f"FILE must be a file to write, but {shown(str(path))} is {kind}")
    if path.exists() and not force:
        raise InputError(
            f"FILE must be new, but {shown(str(path))} is there: another name, or `force`"
        )
    files.check_parent(path, "FILE")


def write(path: Path, tables: Tables, force: bool) -> Problem:
    """Write the file, whole or not at all, and return the problem of its scene.

    The schema that its first line names is written next to it.  A netlist from outside the file's
    folder is copied into it, because a scene reaches no file elsewhere.

    Raises InputError if `check` refuses the file, if it cannot be written, and for tables that are
    not scene.
    """
    check(path, force)
    content = text(
        {**tables, "load": [_beside(entry, path.parent, force) for entry in tables["load"]]}
    )
    problem = Problem(loads(content, path.parent))  # refuses numbers that no device has
    _ = problem.circuit  # refuses a netlist that is not allowed
    files.write(path, content, "FILE")
    write_beside(path)
    return problem


def _beside(entry: Entry, folder: Path, force: bool) -> Entry:
    """The entry of a load; that of a netlist with its path in the folder, into which it is copied from outside."""
    if entry.key != "netlist" or not is_path(name := str(entry.value)):
        return entry
    path = (folder / name).resolve()
    folder = folder.resolve()
    if not path.is_relative_to(folder):
        if any(line.where.rpartition(" line ")[0] != path.name for line in read_lines(path)):
            raise InputError(
                f"`netlist` must be in the folder of FILE with all that it includes, but is {shown(name)}"
            )
        content = files.read(path, "`netlist`", MOST_BYTES)
        copy = folder / path.name
        if copy.exists() and not force and files.read(copy, "`netlist`", MOST_BYTES) != content:
            raise InputError(
                f"`netlist` is copied to {shown(str(copy))}, which must be new, but is there: or `force`"
            )
        files.write(copy, content, "netlist")
        path = copy
    return dataclasses.replace(entry, value=f"./{path.relative_to(folder)}")
