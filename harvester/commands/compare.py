"""The command `harvester compare`."""

from functools import partial
from typing import Any

import cloup

from harvester.commands.options import engines_option, sampling
from harvester.commands.study import Output, output_options, study_command


@study_command(
    "harvester compare mine.toml --within 1% --out compare",
    "harvester compare mine.toml --engine averaged --engine spice",
    "harvester compare mine.toml --lifetime '5 years'",
)
@cloup.option_group(
    "Limits",
    cloup.option(
        "--lifetime",
        metavar="TIME",
        help="Also report the largest displacement, voltage, strain and impact in that time ('5 years'): by "
        "Rice's formula for a linear scene, and counted.",
    ),
)
@cloup.option_group(
    "Computation", engines_option("Repeatable.  Default: every engine that supports SCENE.")
)
@partial(sampling, whole="all engines together")
@output_options("Folder for compare.csv, compare.png and provenance.json.")
def compare(output: Output, lifetime: str | None, engines: tuple[str, ...], **options: Any) -> None:
    """Every engine that supports SCENE, side by side, with z-scores.

    One trajectory of V from three sources.
    """
    from harvester.machine.bars import EFFORT, Bar
    from harvester.studies import compare as study
    from harvester.studies.extremes.extremes import check_extremes, extremes_both_ways

    scene = output.scene
    seed = options["seed"]
    if lifetime is not None:
        check_extremes(scene, lifetime)
    with Bar("compare", shorter=EFFORT) as bar:
        result = study.compare(
            scene, engines=engines or None, execution=output.execution(bar), **options
        )
    largest = [] if lifetime is None else extremes_both_ways(scene, lifetime, seed)
    output.show(
        result,
        ("compare.csv", "compare.png", "provenance.json"),
        lambda report: report.of_comparison(scene, result, seed, largest),
        beside={"extremes": largest} if largest else {},
    )
