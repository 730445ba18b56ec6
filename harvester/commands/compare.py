"""The command `harvester compare`."""

from typing import Any

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, sampling, scene_argument, vector_needs_out, vector_option
from harvester.commands.reports import report_file, report_option, save_report


@command("harvester compare mine.toml --within 1% --out compare")
@scene_argument
@sampling
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for compare.png: the engines, and V of one path with and without the stop."),
    vector_option,
    report_option,
    json_option,
)
@vector_needs_out("as_json")
def compare(
    path: str, out: str | None, vector: tuple[str, ...], report: str | None, as_json: bool, **options: Any
) -> None:
    """Every engine that can serve SCENE, side by side, with z-scores; one path of V drawn from three sources."""
    from harvester.commands.progress import EFFORT, Bar
    from harvester.machine import files
    from harvester.scene.toml import load
    from harvester.studies import compare as study

    scene = load(path)
    folder = files.folder(out or ".") if out or not as_json else None
    file = report_file(report, out)
    with Bar("compare", shorter=EFFORT) as bar:
        result = study.compare(scene, tick=bar.tell, **options)
    if folder is not None:
        from harvester import figures

        figures.save(result.plot(scene.title), folder, "compare", vector)
    echo_answer(result, as_json)
    if not as_json:
        echo_written(out or ".", *figure("compare", vector))
    save_report(file, lambda report: report.of_comparison(scene, result, options["seed"]), quiet=as_json, scene=path)
