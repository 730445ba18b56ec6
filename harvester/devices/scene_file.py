"""The scene file of a new device: readable, a comment a line, and exactly the scene that was asked for."""

from pathlib import Path

import tomli_w

from harvester.devices.device import Device, Key
from harvester.equations.problem import Problem
from harvester.errors import InputError, shown
from harvester.machine import files
from harvester.scene.scene import Scene
from harvester.scene.toml import loads

WIDTH = 34  # where comments begin
TABLES = {
    "oscillator": "the mass on its spring",
    "piezo": "what couples it to the circuit",
    "stop": "without this table: no stop",
    "excitation": "what shakes the base",
    "load": "what takes the power",
}
EXAMPLES = {  # of a table that is left out
    "stop": ["restitution = 0.96"],
    "excitation": ['acceleration_psd = "1e-5 g^2/Hz"'],
    "load": ['resistance = "1 Mohm"'],
}


def text(device: Device) -> str:
    """The file's text."""
    lines = ["# Numbers are SI, texts carry their unit; a table or key that is left out is an effect that is absent."]
    lines += ["# All keys, their units and meanings: harvester keys", ""]
    lines += [_line(key) for key in device.tables[""]]
    for table, word in TABLES.items():
        keys = device.tables[table]
        lines += ["", _commented(f"[{table}]" if keys else f"# [{table}]", word)]
        lines += [_line(key) for key in keys] or [f"# {example}" for example in EXAMPLES[table]]
    return "\n".join(lines).replace("\n\n\n", "\n\n") + "\n"


def _line(key: Key) -> str:
    if isinstance(key.value, dict):
        pairs = ", ".join(tomli_w.dumps({name: value}).strip() for name, value in key.value.items())
        return _commented(f"{key.name} = {{ {pairs} }}", key.comment)
    return _commented(tomli_w.dumps({key.name: key.value}).strip(), key.comment)


def _commented(line: str, comment: str) -> str:
    return f"{line:<{WIDTH}} # {comment}" if comment else line


def check(path: Path, force: bool) -> None:
    """InputError where the file cannot be made: it is there and not to be overwritten, or its folder is not."""
    if path.exists() and not path.is_file():
        raise InputError(f"FILE must be a file to write, but {shown(str(path))} is a folder")
    if path.exists() and not force:
        raise InputError(f"FILE must be new, but {shown(str(path))} is there: another name, or `force`")
    if not path.parent.is_dir():
        raise InputError(f"FILE must be in a folder that is there, but {shown(str(path.parent))} is not")


def write(path: Path, device: Device, force: bool) -> Scene:
    """Write the file, whole or not at all, and return the scene that it is.

    Raises
    ------
    InputError
        where `check` finds something, where it cannot be written, and for what no scene can be.
    """
    check(path, force)
    whole = text(device)
    scene = loads(whole, path.parent)
    problem = Problem(scene)  # refuses numbers that no device has
    if problem.netlist is not None:
        _ = problem.circuit  # refuses a netlist that is not allowed
    files.write(path, whole, "FILE")
    return scene
