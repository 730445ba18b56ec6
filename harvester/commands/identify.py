"""The command `harvester identify`."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_answer
from harvester.commands.options import json_option, pairs_of, single_points
from harvester.commands.reports import report_file, report_option, save_report
from harvester.errors import InputError, invalid

if TYPE_CHECKING:
    from harvester.identification.identification_result import IdentificationResult


SHEET = [
    cloup.option("--frequency", metavar="VALUE", help="Resonance in short circuit, such as 60 Hz."),
    cloup.option(
        "--open-circuit-frequency", metavar="VALUE", help="In open circuit, such as 62 Hz."
    ),
    cloup.option("--capacitance", metavar="VALUE", help="Clamped capacitance, such as 30 nF."),
    cloup.option("--q", metavar="VALUE", help="Quality factor, such as 60.  Default: a prior."),
    *single_points(),
]


@command(
    "harvester identify impedance.csv frf.csv@100k --out mine.toml --report",
    "harvester identify impedance.csv --known mass='12 g' --out mine.toml",
    "harvester identify short.csv@short open.csv@open bounce.csv --json",
    "harvester identify impedance.csv --open-circuit-voltage '21 V at 0.25 g' --out mine.toml",
    "harvester identify --known mass='4 g' --frequency '60 Hz' --capacitance '30 nF' "
    "--open-circuit-voltage '21 V at 0.25 g' --out mine.toml",
)
@cloup.argument(
    "names",
    nargs=-1,
    metavar="[FILE...]",
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
@cloup.option_group("Numbers of a datasheet (next to files, or alone)", *SHEET)
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
    prior: str | None,
    **stated: str | None,
) -> None:
    """Identify a device's parameters from measurements in FILEs or a datasheet's numbers, with intervals.

    A file holds frequency with |Z| and phase, R and X, or G and B; frequency with a voltage or
    displacement per g; or time with a voltage or displacement.  Files are fitted jointly; a
    ring-down that bounces gives the stop.
    """
    from harvester.devices.scene_file import check
    from harvester.identification import identified_scene as scene_file
    from harvester.identification.identify import identify as study
    from harvester.machine.bars import Bar
    from harvester.presentation.diagnostic import note
    from harvester.scene.schema import NAME
    from harvester.studies.prediction.priors import DEFAULT_CLASS

    path = None if out is None else Path(out)
    if force and path is None:
        raise InputError(
            "--force must be used with --out, the scene file to overwrite, but --out is left out"
        )
    if path is not None:
        if path.suffix != ".toml":
            raise invalid("--out", "be a scene file that ends in .toml", out)
        check(path, force)
    page = report_file(report, None if path is None else str(path.parent))
    points = _points(stated, prior)
    fixed = pairs_of("--known", known, "be KEY=VALUE, such as mass='12 g'")
    with Bar("identify") as bar:
        result = study(names, fixed, points, DEFAULT_CLASS if prior is None else prior, bar.tell)
    origins = [*(Path(name).name for name in names), *["a datasheet"][: len(points)]]
    title = "Identified from " + ", ".join(origins)
    echo_answer(result, as_json)
    if path is not None:
        scene_file.write(path, result, title, force)
        drawn = _draw(result, title, path)
        if not as_json:
            click.echo(f"written: {', '.join([str(path), *drawn, NAME])}")
            if scene_file.is_whole(result):
                echo(f"next: harvester run {path}   (after its excitation and load)")
            else:
                given = None if "mass" in result.fit.fixed else typed(names, points, prior, known)
                echo(f"note: {note('scene_not_whole', given=given)}")
    save_report(page, lambda report: report.of_identification(result, title), quiet=as_json)


def typed(
    names: Sequence[str], points: Mapping[str, str], prior: str | None, known: Sequence[str]
) -> str:
    """The files and options that were given, as a shell reads them."""
    options = [(f"--{name.replace('_', '-')}", text) for name, text in points.items()]
    options += [("--known", text) for text in known]
    options += [] if prior is None else [("--prior", prior)]
    return shlex.join([*names, *(word for option in options for word in option)])


def _points(stated: dict[str, str | None], prior: str | None) -> dict[str, str]:
    """The numbers of a datasheet that are given; InputError for a prior without any."""
    from harvester.identification.data_sheet import NAMES

    points = {name: text for name in NAMES if (text := stated[name]) is not None}
    if prior is not None and not points:
        raise InputError(
            "--prior must be given with a number of a datasheet, such as --open-circuit-voltage, "
            "but there is none"
        )
    return points


def _draw(result: "IdentificationResult", title: str, path: Path) -> list[str]:
    """The name of the figure that is drawn next to the scene; none if there is no curve."""
    if not result.curves():
        return []
    plot = result.plot(title)
    from harvester.presentation.plot import save  # and with it matplotlib, which has drawn it

    save(plot, path.parent, f"{path.stem}_fit")
    return [path.with_name(path.stem + "_fit.png").name]
