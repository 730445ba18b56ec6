"""The commands that tell the power: run, sweep, optimise, compare."""

from pathlib import Path
from typing import Any

import click

from harvester.commands.help import command, echo, option
from harvester.commands.options import (
    GRID,
    OUTPUT,
    RUNNERS,
    WHAT,
    as_json_option,
    report_option,
    sampling,
    scene_argument,
    vector_option,
)
from harvester.commands.shared import (
    drawn,
    given_options,
    loaded,
    need_out,
    print_answer,
    progress,
    progress_of_rows,
    report_file,
    save_report,
)
from harvester.errors import InputError


@command(
    "harvester run mine.toml",
    "harvester run mine.toml --within 1%",
    "harvester run mine.toml --engine spice --within 1% --budget 30s --json",
)
@scene_argument
@option(
    "--engine",
    group=WHAT,
    help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice; with --within, "
    "the cheapest that is known to reach it.",
)
@sampling
@report_option
@as_json_option
def run(scene: str, engine: str | None, report: str | None, as_json: bool, **options: Any) -> None:
    """Mean square voltage and mean power of one SCENE by one engine."""
    from harvester.engines.selection import default_engine
    from harvester.engines.selection import engine as engine_of

    given = loaded(scene)
    chosen = engine_of(default_engine(given, options["within"]) if engine is None else engine, **given_options(options))
    page = report_file(report, None)
    with progress(chosen.NAME) as bar:
        answer = chosen.run(given, bar.tell)
    print_answer(answer, as_json)
    save_report(page, lambda report: report.of_run(given, answer, options["seed"]), quiet=as_json)


@command(
    "harvester sweep mine.toml --vary load.resistance=1k:10M:25 --out sweep",
    "harvester sweep mine.toml --vary stop.restitution=.8,.9 --vary load.resistance=1k:10M:9 --out grid",
)
@scene_argument
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
@sampling
@option("--out", group=OUTPUT, required=True, help="Folder for sweep.csv, sweep.nc, sweep.png and provenance.json.")
@option("--resume", group=RUNNERS, is_flag=True, help="Keep the points that an earlier run of the same sweep finished.")
@option(
    "--workers", group=RUNNERS, type=int, metavar="N", help="Processes.  Default: one a core, if there are many points."
)
@option("--scheduler", group=RUNNERS, metavar="ADDRESS", help="Instead: a Dask scheduler, such as tcp://host:8786.")
@vector_option
@report_option
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
    from harvester.engines.selection import default_engine, default_engines
    from harvester.engines.selection import engines as engines_of
    from harvester.studies.sweep import printed_rows
    from harvester.studies.sweep.compute import compute_table
    from harvester.studies.sweep.points import grid, read_axis, read_points

    if bool(varied) == (points is not None):
        found = "both are" if varied else "neither is"
        raise InputError(
            f"either --vary or --points must be given, but {found} (such as --vary load.resistance=1k:10M:25)"
        )
    if workers is not None and scheduler is not None:
        raise InputError("--workers must be left out where --scheduler is given, but both are given")
    given = loaded(scene)
    where = read_points(points) if points is not None else grid([read_axis(text) for text in varied])
    within = options["within"]
    names = engines or (default_engines(given) if within is None else [default_engine(given, within)])
    chosen = engines_of(names, **given_options(options))
    page = report_file(report, out)
    with progress_of_rows("sweep", {one.NAME: len(where) for one in chosen}) as bar:
        options = {"resume": resume, "workers": workers, "scheduler": scheduler, "vector": vector}
        table = compute_table(given, where, chosen, out, tick=bar.row, skip=bar.skip, **options)
    echo("\n".join([printed_rows.grid(table.rows, table.unit_names), *printed_rows.warnings(table.rows)]))
    click.echo(f"written: {Path(out) / 'sweep.csv'}, sweep.nc, {drawn('sweep', vector)}, provenance.json")
    save_report(page, lambda report: report.of_sweep(given, table))


@command(
    "harvester optimise mine.toml --over load.resistance=1k:10M",
    "harvester optimise mine.toml --over load.resistance=1k:10M --over stop.restitution=.5:1 --out best",
)
@scene_argument
@option(
    "--over", "over", group=WHAT, multiple=True, required=True, help="KEY=LOW:HIGH, a range to search; up to 4 keys."
)
@option(
    "--engine",
    group=WHAT,
    help="published, averaged, ensemble, ideal or spice.  Default: ensemble; for a netlist, spice.",
)
@sampling
@option("--out", group=OUTPUT, help="Folder for optimise.csv (all evaluations), optimise.png and provenance.json.")
@vector_option
@as_json_option
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
    from harvester.engines.selection import default_engine
    from harvester.engines.selection import engine as engine_of
    from harvester.studies.optimum import optimise as optimising
    from harvester.studies.optimum.ranges import parse

    need_out(vector, out)
    given, ranges = loaded(scene), [parse(text) for text in over]
    within, budget = options["within"] or 0.01, options["budget"] or 60.0
    effort = given_options(options | {"within": None, "budget": None})
    chosen = engine_of(default_engine(given) if engine is None else engine, **effort)
    with progress("optimise", most=True) as bar:
        answer = optimising.optimise(given, ranges, chosen, within, budget, out, bar.tell, vector)
    print_answer(answer, as_json)
    if out is not None and not as_json:
        click.echo(f"written: {Path(out) / 'optimise.csv'}, {drawn('optimise', vector)}, provenance.json")


@command("harvester compare mine.toml --within 1% --out compare")
@scene_argument
@sampling
@option("--out", group=OUTPUT, help="Folder for compare.png: the engines, and V of one path with and without the stop.")
@vector_option
@report_option
@as_json_option
def compare(
    scene: str, out: str | None, vector: tuple[str, ...], report: str | None, as_json: bool, **options: Any
) -> None:
    """Every engine that can serve SCENE, side by side, with z-scores; one path of V drawn from three sources."""
    from harvester.machine import files
    from harvester.studies import compare as comparing

    if as_json:
        need_out(vector, out)
    given = loaded(scene)
    folder = files.folder(out or ".") if out or not as_json else None
    page = report_file(report, out)
    with progress("compare") as bar:
        result = comparing.compare(given, tick=bar.tell, **given_options(options))
    if folder is not None:
        from harvester import figures

        figures.save(figures.comparison(result, given.title), folder, "compare", vector)
    print_answer(result, as_json)
    if not as_json:
        click.echo(f"written: {Path(out or '.')}/{drawn('compare', vector)}")
    save_report(page, lambda report: report.of_comparison(given, result, options["seed"]), quiet=as_json)
