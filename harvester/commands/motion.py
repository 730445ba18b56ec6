"""The command `harvester motion`."""

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_written
from harvester.commands.options import figure, scene_argument, seed_option, time_of, vector_option


@command(
    "harvester motion mine.toml --out motion", "harvester motion mine.toml --engine spice --duration 2 --out motion"
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--engine", help="ensemble (exact update of a load resistor) or spice.  Default: for a netlist, spice."
    ),
    cloup.option(
        "--duration",
        type=time_of("duration"),
        metavar="TIME",
        help="Time that the plot shows, such as 2s (nondimensional scene: a number of 1/w0).",
    ),
)
@cloup.option_group(
    "Output",
    cloup.option("--out", required=True, help="Folder for motion.csv, motion.png and provenance.json."),
    vector_option,
)
@cloup.option_group("Accuracy", seed_option)
def motion(path: str, engine: str | None, duration: float | None, out: str, seed: int, vector: tuple[str, ...]) -> None:
    """One path of SCENE from rest: displacement and voltage over time, phase plane, density."""
    from harvester.commands.progress import Bar
    from harvester.engines.selection import default_sampler
    from harvester.scene.toml import load
    from harvester.studies import motion as study

    scene = load(path)
    with Bar("motion", known=False):
        answer = study.draw(scene, out, default_sampler(scene) if engine is None else engine, duration, seed, vector)
    echo(str(answer))
    echo_written(out, "motion.csv", *figure("motion", vector), "provenance.json")
