"""The command `harvester sweep`."""

from functools import partial
from typing import Any

import cloup
from cloup.constraints import If, mutually_exclusive, require_all, require_any

from harvester.commands.options import engines_option, keys_option, sampling, who_computes
from harvester.commands.study import Output, output_options, study_command

EITHER = (
    "either --vary or --points must be given, but %s (such as --vary load.resistance=1k:10M:25)"
)
one_grid = require_any.rephrased(error=EITHER % "neither is") & mutually_exclusive.rephrased(
    error=EITHER % "both are"
)
resume_needs_out = cloup.constraint(
    If("resume", then=require_all).rephrased(
        error="--resume must be used with --out, the folder of an earlier sweep"
    ),
    ["out"],
)


@study_command(
    "harvester sweep mine.toml --vary load.resistance=1k:10M:25 --out sweep",
    "harvester sweep mine.toml --vary stop.restitution=0.8,0.9 --vary load.resistance=1k:10M:9 --out grid",
)
@cloup.option_group(
    "Where",
    keys_option(
        "--vary",
        "varied",
        help_="KEY=FROM:TO:COUNT or KEY=A,B,C; repeatable: a grid.  A range of positive ends "
        "is geometric if they differ tenfold or more, else linear.",
    ),
    cloup.option(
        "--points", metavar="FILE.csv", help="CSV list instead: scene keys, then a point per row."
    ),
    constraint=one_grid.rephrased(help="one of the two"),
)
@cloup.option_group(
    "Computation",
    engines_option(
        "Repeatable; all: those that support SCENE.  Default: exact for a linear scene, spice and ideal for a netlist, "
        "otherwise ensemble and the formulas, checked by density or spice at a few points; with --within, see run."
    ),
    cloup.option(
        "--common-noise",
        is_flag=True,
        help="Same noise at all points: differences between points have a smaller error.",
    ),
)
@partial(sampling, whole="the whole sweep (shared by its points)")
@output_options("Folder for sweep.csv, sweep.nc, sweep.png and provenance.json.")
@who_computes(
    "Keep the points that an earlier run of the same sweep finished.",
    "Number of processes.  Default: one per core, if there are many points.",
)
@resume_needs_out
def sweep(
    output: Output,
    varied: tuple[str, ...],
    points: str | None,
    engines: tuple[str, ...],
    common_noise: bool,
    resume: bool,
    workers: int | None,
    scheduler: str | None,
    **options: Any,
) -> None:
    """Mean power over a range of one or several scene keys, by one or several engines."""
    from harvester.engines import selection
    from harvester.machine.bars import EFFORT, RowsBar
    from harvester.presentation.sheet import sheet
    from harvester.studies.sweep.cluster import client_of
    from harvester.studies.sweep.compute import compute_table
    from harvester.studies.sweep.points import grid, read_axis, read_points
    from harvester.studies.sweep.sweep import chosen

    scene = output.scene
    where = (
        grid([read_axis(text, scene.tables()) for text in varied])
        if points is None
        else read_points(points, scene.tables())
    )
    within = options["within"]
    if within is not None and not engines:
        engines = (selection.default_engine(scene, within=within),)
    which = chosen(where.middle(scene), engines)
    budget = options["budget"]
    shorter = EFFORT if budget is None else ""
    computing = selection.engines(which.engines, **options)
    with client_of(scheduler) as executor, RowsBar("sweep", shorter=shorter, warms_up=True) as bar:
        execution = output.execution(bar, workers=workers, executor=executor, resume=resume)
        table = compute_table(
            scene,
            where,
            computing,
            execution,
            budget,
            which.stand_ins,
            common_noise=common_noise,
            check=which.check,
        )
    text = None
    if not output.as_json:
        elsewhere = "sweep.csv" if output.out else ""
        text = "\n".join([*table.powers.lines(elsewhere=elsewhere), *sheet(table).remarks()])
    files = ("sweep.csv", "sweep.nc", "sweep.png", "provenance.json")
    output.show(table, files, lambda report: report.of_sweep(scene, table), text=text)
