"""The command `harvester compare`."""

from typing import Any

import cloup

from harvester.commands.completion import engines as engines_of
from harvester.commands.help import command
from harvester.commands.messages import echo, echo_json, echo_written
from harvester.commands.options import figure, json_option, sampling, scene_argument, vector_needs_out, vector_option
from harvester.commands.reports import report_file, report_option, save_report


@command(
    "harvester compare mine.toml --within 1% --out compare",
    "harvester compare mine.toml --engine averaged --engine spice",
    "harvester compare mine.toml --lifetime '5 years'",
)
@scene_argument
@cloup.option_group(
    "Limits",
    cloup.option(
        "--lifetime",
        metavar="TIME",
        help="Also the largest displacement, voltage, strain and impact in that time ('5 years'): by Rice's formula "
        "for a linear scene, and counted.",
    ),
)
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--engine",
        "engines",
        shell_complete=engines_of,
        multiple=True,
        help="Repeatable.  Default: every engine that can serve SCENE.",
    ),
)
@sampling
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for compare.csv, compare.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@vector_needs_out()
def compare(
    path: str,
    lifetime: str | None,
    engines: tuple[str, ...],
    out: str | None,
    vector: tuple[str, ...],
    report: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Every engine that can serve SCENE, side by side, with z-scores; one path of V drawn from three sources."""
    from harvester.commands.progress import EFFORT, Bar
    from harvester.machine.execution import Execution
    from harvester.scene.toml import load
    from harvester.studies import compare as study
    from harvester.studies.extremes.extremes import check_asked, extremes_both_ways

    scene = load(path)
    if lifetime is not None:
        check_asked(scene, lifetime)
    file = report_file(report, out)
    with Bar("compare", shorter=EFFORT) as bar:
        execution = Execution(out=out, formats=vector, progress=bar)
        result = study.compare(scene, engines=engines or None, execution=execution, **options)
    largest = [] if lifetime is None else extremes_both_ways(scene, lifetime, options["seed"])
    if as_json:
        echo_json(result.as_json() | ({"extremes": [one.as_json() for one in largest]} if largest else {}))
    else:
        echo("\n".join(map(str, (result, *largest))))
        if out is not None:
            echo_written(out, "compare.csv", *figure("compare", vector), "provenance.json")
    seed = options["seed"]
    save_report(file, lambda report: report.of_comparison(scene, result, seed, largest), quiet=as_json, scene=path)
