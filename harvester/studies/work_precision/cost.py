"""The cost of accuracy: every engine at many settings, its seconds against three errors that are never mixed.

sampling
    half-width of the 95 % interval, as the engine states it.
step
    E_h - E_0 of the step, and the bias of ngspice's tolerance (`richardson_ladder`,
    `ngspice_bias`).
model
    of the engine, its step bias removed, against the finest engine: ngspice paired with the cheap
    model.  `Exact` has none, and that of `Density` is the error by its mesh, its modes and its box.

All are relative to one power, the finest engine's for a step of zero, and each bias has a standard
error of its own.

    total = sampling + max(|step|, 2 stderr) + max(|model|, 2 stderr)

so that a bias that is lost in its own error is counted at its upper limit.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import cast

from harvester.engines import Spice
from harvester.engines.protocol import AnyScene
from harvester.equations.problem import Problem
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.work_precision.bias import NONE, Bias
from harvester.studies.work_precision.cost_table import Cost, CostRow, front
from harvester.studies.work_precision.settings import ALONE, base_name, label, setting
from harvester.studies.work_precision.timed_runs import Measurement, Run
from harvester.uncertainty.value import Value


def cost(
    scene: AnyScene, *, seed: int = 0, budget: float = 60.0, execution: Execution = DEFAULT
) -> Cost:
    """Measure every engine that can handle a scene in about ``budget`` seconds, compilation apart, at least once each.

    Into the folder of its `Execution` it writes cost.csv, cost.png and provenance.json.  An engine
    that fails is a row with its error.

    Raises InputError for a folder that cannot be written, or the options that `Execution` has for
    other studies; HarvesterError if no engine that samples gives a power above zero.
    """
    execution.only("cost", "out", "formats", "progress")
    folder = OutputFolder.of(execution)
    problem = Problem.of(scene)
    with working_on("cost", execution) as progress:
        measurement = Measurement(problem, seed, budget, progress)
        measurement.measure()
    answer = table_of(measurement)
    if folder is not None:
        about = provenance(problem, seed=seed, budget=budget, reference=answer.reference)
        folder.save("cost", answer.table.csv(), answer.plot(problem.scene.name), about)
    return answer


def table_of(measurement: Measurement) -> Cost:
    """The table that the runs and biases of a measurement make."""
    power, reference = _reference(measurement)
    runs = [(run, _step(measurement, run)) for run in measurement.runs]
    models = _models(measurement, runs, power, reference)
    rows = [_row(run, step, _model(run, models), abs(power.value)) for run, step in runs]
    for index in front([(row.seconds or 0.0, row.total_error or 0.0) for row in rows]):
        rows[index] = dataclasses.replace(rows[index], best=True)
    rows += [
        CostRow(label(engine), setting(engine), error=str(error))
        for engine, error in measurement.failed
    ]
    order = list(dict.fromkeys(row.engine for row in rows))
    rows.sort(key=lambda row: order.index(row.engine))
    refused = {name: str(why) for name, why in measurement.refused.items()}
    return Cost(tuple(rows), reference, power, refused, measurement.problem.physical)


def _model(run: Run, models: dict[str, Bias]) -> Bias:
    """The bias of a run's model.

    For an engine whose error is that of its resolution, its own statement.
    """
    if not run.engine.is_resolved:
        return models[base_name(label(run.engine))]
    power = run.answer.mean_power
    return Bias(0.0, 0.5 * power.known_error95 / abs(power.value))


def _models(
    measurement: Measurement, runs: Sequence[tuple[Run, Bias | None]], power: Value, reference: str
) -> dict[str, Bias]:
    """The bias of each engine's model: none for the reference and a closed form, of the others from their best run."""
    cheap, ngspice = measurement.cheap, measurement.ngspice
    biases: dict[str, Bias] = {}
    for name, engine in {base_name(label(run.engine)): run.engine for run, _ in runs}.items():
        if name in (reference, ALONE) or engine.is_exact:
            biases[name] = NONE
        elif ngspice is not None and cheap is not None and name == label(cheap.engine):
            biases[name] = ngspice.cheap
        else:
            candidates = [pair for pair in runs if base_name(label(pair[0].engine)) == name]
            biases[name] = model_bias(
                power, *min(candidates, key=lambda pair: pair[0].answer.mean_power.stderr or 0.0)
            )
    return biases


def _reference(measurement: Measurement) -> tuple[Value, str]:
    """The power of the finest engine at a step of zero, and its name.

    The cheap model's, known from long runs, over 1 + its bias against ngspice: ngspice paired with
    all of them.
    """
    if measurement.cheap is None or measurement.steps is None:
        ngspice_runs = [run for run in measurement.runs if run.engine.runs_ngspice]
        if not ngspice_runs:
            raise [*measurement.refused.values(), *(error for _, error in measurement.failed)][-1]
        best = min(ngspice_runs, key=lambda run: run.answer.mean_power.stderr or 0.0)
        return best.answer.mean_power, label(best.engine)
    mean = measurement.steps.mean.scaled(measurement.power_unit)
    if measurement.ngspice is None:
        return mean, label(measurement.cheap.engine)
    ratio = 1.0 / (1.0 + measurement.ngspice.cheap.value)
    error = math.hypot(
        (mean.stderr or 0.0) * ratio, measurement.ngspice.cheap.stderr * ratio**2 * mean.value
    )
    return Value(mean.value * ratio, error), Spice.NAME


def _step(measurement: Measurement, run: Run) -> Bias | None:
    """The bias of an answer's step, and of ngspice's tolerance."""
    if measurement.steps is None or not run.engine.samples:
        return None
    bias = measurement.steps.at(run.answer.details["step"] * measurement.unit)
    if run.engine.runs_ngspice and measurement.ngspice is not None:
        bias = bias + measurement.ngspice.tolerances.get(cast(Spice, run.engine).reltol, NONE)
    return bias


def model_bias(power: Value, run: Run, step: Bias | None) -> Bias:
    """The bias of an engine's model, from an answer less the bias of its step."""
    step = step or NONE
    zero = run.answer.mean_power.scaled(1.0 / (1.0 + step.value) / abs(power.value))
    errors = (
        zero.stderr or 0.0,
        zero.value * step.stderr,
        zero.value * (power.stderr or 0.0) / abs(power.value),
    )
    return Bias(zero.value - 1.0, math.hypot(*errors))


def _row(run: Run, step: Bias | None, model: Bias, power: float) -> CostRow:
    engine = run.engine
    answer = run.answer
    details = run.answer.details
    samples = engine.samples
    spice = cast(Spice, engine) if engine.runs_ngspice else None
    sampling = answer.mean_power.sampling95 / power
    return CostRow(
        label(engine),
        setting(engine),
        step=details.get("step"),
        duration=details["duration"] if samples else None,
        trajectories=int(details["trajectories"]) if samples else None,
        reltol=spice.reltol if spice is not None and "netlist" in answer.effects else None,
        noise=""
        if not samples
        else "gaussian"
        if spice is not None and spice.gaussian
        else "three-point",
        mean_power=answer.mean_power.value,
        seconds=answer.seconds,
        warm_up_seconds=run.warm_up,
        sampling_error=sampling if samples else None,
        step_bias=None if step is None else step.value,
        step_bias_stderr=None if step is None else step.stderr,
        model_bias=model.value,
        model_bias_stderr=model.stderr,
        total_error=sampling + (0.0 if step is None else step.counted) + model.counted,
    )
