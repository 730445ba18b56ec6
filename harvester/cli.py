"""The command line: thin commands over the library; errors in one line, exit status 0, 2 or 3."""

import json
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from harvester.errors import HarvesterError, InputError, invalid, shown, unknown
from harvester.help import WIDTH, Group, coloured, complain, echo, option
from harvester.new.command import new
from harvester.quantity import fraction, seconds

if TYPE_CHECKING:
    from harvester.engines import Engine
    from harvester.progress import Bar, Rows
    from harvester.scene import Scene


def _percent(text: str) -> float:
    """1% or .01."""
    return _read("--within", fraction, text)


def _seconds(text: str) -> float:
    """30s, 2min, 1h or a number of seconds."""
    return _read("--budget", seconds, text)


def _read(argument: str, reader: Callable[[str], float], text: str) -> float:
    try:
        return reader(text)
    except ValueError as error:
        raise InputError(f"{argument} {error}, but is {shown(text)}") from None


ACCURACY, EFFORT, OUTPUT = "Accuracy", "Effort by hand (engines that sample)", "Output"
WHAT, GRID, RUNNERS = "What to compute", "Where", "Who computes"
SEED = click.IntRange(min=0)


def _sampling(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of the engines that sample."""
    for one in (
        option("--alone", is_flag=True, group=EFFORT, help="spice: ngspice runs only, not paired with a cheap model."),
        option(
            "--dt", type=float, group=EFFORT, help="Step, in s (nondimensional scene: 1/w0).  Default: from the scene."
        ),
        option("--duration", type=float, group=EFFORT, help="Of a trajectory after its burn-in, in the unit of --dt."),
        option("--trajectories", type=int, group=EFFORT, help="Independent ones.  Default: 4096 (spice: 16)."),
        option(
            "--seed", type=int, default=0, group=ACCURACY, show_default=True, help="The same seed, the same answer."
        ),
        option(
            "--budget",
            type=_seconds,
            metavar="TIME",
            group=ACCURACY,
            help="Time that reaching --within may take, such as 30s.  Default: what it takes.",
        ),
        option(
            "--within",
            type=_percent,
            metavar="PERCENT",
            group=ACCURACY,
            help="Error to reach in the mean power, such as 1%: sampling (95 %) plus bias.",
        ),
    ):
        command = one(command)
    return command


def _json(command: Callable[..., Any]) -> Callable[..., Any]:
    made: Callable[..., Any] = option("--json", "as_json", is_flag=True, group=OUTPUT, help="Print one JSON object.")(
        command
    )
    return made


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
_vector = option(
    "--vector",
    group=OUTPUT,
    type=_form,
    multiple=True,
    metavar="FORM",
    help="svg or pdf: the figure in that form too; repeatable.",
)
_report = option(
    "--report",
    group=OUTPUT,
    is_flag=False,
    flag_value=HERE,
    type=_page,
    metavar="[FILE.html]",
    help="Write a report, one HTML file with all in it.  Default: report.html in --out, or here.",
)


HELP = """How much power a vibro-impact piezoelectric harvester gives, at which load, and how sure that is.

A scene file says what the device is; engines compute it, from formulas in milliseconds to ngspice in lock-step with
the mass.

\b
A first session:
  harvester new mine.toml                                  your device, from questions; what its numbers mean
  harvester run mine.toml --within 1%                      its mean power, with the error
  harvester sweep mine.toml --vary load.resistance=1k:10M:25 --out sweep          against the load, with a plot
  harvester optimise mine.toml --over load.resistance=1k:10M                      the best load
  harvester compare mine.toml --report                     all engines side by side, and one page with all of it
"""


@click.group(
    cls=Group,
    help=HELP,
    sections={
        "Your device": ("new", "keys"),
        "Its power": ("run", "sweep", "optimise", "compare"),
        "A closer look": ("cost", "motion", "response", "stability"),
        "The paper, this machine": ("paper", "doctor"),
    },
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": WIDTH},
    epilog="""\b
Exit status: 0 done; 2 bad input, one line on stderr says what must be what; 3 a named simulation error;
130 interrupted.  Colours and progress are for terminals; NO_COLOR=1: no colours.
A scene file's keys, with units and examples: harvester keys.  A command's options: harvester COMMAND --help.""",
)
@click.version_option(package_name="harvester", prog_name="harvester")
def cli() -> None:
    """How much power a vibro-impact piezoelectric harvester gives, at which load, and how sure that is."""


cli.add_command(new)


@cli.command(examples=("harvester keys", "harvester keys excitation", "harvester keys load.resistance --json"))
@click.argument("what", required=False, metavar="[TABLE|KEY]", help="Such as load or load.resistance.  Default: all.")
@_json
def keys(what: str | None, as_json: bool) -> None:
    """All keys of a scene file: unit, example, meaning."""
    from harvester import keys as everything

    found = everything.chosen(what)
    if as_json:
        click.echo(json.dumps([vars(key) for key in found]))
        return
    click.echo(everything.text(found))


@cli.command(
    examples=(
        "harvester run mine.toml",
        "harvester run mine.toml --within 1%",
        "harvester run mine.toml --engine spice --within 1% --budget 30s --json",
    )
)
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option(
    "--engine",
    group=WHAT,
    help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice; with --within, "
    "the cheapest that is known to reach it.",
)
@_sampling
@_report
@_json
def run(scene: str, engine: str | None, report: str | None, as_json: bool, **options: Any) -> None:
    """Mean square voltage and mean power of one SCENE by one engine."""
    given = _load(scene)
    chosen = _engine(_default(given, options) if engine is None else engine, options)
    page = _report_file(report, None)
    with _bar(chosen.NAME) as bar:
        answer = chosen.run(given, bar.tell)
    _answer(answer, as_json)
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_run(given, answer, options["seed"]))
        _written(page, quiet=as_json)


@cli.command(
    examples=(
        "harvester sweep mine.toml --vary load.resistance=1k:10M:25 --out sweep",
        "harvester sweep mine.toml --vary stop.restitution=.8,.9 --vary load.resistance=1k:10M:9 --out grid",
    )
)
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option("--vary", "varied", group=GRID, multiple=True, help="KEY=FROM:TO:COUNT or KEY=A,B,C; repeatable: a grid.")
@option(
    "--points", group=GRID, metavar="FILE.csv", help="Instead of --vary: a list, scene keys first, then a point a line."
)
@option(
    "--engine",
    "engines",
    group=WHAT,
    multiple=True,
    help="Repeatable.  Default: all that serve SCENE; for a netlist, spice; with --within, see run.",
)
@_sampling
@option("--out", group=OUTPUT, required=True, help="Folder for sweep.csv, sweep.nc, sweep.png and provenance.json.")
@option("--resume", group=RUNNERS, is_flag=True, help="Keep the points that an earlier run of the same sweep finished.")
@option(
    "--workers", group=RUNNERS, type=int, metavar="N", help="Processes.  Default: one a core, if there are many points."
)
@option("--scheduler", group=RUNNERS, metavar="ADDRESS", help="Instead: a Dask scheduler, such as tcp://host:8786.")
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
    from harvester import tables
    from harvester.engines import serving
    from harvester.studies import sweep as sweeps

    if bool(varied) == (points is not None):
        found = "both are" if varied else "neither is"
        raise InputError(
            f"either --vary or --points must be given, but {found} (such as --vary load.resistance=1k:10M:25)"
        )
    if workers is not None and scheduler is not None:
        raise InputError("--workers must be left out where --scheduler is given, but both are given")
    given = _load(scene)
    where = sweeps.read_points(points) if points is not None else sweeps.grid([sweeps.axis(text) for text in varied])
    default = _default(given, options)
    names = engines or (serving(given) if default == "ensemble" else [default])
    chosen = [_engine(name, options) for name in names]
    page = _report_file(report, out)
    with _rows("sweep", {one.NAME: len(where) for one in chosen}) as bar:
        table = sweeps.sweep(given, where, chosen, out, resume, bar.row, workers, scheduler, bar.skip, vector)
    echo("\n".join([tables.grid(table.rows, given.physical), *tables.warnings(table.rows)]))
    click.echo(f"written: {Path(out) / 'sweep.csv'}, sweep.nc, {_drawn('sweep', vector)}, provenance.json")
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_sweep(given, table))
        _written(page)


@cli.command(
    examples=(
        "harvester optimise mine.toml --over load.resistance=1k:10M",
        "harvester optimise mine.toml --over load.resistance=1k:10M --over stop.restitution=.5:1 --out best",
    )
)
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option(
    "--over", "over", group=WHAT, multiple=True, required=True, help="KEY=LOW:HIGH, a range to search; up to 4 keys."
)
@option(
    "--engine",
    group=WHAT,
    help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice.",
)
@_sampling
@option("--out", group=OUTPUT, help="Folder for optimise.csv (all evaluations), optimise.png and provenance.json.")
@_vector
@_json
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
    from harvester.optimum.ranges import parse
    from harvester.studies import optimise as optimising

    _need_out(vector, out)
    given, ranges = _load(scene), [parse(text) for text in over]
    within, budget = options["within"] or 0.01, options["budget"] or 60.0
    name = _default(given, options | {"within": None}) if engine is None else engine
    chosen = _engine(name, options | {"within": None, "budget": None})
    with _bar("optimise", most=True) as bar:
        answer = optimising.optimise(given, ranges, chosen, within, budget, out, bar.tell, vector)
    _answer(answer, as_json)
    if out is not None and not as_json:
        click.echo(f"written: {Path(out) / 'optimise.csv'}, {_drawn('optimise', vector)}, provenance.json")


@cli.command(examples=("harvester compare mine.toml --within 1% --out compare",))
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@_sampling
@option("--out", group=OUTPUT, help="Folder for compare.png: the engines, and V of one path with and without the stop.")
@_vector
@_report
@_json
def compare(
    scene: str, out: str | None, vector: tuple[str, ...], report: str | None, as_json: bool, **options: Any
) -> None:
    """Every engine that can serve SCENE, side by side, with z-scores; one path of V drawn from three sources."""
    from harvester import files
    from harvester.studies import compare as comparing

    if as_json:
        _need_out(vector, out)
    given = _load(scene)
    folder = files.folder(out or ".") if out or not as_json else None
    page = _report_file(report, out)
    with _bar("compare") as bar:
        result = comparing.compare(given, tick=bar.tell, **options)
    if folder is not None:
        from harvester import figures

        figures.save(figures.comparison(result, given.title), folder, "compare", vector)
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_comparison(given, result, options["seed"]))
    if as_json:
        click.echo(json.dumps(result.as_json(), allow_nan=False))
        return
    echo(str(result))
    click.echo(f"written: {Path(out or '.')}/{_drawn('compare', vector)}")
    if page is not None:
        _written(page)


@cli.command(examples=("harvester cost mine.toml --budget 30s --out cost",))
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option("--out", group=OUTPUT, required=True, help="Folder for cost.csv, cost.png and provenance.json.")
@option("--seed", group=ACCURACY, type=SEED, default=0, show_default=True, help="The same seed, the same noise.")
@option(
    "--budget",
    group=ACCURACY,
    type=_seconds,
    metavar="TIME",
    default="60s",
    show_default=True,
    help="Time for all of it.",
)
@_vector
@_report
def cost(scene: str, out: str, seed: int, budget: float, vector: tuple[str, ...], report: str | None) -> None:
    """What accuracy costs: seconds and errors of every engine that can serve SCENE, at many settings."""
    from harvester import cost as costs
    from harvester.cost_table import report as table

    given = _load(scene)
    page = _report_file(report, out)
    with _bar("cost") as bar:
        answer = costs.cost(given, out, seed, budget, lambda what, spent: bar.tell(spent, what), vector)
    click.echo(table(answer))
    click.echo(f"written: {Path(out) / 'cost.csv'}, {_drawn('cost', vector)}, provenance.json")
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_cost(given, answer, seed, budget))
        _written(page)


@cli.command(examples=("harvester response mine.toml --sweep 1Hz:10Hz:61 --out response",))
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option("--sweep", group=WHAT, required=True, help="FROM:TO:COUNT, such as 1Hz:10Hz:60 (nondimensional scene: rad).")
@option("--out", group=OUTPUT, required=True, help="Folder for response.csv, response.png and provenance.json.")
@option("--seed", group=ACCURACY, type=SEED, default=0, show_default=True, help="The same seed, the same noise.")
@_vector
@_json
def response(scene: str, sweep: str, out: str, seed: int, vector: tuple[str, ...], as_json: bool) -> None:
    """Voltage and power of a harmonically driven SCENE against the frequency, swept up and down."""
    from harvester.studies import response as responses

    given = _load(scene)
    with _rows("response", {"": 2 * len(responses.frequencies(given, sweep))}) as bar:
        answer = responses.draw(given, sweep, out, seed, lambda: bar.row(""), vector)
    _answer(answer, as_json)
    if not as_json:
        click.echo(f"written: {Path(out) / 'response.csv'}, {_drawn('response', vector)}, provenance.json")


@cli.command(
    examples=(
        "harvester motion mine.toml --out motion",
        "harvester motion mine.toml --engine spice --duration 2 --out motion",
    )
)
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option(
    "--engine", group=WHAT, help="ensemble (exact update of a load resistor) or spice.  Default: for a netlist, spice."
)
@option("--duration", group=WHAT, type=float, help="Time that the plot shows: seconds (nondimensional scene: 1/w0).")
@option("--out", group=OUTPUT, required=True, help="Folder for motion.csv, motion.png and provenance.json.")
@option("--seed", group=ACCURACY, type=SEED, default=0, show_default=True, help="The same seed, the same noise.")
@_vector
def motion(
    scene: str, engine: str | None, duration: float | None, out: str, seed: int, vector: tuple[str, ...]
) -> None:
    """One path of SCENE from rest: displacement and voltage over time, phase plane, density."""
    from harvester.studies import motion as motions

    given = _load(scene)
    with _bar("motion", known=False):
        answer = motions.draw(given, out, engine or _default(given, {"within": None}), duration, seed, vector)
    echo(str(answer))
    click.echo(f"written: {Path(out) / 'motion.csv'}, {_drawn('motion', vector)}, provenance.json")


@cli.command(
    examples=(
        "harvester paper --out paper",
        "harvester paper 3 7 --out paper",
    )
)
@click.argument("figures", nargs=-1, help="1 to 9.  Default: all.")
@option("--out", group=OUTPUT, required=True, help="Folder for fig1.csv, fig1.png and so on.")
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
    with _bar("paper") as bar:
        drawn = papers.draw(numbers, out, bar.tell, vector)
    also = " and ".join(f".{form}" for form in ("csv", *dict.fromkeys(vector)))
    click.echo(f"written: {', '.join(str(Path(out) / f'fig{n}.png') for n in numbers)}, and the {also} of each")
    if page is not None:
        from harvester import report as reports

        reports.write(page, reports.of_paper(drawn))
        _written(page)


@cli.command(
    examples=(
        "harvester stability mine.toml",
        "harvester stability mine.toml --out stability",
    )
)
@click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
@option("--seed", group=ACCURACY, type=SEED, default=0, show_default=True, help="The same seed, the same answer.")
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
@_vector
@_json
def stability(
    scene: str, seed: int, trajectories: int, out: str | None, vector: tuple[str, ...], as_json: bool
) -> None:
    """Top Lyapunov exponent of SCENE at rest: published, averaged and by Monte Carlo."""
    from harvester.studies.stability import stability as examine

    _need_out(vector, out)
    given = _load(scene)
    with _bar("stability") as bar:
        answer = examine(given, seed, trajectories, tick=bar.tell)
    _answer(answer, as_json)
    if out is not None:
        from harvester import region

        with _rows("region", {"": len(region.LOADS)}) as bar:
            region.draw(given, out, seed, lambda: bar.row(""), vector)
        if not as_json:
            click.echo(f"written: {Path(out) / 'stability.csv'}, {_drawn('stability', vector)}")


@cli.command(examples=("harvester doctor",))
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


def _answer(answer: Any, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(answer.as_json(), allow_nan=False))
    else:
        echo(str(answer))


def _bar(what: str, known: bool = True, most: bool = False) -> "Bar":
    """A progress bar on a terminal, and none in a pipe."""
    from harvester.progress import Bar

    return Bar(what, known=known, most=most)


def _rows(what: str, rows: dict[str, int]) -> "Rows":
    """The same for rows of several engines."""
    from harvester.progress import Rows

    return Rows(what, rows)


def main() -> NoReturn:
    """Entry point: runs a command; any failure is one line on stderr and an exit status."""
    if not sys.warnoptions:  # what a library has to say about its own numbers is no line of ours
        warnings.simplefilter("ignore")
    sys.exit(_main())


def _main() -> int:
    try:
        cli.main(sys.argv[1:] or ["--help"], prog_name="harvester", standalone_mode=False, color=coloured())
        return 0
    except HarvesterError as error:
        return _say(str(error), error.exit_status)
    except click.ClickException as error:
        return _say(error.format_message() + _hint(error), 2)
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


_FILL = {"scene": "'harvester new FILE.toml' makes one", "file": "such as mine.toml", "out": "such as --out out"}
_FILL |= {"over": "such as --over load.resistance=1k:10M", "sweep": "such as --sweep 1Hz:10Hz:61"}


def _hint(error: click.ClickException) -> str:
    """What to type where click only says what is wrong."""
    if not isinstance(error, click.UsageError) or "Did you mean" in error.format_message():
        return ""
    if isinstance(error, click.MissingParameter) and error.param is not None and error.param.name in _FILL:
        return f" ({_FILL[error.param.name]})"
    return f" ({error.ctx.command_path if error.ctx else 'harvester'} --help)"


def _say(text: str, status: int) -> int:
    complain(text)
    return status
