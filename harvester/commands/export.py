"""The command `harvester export`."""

from typing import Any

import click
import cloup
from cloup.constraints import RequireExactly

from harvester.commands.help import command
from harvester.commands.options import another_file, scene_argument, seed_option
from harvester.errors import InputError


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
    cloup.option(
        "--circuit",
        help="'inside', 'netlist' (never as an ideal circuit), or 'outside'.  Default: inside.",
    ),
    cloup.option("--fmi", type=int, help="Version of FMI, 2 or 3.  Default: 2."),
    cloup.option(
        "--platforms", help="Such as linux-x86_64,windows-x86_64, or all.  Default: this machine's."
    ),
)
@cloup.option_group("Noise that is drawn when the part is written", seed_option)
def export(
    path: str, out: str | None, fmu: str | None, seed: int, **options: str | int | None
) -> None:
    """Write SCENE's device as a part for other simulators: a subcircuit, or an FMU.

    A subcircuit is for ngspice, LTspice and KiCad, with an excitation source.  An FMU (functional
    mock-up unit) is for simulators of machines: Simulink, Amesim, Modelica, and others that import
    FMI 2.0 or 3.0.
    """
    from harvester.scene.toml import load

    file = str(out if fmu is None else fmu)
    others, kind = (
        (("name", "duration"), "out")
        if fmu is not None
        else (("circuit", "fmi", "platforms"), "fmu")
    )
    for name in others:
        if options[name] is not None:
            raise InputError(
                f"`{name}` must be used with --{kind}, but {file!r} is another kind of part"
            )
    another_file("--out" if fmu is None else "--fmu", file, path, "SCENE")
    given: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    if fmu is not None:
        from harvester.devices.fmu.unit import export_fmu

        made = export_fmu(load(path), file, seed=seed, argument="fmu", **given)
        click.echo(
            f"FMU {made.name}: {len(made.variables)} variables, inner step {made.step:.3g} s, "
            f"{made.size / 1e3:.0f} kB for {', '.join(made.platforms)}"
        )
    else:
        from harvester.devices.export import export as export_subcircuit

        subcircuit = export_subcircuit(load(path), file, seed=seed, **given)
        click.echo(f"subcircuit {subcircuit}: the first lines of the file explain its use")
    click.echo(f"written: {file}")
