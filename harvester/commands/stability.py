"""The command `harvester stability`."""

import click
import cloup

from harvester.commands.options import seed_option
from harvester.commands.study import Output, output_options, study_command


@study_command("harvester stability mine.toml", "harvester stability mine.toml --out stability")
@cloup.option_group(
    "Accuracy",
    seed_option,
    cloup.option(
        "--trajectories",
        type=click.IntRange(2, 1_000_000),
        default=4096,
        show_default=True,
        help="Trajectories.",
    ),
)
@output_options(
    "Folder for stability.csv and .png: the region of stability in the plane (mu, D22)."
)
def stability(output: Output, seed: int, trajectories: int) -> None:
    """Top Lyapunov exponent of SCENE at rest: published, averaged and by Monte Carlo."""
    from harvester.machine.bars import Bar
    from harvester.studies.stability import exponent

    scene = output.scene
    with Bar("stability", shorter="fewer --trajectories") as bar:
        execution = output.execution(bar)
        answer = exponent.stability(
            scene, seed=seed, trajectories=trajectories, execution=execution
        )
    output.show(
        answer,
        ("stability.csv", "stability.png"),
        lambda report: report.of_stability(scene, answer, seed),
    )
