"""The command line: thin commands over the library; errors in one line, exit status 0, 2 or 3."""

import json
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from harvester.errors import HarvesterError, InputError, invalid, shown, unknown

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


def _form(text: str) -> str:
    """A form of a figure."""
    from harvester import files

    files.check_vector([text])
    return text


def _page(text: str) -> str:
    """The name of a report, or ``HERE``: beside what else is written."""
    if text != HERE and not text.endswith(".html"):
        raise InputError(
            f"--report must be followed by a name that ends in .html, or by nothing, but is followed by {shown(text)}: "
            "put --report after SCENE or give it a name"
        )
    return text


HERE = "."
_vector = click.option(
    "--vector", type=_form, multiple=True, metavar="FORM", help="svg or pdf: the figure in that form too; repeatable."
)
_report = click.option(
    "--report",
    is_flag=False,
    flag_value=HERE,
    type=_page,
    metavar="[FILE.html]",
    help="Write a report, one HTML file with all in it.  Default: report.html in --out, or here.",
)


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
@_report
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def run(scene: str, engine: str | None, report: str | None, as_json: bool, **options: Any) -> None:
    """Mean square voltage and mean power of one SCENE by one engine."""
    given = _load(scene)
    chosen = _engine(_default(given, options) if engine is None else engine, options)
    page = _report_file(report, None)
    with _bar(1000, chosen.NAME) as bar:
        answer = chosen.run(given, lambda fraction: bar.update(int(1000 * fraction) - bar.n))
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_run(given, answer, options["seed"]))
        _written(page, quiet=as_json)


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
@_vector
@_report
def sweep(
    scene: str,
    varied: tuple[str, ...],
    points: str | None,
    engines: tuple[str, ...],
    out: str,
    resume: bool,
    workers: int | None,
    scheduler: str | None,
    vector: tuple[str, ...],
    report: str | None,
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
    page = _report_file(report, out)
    with _bar(len(chosen) * len(where), "sweep") as bar:

        def tick(engine: str) -> None:
            bar.set_postfix_str(engine, refresh=False)
            bar.update()

        table = sweeps.sweep(given, where, chosen, out, resume, tick, workers, scheduler, vector)
    click.echo(tables.grid(table.rows, given.physical))
    for line in tables.warnings(table.rows):
        click.echo(line)
    click.echo(f"written: {Path(out) / 'sweep.csv'}, sweep.nc, {_drawn('sweep', vector)}, provenance.json")
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_sweep(given, table))
        _written(page)


@cli.command()
@click.argument("scene")
@click.option("--over", "over", multiple=True, required=True, help="KEY=LOW:HIGH, a range to search; up to 4 keys.")
@click.option(
    "--engine", help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice."
)
@_sampling
@click.option("--out", help="Folder for optimise.csv (all evaluations), optimise.png and provenance.json.")
@_vector
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def optimise(
    scene: str,
    over: tuple[str, ...],
    engine: str | None,
    out: str | None,
    vector: tuple[str, ...],
    as_json: bool,
    **options: Any,
) -> None:
    """The largest mean power over one or several scene keys, and how well both are known.

    --within (default 1%) is the error of the power at the optimum, --budget (default 60s) the time for all of it.
    """
    from harvester import optimise as optimising
    from harvester.optimum.ranges import parse

    _need_out(vector, out)
    given, ranges = _load(scene), [parse(text) for text in over]
    within, budget = options["within"] or 0.01, options["budget"] or 60.0
    name = _default(given, options | {"within": None}) if engine is None else engine
    chosen = _engine(name, options | {"within": None, "budget": None})
    with _bar(1000, "optimise") as bar:
        answer = optimising.optimise(
            given, ranges, chosen, within, budget, out, lambda spent: bar.update(int(1000 * spent) - bar.n), vector
        )
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if out is not None and not as_json:
        click.echo(f"written: {Path(out) / 'optimise.csv'}, {_drawn('optimise', vector)}, provenance.json")


@cli.command()
@click.argument("scene")
@_sampling
@click.option("--out", help="Folder for compare.png: the engines, and V of one path with and without the stop.")
@_vector
@_report
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def compare(
    scene: str, out: str | None, vector: tuple[str, ...], report: str | None, as_json: bool, **options: Any
) -> None:
    """Every engine that can serve SCENE, side by side, with z-scores; one path of V drawn from three sources."""
    from harvester import compare as comparing
    from harvester import files

    if as_json:
        _need_out(vector, out)
    given = _load(scene)
    folder = files.folder(out or ".") if out or not as_json else None
    page = _report_file(report, out)
    result = comparing.compare(given, **options)
    if folder is not None:
        from harvester import figures

        figures.save(figures.comparison(result, given.title), folder, "compare", vector)
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_comparison(given, result, options["seed"]))
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
    click.echo(f"written: {Path(out or '.')}/{_drawn('compare', vector)}")
    if page is not None:
        _written(page)


@cli.command()
@click.argument("scene")
@click.option("--out", required=True, help="Folder for cost.csv, cost.png and provenance.json.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same noise.")
@click.option("--budget", type=_seconds, metavar="TIME", default="60s", show_default=True, help="Time for all of it.")
@_vector
@_report
def cost(scene: str, out: str, seed: int, budget: float, vector: tuple[str, ...], report: str | None) -> None:
    """What accuracy costs: seconds and errors of every engine that can serve SCENE, at many settings."""
    from harvester import cost as costs
    from harvester.cost_table import report as table

    given = _load(scene)
    page = _report_file(report, out)
    with _bar(1000, "cost") as bar:

        def tick(what: str, fraction: float) -> None:
            bar.set_postfix_str(what, refresh=False)
            bar.update(int(1000 * fraction) - bar.n)

        answer = costs.cost(given, out, seed, budget, tick, vector)
    click.echo(table(answer))
    click.echo(f"written: {Path(out) / 'cost.csv'}, {_drawn('cost', vector)}, provenance.json")
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_cost(given, answer, seed, budget))
        _written(page)


