"""The commands that look closer: cost, response, motion, stability."""

from pathlib import Path

import click

from harvester.commands.help import command, echo, option
from harvester.commands.options import (
    ACCURACY,
    OUTPUT,
    WHAT,
    as_json_option,
    duration,
    report_option,
    scene_argument,
    seed_option,
    vector_option,
)
from harvester.commands.shared import (
    drawn,
    loaded,
    need_out,
    print_answer,
    progress,
    progress_of_rows,
    report_file,
    save_report,
)


@command("harvester cost mine.toml --budget 30s --out cost")
@scene_argument
@option("--out", group=OUTPUT, required=True, help="Folder for cost.csv, cost.png and provenance.json.")
@seed_option
@option(
    "--budget",
    group=ACCURACY,
    type=duration,
    metavar="TIME",
    default="60s",
    show_default=True,
    help="Time for all of it.",
)
@vector_option
@report_option
def cost(scene: str, out: str, seed: int, budget: float, vector: tuple[str, ...], report: str | None) -> None:
    """What accuracy costs: seconds and errors of every engine that can serve SCENE, at many settings."""
    from harvester.studies.work_precision import cost as costs
    from harvester.studies.work_precision.cost_table import report as table

    given = loaded(scene)
    page = report_file(report, out)
    with progress("cost") as bar:
        answer = costs.cost(given, out, seed, budget, lambda what, spent: bar.tell(spent, what), vector)
    click.echo(table(answer))
    click.echo(f"written: {Path(out) / 'cost.csv'}, {drawn('cost', vector)}, provenance.json")
    save_report(page, lambda report: report.of_cost(given, answer, seed, budget))


@command("harvester response mine.toml --sweep 1Hz:10Hz:61 --out response")
@scene_argument
@option("--sweep", group=WHAT, required=True, help="FROM:TO:COUNT, such as 1Hz:10Hz:60 (nondimensional scene: rad).")
@option("--out", group=OUTPUT, required=True, help="Folder for response.csv, response.png and provenance.json.")
@seed_option
@vector_option
@as_json_option
def response(scene: str, sweep: str, out: str, seed: int, vector: tuple[str, ...], as_json: bool) -> None:
    """Voltage and power of a harmonically driven SCENE against the frequency, swept up and down."""
    from harvester.equations.problem import Problem
    from harvester.studies.frequency_response import response as responses

    given = loaded(scene)
    with progress_of_rows("response", {"": 2 * len(responses.frequencies(Problem(given), sweep))}) as bar:
        answer = responses.draw(given, sweep, out, seed, lambda: bar.row(""), vector)
    print_answer(answer, as_json)
    if not as_json:
        click.echo(f"written: {Path(out) / 'response.csv'}, {drawn('response', vector)}, provenance.json")


@command(
    "harvester motion mine.toml --out motion", "harvester motion mine.toml --engine spice --duration 2 --out motion"
)
@scene_argument
@option(
    "--engine", group=WHAT, help="ensemble (exact update of a load resistor) or spice.  Default: for a netlist, spice."
)
@option("--duration", group=WHAT, type=float, help="Time that the plot shows: seconds (nondimensional scene: 1/w0).")
@option("--out", group=OUTPUT, required=True, help="Folder for motion.csv, motion.png and provenance.json.")
@seed_option
@vector_option
def motion(
    scene: str, engine: str | None, duration: float | None, out: str, seed: int, vector: tuple[str, ...]
) -> None:
    """One path of SCENE from rest: displacement and voltage over time, phase plane, density."""
    from harvester.engines.selection import default_engine
    from harvester.studies import motion as motions

    given = loaded(scene)
    with progress("motion", known=False):
        answer = motions.draw(given, out, default_engine(given) if engine is None else engine, duration, seed, vector)
    echo(str(answer))
    click.echo(f"written: {Path(out) / 'motion.csv'}, {drawn('motion', vector)}, provenance.json")


@command("harvester stability mine.toml", "harvester stability mine.toml --out stability")
@scene_argument
@seed_option
@option(
    "--trajectories",
    group=ACCURACY,
    type=click.IntRange(2, 1_000_000),
    default=4096,
    show_default=True,
    help="Independent ones.",
)
@option(
    "--out", group=OUTPUT, help="Folder for stability.csv and .png: the region of stability in the plane (mu, D22)."
)
@vector_option
@as_json_option
def stability(
    scene: str, seed: int, trajectories: int, out: str | None, vector: tuple[str, ...], as_json: bool
) -> None:
    """Top Lyapunov exponent of SCENE at rest: published, averaged and by Monte Carlo."""
    from harvester.studies.stability.exponent import stability as examine

    need_out(vector, out)
    given = loaded(scene)
    with progress("stability") as bar:
        answer = examine(given, seed, trajectories, tick=bar.tell)
    print_answer(answer, as_json)
    if out is not None:
        from harvester.studies.stability import region

        with progress_of_rows("region", {"": len(region.LOADS)}) as bar:
            region.draw(given, out, seed, lambda: bar.row(""), vector)
        if not as_json:
            click.echo(f"written: {Path(out) / 'stability.csv'}, {drawn('stability', vector)}")
