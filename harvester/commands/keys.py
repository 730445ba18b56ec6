"""The command `harvester keys`."""

import json

import click
import cloup

from harvester.commands.help import command
from harvester.commands.options import json_option


@command("harvester keys", "harvester keys excitation", "harvester keys load.resistance --json")
@cloup.argument("what", required=False, metavar="[TABLE|KEY]", help="Such as load or load.resistance.  Default: all.")
@cloup.option_group("Output", json_option)
def keys(what: str | None, as_json: bool) -> None:
    """All keys of a scene file: unit, example, meaning."""
    from harvester.scene import keys as scene_keys

    chosen = scene_keys.chosen(what)
    click.echo(json.dumps([vars(key) for key in chosen]) if as_json else scene_keys.text(chosen))
