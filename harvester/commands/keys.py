"""The command `harvester keys`."""

import json

import click
import cloup

from harvester.commands.help import command
from harvester.commands.options import json_option


@command(
    "harvester keys", "harvester keys excitation", "harvester keys load.resistance --json", "harvester keys profile"
)
@cloup.argument(
    "what", required=False, metavar="[TABLE|KEY]", help="Such as load or load.resistance, or profile.  Default: all."
)
@cloup.option_group("Output", json_option)
def keys(what: str | None, as_json: bool) -> None:
    """All keys of a scene file: unit, example, meaning; of 'profile' all shakings by name, with their sources."""
    from harvester.scene import keys as scene_keys

    if what in ("profile", "excitation.profile"):
        from harvester.records.profiles import catalogue

        click.echo(json.dumps(catalogue.listed()) if as_json else catalogue.text())
        return

    chosen = scene_keys.chosen(what)
    click.echo(json.dumps([vars(key) for key in chosen]) if as_json else scene_keys.text(chosen))
