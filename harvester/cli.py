"""The command line: thin commands over the library; errors in one line, exit status 0, 2 or 3."""

import json
import os
import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from harvester.errors import HarvesterError, InputError, invalid, unknown

if TYPE_CHECKING:
    from harvester.engines import Engine
    from harvester.scene import Scene


def _percent(text: str) -> float:
    """1% or .01."""
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)(e-?\d{1,2})?\s*(%?)\s*", text)
    fraction = float(match[1] + (match[2] or "")) * (0.01 if match[3] else 1.0) if match else 0.0
    if not 0.0 < fraction < 1.0:
        raise invalid("--within", "be a percentage between 0% and 100%, such as 1%", text)
    return fraction


def _seconds(text: str) -> float:
    """30s, 2min, 1h or a number of seconds."""
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|min|h)?\s*", text)
    if match is None or float(match[1]) == 0.0:
        raise invalid("--budget", "be a time above 0, such as 30s or 2min", text)
    return float(match[1]) * {"s": 1.0, "min": 60.0, "h": 3600.0}[match[2] or "s"]


def _sampling(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of the engines that sample."""
    for option in (
        click.option("--dt", type=float, help="Step: seconds (nondimensional scene: 1/w0).  Default: from the scene."),
        click.option("--alone", is_flag=True, help="spice: ngspice runs only, not paired with a cheap model."),
        click.option("--trajectories", type=int, help="Independent trajectories.  Default: 4096 (spice: 16)."),
        click.option("--duration", type=float, help="Time of a trajectory after its burn-in, in the unit of --dt."),
        click.option("--seed", type=int, default=0, show_default=True, help="The same seed, the same answer."),
        click.option(
            "--budget", type=_seconds, metavar="TIME", help="Time that reaching --within may take, such as 30s."
        ),
        click.option(
            "--within",
            type=_percent,
            metavar="PERCENT",
            help="Error to reach in the mean power, such as 1%: sampling (95 %) plus bias.",
        ),
    ):
        command = option(command)
    return command


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="harvester", prog_name="harvester")
def cli() -> None:
    r"""How much power a vibro-impact piezoelectric harvester gives, at which load, and how sure that is.

    SCENE is a TOML file: examples/plate_with_stop.toml is one.

    \b
      harvester run examples/plate_with_stop.toml --engine ensemble
      harvester sweep examples/plate.toml --vary load.resistance=1k:10M:13 --out sweep
    """


@cli.command()
@click.argument("scene")
@click.option(
    "--engine",
    help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice; with --within, "
    "the cheapest that is known to reach it.",
)
@_sampling
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def run(scene: str, engine: str | None, as_json: bool, **options: Any) -> None:
    """Mean square voltage and mean power of one SCENE by one engine."""
    given = _load(scene)
    chosen = _engine(_default(given, options) if engine is None else engine, options)
    with _bar(1000, chosen.NAME) as bar:
        answer = chosen.run(given, lambda fraction: bar.update(int(1000 * fraction) - bar.n))
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))


@cli.command()
@click.argument("scene")
@click.option("--vary", "varied", multiple=True, help="KEY=FROM:TO:COUNT or KEY=A,B,C; repeatable: a grid.")
@click.option("--points", metavar="FILE.csv", help="Instead of --vary: a list, scene keys first, then a point a line.")
@click.option(
    "--engine",
    "engines",
    multiple=True,
    help="Repeatable.  Default: all that serve SCENE; for a netlist, spice; with --within, see run.",
)
@_sampling
@click.option("--out", required=True, help="Folder for sweep.csv, sweep.nc, sweep.png and provenance.json.")
@click.option("--resume", is_flag=True, help="Keep the points that an earlier run of the same sweep finished.")
@click.option("--workers", type=int, metavar="N", help="Processes.  Default: one a core, if there are many points.")
@click.option("--scheduler", metavar="ADDRESS", help="Instead: a Dask scheduler, such as tcp://host:8786.")
def sweep(
    scene: str,
    varied: tuple[str, ...],
    points: str | None,
    engines: tuple[str, ...],
    out: str,
    resume: bool,
    workers: int | None,
    scheduler: str | None,
    **options: Any,
) -> None:
    """Mean power over a range of one or several scene keys, by one or several engines."""
    from harvester import sweep as sweeps
    from harvester import tables
    from harvester.engines import serving

    if bool(varied) == (points is not None):
        found = "both are" if varied else "neither is"
        raise InputError(f"either --vary or --points must be given, but {found}")
    if workers is not None and scheduler is not None:
        raise InputError("--workers must be left out where --scheduler is given, but both are given")
    given = _load(scene)
    where = sweeps.read_points(points) if points is not None else sweeps.grid([sweeps.axis(text) for text in varied])
    default = _default(given, options)
    names = engines or (serving(given) if default == "ensemble" else [default])
    chosen = [_engine(name, options) for name in names]
    with _bar(len(chosen) * len(where), "sweep") as bar:

        def tick(engine: str) -> None:
            bar.set_postfix_str(engine, refresh=False)
            bar.update()

        table = sweeps.sweep(given, where, chosen, out, resume, tick, workers, scheduler)
    click.echo(tables.grid(table.rows, given.physical))
    for line in tables.warnings(table.rows):
        click.echo(line)
    click.echo(f"written: {Path(out) / 'sweep.csv'}, sweep.nc, sweep.png, provenance.json")


@cli.command()
@click.argument("scene")
@click.option("--over", "over", multiple=True, required=True, help="KEY=LOW:HIGH, a range to search; up to 4 keys.")
@click.option(
    "--engine", help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice."
)
@_sampling
@click.option("--out", help="Folder for optimise.csv (all evaluations), optimise.png and provenance.json.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def optimise(
    scene: str, over: tuple[str, ...], engine: str | None, out: str | None, as_json: bool, **options: Any
) -> None:
    """The largest mean power over one or several scene keys, and how well both are known.

    --within (default 1%) is the error of the power at the optimum, --budget (default 60s) the time for all of it.
    """
    from harvester import optimise as optimising
    from harvester.optimum.ranges import parse

    given, ranges = _load(scene), [parse(text) for text in over]
    within, budget = options["within"] or 0.01, options["budget"] or 60.0
    name = _default(given, options | {"within": None}) if engine is None else engine
    chosen = _engine(name, options | {"within": None, "budget": None})
    with _bar(1000, "optimise") as bar:
        answer = optimising.optimise(
            given, ranges, chosen, within, budget, out, lambda spent: bar.update(int(1000 * spent) - bar.n)
        )
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if out is not None and not as_json:
        click.echo(f"written: {Path(out) / 'optimise.csv'}, optimise.png, provenance.json")


@cli.command()
@click.argument("scene")
@_sampling
@click.option("--out", help="Folder for compare.png: the engines, and V of one path with and without the stop.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def compare(scene: str, out: str | None, as_json: bool, **options: Any) -> None:
    """Every engine that can serve SCENE, side by side, with z-scores; one path of V drawn from three sources."""
    from harvester import compare as comparing
    from harvester import files

    given = _load(scene)
    folder = files.folder(out or ".") if out or not as_json else None
    result = comparing.compare(given, **options)
    if folder is not None:
        from harvester import figures

        files.write(folder / "compare.png", figures.comparison(result, given.title))
    if as_json:
        click.echo(json.dumps(result.as_json(), allow_nan=False))
        return
    for estimate in result.estimates:
        click.echo(str(estimate))
    click.echo(f"against {result.reference.engine}:")
    for estimate in result.estimates:
        if estimate is not result.reference:
            ratio, z = result.ratio(estimate), result.z(estimate)
            told = "" if ratio is None else f"power times {ratio:.4g}"
            click.echo(f"  {estimate.engine:<10} {told}" + ("" if z is None else f", z = {z:.2f}"))
    for path in result.paths:
        click.echo(
            f"one path {path.title}: relative RMS error of V, ngspice against exact {path.spice_error:.1e}, "
            f"decoupled against ngspice {path.decoupled_error:.2g}"
        )
    for name, why in result.refused.items():
        click.echo(f"{name} did not run: {why}")
    click.echo(f"written: {Path(out or '.') / 'compare.png'}")


@cli.command()
@click.argument("scene")
@click.option("--out", required=True, help="Folder for cost.csv, cost.png and provenance.json.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same noise.")
@click.option("--budget", type=_seconds, metavar="TIME", default="60s", show_default=True, help="Time for all of it.")
def cost(scene: str, out: str, seed: int, budget: float) -> None:
    """What accuracy costs: seconds and errors of every engine that can serve SCENE, at many settings."""
    from harvester import cost as costs
    from harvester.cost_table import report

    given = _load(scene)
    with _bar(1000, "cost") as bar:

        def tick(what: str, fraction: float) -> None:
            bar.set_postfix_str(what, refresh=False)
            bar.update(int(1000 * fraction) - bar.n)

        answer = costs.cost(given, out, seed, budget, tick)
    click.echo(report(answer))
    click.echo(f"written: {Path(out) / 'cost.csv'}, cost.png, provenance.json")


@cli.command()
@click.argument("scene")
@click.option("--sweep", required=True, help="FROM:TO:COUNT, such as 1Hz:10Hz:60 (nondimensional scene: rad).")
@click.option("--out", required=True, help="Folder for response.csv, response.png and provenance.json.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same noise.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def response(scene: str, sweep: str, out: str, seed: int, as_json: bool) -> None:
    """Voltage and power of a harmonically driven SCENE against the frequency, swept up and down."""
    from harvester import response as responses

    given = _load(scene)
    with _bar(2 * len(responses.frequencies(given, sweep)), "response") as bar:
        answer = responses.draw(given, sweep, out, seed, bar.update)
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if not as_json:
        click.echo(f"written: {Path(out) / 'response.csv'}, response.png, provenance.json")


@cli.command()
@click.argument("scene")
@click.option("--engine", help="ensemble (exact update of a load resistor) or spice.  Default: for a netlist, spice.")
@click.option("--duration", type=float, help="Time that the plot shows: seconds (nondimensional scene: 1/w0).")
@click.option("--out", required=True, help="Folder for motion.csv, motion.png and provenance.json.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same noise.")
def motion(scene: str, engine: str | None, duration: float | None, out: str, seed: int) -> None:
    """One path of SCENE from rest: displacement and voltage over time, phase plane, density."""
    from harvester import motion as motions

    given = _load(scene)
    answer = motions.draw(given, out, engine or _default(given, {"within": None}), duration, seed)
    click.echo(str(answer))
    click.echo(f"written: {Path(out) / 'motion.csv'}, motion.png, provenance.json")


@cli.command()
@click.argument("figures", nargs=-1)
@click.option("--out", required=True, help="Folder for fig1.csv, fig1.png and so on.")
def paper(figures: tuple[str, ...], out: str) -> None:
    """The paper's FIGURES 1 to 9 (default: all): published theory, ours and Monte Carlo, data and plots."""
    from harvester import paper as papers

    numbers = list(figures or papers.TITLES)
    for number in numbers:
        if number not in papers.TITLES:
            raise unknown("figure", number, papers.TITLES)
    with _bar(len(numbers), "paper") as bar:
        papers.draw(numbers, out, lambda _: bar.update())
    click.echo(f"written: {', '.join(str(Path(out) / f'fig{n}.png') for n in numbers)}, and the .csv of each")


@cli.command()
@click.argument("scene")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same answer."
)
@click.option("--trajectories", type=click.IntRange(2, 1_000_000), default=4096, show_default=True)
@click.option("--out", help="Folder for stability.csv and .png: the region of stability in the plane (mu, D22).")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def stability(scene: str, seed: int, trajectories: int, out: str | None, as_json: bool) -> None:
    """Top Lyapunov exponent of SCENE at rest: published, averaged and by Monte Carlo."""
    from harvester.stability import stability as examine

    given = _load(scene)
    answer = examine(given, seed, trajectories)
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if out is not None:
        from harvester import region

        with _bar(len(region.LOADS), "region") as bar:
            region.draw(given, out, seed, bar.update)
        if not as_json:
            click.echo(f"written: {Path(out) / 'stability.csv'}, stability.png")


