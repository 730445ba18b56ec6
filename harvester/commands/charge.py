"""The command `harvester charge`."""

from typing import Any

import cloup

from harvester.commands.options import duration, engine_option, seed_option
from harvester.commands.study import Output, output_options, study_command
from harvester.errors import InputError


@study_command(
    "harvester charge mine.toml --to 3.3V",
    "harvester charge mine.toml --to 3.3V --duration 10min --trajectories 10000 --out charge",
    "harvester charge chip.toml --probe 'v(out,com)' --to 3V --duration 60s",
    "harvester charge shock.toml --to 1.8V --duration 0.5s --engine spice",
)
@cloup.option_group(
    "Computation",
    cloup.option(
        "--to",
        required=True,
        help="Target of the probe: a voltage such as 3.3V, for i(ELEMENT) a current such as 5mA, for p(ELEMENT) a "
        "power (nondimensional scene: a number).",
    ),
    cloup.option(
        "--probe",
        default="store",
        show_default=True,
        help="store (the capacitor Csmooth), v(NODE), v(NODE,NODE), i(ELEMENT) or p(ELEMENT) of the netlist.",
    ),
    engine_option(
        "ideal, compiled, slow or spice.  Default: slow for a large capacitor, else ideal if it can, else spice."
    ),
    cloup.option(
        "--duration",
        help="Simulated time of a run, such as 60s; also reports the behaviour after the target is reached.  "
        "Default: until all runs have reached it, at most five R C.",
    ),
    cloup.option(
        "--anywhere",
        is_flag=True,
        help="Begin each run at a random place of the recording or excitation period.  Default: at the beginning.",
    ),
)
@cloup.option_group(
    "Accuracy",
    cloup.option(
        "--trajectories",
        type=int,
        help="Runs.  Default: 2048 (ideal, slow), 512 (compiled), 16 (spice), 1 if nothing is random.",
    ),
    cloup.option(
        "--dt",
        help="Step, such as 1ms (nondimensional scene: a number of 1/w0).  Default: from the scene.",
    ),
    cloup.option(
        "--budget",
        type=duration,
        metavar="TIME",
        help="Time limit, such as 30s: as many and as long runs as fit into it; not with "
        "--trajectories.  Default: unlimited.",
    ),
    seed_option,
)
@output_options("Folder for charge.csv, levels.csv, charge.png and provenance.json.")
def charge(output: Output, budget: float | None, **options: Any) -> None:
    """Charge SCENE's storage capacitor from empty to a target voltage: mean time, spread and charging power."""
    from harvester.machine.bars import Bar
    from harvester.studies.charging.charge import charge as charge_of

    scene = output.scene
    shorter = "--budget, a shorter --duration or fewer --trajectories"
    if budget is not None:
        if options["trajectories"] is not None:
            raise InputError(
                "`budget` must be left out if `trajectories` is given, but both are given"
            )
        options["trajectories"] = f"{budget} s"
        shorter = ""
    with Bar("charge", at_most=True, shorter=shorter) as bar:
        options |= {"progress": bar.tell, "notice": bar.notice, "execution": output.execution()}
        answer = charge_of(scene, **options)
    files = ("charge.csv", "levels.csv", "charge.png", "provenance.json")
    output.show(answer, files, lambda report: report.of_charge(scene, answer, options["seed"]))
