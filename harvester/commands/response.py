"""The command `harvester response`."""

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, scene_argument, seed_option, vector_option
from harvester.commands.reports import report_file, report_option, save_report


@command("harvester response mine.toml --sweep 1Hz:10Hz:61 --out response")
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option("--sweep", required=True, help="FROM:TO:COUNT, such as 1Hz:10Hz:60 (nondimensional scene: rad)."),
)
@cloup.option_group(
    "Output",
    cloup.option("--out", required=True, help="Folder for response.csv, response.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@cloup.option_group("Accuracy", seed_option)
def response(
    path: str, sweep: str, out: str, seed: int, vector: tuple[str, ...], report: str | None, as_json: bool
) -> None:
    """Voltage and power of a harmonically driven SCENE against the frequency, swept up and down."""
    from harvester.commands.progress import RowsBar
    from harvester.equations.problem import Problem
    from harvester.scene.toml import load
    from harvester.studies.frequency_response import response as study

    scene, file = load(path), report_file(report, out)
    with RowsBar("response", {"": 2 * len(study.frequencies(Problem(scene), sweep))}) as bar:
        answer = study.draw(scene, sweep, out, seed, lambda: bar.row(""), vector)
    echo_answer(answer, as_json)
    if not as_json:
        echo_written(out, "response.csv", *figure("response", vector), "provenance.json")
    save_report(file, lambda report: report.of_response(scene, answer, seed), quiet=as_json, scene=path)
