"""The command `harvester cost`."""

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import (
    duration,
    figure,
    json_option,
    scene_argument,
    seed_option,
    vector_needs_out,
    vector_option,
)
from harvester.commands.reports import report_file, report_option, save_report


@command("harvester cost mine.toml --budget 30s --out cost")
@scene_argument
@cloup.option_group(
    "Accuracy",
    seed_option,
    cloup.option(
        "--budget", type=duration, metavar="TIME", default="60s", show_default=True, help="Time for all of it."
    ),
)
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for cost.csv, cost.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@vector_needs_out()
def cost(
    path: str, out: str | None, seed: int, budget: float, vector: tuple[str, ...], report: str | None, as_json: bool
) -> None:
    """What accuracy costs: seconds and errors of every engine that can serve SCENE, at many settings."""
    from harvester.commands.progress import Bar
    from harvester.machine.execution import Execution
    from harvester.scene.toml import load
    from harvester.studies.work_precision import cost as study

    scene = load(path)
    file = report_file(report, out)
    with Bar("cost", shorter="a shorter --budget", budget=budget) as bar:
        bar.announce(budget)
        answer = study.cost(scene, seed=seed, budget=budget, execution=Execution(out=out, formats=vector, progress=bar))
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, "cost.csv", *figure("cost", vector), "provenance.json")
    save_report(file, lambda report: report.of_cost(scene, answer, seed, budget), quiet=as_json, scene=path)
