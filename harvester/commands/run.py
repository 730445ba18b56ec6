"""The command `harvester run`.

On a terminal it shows the answer of a formula while a slower engine compiles and computes.
"""

import contextlib
import dataclasses
import math
import sys
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click
import cloup

from harvester.commands.options import engine_option, json_option, probe_option, sampling
from harvester.commands.priors import (
    Origins,
    check_alone,
    point_options,
    predicted_in_time,
    prediction_of,
    prior_options,
)
from harvester.commands.reports import report_option
from harvester.commands.study import Output, study_command
from harvester.errors import HarvesterError, SimulationError

if TYPE_CHECKING:
    from harvester.answers.estimate import Estimate
    from harvester.engines.protocol import Engine
    from harvester.scene.scene import Scene
    from harvester.studies.prediction.prediction_result import Prediction
    from harvester.studies.sensitivity import Sensitivity


PATIENCE = 1.0  # seconds that a person waits without asking what happens


@contextlib.contextmanager
def formula_meanwhile(scene: "Scene", engine: "Engine") -> Iterator[None]:
    """Show on a terminal the answer of a formula for a scene, if the engine needs more than `PATIENCE`."""
    if engine.is_formula or not sys.stderr.isatty():
        yield
        return
    waiting = threading.Timer(PATIENCE, _show, (scene,))
    waiting.daemon = True
    waiting.start()
    try:
        yield
    finally:
        waiting.cancel()
        if waiting.is_alive():  # it has begun: its line does not come after the answer
            waiting.join()


def _show(scene: "Scene") -> None:
    line = formula_line(scene)
    if line:
        click.echo(line, file=sys.stderr)  # above the bar, which takes stderr while it is drawn


def formula_line(scene: "Scene") -> str:
    """The mean power by the first formula that supports the scene and knows its own error; "" if none does."""
    from harvester.engines.selection import ENGINES
    from harvester.equations.problem import Problem

    with contextlib.suppress(HarvesterError):
        problem = Problem.of(scene)
        for name, kind in ENGINES.items():
            if kind.is_formula and kind.refusal(problem) is None:
                answer = kind().run(problem)
                if answer.mean_power.error95 is not None:
                    power = answer.mean_power.format(answer.unit_names.power)
                    return f"meanwhile, by the formula of engine '{name}': mean power {power}"
    return ""


LEAST = 1.0  # s of a budget, for the sensitivity and for a prediction at least
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
        "A --budget includes these devices if the engine for them is slow or compiled.",
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
    is_in_time = predict and budget is not None and predicted_in_time(scene)
    if sensitivity or is_in_time:
        options["budget"] = _first_part(budget)
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
    left = math.inf if budget is None else budget - answer.seconds
    if sensitivity:
        beside["sensitivity"], answer = _with_sensitivities(
            scene, answer, 0.5 * left if is_in_time else left
        )
        left -= getattr(beside["sensitivity"], "seconds", 0.0)
    if predict:
        beside["prediction"], answer = _with_prediction(
            scene, answer, options["seed"], Origins(prior, known, points), left, is_in_time
        )
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


def _first_part(budget: float | None) -> float | None:
    """The time of a budget (s) for the power itself."""
    return None if budget is None else max(SHARE * budget, min(budget, SHORT))


def _with_sensitivities(
    scene: "Scene", answer: "Estimate", left: float
) -> "tuple[Sensitivity | None, Estimate]":
    """The sensitivities in the time ``left`` (s), and the answer, with a warning if there are none."""
    from harvester.studies.sensitivity import sensitivity

    part = None if math.isinf(left) else max(left, LEAST)
    try:
        return sensitivity(scene, budget=part), answer
    except SimulationError as error:
        if part is None:
            raise
        return None, _warned(answer, "no_sensitivity", left=part, why=str(error))


def _with_prediction(
    scene: "Scene", answer: "Estimate", seed: int, origins: Origins, left: float, is_in_time: bool
) -> "tuple[Prediction, Estimate]":
    """The prediction, in the time ``left`` (s) if it can be, and the answer, with a warning if it took longer."""
    part = max(left, LEAST) if is_in_time else None
    prediction = prediction_of(scene, answer.mean_power, seed, origins, part)
    if not is_in_time and prediction.seconds > left:
        answer = _warned(answer, "prediction_beyond_budget", seconds=prediction.seconds)
    return prediction, answer


def _warned(answer: "Estimate", code: str, **numbers: Any) -> "Estimate":
    """The answer with one more warning."""
    from harvester.presentation.diagnostic import warning

    return dataclasses.replace(answer, diagnostics=(*answer.diagnostics, warning(code, **numbers)))
