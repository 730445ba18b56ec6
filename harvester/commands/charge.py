"""The command `harvester charge`."""

from typing import Any

import cloup

from harvester.commands.completion import engines
from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, scene_argument, seed_option, vector_needs_out, vector_option
from harvester.commands.reports import report_file, report_option, save_report


@command(
    "harvester charge mine.toml --to 3.3V",
    "harvester charge mine.toml --to 3.3V --duration 10min --trajectories 10000 --out charge",
    "harvester charge chip.toml --probe 'v(out,com)' --to 3V --duration 60s",
    "harvester charge shock.toml --to 1.8V --duration 0.5s --engine spice",
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--to",
        required=True,
        help="What the probe must reach: a voltage such as 3.3V, of i(ELEMENT) a current such as 5mA, of p(ELEMENT) a "
        "power (nondimensional scene: a number).",
    ),
    cloup.option(
        "--probe",
        default="store",
        show_default=True,
        help="store (the capacitor Csmooth), v(NODE), v(NODE,NODE), i(ELEMENT) or p(ELEMENT) of the netlist.",
    ),
    cloup.option(
        "--engine",
        shell_complete=engines,
        help="ideal, slow or spice.  Default: slow for a large store, else ideal where it serves, else spice.",
    ),
    cloup.option(
        "--duration",
        help="How long a run is watched, such as 60s; what it does after its arrival is told, too.  Default: until all "
        "have arrived, at most five R C.",
    ),
    cloup.option(
        "--anywhere",
        is_flag=True,
        help="Begin each run at a random place of the record, or of the drive's period.  Default: at the beginning.",
    ),
)
@cloup.option_group(
    "Accuracy",
    cloup.option(
        "--trajectories", type=int, help="Runs.  Default: 2048 (ideal, slow), 16 (spice), 1 if nothing is random."
    ),
    cloup.option("--dt", help="Step, such as 1ms (nondimensional scene: a number of 1/w0).  Default: from the scene."),
    seed_option,
)
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for charge.csv, levels.csv, charge.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@vector_needs_out()
def charge(
    path: str, out: str | None, vector: tuple[str, ...], report: str | None, as_json: bool, **options: Any
) -> None:
    """The time that SCENE's storage capacitor takes from empty to a voltage, its spread, and the power on the way."""
    from harvester.commands.progress import Bar
    from harvester.scene.toml import load
    from harvester.studies.charging import charge as study

    scene, file = load(path), report_file(report, out)
    with Bar("charge", at_most=True, shorter="a shorter --duration or fewer --trajectories") as bar:
        answer = study.draw(scene, out, vector, progress=bar.tell, notice=bar.notice, **options)
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, "charge.csv", "levels.csv", *figure("charge", vector), "provenance.json")
    save_report(file, lambda report: report.of_charge(scene, answer, options["seed"]), quiet=as_json, scene=path)
