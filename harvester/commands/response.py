"""The command `harvester response`."""

from typing import Any

import cloup

from harvester.commands.messages import typed
from harvester.commands.options import duration, engines_option, keys_option, seed_option
from harvester.commands.study import Output, output_options, study_command


@study_command(
    "harvester response mine.toml --sweep 1Hz:10Hz:61 --out response",
    "harvester response mine.toml --sweep 40Hz:50Hz:41 --vary load.resistance=10k,100k,1M --out loads",
    "harvester response mine.toml --sweep 40Hz:50Hz:41 --vary acceleration_amplitude=0.1g:1g:10 --out map",
)
@cloup.option_group(
    "Computation",
    cloup.option(
        "--sweep",
        required=True,
        help="FROM:TO:COUNT, such as 1Hz:10Hz:60 (nondimensional scene: rad); geometric if "
        "the ends differ tenfold or more, else linear.",
    ),
    keys_option(
        "--vary",
        "varied",
        help_="KEY=FROM:TO:COUNT or KEY=A,B,C: a response for each value; repeatable.  Seven values or more of "
        "one key make a map.",
    ),
    engines_option(
        "exact, ensemble, ideal, compiled or spice; repeatable.  Default: exact for a linear scene, spice for a "
        "netlist, otherwise ensemble."
    ),
)
@output_options(
    "Folder for response.csv, response.png and provenance.json.",
    cloup.option(
        "--per-g",
        is_flag=True,
        help="Draw power, voltage and displacement over the base amplitude in g.",
    ),
    cloup.option(
        "--resume", is_flag=True, help="Keep the frequencies that an interrupted run finished."
    ),
    needs_out=("per_g", "resume"),
)
@cloup.option_group(
    "Accuracy",
    cloup.option(
        "--budget", type=duration, metavar="TIME", help="Time limit per spice point.  Default: 20s."
    ),
    seed_option,
)
def response(
    output: Output,
    sweep: str,
    varied: tuple[str, ...],
    engines: tuple[str, ...],
    budget: float | None,
    seed: int,
    **options: bool,
) -> None:
    """Power, voltage, displacement and phases of a harmonically excited SCENE against the frequency.

    The frequency is swept up and then down; for a linear mass, engine spice starts every frequency
    from rest instead.
    """
    from harvester.equations.problem import Problem
    from harvester.machine.bars import RowsBar
    from harvester.studies.frequency_response import response as study
    from harvester.studies.frequency_response.driven import HarmonicDrive
    from harvester.studies.frequency_response.engines import engines_of
    from harvester.studies.sweep.points import grid, read_axis

    scene = output.scene
    problem = Problem(scene)
    points = (
        study.points_of(problem, grid([read_axis(text, scene.tables()) for text in varied]))
        if varied
        else None
    )
    chosen = engines_of(problem, engines or None, seed, budget)
    frequencies = study.frequencies(problem, sweep)
    rows = study.rows_of(problem, chosen, len(frequencies), points)
    with RowsBar("response", rows, shorter="fewer frequencies in --sweep", warms_up=True) as bar:
        for remark in HarmonicDrive(problem).diagnostics(frequencies):  # before minutes go by
            bar.notice(f"warning: {typed(str(remark))}")
        settings: Any = {
            "out": output.out,
            "vector": output.formats,
            "vary": points,
            "engines": chosen,
            **options,
        }
        answer = study.draw(
            scene, sweep, seed=seed, report=bar.row, report_reused=bar.skip, **settings
        )
    files = ("response.csv", "response.png", "provenance.json")
    output.show(answer, files, lambda report: report.of_response(scene, answer, seed))
