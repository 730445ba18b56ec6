"""The reports of `cost`, `sweep` and `paper`."""

from typing import Any

import numpy as np

from harvester.equations.problem import Problem
from harvester.machine.provenance import origin
from harvester.presentation.diagnostic import warning
from harvester.presentation.sheet import sheet
from harvester.presentation.table import Column, Table, error_in_percent
from harvester.report.numbers import amount, share, signs, with_errors
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.result import text_table
from harvester.report.scenes import coefficients, command_line, made_by, scene_page
from harvester.scene.keys import unit_of
from harvester.scene.scene import Scene
from harvester.studies.output_folder import provenance
from harvester.studies.paper import RESPONSE, STABILITY, FigurePoint, PaperFigure
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.studies.work_precision.cost_table import TARGETS, Cost, errors_of
from harvester.uncertainty.value import Value, clock


def of_cost(scene: Scene | Problem, cost: Cost, seed: int, budget: float) -> Page:
    """The page of the cost of accuracy: the front, the seconds for an accuracy, and all rows with three errors."""
    problem = Problem.of(scene)
    reached = [(target, *cost.fastest(target)) for target in TARGETS]
    lead = [
        f"Within {100 * target:g} %: {name} in {clock(seconds)}"
        for target, name, seconds in reached
        if seconds
    ]
    page = sheet(cost)
    section = Section(
        "The cost of accuracy",
        texts=[
            f"Errors are relative to the power of {cost.reference} at a step of zero, "
            f"{with_errors(cost.power, cost.unit_names.power)}. Total: sampling at 95 % + step + model, unknown parts "
            "at their upper bound.",
            *map(signs, page.notes),
        ],
        drawings=[
            drawing(
                cost.plot(None),
                f"Total error against seconds. {'. '.join(lead)}.",
                "Each marker is an engine at one setting; the line is the front, where none is as fast and accurate.",
            )
        ],
        tables=[
            *map(text_table, page.tables),
            text_table(errors_of([row for row in cost.rows if not row.error], "All settings")),
        ],
        warnings=[signs(line) for line in page.warnings],
    )
    lead = lead or ["No engine is known to reach 10 % in the time given."]
    made: dict[str, Any] = {"seed": seed, "budget": f"{budget:g} s", "reference": cost.reference}
    return scene_page(problem, "cost", lead, section, provenance(problem), **made)


def of_sweep(scene: Scene | Problem, table: SweepTable) -> Page:
    """The page of a sweep: its figure, each engine's best point, all rows, failures, and the scene to start from."""
    about = table.about
    keys = ", ".join(table.keys)
    names = table.engines
    best = [_best(table, name) for name in names if any(row.mean_power for row in table.of(name))]
    seeds = {options["seed"] for options in about["engines"].values() if "seed" in options}
    figure = drawing(
        table.plot(None),
        f"Mean power against {keys}. {'. '.join(best)}.",
        f"Mean power against {table.curve_axis.key}, engine by engine.",
    )
    failed = sum(bool(row.error) for row in table.rows)
    section = Section(
        "Sweep",
        texts=[f"{failed} of {len(table.rows)} rows failed; the table gives the reasons."]
        if failed
        else [],
        drawings=[figure],
        tables=[text_table(_summary(table)), text_table(_points(table, failed > 0))],
        warnings=[signs(line) for line in sheet(table).warnings],
    )
    base = f"The start of all points; each has its own {keys}."
    seed = ", ".join(map(str, sorted(seeds))) or "nothing was sampled"
    return scene_page(
        Problem.of(scene), f"sweep of {keys}", best, section, dict(about), base, seed=seed
    )


def _best(table: SweepTable, engine: str) -> str:
    """The largest power in the rows of an engine, with its error, and its place."""
    known = [(row, row.mean_power) for row in table.of(engine) if row.mean_power is not None]
    row, power = max(known, key=lambda pair: pair[1].value)
    where = ", ".join(f"{key} = {amount(value, unit_of(key))}" for key, value in row.varied.items())
    error = error_in_percent(power)
    return f"{engine}: largest {amount(power.value, table.unit_names.power)} (error, 95 %: {error}) at {where}"


