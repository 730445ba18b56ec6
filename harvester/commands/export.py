"""The command `harvester export`."""

import click
import cloup
from cloup.constraints import RequireExactly

from harvester.commands.help import command
from harvester.commands.options import scene_argument, seed_option


@command(
    "harvester export mine.toml --out device.lib",
    "harvester export mine.toml --out device.lib --name bimorph",
    "harvester export mine.toml --fmu device.fmu",
    "harvester export mine.toml --fmu device.fmu --circuit outside --fmi 3",
)
@scene_argument
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Subcircuit to write, such as device.lib."),
    cloup.option("--fmu", help="FMU to write, such as device.fmu."),
    constraint=RequireExactly(1),
)
@cloup.option_group(
    "Subcircuit",
    cloup.option("--name", help="Its name.  Default: the file name."),
    cloup.option(
        "--duration",
        help="Length of noise drawn point by point, such as 60s.  Default: 1000 periods.",
    ),
)
@cloup.option_group(
    "FMU",
    cloup.option("--circuit", help="'inside', or 'outside': an electrical port.  Default: inside."),
    cloup.option("--fmi", type=int, help="Version of FMI, 2 or 3.  Default: 2."),
    cloup.option(
        "--platforms",
        help="Such as linux-x86_64,linux-aarch64,windows-x86_64,macos-aarch64.  Default: all.",
    ),
)
@cloup.option_group("Noise that is drawn when the part is written", seed_option)
def export(
    path: str, out: str | None, fmu: str | None, seed: int, **options: str | int | None
) -> None:
    """Write SCENE's device as a part for other simulators: a subcircuit, or an FMU.

    A subcircuit is for ngspice, LTspice and KiCad, with an excitation source.  An FMU (functional mock-up unit) is for
    simulators of machines: Simulink, Amesim, Modelica, and others that import FMI 2.0 or 3.0.
    """
    from harvester.devices.part_file import export_part
    from harvester.scene.toml import load

    platforms = options.pop("platforms")
    if isinstance(platforms, str):
        options["platforms"] = tuple(name.strip() for name in platforms.split(","))  # type: ignore[assignment]
    given = {name: value for name, value in options.items() if value is not None}
    is_fmu = fmu is not None
    argument = "fmu" if is_fmu else "out"
    out = str(fmu if is_fmu else out)
    part = export_part(load(path), out, seed=seed, is_fmu=is_fmu, argument=argument, **given)
    click.echo(part)
    click.echo(f"written: {out}")
