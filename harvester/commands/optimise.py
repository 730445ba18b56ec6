"""The command `harvester optimise`."""

from pathlib import Path
from typing import Any

import cloup

from harvester.commands.completion import engines, scene_keys
from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, sampling, scene_argument, vector_needs_out, vector_option
from harvester.commands.reports import report_file, report_option, save_report
from harvester.errors import InputError, invalid


@command(
    "harvester optimise mine.toml --over load.resistance=1k:10M",
    "harvester optimise mine.toml --over load.resistance=1k:10M --over stop.restitution=.5:1 --out best",
    "harvester optimise mine.toml --over load.resistance=E24:100k:1M --vary piezo.capacitance=10% --for 5%",
    'harvester optimise mine.toml --over load.resistance=1k:10M --limit "voltage_rms < 2 V"',
    "harvester optimise bridge.toml --over load.netlist=bridge,parallel_sshi,sece --over load.parameters.R=100k:10M "
    "--engine ideal",
    "harvester optimise mine.toml --over load.resistance=1k:10M --pareto peak_displacement --lifetime '5 years' "
    "--out front",
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--over",
        shell_complete=scene_keys,
        multiple=True,
        required=True,
        help="KEY=LOW:HIGH, or of a series KEY=E24:LOW:HIGH; up to 4 keys.  load.netlist=A,B,C: the best of these "
        "circuits, scanned alike first, each with its own best values of the other keys; --budget is for each.",
    ),
    cloup.option(
        "--engine",
        shell_complete=engines,
        help="exact, published, averaged, ensemble, ideal or spice.  Default: exact for a linear scene, else ensemble; "
        "for a netlist, spice.",
    ),
)
@cloup.option_group(
    "Limits, a second aim, and parts that scatter",
    cloup.option(
        "--limit", "limits", multiple=True, metavar="TEXT", help="Such as 'voltage_rms < 3 V'; see tolerance."
    ),
    cloup.option(
        "--pareto",
        metavar="QUANTITY",
        help="A second aim, such as peak_displacement, to be low (voltage_rms:high: high): the most power for each of "
        "its values.",
    ),
    cloup.option("--lifetime", metavar="TIME", help="For peaks; see tolerance."),
    cloup.option(
        "--vary",
        "varied",
        shell_complete=scene_keys,
        multiple=True,
        metavar="KEY=SPREAD",
        help="As in tolerance; about each value; by engines of formulas.",
    ),
    cloup.option(
        "--for", "share", metavar="PERCENT", help="Power that all but so many devices exceed.  Default: the mean."
    ),
)
@sampling
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for optimise.csv (all evaluations), optimise.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@vector_needs_out()
def optimise(
    path: str,
    over: tuple[str, ...],
    limits: tuple[str, ...],
    varied: tuple[str, ...],
    share: str | None,
    lifetime: str | None,
    pareto: str | None,
    engine: str | None,
    within: float | None,
    budget: float | None,
    out: str | None,
    vector: tuple[str, ...],
    report: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """The largest mean power over one or several scene keys, and how well both are known.

    --within (default 1%) is the error of the power at the optimum, --budget (default 60s) the time for all of it.
    """
    from harvester.commands.progress import Bar
    from harvester.engines import Exact, Spice, selection
    from harvester.equations.problem import Problem
    from harvester.scene.toml import load
    from harvester.studies.optimum import optimise as study
    from harvester.studies.optimum.circuits import optimise_circuits
    from harvester.studies.optimum.ranges import parse
    from harvester.studies.robust.optimise import optimise_robust
    from harvester.studies.robust.pareto import pareto as front_of

    circuits, over, varied = _circuits(over, varied)
    scene, ranges, file = load(path), [parse(text) for text in over], report_file(report, out)
    special = limits or varied or lifetime or pareto or share is not None or any(one.steps for one in ranges)
    if circuits and special:
        names = "`limit`, `lifetime`, `vary`, `for`, `pareto` and series"
        raise InputError(f"{names} must be left out where circuits are compared, but one is given")
    answer: Any
    written = ["optimise.csv", *figure("optimise", vector), "provenance.json"]
    asked = within or 0.01, budget or 60.0
    whole = asked[1] * max(len(circuits), 1)
    with Bar("optimise", at_most=True, shorter="a shorter --budget", budget=whole) as bar:
        if circuits:
            written = ["circuits.csv", *(f"{Path(name).stem}/" for name in circuits)]
            which = selection.engine(engine or Spice.NAME, **options)
            answer = optimise_circuits(scene, circuits, ranges, which, *asked, out, bar.tell, vector)
        elif special:
            formula = "averaged" if Exact.refusal(Problem(scene)) else "exact"
            inner = selection.engine(engine or formula, within=within, **options)
            files: Any = {"out": out, "vector": vector, "tick": bar.tell, "lifetime": lifetime}
            files |= {"within": asked[0], "budget": asked[1]}
            devices = varied, share, limits, inner
            if pareto is None:
                answer = optimise_robust(scene, ranges, *devices, **files)
            else:
                written = ["pareto.csv", *figure("pareto", vector), "provenance.json"]
                answer = front_of(scene, ranges, pareto, *devices, **files)
        else:
            which = selection.engine(engine or selection.default_engine(scene, **options), **options)
            answer = study.optimise(scene, ranges, which, *asked, out, bar.tell, vector)
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, *written)
    save_report(file, lambda report: report.of_search(scene, answer, options["seed"]), quiet=as_json, scene=path)


def _circuits(over: tuple[str, ...], varied: tuple[str, ...]) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    """The circuits to choose from, which --over or --vary names, and what else these name."""
    chosen = [text for text in (*over, *varied) if text.partition("=")[0].strip() in ("load.netlist", "netlist")]
    if len(chosen) > 1:
        raise InputError("`over` must name each key only once, but names 'load.netlist' twice")
    over, varied = (tuple(text for text in some if text not in chosen) for some in (over, varied))
    names = [name.strip() for name in chosen[0].partition("=")[2].split(",")] if chosen else []
    if chosen and (len(set(names)) < 2 or not all(names)):
        raise invalid("`over`", "be load.netlist=A,B,... with two circuits or more", chosen[0])
    return names, over, varied
