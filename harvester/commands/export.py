"""The command `harvester export`."""

import click
import cloup

from harvester.commands.help import command
from harvester.commands.options import scene_argument, seed_option


@command(
    "harvester export mine.toml --out device.lib",
    "harvester export mine.toml --out device.lib --name bimorph",
)
@scene_argument
@cloup.option_group(
    "Output",
    cloup.option("--out", required=True, help="File to write, such as device.lib."),
    cloup.option("--name", help="Name of the subcircuit.  Default: the file name."),
)
@cloup.option_group(
    "Noise drawn point by point (coloured, band-limited, tabulated)",
    cloup.option("--duration", help="Length, such as 60s.  Default: 1000 periods."),
    seed_option,
)
def export(path: str, out: str, name: str | None, duration: str | None, seed: int) -> None:
    """Write SCENE's device as a part for ngspice, LTspice and KiCad: a subcircuit, and an excitation source."""
    from harvester.devices.export import export as write
    from harvester.scene.toml import load

    subcircuit = write(load(path), out, name, duration, seed)
    click.echo(f"subcircuit {subcircuit}: the first lines of the file explain its use")
    click.echo(f"written: {out}")
