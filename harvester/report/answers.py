"""The reports of `run` and `compare`."""

from collections.abc import Sequence
from dataclasses import replace

from harvester.answers.estimate import Estimate
from harvester.equations.problem import Problem
from harvester.presentation.sheet import sheet
from harvester.report import engines
from harvester.report.numbers import amount, share, signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.result import text_table
from harvester.report.scenes import scene_page
from harvester.scene.scene import Scene
from harvester.studies.compare import Comparison
from harvester.studies.extremes.extremes import Extremes
from harvester.studies.output_folder import provenance
from harvester.studies.prediction.prediction_result import Prediction
from harvester.studies.sensitivity import Sensitivity

Z = (
    "z: difference over the standard errors of both. An engine with a bias of its model or step may be"
    " off by more than |z| < 4 allows, within that bias."
)


def of_run(
    scene: Scene | Problem,
    answer: Estimate,
    seed: int,
    largest: Extremes | None = None,
    sensitivity: Sensitivity | None = None,
    prediction: Prediction | None = None,
) -> Page:
    """The page of one engine's answer: its errors, the effects of the scene, and the command that repeats it.

    ``largest`` are the largest values over a lifetime and ``sensitivity`` the normalised
    sensitivities of the power, if requested;
    ``prediction`` is that of a real device.
    """
    problem = Problem.of(scene)
    parts = "The parts of the mean-power error, in percent of the mean power."
    ledger = any(name.startswith("ledger_") for name in answer.details)
    caption = f"{parts} Below, the power dissipated by element." if ledger else parts
    tables = [
        engines.table([answer]),
        engines.reasons([answer]),
        *engines.details(answer),
        *_largest(largest),
    ]
    if sensitivity is not None:
        caption_of = "Normalised sensitivity of the mean power in each key, the largest first"
        said = signs("; ".join(map(str, sensitivity.diagnostics)))
        tables.append(replace(text_table(sensitivity.table), caption=caption_of, note=said))
    if prediction is not None:
        tables += _predicted(prediction)
    section = Section(
        "Answer",
        drawings=[drawing(answer.plot(None), f"Bars: {_spoken(answer)}", caption)],
        tables=tables,
        warnings=engines.warnings([answer]),
    )
    seed_text = seed if answer.mean_power.stderr is not None else f"{seed} (nothing was sampled)"
    kind = f"run, engine {answer.engine}"
    return scene_page(
        problem, kind, engines.lead(answer), section, provenance(problem), seed=seed_text
    )


def _predicted(prediction: Prediction) -> list[TextTable]:
    """The tables of a real device: its interval, and its quantities with the next measurement."""
    device, quantities = prediction.real_device, prediction.measurements
    following = prediction.next_measurement
    return [
        replace(
            text_table(device),
            caption=f"{device.title} (class {prediction.prior})",
            note=signs("; ".join(map(str, prediction.notes))),
        ),
        replace(
            text_table(quantities),
            caption=quantities.title,
            note=f"Next measurement: {following}" if following else "",
        ),
    ]


def _largest(extremes: Extremes | None) -> list[TextTable]:
    """The table of the largest values over a lifetime; none if they were not asked for."""
    if extremes is None:
        return []
    caption = f"Largest over a lifetime of {amount(extremes.lifetime, extremes.unit_names.time)}"
    return [replace(text_table(extremes.table), caption=caption, note=signs(extremes.method))]


def of_comparison(
    scene: Scene | Problem, result: Comparison, seed: int, largest: Sequence[Extremes] = ()
) -> Page:
    """The page of all engines side by side, with z-scores, refusals, and the statements of the trajectories.

    ``largest`` are the largest values over a lifetime, by each method.
    """
    problem = Problem.of(scene)
    figure = drawing(
        result.plot(None),
        "Mean power: " + "; ".join(_spoken(e) for e in result.estimates),
        "Mean power of each engine with its error."
        + (" Below, the voltage of one trajectory from three sources." if result.paths else ""),
    )
    section = Section(
        "Engines side by side",
        drawings=[figure],
        tables=[
            engines.table(result.estimates),
            replace(text_table(result.table), note=Z),
            engines.reasons(result.estimates),
            *engines.refusals(result.refused),
            *map(text_table, sheet(result).tables[1:]),
            *(table for extremes in largest for table in _largest(extremes)),
        ],
        warnings=engines.warnings(result.estimates),
    )
    lead = [
        f"{e.engine}: {line[0].lower()}{line[1:]}"
        for e in result.estimates
        for line in engines.lead(e)[:1]
    ]
    lead.append(_agreement(result))
    about = provenance(problem)
    return scene_page(
        problem, "compare", lead, section, about, seed=seed, reference=result.reference.engine
    )


def _agreement(result: Comparison) -> str:
    """Which engines agree with the reference within the errors that both state."""
    reference = result.reference
    others = [estimate for estimate in result.estimates if estimate is not reference]
    words = []
    for estimate in others:
        away = estimate.mean_power.value - reference.mean_power.value
        within = estimate.mean_power.known_error95 + reference.mean_power.known_error95
        off = f"differs by {share(away, reference.mean_power.value)}"
        words.append(
            f"{estimate.engine} {'agrees within the errors' if abs(away) <= within else off}"
        )
    return f"Against {reference.engine}: {'; '.join(words)}" if words else "Nothing to compare with"


def _spoken(answer: Estimate) -> str:
    return f"{answer.engine} {signs(answer.mean_power.format(answer.unit_names.power))}"
