"""The command `harvester design`."""

from typing import Any

import cloup

from harvester.commands.options import json_option, keys_option, seed_option
from harvester.commands.reports import report_option
from harvester.commands.study import Output, page_of, study_command


@study_command(
    "harvester design mine.toml --needs '40 uW at 3.3 V' --spread frequency=2Hz --out design",
    "harvester design mine.toml --needs '1 mW at 1.8 V' --wake '10 s' --limit 'peak_displacement < 1 mm' "
    "--circuits bridge --chips ltc3588",
    reported=True,
)
@cloup.option_group(
    "Requirements",
    cloup.option(
        "--needs",
        metavar="TEXT",
        help="POWER at VOLTAGE, such as '40 uW at 3.3 V'.  Default: [node]'s.",
    ),
    cloup.option(
        "--wake", metavar="TIME", help="Longest time to charge to that voltage, such as '10 s'."
    ),
    cloup.option(
        "--limit",
        multiple=True,
        metavar="TEXT",
        help="Such as 'peak_displacement < 1 mm' or 'mean_power > 50 uW'; repeatable.",
    ),
    keys_option(
        "--spread",
        metavar="KEY=SPREAD",
        help_="Spread of devices or excitation, as 'tolerance --vary', such as frequency=2Hz; repeatable.",
    ),
)
@cloup.option_group(
    "Candidates",
    cloup.option(
        "--circuits",
        metavar="A,B,...",
        help="Netlists, the simplest first.  Default: bridge, doubler, series_sshi, parallel_sshi and, under a "
        "harmonic excitation, all chips.",
    ),
    cloup.option("--chips", metavar="A,B,...", help="Chips: ltc3588, bq25570."),
)
@cloup.option_group(
    "Computation",
    cloup.option(
        "--budget",
        metavar="TIME",
        help="Time limit, such as 60s: circuits that do not fit into it are left out.  Default: unlimited.",
    ),
    seed_option,
)
@cloup.option_group(
    "Output",
    cloup.option(
        "--out",
        help="Folder for design.toml (the scene with the chosen parts), design.csv, design.png and a report.",
    ),
    report_option,
    json_option,
)
def design(output: Output, circuits: str | None, chips: str | None, **options: Any) -> None:
    """Choose the circuit, inductor or chip, and capacitor that meet a power requirement, and estimate the yield."""
    from harvester.machine.bars import Bar
    from harvester.studies.design.decision import design as study

    options |= {"circuits": _names(circuits), "chips": _names(chips)}
    with Bar("design", shorter="" if options["budget"] else "--budget") as bar:
        answer = study(output.scene, execution=output.execution(bar), **options)
    files = ("design.toml", "design.csv", "design.png", "provenance.json")
    output.show(answer, files, lambda _: page_of(answer.scene, "design", answer))


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [part.strip() for part in text.split(",") if part.strip()]
