"""The command `harvester cost`."""

import cloup

from harvester.commands.options import duration, seed_option
from harvester.commands.study import Output, output_options, study_command


@study_command("harvester cost mine.toml --budget 30s --out cost")
@cloup.option_group(
    "Accuracy",
    seed_option,
    cloup.option(
        "--budget",
        type=duration,
        metavar="TIME",
        default="60s",
        show_default=True,
        help="Total time.",
    ),
)
@output_options("Folder for cost.csv, cost.png and provenance.json.")
def cost(output: Output, seed: int, budget: float) -> None:
    """The cost of accuracy: seconds and errors of every engine that supports SCENE, at many settings."""
    from harvester.machine.bars import Bar
    from harvester.studies.work_precision import cost as study

    scene = output.scene
    with Bar("cost", shorter="a shorter --budget", budget=budget) as bar:
        bar.announce(budget)
        answer = study.cost(scene, seed=seed, budget=budget, execution=output.execution(bar))
    files = ("cost.csv", "cost.png", "provenance.json")
    output.show(answer, files, lambda report: report.of_cost(scene, answer, seed, budget))
