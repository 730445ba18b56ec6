"""The command `harvester sweep`."""

from contextlib import ExitStack
from functools import partial
from typing import Any

import cloup
from cloup.constraints import If, mutually_exclusive, require_all, require_any

from harvester.commands.completion import engines, scene_keys
from harvester.commands.help import command
from harvester.commands.messages import echo, echo_json, echo_written
from harvester.commands.options import figure, json_option, sampling, scene_argument, vector_needs_out, vector_option
from harvester.commands.reports import report_file, report_option, save_report

EITHER = "either --vary or --points must be given, but %s (such as --vary load.resistance=1k:10M:25)"
one_grid = require_any.rephrased(error=EITHER % "neither is") & mutually_exclusive.rephrased(error=EITHER % "both are")
resume_needs_out = cloup.constraint(
    If("resume", then=require_all).rephrased(error="--resume must go with --out, the folder of an earlier sweep"),
    ["out"],
)
one_runner = mutually_exclusive.rephrased(
    error="--workers must be left out where --scheduler is given, but both are given"
)


@command(
    "harvester sweep mine.toml --vary load.resistance=1k:10M:25 --out sweep",
    "harvester sweep mine.toml --vary stop.restitution=.8,.9 --vary load.resistance=1k:10M:9 --out grid",
)
@scene_argument
@cloup.option_group(
    "Where",
    cloup.option(
        "--vary",
        "varied",
        shell_complete=scene_keys,
        multiple=True,
        help="KEY=FROM:TO:COUNT or KEY=A,B,C; repeatable: a grid.",
    ),
    cloup.option(
        "--points", metavar="FILE.csv", help="Instead of --vary: a list, scene keys first, then a point a line."
    ),
    constraint=one_grid.rephrased(help="one of the two"),
)
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--engine",
        "engines",
        shell_complete=engines,
        multiple=True,
        help="Repeatable.  Default: exact for a linear scene, for a netlist spice beside ideal, else all that serve "
        "SCENE; with --within, see run.",
    ),
)
@partial(sampling, whole="the whole sweep, in equal shares of its points,")
@cloup.option_group(
    "Output",
    cloup.option("--out", help="Folder for sweep.csv, sweep.nc, sweep.png and provenance.json."),
    vector_option,
    report_option,
    json_option,
)
@cloup.option_group(
    "Who computes",
    cloup.option("--resume", is_flag=True, help="Keep the points that an earlier run of the same sweep finished."),
    one_runner(
        cloup.option(
            "--workers", type=int, metavar="N", help="Processes.  Default: one a core, if there are many points."
        ),
        cloup.option("--scheduler", metavar="ADDRESS", help="Instead: a Dask scheduler, such as tcp://host:8786."),
    ),
)
@vector_needs_out()
@resume_needs_out
def sweep(
    path: str,
    varied: tuple[str, ...],
    points: str | None,
    engines: tuple[str, ...],
    out: str | None,
    resume: bool,
    workers: int | None,
    scheduler: str | None,
    vector: tuple[str, ...],
    report: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Mean power over a range of one or several scene keys, by one or several engines."""
    from harvester.commands.progress import EFFORT, RowsBar
    from harvester.engines import selection
    from harvester.machine.execution import Execution
    from harvester.presentation.sheet import sheet
    from harvester.scene.toml import load
    from harvester.studies.sweep.cluster import dask_client
    from harvester.studies.sweep.compute import compute_table, share_of_budget
    from harvester.studies.sweep.points import grid, read_axis, read_points

    scene = load(path)
    where = read_points(points) if points is not None else grid([read_axis(text) for text in varied])
    within = options["within"]
    default = selection.default_engines(scene) if within is None else [selection.default_engine(scene, within=within)]
    names = engines or tuple(default)
    if options["budget"] is not None:
        rows = len(where) * sum(not selection.ENGINES[one].is_formula for one in names if one in selection.ENGINES)
        options["budget"] = share_of_budget(options["budget"], rows, 1 if scheduler else workers)
    chosen = selection.engines(names, **options)
    file = report_file(report, out)
    with ExitStack() as stack:
        executor = None if scheduler is None else stack.enter_context(dask_client(scheduler))
        bar = stack.enter_context(RowsBar("sweep", shorter=EFFORT, warms_up=True))
        execution = Execution(workers, executor, resume, out, vector, bar)
        table = compute_table(scene, where, chosen, execution)
    if as_json:
        echo_json(table.as_json())
    else:
        echo("\n".join([*table.powers.lines(elsewhere="sweep.csv" if out else ""), *sheet(table).remarks()]))
    if out is not None and not as_json:
        echo_written(out, "sweep.csv", "sweep.nc", *figure("sweep", vector), "provenance.json")
    save_report(file, lambda report: report.of_sweep(scene, table), quiet=as_json, scene=path)
