"""The command `harvester run`."""

import dataclasses
from typing import TYPE_CHECKING, Any

import cloup

from harvester.commands.formula_meanwhile import formula_meanwhile
from harvester.commands.options import engine_option, json_option, probe_option, sampling
from harvester.commands.priors import check_alone, point_options, prediction_of, prior_options
from harvester.commands.reports import report_option
from harvester.commands.study import Output, study_command
from harvester.errors import SimulationError

if TYPE_CHECKING:
    from harvester.answers.estimate import Estimate
    from harvester.scene.scene import Scene
    from harvester.studies.sensitivity import Sensitivity

LEAST = 1.0  # s of a budget, for the sensitivity at least
# of a budget, for the power itself, which has all of a shorter one (s): the rest is for that
SHARE, SHORT = 0.3, 5.0


@study_command(
    "harvester run mine.toml",
    "harvester run mine.toml --within 1%",
    "harvester run mine.toml --engine spice --within 1% --budget 30s --json",
    "harvester run mine.toml --lifetime '5 years' --sensitivity",
    "harvester run mine.toml --predict --prior film --known damping=measured",
    "harvester run mine.toml --predict --points open_circuit_voltage='21 V at 0.25 g'",
    "harvester run bridge.toml --probe store --probe 'i(d1)' --energy-balance",
)
@cloup.option_group(
    "Computation",
    engine_option(
        "{engines}.  Default: exact for a linear scene, otherwise ensemble; for a netlist, spice; with --within, "
        "the cheapest that is known to reach it."
    ),
)
@cloup.option_group(
    "Inside the circuit (spice, compiled)",
    probe_option,
    cloup.option(
        "--energy-balance",
        "--ledger",
        "ledger",
        is_flag=True,
        default=None,
        help="Also report the power of each netlist element.",
    ),
)
@cloup.option_group(
    "Limits",
    cloup.option(
        "--lifetime",
        metavar="TIME",
        help="Also the largest displacement, voltage and impact in '5 years'.",
    ),
    cloup.option(
        "--sensitivity",
        is_flag=True,
        help="Also report the sensitivity of the power to every scene key (engine exact or density) or netlist "
        "element (engine slow or compiled).",
    ),
)
@cloup.option_group(
    "Real device",
    cloup.option(
        "--predict",
        is_flag=True,
        help="Also report the power of a real device with its 95 % interval, by the priors of "
        "its class, and the measurement that narrows it most.  The error of the computation is reported separately. "
        "A --budget is that of the scene as it is written, without these devices.",
    ),
    *prior_options("With --predict, the class of the device (default: bulk)"),
    point_options,
)
@sampling
@cloup.option_group("Output", report_option, json_option)
def run(
    output: Output,
    engine: str | None,
    probe: tuple[str, ...],
    lifetime: str | None,
    sensitivity: bool,
    predict: bool,
    prior: str | None,
    known: tuple[str, ...],
    points: tuple[str, ...],
    **options: Any,
) -> None:
    """Mean power and mean square voltage of one SCENE by one engine."""
    from harvester.engines import selection
    from harvester.machine.bars import Bar

    scene = output.scene
    check_alone(predict, prior, known, points)
    options["probe"] = probe or None
    budget = options["budget"]
    if sensitivity and budget is not None:
        options["budget"] = max(SHARE * budget, min(budget, SHORT))
    if engine is None:
        engine = selection.default_engine(scene, **options)
    chosen = selection.engine(engine, **options)
    if lifetime is not None:
        from harvester.studies.extremes.extremes import check_extremes, extremes

        check_extremes(scene, lifetime)
    sooner = selection.sooner(chosen, scene)
    remedies = " or --engine ".join(["--budget", *sooner])
    with (
        Bar(chosen.NAME, shorter="" if options.get("budget") else remedies) as bar,
        formula_meanwhile(scene, chosen),
    ):
        answer = selection.answer_of(chosen, scene, bar.tell)
    beside: dict[str, Any] = {}
    if lifetime is not None:
        beside["extremes"] = extremes(scene, lifetime=lifetime, seed=options["seed"])
        if chosen.has_first_passages:
            beside["extremes_by_first_passages"] = extremes(scene, lifetime=lifetime, passages=True)
    if sensitivity:
        beside["sensitivity"], answer = _with_sensitivities(scene, answer, budget)
    if predict:
        prediction = prediction_of(scene, answer.mean_power, options["seed"], prior, known, points)
        beside["prediction"] = prediction
        if budget is not None and answer.seconds + prediction.seconds > budget:
            from harvester.presentation.diagnostic import warning

            late = warning("prediction_beyond_budget", seconds=prediction.seconds)
            answer = dataclasses.replace(answer, diagnostics=(*answer.diagnostics, late))
    output.show(
        answer,
        (),
        lambda report: report.of_run(
            scene,
            answer,
            options["seed"],
            largest=beside.get("extremes"),
            sensitivity=beside.get("sensitivity"),
            prediction=beside.get("prediction"),
        ),
        beside=beside,
    )


def _with_sensitivities(
    scene: "Scene", answer: "Estimate", budget: float | None
) -> "tuple[Sensitivity | None, Estimate]":
    """The sensitivities in the rest of a budget, and the answer, with a warning if there are none."""
    from harvester.presentation.diagnostic import warning
    from harvester.studies.sensitivity import sensitivity

    left = None if budget is None else max(budget - answer.seconds, LEAST)
    try:
        return sensitivity(scene, budget=left), answer
    except SimulationError as error:
        if left is None:
            raise
        missing = warning("no_sensitivity", left=left, why=str(error))
        return None, dataclasses.replace(answer, diagnostics=(*answer.diagnostics, missing))
