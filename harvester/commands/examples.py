"""The command `harvester examples`."""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import cloup

from harvester.commands.completion import example_names
from harvester.commands.help import command
from harvester.commands.options import json_option
from harvester.errors import InputError, shown, unknown
from harvester.scene.example_scenes import example_scenes


@command(
    "harvester examples",
    "harvester examples plate_bridge",
    "harvester examples plate --out mine.toml",
)
@cloup.argument(
    "name",
    required=False,
    metavar="[NAME]",
    shell_complete=example_names,
    help="Example to copy.  Default: list all.",
)
@cloup.option_group(
    "Output",
    cloup.option("--out", metavar="FILE", help="Name of the copy.  Default: NAME.toml."),
    json_option,
)
def examples(name: str | None, out: str | None, as_json: bool) -> None:
    """List the example scenes, or copy one, with the files that it reads."""
    scenes = example_scenes()
    if name is None:
        if out is not None:
            raise InputError(
                "NAME must be given with --out, but is left out: 'harvester examples' lists them"
            )
        titles = {
            scene_name: tomllib.loads(path.read_text()).get("title", "")
            for scene_name, path in scenes.items()
        }
        width = max(map(len, titles))
        lines = [f"{scene_name:<{width}}  {title}" for scene_name, title in titles.items()]
        click.echo(json.dumps(titles) if as_json else "\n".join(lines))
        return
    if name not in scenes:
        raise unknown("example", name, scenes)
    written = [
        str(path) for path in copy(scenes[name], Path(f"{name}.toml" if out is None else out))
    ]
    if as_json:
        click.echo(json.dumps({"written": written}))
        return
    click.echo(
        "\n".join([*(f"written: {path}" for path in written), f"next: harvester run {written[0]}"])
    )


def copy(scene: Path, to: Path) -> list[Path]:
    """Copy a scene and its files, all or nothing, and return the copies.

    InputError if a file is in the way.
    """
    from harvester.devices.scene_file import check
    from harvester.machine import files
    from harvester.scene.schema import DIRECTIVE, NAME, write_beside

    if to.suffix != ".toml":
        raise InputError(f"FILE must end in .toml, but is {shown(str(to))}")
    if to.is_file():
        raise InputError(f"FILE must be new, but {shown(str(to))} is there: another name by --out")
    check(to, True)
    beside = {
        to.parent / path.relative_to(scene.parent): path.read_bytes() for path in read_by(scene)
    }
    for path, content in beside.items():
        if path.exists() and not (path.is_file() and path.read_bytes() == content):
            raise InputError(
                f"{shown(str(path))} must be new, for the scene reads it, but another file is there"
            )
    for path, content in beside.items():
        files.write(path, content, "out")
    files.write(to, f"{DIRECTIVE}\n{scene.read_text()}", "out")
    write_beside(to)
    return [to, *beside, to.with_name(NAME)]


def read_by(path: Path) -> Iterator[Path]:
    """The files next to a scene that it reads: records, and a netlist with all that it includes."""
    from harvester.netlists.read_lines import read_lines
    from harvester.scene.physical import FILES
    from harvester.scene.toml import load

    scene = load(path)
    yield from (
        Path(name) for key in FILES if (name := getattr(scene.excitation, key, None)) is not None
    )
    if scene.load is not None and scene.load.file:
        netlist = Path(scene.load.file)
        names = (line.where.rpartition(" line ")[0] for line in read_lines(netlist))
        yield from dict.fromkeys([netlist, *(netlist.with_name(name) for name in names)])
