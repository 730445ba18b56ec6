"""The command `harvester motion`."""

import cloup

from harvester.commands.completion import engines
from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import (
    figure,
    json_option,
    probe_option,
    scene_argument,
    seed_option,
    time_of,
    vector_needs_out,
    vector_option,
)
from harvester.commands.reports import report_file, report_option, save_report


@command(
    "harvester motion mine.toml --out motion",
    "harvester motion mine.toml --engine spice --duration 2 --out motion",
    "harvester motion bridge.toml --from-rest --duration 5s --probe store --probe 'v(a,b)' --out motion",
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--engine",
        shell_complete=engines,
        help="ensemble (exact update of a load resistor), compiled or spice.  Default: for a netlist, spice.",
    ),
    cloup.option(
        "--duration",
        type=time_of("duration"),
        metavar="TIME",
        help="Time that the plot shows, such as 2s (nondimensional scene: a number of 1/w0).",
    ),
    cloup.option(
        "--from-rest",
        is_flag=True,
        help="Show the beginning, from rest with empty capacitors.  Default: after four times the --duration.",
    ),
    probe_option,
)
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for motion.csv, motion.npz, motion.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@cloup.option_group("Accuracy", seed_option)
@vector_needs_out()
def motion(
    path: str,
    engine: str | None,
    duration: float | None,
    from_rest: bool,
    probe: tuple[str, ...],
    out: str | None,
    seed: int,
    vector: tuple[str, ...],
    report: str | None,
    as_json: bool,
) -> None:
    """One path of SCENE: displacement, voltage and probes over time, phase plane, density."""
    from harvester.commands.progress import Bar
    from harvester.engines.selection import default_sampler
    from harvester.scene.toml import load
    from harvester.studies import motion as study

    scene, file = load(path), report_file(report, out)
    if engine is None:
        engine = "spice" if probe else default_sampler(scene)
    with Bar("motion", known=False, shorter="a shorter --duration") as bar:
        answer = study.draw(scene, out, engine, duration, seed, vector, from_rest, probe, bar.expect)
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, "motion.csv", "motion.npz", *figure("motion", vector), "provenance.json")
    save_report(file, lambda report: report.of_motion(scene, answer, seed), quiet=as_json, scene=path)
