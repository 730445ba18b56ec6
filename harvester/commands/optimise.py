"""The command `harvester optimise`."""

from typing import Any

import cloup

from harvester.commands.completion import engines, scene_keys
from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, sampling, scene_argument, vector_needs_out, vector_option


@command(
    "harvester optimise mine.toml --over load.resistance=1k:10M",
    "harvester optimise mine.toml --over load.resistance=1k:10M --over stop.restitution=.5:1 --out best",
    "harvester optimise mine.toml --over load.resistance=E24:100k:1M --vary piezo.capacitance=10% --for 5%",
    'harvester optimise mine.toml --over load.resistance=1k:10M --limit "voltage_rms < 2 V"',
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--over",
        shell_complete=scene_keys,
        multiple=True,
        required=True,
        help="KEY=LOW:HIGH, or of a series KEY=E24:LOW:HIGH; up to 4 keys.",
    ),
    cloup.option(
        "--engine",
        shell_complete=engines,
        help="exact, published, averaged, ensemble, ideal or spice.  Default: exact for a linear scene, else ensemble; "
        "for a netlist, spice.",
    ),
)
@cloup.option_group(
    "Limits, and parts that scatter (engines of formulas)",
    cloup.option(
        "--limit", "limits", multiple=True, metavar="TEXT", help="Such as 'voltage_rms < 3 V'; see tolerance."
    ),
    cloup.option("--lifetime", metavar="TIME", help="For limits of peaks; see tolerance."),
    cloup.option(
        "--vary",
        "varied",
        shell_complete=scene_keys,
        multiple=True,
        metavar="KEY=SPREAD",
        help="As in tolerance; about each value.",
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
    engine: str | None,
    within: float | None,
    budget: float | None,
    out: str | None,
    vector: tuple[str, ...],
    as_json: bool,
    **options: Any,
) -> None:
    """The largest mean power over one or several scene keys, and how well both are known.

    --within (default 1%) is the error of the power at the optimum, --budget (default 60s) the time for all of it.
    """
    from harvester.commands.progress import Bar
    from harvester.engines import Exact, selection
    from harvester.equations.problem import Problem
    from harvester.scene.toml import load
    from harvester.studies.optimum import optimise as study
    from harvester.studies.optimum.ranges import parse
    from harvester.studies.robust.optimise import optimise_robust

    scene, ranges = load(path), [parse(text) for text in over]
    if limits or varied or lifetime or share is not None or any(one.steps for one in ranges):
        formula = "averaged" if Exact.refusal(Problem(scene)) else "exact"
        inner = selection.engine(engine or formula, within=within, **options)
        with Bar("optimise", at_most=True, shorter="a shorter --budget", budget=budget or 60.0) as bar:
            files: Any = {
                "out": out,
                "vector": vector,
                "tick": bar.tell,
                "lifetime": lifetime,
                "within": within or 0.01,
            }
            files["budget"] = budget or 60.0
            best = optimise_robust(scene, ranges, varied, share, limits, inner, **files)
        echo_answer(best, as_json)
        if out is not None and not as_json:
            echo_written(out, "optimise.csv", *figure("optimise", vector), "provenance.json")
        return
    chosen = selection.engine(selection.default_engine(scene, **options) if engine is None else engine, **options)
    with Bar("optimise", at_most=True, shorter="a shorter --budget", budget=budget or 60.0) as bar:
        answer = study.optimise(scene, ranges, chosen, within or 0.01, budget or 60.0, out, bar.tell, vector)
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, "optimise.csv", *figure("optimise", vector), "provenance.json")
