"""The command `harvester optimise`."""

from functools import partial
from pathlib import Path
from typing import Any

import cloup

from harvester.commands.options import engine_option, keys_option, sampling
from harvester.commands.study import Output, output_options, study_command
from harvester.errors import InputError


@study_command(
    "harvester optimise mine.toml --vary load.resistance=1k:10M",
    "harvester optimise mine.toml --vary load.resistance=1k:10M --vary stop.restitution=0.5:1 --out best",
    "harvester optimise mine.toml --vary load.resistance=E24:100k:1M --spread piezo.capacitance=10% --objective 5%",
    'harvester optimise mine.toml --vary load.resistance=1k:10M --constraint "voltage_rms < 2 V"',
    "harvester optimise bridge.toml --vary load.netlist=bridge,parallel_sshi,sece --vary load.parameters.R=100k:10M "
    "--engine ideal",
    "harvester optimise mine.toml --vary load.resistance=1k:10M --objective peak_displacement --lifetime '5 years' "
    "--out front",
)
@cloup.option_group(
    "Computation",
    keys_option(
        "--vary",
        help_="KEY=LOW:HIGH, or from a series KEY=E24:LOW:HIGH; up to 4 keys.  load.netlist=A,B,C: the best of "
        "these circuits, each with its own best values of the other keys.",
    ),
    engine_option(
        "{engines}.  Default: exact for a linear scene, otherwise ensemble; for a netlist, spice; if circuits are "
        "compared, slow for a chip under a sinusoid."
    ),
)
@cloup.option_group(
    "Objective",
    cloup.option(
        "--objective",
        multiple=True,
        metavar="OBJECTIVE",
        help="mean_power (default); 5%: the power that 95 % of devices exceed; peak_displacement, "
        "voltage_rms:high, ...: a second objective (minimised, or maximised with :high), for a Pareto front.",
    ),
    cloup.option(
        *("--constraint", "--limit", "constraints"),
        multiple=True,
        metavar="TEXT",
        help="A limit such as 'voltage_rms < 3 V'; see tolerance.",
    ),
    cloup.option("--lifetime", metavar="TIME", help="Lifetime for limits on peaks; see tolerance."),
    keys_option(
        "--spread",
        metavar="KEY=SPREAD",
        help_="Manufacturing tolerance of a key, as 'tolerance --vary', around each value.  Formula engines only.",
    ),
    cloup.option(
        "--points",
        type=int,
        metavar="N",
        help="Largest number of designs on a Pareto front.  Default: 9.",
    ),
)
@partial(sampling, whole="the whole search, or the search of each circuit", unset="60s")
@output_options("Folder for optimise.csv (all evaluations), optimise.png and provenance.json.")
def optimise(
    output: Output, engine: str | None, within: float | None, budget: float | None, **options: Any
) -> None:
    """Find the largest mean power over one or several scene keys, with intervals.

    --within (default 1%) is the power error at the optimum, --budget (default 60s) the time
    for the search; if circuits are compared, for each of them.
    """
    from harvester.engines import selection
    from harvester.engines.cheapest import formula
    from harvester.equations.problem import Problem
    from harvester.machine.bars import Bar
    from harvester.studies.optimum import optimise as study
    from harvester.studies.optimum.ranges import middle, varied

    scene = output.scene
    objective = _objective_of(options)
    points = options.pop("points")
    kind = study.kind_of_search(**objective)
    circuits, ranges = varied(objective["vary"])
    which: Any
    if kind == "devices":
        which = selection.engine(engine or formula(Problem(scene)).NAME, within=within, **options)
    elif (
        kind == "circuits" and engine is None and not any(options.values())
    ):  # each circuit has its own default
        which = None
    elif kind == "circuits":
        which = selection.engine(engine or selection.ENGINE_OF_CIRCUITS, **options)
    else:
        default = selection.default_engine(middle(scene, ranges), **options)
        which = selection.engine(engine or default, **options)
    seconds = budget or 60.0
    whole = seconds * max(len(circuits), 1)
    with Bar("optimise", at_most=True, shorter="a shorter --budget", budget=whole) as bar:
        execution = output.execution(bar)
        limits: Any = {
            "within": within or 0.01,
            "budget": seconds,
            "points": points,
            "execution": execution,
        }
        answer: Any = study.optimise(scene, engine=which, **objective, **limits)
    written = [f"{answer.FILE}.csv", f"{answer.FILE}.png", "provenance.json"]
    files = ["circuits.csv", *(f"{Path(name).stem}/" for name in circuits)] if circuits else written
    output.show(answer, files, lambda report: report.of_search(scene, answer, options["seed"]))


def _objective_of(options: dict[str, Any]) -> dict[str, Any]:
    """The varied keys and the objective, read from the options."""
    names = ("vary", "spread", "objective", "constraints", "lifetime")
    objective = {name: options.pop(name) for name in names}
    if not objective["vary"]:
        raise InputError("Missing option '--vary'. (such as --vary load.resistance=1k:10M)")
    return objective | {"objective": list(objective["objective"]) or "mean_power"}
