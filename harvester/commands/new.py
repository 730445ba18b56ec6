"""The command `harvester new`."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_json
from harvester.commands.options import json_option
from harvester.devices.flags import FLAGS, LOAD
from harvester.errors import InputError, invalid


def _datasheet_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add an option for each field of a datasheet to a command, in the fields' groups."""
    netlist = [
        cloup.option("--netlist", metavar="NAME", help="Instead: a circuit of netlists/, such as bridge, or a path."),
        cloup.option(
            "--parameter", "parameters", multiple=True, metavar="NAME=VALUE", help="Of the netlist; repeatable."
        ),
    ]
    for group in reversed(dict.fromkeys(flag.group for flag in FLAGS.values())):
        options = [
            cloup.option("--" + flag.name.replace("_", "-"), flag.name, metavar="VALUE", help=flag.help)
            for flag in FLAGS.values()
            if flag.group == group
        ]
        command = cloup.option_group(group, *options, *(netlist if group == LOAD else []))(command)
    return command


@command(
    "harvester new mine.toml      (asks)",
    "harvester new mine.toml --mass '40 g' --frequency '3.2 Hz' --q 125 --capacitance '50 nF' "
    "--open-circuit-frequency '4.8 Hz' --acceleration-psd '1e-5 g^2/Hz' --resistance '1 Mohm'",
    "harvester new mine.toml --mass '40 g' --stiffness '16 N/m' --damping-ratio 0.004 --coupling '1e-3 N/V' "
    "--capacitance '50 nF' --netlist bridge --parameter R='1 Mohm' --parameter C='1 uF'",
)
@cloup.argument("file", help="The scene file to write, such as mine.toml.")
@_datasheet_options
@cloup.option_group(
    "File and output",
    cloup.option("--title", help="Of tables and plots."),
    cloup.option("--force", is_flag=True, help="Overwrite FILE."),
    json_option,
)
def new(
    file: str,
    netlist: str | None,
    parameters: tuple[str, ...],
    title: str | None,
    force: bool,
    as_json: bool,
    **values: str | None,
) -> None:
    """Write the scene FILE of your device, from flags or questions, and say what its numbers mean.

    On a terminal, what is needed and left out is asked for.  Values carry their unit, or are in SI units.
    """
    from harvester.devices.device import device, missing
    from harvester.devices.meaning import meaning
    from harvester.devices.scene_file import check, write

    path = Path(file)
    check(path, force)  # before anybody answers questions
    given = {name: value for name, value in values.items() if value is not None}
    others = {"netlist": netlist, "title": title}
    if missing(given) and sys.stdin.isatty():
        from harvester.commands.questions import ask

        ask(given, others)
    if netlist is not None:
        netlist = _netlist(netlist, path)
    made = device(given, others["title"] or "", netlist, _parameters(parameters))
    scene = write(path, made, force)
    found = meaning(scene, file)
    if as_json:
        whole = {"file": file, "scene": scene.tables(), **found.as_json()}
        echo_json(whole)
        return
    echo(f"written: {file}\n\n{found}")


def _parameters(pairs: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise invalid("--parameter", "be NAME=VALUE, such as R='1 Mohm'", pair)
        if name.strip() in found:
            raise InputError(f"--parameter must name each only once, but names {name.strip()!r} twice")
        found[name.strip()] = value
    return found


def _netlist(name: str, scene: Path) -> str:
    """As the scene file names it: a path from where the program runs becomes one from the file."""
    if "/" not in name and not name.endswith(".cir"):
        return name
    given = os.path.relpath(name, scene.parent)
    return given if "/" in given else f"./{given}"