def _summary(table: SweepTable) -> Table:
    """The cost of each engine, and the largest errors that it states."""
    rows = {name: table.of(name) for name in table.engines}
    powers = {
        name: [row.mean_power for row in mine if row.mean_power is not None]
        for name, mine in rows.items()
    }
    worst = [max(some, key=_relative_error, default=None) for some in powers.values()]
    return Table(
        (
            Column("engine", list(rows)),
            Column("points", [len(mine) for mine in rows.values()]),
            Column("failed", [sum(bool(row.error) for row in mine) for mine in rows.values()]),
            Column(
                "with warnings", [sum(bool(row.warnings) for row in mine) for mine in rows.values()]
            ),
            Column("error, 95 %, at most", [error_in_percent(error) for error in worst]),
            Column("seconds", [sum(row.seconds or 0.0 for row in mine) for mine in rows.values()]),
        ),
        "Engines",
    )


def _relative_error(power: Value) -> float:
    return power.known_error95 / abs(power.value) if power.value else 0.0


def _points(table: SweepTable, failures: bool) -> Table:
    """All rows, with the errors of both means."""
    shown = (
        *table.keys,
        "engine",
        "mean_power",
        "mean_square_voltage",
        "seconds",
        *["error"] * failures,
    )
    columns = {column.name: column for column in table.table.columns}
    return Table(tuple(columns[name] for name in shown), "Points")


def of_paper(drawn: list[PaperFigure]) -> Page:
    """The page of the paper's figures: each one, how far both theories are from the Monte Carlo, and all parameters."""
    about = origin()
    parameters = Section(
        "Parameters",
        texts=[
            "As the paper's text prints them. Missing values are assumed, and stated in each figure's title."
        ],
        tables=[
            coefficients("Figures 1 to 6", RESPONSE),
            coefficients("Figures 7 to 9", STABILITY),
        ],
    )
    return Page(
        title="The paper's figures: its theory, ours, and Monte Carlo of the coupled equations",
        kind="paper",
        lead=[f"{figure.title}: {clock(figure.seconds)}" for figure in drawn],
        sections=[_on_published(drawn), *[_section(figure) for figure in drawn], parameters],
        command=command_line(about),
        about=made_by(about, seed="fixed for each figure"),
    )


def _on_published(drawn: list[PaperFigure]) -> Section:
    """The warning above all figures, with the largest error of the published theory."""
    largest = max((figure.published_off for figure in drawn), default=0.0)
    return Section("The published theory", warnings=[str(warning("paper_published", off=largest))])


def _section(published: PaperFigure) -> Section:
    rows = []
    for panel in dict.fromkeys(p.panel for p in published.points):
        points = [p for p in published.points if p.panel == panel]
        theories = (_off(points, name) for name in ("published", "averaged", "density"))
        noise = share(max(p.ensemble_error95 for p in points), _size(points))
        rows.append([signs(panel), str(len(points)), *theories, noise])
    heads = [
        "panel",
        "points",
        "published off by",
        "averaged off by",
        "density off by",
        "Monte Carlo, 95 %",
    ]
    note = (
        "Largest differences from the Monte Carlo, and its widest 95 % half-interval, relative to the largest"
        " value of the panel."
    )
    summary = "; ".join(
        f"{row[0]}: published off by up to {row[2]}, averaged by {row[3]}" for row in rows
    )
    figure = drawing(published.plot(None), f"{published.title}. {summary}.", published.title)
    table = TextTable("How far the theories are off", heads, rows, range(1, 6), note)
    return Section(f"Figure {published.number}", drawings=[figure], tables=[table])


def _size(points: list[FigurePoint]) -> float:
    return float(np.max(np.abs([p.ensemble for p in points]))) or 1.0


def _off(points: list[FigurePoint], name: str) -> str:
    both = [(getattr(p, name), p.ensemble) for p in points]
    far = [abs(value - ensemble) for value, ensemble in both if value is not None]
    return share(max(far), _size(points)) if far else "not solved"
