"""The reports of `optimise`: one optimum, that of most devices, the front of two aims, the best of several circuits."""

import itertools

from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.report.numbers import amount, signs, with_errors
from harvester.report.page import Page, TextTable
from harvester.report.printed import printed_page
from harvester.scene.keys import unit_of
from harvester.scene.scene import Scene
from harvester.studies.optimum.answer import Optimum
from harvester.studies.optimum.circuits import KEY, CircuitChoice
from harvester.studies.robust.front import ParetoFront
from harvester.studies.robust.optimise import RobustOptimum

BEST = 20  # evaluations of an optimum in its table


def of_search(scene: Scene | Problem, answer: Optimum | RobustOptimum | ParetoFront | CircuitChoice, seed: int) -> Page:
    """The page of whatever `optimise` found."""
    if isinstance(answer, ParetoFront):
        return of_front(scene, answer, seed)
    return of_circuits(scene, answer, seed) if isinstance(answer, CircuitChoice) else of_optimum(scene, answer, seed)


def of_optimum(scene: Scene | Problem, answer: Optimum | RobustOptimum, seed: int) -> Page:
    """The page of the largest power: the keys with their intervals, the evaluations with the largest powers."""
    found = answer.optimum if isinstance(answer, RobustOptimum) else answer
    unit, ranges = found.estimate.unit_names.power, [key.range for key in found.keys]
    known = [(p.power, p) for p in found.points if p.engine == found.engine and p.power is not None]
    known.sort(key=lambda one: -one[0].value)
    cells = (
        (
            *(amount(r.value(float(u)), unit_of(r.key)) for r, u in zip(ranges, p.u, strict=True)),
            with_errors(power, unit),
        )
        for power, p in known
    )
    rows = [list(row) for row in itertools.islice(dict.fromkeys(cells), BEST)]  # places that are told apart in print
    heads = [*(r.key for r in ranges), "mean power"]
    note = f"Of {len(found.points)} evaluations, {found.failed} of which failed. All are in optimise.csv, with --out."
    tables = [TextTable(f"The highest of what {found.engine} evaluated", heads, rows, range(len(heads)), note)]
    caption = "What was evaluated, and the optimum with its interval."
    return printed_page(
        scene, f"optimise, engine {found.engine}", str(answer), answer.plot(None), caption, tables, seed
    )


def of_front(scene: Scene | Problem, answer: ParetoFront, seed: int) -> Page:
    """The page of the front of two aims: each design with its power, the other quantity and its keys."""
    rows = [
        [
            amount(one.quantity, answer.unit),
            with_errors(one.mean_power, answer.unit_names.power),
            *(amount(value, unit_of(key)) for key, value in one.keys.items()),
        ]
        for one in answer.points
    ]
    heads = [answer.quantity.replace("_", " "), "largest mean power", *answer.points[0].keys]
    tables = [TextTable("The front: none has more power and a better other quantity", heads, rows, range(len(heads)))]
    caption = f"The largest mean power against the {heads[0]}."
    return printed_page(
        scene, f"optimise, engine {answer.engine}", _told(answer), answer.plot(None), caption, tables, seed
    )


def of_circuits(scene: Scene | Problem, answer: CircuitChoice, seed: int) -> Page:
    """The page of the best of several circuits: the optimum of each, and the search of the best one drawn."""
    rows = []
    for name, one in answer.optima.items():
        if isinstance(one, HarvesterError):
            rows.append([name, "no optimum", str(one)])
        else:
            keys = "; ".join(f"{key.range.key} = {key}" for key in one.keys)
            rows.append([name, with_errors(one.mean_power, one.estimate.unit_names.power), signs(keys)])
    tables = [TextTable("The circuits", [KEY, "largest mean power", "keys there"], rows, (1,))]
    name, best = next(iter(answer.found.items()))
    which = "the best" if answer.best else "that of most power so far"
    caption = f"What was evaluated with {name}, {which}, and its optimum."
    kind = f"optimise, circuits, engine {best.engine}"
    return printed_page(scene, kind, _told(answer), best.plot(None), caption, tables, seed)


def _told(answer: ParetoFront | CircuitChoice) -> str:
    """The first line of an answer, and its warnings; its rows are a table on the page."""
    first, *lines = str(answer).splitlines()
    return "\n".join([first, *(line for line in lines if line.startswith("  warning: "))])
