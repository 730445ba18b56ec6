"""The command `harvester run`."""

from typing import Any

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo_answer
from harvester.commands.options import json_option, sampling, scene_argument
from harvester.commands.reports import report_file, report_option, save_report


@command(
    "harvester run mine.toml",
    "harvester run mine.toml --within 1%",
    "harvester run mine.toml --engine spice --within 1% --budget 30s --json",
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--engine",
        help="exact, published, averaged, ensemble, ideal or spice.  Default: exact for a linear scene, else ensemble; "
        "for a netlist, spice; with --within, the cheapest that is known to reach it.",
    ),
)
@sampling
@cloup.option_group("Output", report_option, json_option)
def run(path: str, engine: str | None, report: str | None, as_json: bool, **options: Any) -> None:
    """Mean square voltage and mean power of one SCENE by one engine."""
    from harvester.commands.progress import Bar
    from harvester.engines import selection
    from harvester.scene.toml import load

    scene = load(path)
    if engine is None:
        engine = selection.default_engine(scene, **options)
    chosen = selection.engine(engine, **options)
    file = report_file(report, None)
    with Bar(chosen.NAME) as bar:
        answer = chosen.run(scene, bar.tell)
    echo_answer(answer, as_json)
    save_report(file, lambda report: report.of_run(scene, answer, options["seed"]), quiet=as_json)
