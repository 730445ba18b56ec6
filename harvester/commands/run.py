"""The command `harvester run`."""

from typing import Any

import cloup

from harvester.commands.completion import engines
from harvester.commands.formula_meanwhile import formula_meanwhile
from harvester.commands.help import command
from harvester.commands.messages import echo, echo_answer, echo_json
from harvester.commands.options import json_option, probe_option, sampling, scene_argument
from harvester.commands.reports import report_file, report_option, save_report


@command(
    "harvester run mine.toml",
    "harvester run mine.toml --within 1%",
    "harvester run mine.toml --engine spice --within 1% --budget 30s --json",
    "harvester run mine.toml --lifetime '5 years'",
    "harvester run mine.toml --sensitivity",
    "harvester run bridge.toml --probe store --probe 'i(d1)' --ledger",
)
@scene_argument
@cloup.option_group(
    "What to compute",
    cloup.option(
        "--engine",
        shell_complete=engines,
        help="{engines}.  Default: exact for a linear "
        "scene, else ensemble; for a netlist, spice; with --within, the cheapest that is known to reach it.",
    ),
)
@cloup.option_group(
    "Inside the circuit (spice)",
    probe_option,
    cloup.option("--ledger", is_flag=True, default=None, help="What each element of the netlist takes, too."),
)
@cloup.option_group(
    "Limits",
    cloup.option(
        "--lifetime", metavar="TIME", help="Also the largest displacement, voltage and impact in that time: '5 years'."
    ),
    cloup.option(
        "--sensitivity", is_flag=True, help="Also how much the power changes with each key, by engine density."
    ),
)
@sampling
@cloup.option_group("Output", report_option, json_option)
def run(
    path: str,
    engine: str | None,
    probe: tuple[str, ...],
    report: str | None,
    as_json: bool,
    lifetime: str | None,
    sensitivity: bool,
    **options: Any,
) -> None:
    """Mean square voltage and mean power of one SCENE by one engine."""
    from harvester.commands.progress import Bar
    from harvester.engines import selection
    from harvester.scene.toml import load

    scene = load(path)
    options["probe"] = probe or None
    if engine is None:
        engine = selection.default_engine(scene, **options)
    chosen = selection.engine(engine, **options)
    file = report_file(report, None)
    if lifetime is not None:
        from harvester.studies.extremes.extremes import check_asked

        check_asked(scene, lifetime)
    with Bar(chosen.NAME, shorter="" if options.get("budget") else "--budget") as bar, formula_meanwhile(scene, chosen):
        answer = chosen.run(scene, bar.tell)
    further: dict[str, Any] = {}
    if lifetime is not None:
        from harvester.studies.extremes.extremes import extremes

        further["extremes"] = extremes(scene, lifetime=lifetime, seed=options["seed"])
        if chosen.has_first_passages:
            further["extremes_by_first_passages"] = extremes(scene, lifetime=lifetime, passages=True)
    if sensitivity:
        from harvester.studies.sensitivity import sensitivity as sensitivities

        further["sensitivity"] = sensitivities(scene, budget=options.get("budget"))
    if not further:
        echo_answer(answer, as_json)
    elif as_json:
        echo_json(answer.as_json() | {name: one.as_json() for name, one in further.items()})
    else:
        echo("\n".join(str(one) for one in (answer, *further.values())))
    more = [further.get(name) for name in ("extremes", "sensitivity")]
    save_report(file, lambda report: report.of_run(scene, answer, options["seed"], *more), quiet=as_json, scene=path)
