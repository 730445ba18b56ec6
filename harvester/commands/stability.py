"""The command `harvester stability`."""

import click
import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo_answer, echo_written
from harvester.commands.options import figure, json_option, scene_argument, seed_option, vector_needs_out, vector_option
from harvester.commands.reports import report_file, report_option, save_report


@command("harvester stability mine.toml", "harvester stability mine.toml --out stability")
@scene_argument
@cloup.option_group(
    "Accuracy",
    seed_option,
    cloup.option(
        "--trajectories", type=click.IntRange(2, 1_000_000), default=4096, show_default=True, help="Number of paths."
    ),
)
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for stability.csv and .png: the region of stability in the plane (mu, D22)."),
    vector_option,
    report_option,
    json_option,
)
@vector_needs_out()
def stability(
    path: str, seed: int, trajectories: int, out: str | None, vector: tuple[str, ...], report: str | None, as_json: bool
) -> None:
    """Top Lyapunov exponent of SCENE at rest: published, averaged and by Monte Carlo."""
    from harvester.commands.progress import Bar
    from harvester.machine.execution import Execution
    from harvester.scene.toml import load
    from harvester.studies.stability import exponent

    scene, file = load(path), report_file(report, out)
    with Bar("stability", shorter="fewer --trajectories") as bar:
        execution = Execution(out=out, formats=vector, progress=bar)
        answer = exponent.stability(scene, seed=seed, trajectories=trajectories, execution=execution)
    echo_answer(answer, as_json)
    if out is not None and not as_json:
        echo_written(out, "stability.csv", *figure("stability", vector))
    save_report(file, lambda report: report.of_stability(scene, answer, seed), quiet=as_json, scene=path)