@cli.command()
@click.argument("scene")
@click.option("--sweep", required=True, help="FROM:TO:COUNT, such as 1Hz:10Hz:60 (nondimensional scene: rad).")
@click.option("--out", required=True, help="Folder for response.csv, response.png and provenance.json.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same noise.")
@_vector
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def response(scene: str, sweep: str, out: str, seed: int, vector: tuple[str, ...], as_json: bool) -> None:
    """Voltage and power of a harmonically driven SCENE against the frequency, swept up and down."""
    from harvester import response as responses

    given = _load(scene)
    with _bar(2 * len(responses.frequencies(given, sweep)), "response") as bar:
        answer = responses.draw(given, sweep, out, seed, bar.update, vector)
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if not as_json:
        click.echo(f"written: {Path(out) / 'response.csv'}, {_drawn('response', vector)}, provenance.json")


@cli.command()
@click.argument("scene")
@click.option("--engine", help="ensemble (exact update of a load resistor) or spice.  Default: for a netlist, spice.")
@click.option("--duration", type=float, help="Time that the plot shows: seconds (nondimensional scene: 1/w0).")
@click.option("--out", required=True, help="Folder for motion.csv, motion.png and provenance.json.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same noise.")
@_vector
def motion(
    scene: str, engine: str | None, duration: float | None, out: str, seed: int, vector: tuple[str, ...]
) -> None:
    """One path of SCENE from rest: displacement and voltage over time, phase plane, density."""
    from harvester import motion as motions

    given = _load(scene)
    answer = motions.draw(given, out, engine or _default(given, {"within": None}), duration, seed, vector)
    click.echo(str(answer))
    click.echo(f"written: {Path(out) / 'motion.csv'}, {_drawn('motion', vector)}, provenance.json")


@cli.command()
@click.argument("figures", nargs=-1)
@click.option("--out", required=True, help="Folder for fig1.csv, fig1.png and so on.")
@_vector
@_report
def paper(figures: tuple[str, ...], out: str, vector: tuple[str, ...], report: str | None) -> None:
    """The paper's FIGURES 1 to 9 (default: all): published theory, ours and Monte Carlo, data and plots."""
    from harvester import paper as papers

    numbers = list(figures or papers.TITLES)
    for number in numbers:
        if number not in papers.TITLES:
            raise unknown("figure", number, papers.TITLES)
    page = _report_file(report, out)
    with _bar(len(numbers), "paper") as bar:
        drawn = papers.draw(numbers, out, lambda _: bar.update(), vector)
    also = " and ".join(f".{form}" for form in ("csv", *dict.fromkeys(vector)))
    click.echo(f"written: {', '.join(str(Path(out) / f'fig{n}.png') for n in numbers)}, and the {also} of each")
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_paper(drawn))
        _written(page)


@cli.command()
@click.argument("scene")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The same seed, the same answer."
)
@click.option("--trajectories", type=click.IntRange(2, 1_000_000), default=4096, show_default=True)
@click.option("--out", help="Folder for stability.csv and .png: the region of stability in the plane (mu, D22).")
@_vector
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def stability(
    scene: str, seed: int, trajectories: int, out: str | None, vector: tuple[str, ...], as_json: bool
) -> None:
    """Top Lyapunov exponent of SCENE at rest: published, averaged and by Monte Carlo."""
    from harvester.stability import stability as examine

    _need_out(vector, out)
    given = _load(scene)
    answer = examine(given, seed, trajectories)
    click.echo(json.dumps(answer.as_json(), allow_nan=False) if as_json else str(answer))
    if out is not None:
        from harvester import region

        with _bar(len(region.LOADS), "region") as bar:
            region.draw(given, out, seed, bar.update, vector)
        if not as_json:
            click.echo(f"written: {Path(out) / 'stability.csv'}, {_drawn('stability', vector)}")


@cli.command()
def doctor() -> None:
    """What is installed, what is missing, and how to get it."""
    from harvester.doctor import examine

    for line in examine():
        click.echo(line)


def _drawn(name: str, vector: tuple[str, ...]) -> str:
    """The files of a figure."""
    return ", ".join(f"{name}.{form}" for form in ("png", *dict.fromkeys(vector)))


def _need_out(vector: tuple[str, ...], out: str | None) -> None:
    """An option that would be ignored is refused."""
    if vector and out is None:
        raise InputError("--vector must go with --out, where the figure is written, but --out is left out")


def _report_file(report: str | None, out: str | None) -> Path | None:
    """Where the report goes, checked before anything is computed."""
    if report is None:
        return None
    from harvester import files

    path = Path("." if out is None else out) / "report.html" if report == HERE else Path(report)
    files.folder(path.parent, "--out" if report == HERE and out is not None else "--report")
    if path.is_dir():
        raise invalid("--report", "be a file", str(path))
    return path


def _written(page: Path, quiet: bool = False) -> None:
    if not quiet:
        click.echo(f"report: {page}")


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
