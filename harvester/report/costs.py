"""The report of `cost`."""

from typing import Any

from harvester.equations.problem import Problem
from harvester.printing.answer_units import AnswerUnits
from harvester.report.engines import refusals
from harvester.report.numbers import share, signs, with_errors
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import scene_page
from harvester.scene.scene import Scene
from harvester.studies.output_folder import provenance
from harvester.studies.work_precision.cost_table import TARGETS, Cost, CostRow


def of_cost(scene: Scene | Problem, cost: Cost, seed: int, budget: float) -> Page:
    """The page of what accuracy costs: the front, the seconds for an accuracy, and all rows with three errors."""
    problem = Problem.of(scene)
    power = with_errors(cost.power, AnswerUnits.of(problem.physical).power)
    fastest = [_fastest(cost, target) for target in TARGETS]
    figure = drawing(
        cost.plot(None),
        f"Total error against seconds. {'. '.join(line for line in fastest if line)}.",
        "Each marker is an engine at one setting; the line is the front, where no other is as fast and as accurate.",
    )
    failed = [[row.engine, row.setting, signs(row.error)] for row in cost.rows if row.error]
    rows = [row for row in cost.rows if not row.error]
    unknown = any(row.step is not None and row.step_bias is None for row in rows)
    found = Section(
        "What accuracy costs",
        texts=[
            f"Errors are relative to the power of {cost.reference} at a step of zero, {power}."
            " Total: sampling at 95 % + step + model, a bias that was not seen counted as large as it may be unseen.",
            *(["The bias of the step is not known for a netlist of one's own, and not counted."] if unknown else []),
        ],
        drawings=[figure],
        tables=[
            _errors("The front: no other is as fast and as accurate", cost.best),
            _needed(cost),
            _errors("All settings", rows),
            *([TextTable("Settings that failed", ["engine", "setting", "error"], failed)] if failed else []),
            *refusals(cost.refused),
        ],
    )
    lead = [line for line in fastest if line] or ["No engine is known to reach 10 % in the time given."]
    made: dict[str, Any] = {"seed": seed, "budget": f"{budget:g} s", "reference": cost.reference}
    return scene_page(problem, "cost", lead, found, provenance(problem), **made)


def _fastest(cost: Cost, target: float) -> str:
    """The engine that was measured to reach a target in the shortest time, in words."""
    engines = dict.fromkeys(row.engine for row in cost.rows if not row.error)
    needed = {name: cost.needed(name, target) for name in engines}
    measured = {name: one[0] for name, one in needed.items() if one is not None and one[1]}
    best = min(measured, key=lambda name: measured[name], default="")
    return f"Within {100 * target:g} %: {best} in {measured[best]:.2g} s" if best else ""


def _needed(cost: Cost) -> TextTable:
    """The table of the seconds that each engine needs for each target."""
    engines = list(dict.fromkeys(row.engine for row in cost.rows if not row.error))
    rows = []
    for target in TARGETS:
        needed = [cost.needed(name, target) for name in engines]
        rows.append(
            [f"{100 * target:g} %", *("-" if n is None else signs(f"{'' if n[1] else '~'}{n[0]:.2g}") for n in needed)]
        )
    note = "~: a prediction. -: the engine's biases are not known to be smaller."
    return TextTable("Seconds to know the mean power", ["within", *engines], rows, range(1, 1 + len(engines)), note)


def _errors(caption: str, rows: list[CostRow]) -> TextTable:
    heads = ["engine", "setting", "seconds", "sampling, 95 %", "step", "model", "total"]
    cells = [
        [
            row.engine,
            row.setting,
            "-" if row.seconds is None else f"{row.seconds:.2g}",
            *(share(error, 1.0) for error in (row.sampling_error, row.step_bias, row.model_bias, row.total_error)),
        ]
        for row in rows
    ]
    return TextTable(caption, heads, cells, range(2, len(heads)))
