"""The command `harvester identify`."""

from pathlib import Path

import click
import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_answer
from harvester.commands.options import json_option, pairs_of
from harvester.commands.reports import report_file, report_option, save_report
from harvester.errors import InputError, invalid


@command(
    "harvester identify impedance.csv frf.csv@100k --out mine.toml --report",
    "harvester identify impedance.csv --known mass='12 g' --out mine.toml",
    "harvester identify short.csv@short open.csv@open bounce.csv --json",
)
@cloup.argument(
    "names",
    nargs=-1,
    required=True,
    metavar="FILE...",
    help="CSV files with named columns, each followed by its electrical state behind an @ if it needs one: "
    "FILE@100k, @short, @open, @clamped.",
)
@cloup.option_group(
    "Computation",
    cloup.option(
        "--known",
        multiple=True,
        metavar="KEY=VALUE",
        help="A known key, such as mass='12 g'; repeatable.",
    ),
)
@cloup.option_group(
    "Output",
    cloup.option(
        "--out", metavar="SCENE", help="Scene file to write, such as mine.toml, with mine_fit.png."
    ),
    cloup.option("--force", is_flag=True, help="Overwrite the scene file."),
    report_option,
    json_option,
)
def identify(
    names: tuple[str, ...],
    known: tuple[str, ...],
    out: str | None,
    force: bool,
    report: str | None,
    as_json: bool,
) -> None:
    """Identify a device's parameters from measurements in FILEs: impedance, response per g, ring-down, with intervals.

    A file holds frequency with |Z| and phase, R and X, or G and B; frequency with a voltage or displacement per g; or
    time with a voltage or displacement.  Files are fitted jointly; a ring-down that bounces gives the stop.
    """
    from harvester.devices.scene_file import check
    from harvester.identification import identified_scene as scene_file
    from harvester.identification.identify import identify as study
    from harvester.machine.files import folder
    from harvester.presentation.diagnostic import note
    from harvester.scene.schema import NAME

    path = None if out is None else Path(out)
    if force and path is None:
        raise InputError(
            "--force must be used with --out, the scene file to overwrite, but --out is left out"
        )
    if path is not None:
        if path.suffix != ".toml":
            raise invalid("--out", "be a scene file that ends in .toml", out)
        folder(path.parent)
        check(path, force)
    page = report_file(report, None if path is None else str(path.parent))
    result = study(names, pairs_of("--known", known, "be KEY=VALUE, such as mass='12 g'"))
    title = "Identified from " + ", ".join(Path(name).name for name in names)
    echo_answer(result, as_json)
    if path is not None:
        scene_file.write(path, result, title, force)
        plot = result.plot(title)
        from harvester.presentation.plot import save  # and with it matplotlib, which has drawn it

        save(plot, path.parent, f"{path.stem}_fit")
        if not as_json:
            click.echo(f"written: {path}, {path.with_name(path.stem + '_fit.png').name}, {NAME}")
            if scene_file.is_whole(result):
                echo(f"next: harvester run {path}   (after its excitation and load)")
            else:
                echo(f"note: {note('scene_not_whole', files=' '.join(names))}")
    save_report(page, lambda report: report.of_identification(result, title), quiet=as_json)
