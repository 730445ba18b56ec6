"""The command `harvester motion`."""

from typing import Any

import cloup

from harvester.commands.options import engine_option, probe_option, seed_option, time_of
from harvester.commands.study import Output, output_options, study_command


@study_command(
    "harvester motion mine.toml --out motion",
    "harvester motion mine.toml --engine spice --duration 2 --out motion",
    "harvester motion bridge.toml --from-rest --duration 5s --probe store --probe 'v(a,b)' --out motion",
)
@cloup.option_group(
    "Computation",
    engine_option(
        "ensemble (exact update of a load resistor), compiled or spice.  Default: for a netlist, spice."
    ),
    cloup.option(
        "--duration",
        type=time_of("duration"),
        metavar="TIME",
        help="Time shown in the plot, such as 2s (nondimensional scene: a number of 1/w0).",
    ),
    cloup.option(
        "--from-rest",
        is_flag=True,
        help="Show the beginning, from rest with empty capacitors.  Default: after four times the --duration.",
    ),
    probe_option,
)
@output_options("Folder for motion.csv, motion.npz, motion.png and provenance.json.")
@cloup.option_group("Accuracy", seed_option)
def motion(output: Output, engine: str | None, probe: tuple[str, ...], **options: Any) -> None:
    """One trajectory of SCENE: displacement, voltage and probes over time, phase plane, probability density."""
    from harvester.engines.selection import default_sampler
    from harvester.machine.bars import Bar
    from harvester.studies.motion import motion as motion_of

    scene = output.scene
    if engine is None:
        engine = "spice" if probe else default_sampler(scene)
    with Bar("motion", known=False, shorter="a shorter --duration") as bar:
        options |= {"probe": probe, "expected": bar.expect, "execution": output.execution()}
        answer = motion_of(scene, engine, **options)
    files = ("motion.csv", "motion.npz", "motion.png", "provenance.json")
    output.show(answer, files, lambda report: report.of_motion(scene, answer, options["seed"]))
