"""The command `harvester optimise`."""

from typing import Any

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, sampling, scene_argument, vector_needs_out, vector_option


@command(
    "harvester optimise mine.toml --over load.resistance=1k:10M",
    "harvester optimise mine.toml --over load.resistance=1k:10M --over stop.restitution=.5:1 --out best",
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option("--over", multiple=True, required=True, help="KEY=LOW:HIGH, a range to search; up to 4 keys."),
    cloup.option(
        "--engine",
        help="exact, published, averaged, ensemble, ideal or spice.  Default: exact for a linear scene, else ensemble; "
        "for a netlist, spice.",
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
    from harvester.engines import selection
    from harvester.scene.toml import load
    from harvester.studies.optimum import optimise as study
    from harvester.studies.optimum.ranges import parse

    scene, ranges = load(path), [parse(text) for text in over]
    chosen = selection.engine(selection.default_engine(scene, **options) if engine is None else engine, **options)
    with Bar("optimise", at_most=True) as bar:
        answer = study.optimise(scene, ranges, chosen, within or 0.01, budget or 60.0, out, bar.tell, vector)
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, "optimise.csv", *figure("optimise", vector), "provenance.json")