@cli.command()
def doctor() -> None:
    """What is installed, what is missing, and how to get it."""
    from harvester.doctor import examine

    for line in examine():
        click.echo(line)


def _load(path: str) -> "Scene":
    from harvester.scene import load

    return load(path)


def _default(scene: "Scene", options: dict[str, Any]) -> str:
    """The engine where none is given."""
    if options["within"] is not None:
        return "cheapest"
    return "ensemble" if scene.load is None or scene.load.netlist is None else "spice"


def _engine(name: str, options: dict[str, Any]) -> "Engine":
    from harvester.engines import engine

    return engine(name, **options)


def _bar(total: int, what: str) -> Any:
    """A progress bar on a terminal, and none in a pipe."""
    from tqdm import tqdm

    return tqdm(
        total=total, desc=what, disable=None, leave=False, bar_format="{l_bar}{bar}| {elapsed}<{remaining}{postfix}"
    )


def main() -> NoReturn:
    """Entry point: runs a command; any failure is one line on stderr and an exit status."""
    if not sys.warnoptions:  # what a library has to say about its own numbers is no line of ours
        warnings.simplefilter("ignore")
    sys.exit(_main())


def _main() -> int:
    try:
        cli.main(sys.argv[1:] or ["--help"], prog_name="harvester", standalone_mode=False)
        return 0
    except HarvesterError as error:
        return _say(str(error), error.exit_status)
    except click.ClickException as error:
        return _say(error.format_message(), 2)
    except (KeyboardInterrupt, click.Abort) as error:  # click's own hides the other behind it
        return _say(str(error.__cause__ or error) or "interrupted", 130)
    except SystemExit:  # click's way out when the reader of a pipe has gone
        return 0
    except OSError as error:  # such as a full disk behind stdout
        return _say(f"the system refused: {error}", 3)
    except Exception as error:  # a defect of ours: still one line, with a way to see more
        if os.environ.get("HARVESTER_TRACEBACK"):
            raise
        return _say(
            f"internal error, please report it: {type(error).__name__}: {error} (HARVESTER_TRACEBACK=1 shows where)", 3
        )


def _say(text: str, status: int) -> int:
    click.echo("harvester: " + " ".join(text.split()), err=True)
    return status
