"""The report of `optimise`: one optimum, that of most devices, the front of two aims, the best of several circuits."""

from harvester.equations.problem import Problem
from harvester.presentation.table import Column, Table
from harvester.report.page import Page
from harvester.report.result import of_result
from harvester.scene.scene import Scene
from harvester.studies.optimum.answer import Optimum
from harvester.studies.optimum.circuit_choice import CircuitChoice
from harvester.studies.optimum.pareto_front import ParetoFront

BEST = 20  # evaluations of an optimum in its table


def of_search(scene: Scene | Problem, answer: Optimum | ParetoFront, seed: int) -> Page:
    """The page of whatever `optimise` found; of one optimum with the evaluations of the largest powers."""
    caption, tables = "What was evaluated, and the optimum with its interval.", tuple[Table, ...]()
    if isinstance(answer, ParetoFront):
        caption = f"The largest mean power against the {answer.quantity.replace('_', ' ')}."
    elif isinstance(answer, CircuitChoice):
        which = "the best" if answer.best else "that of most power so far"
        caption = f"What was evaluated with {next(iter(answer.found))}, {which}, and its optimum."
    else:
        tables = (highest(answer),)
    return of_result(scene, f"optimise, engine {answer.engine}", answer, answer.plot(None), caption, tables, seed=seed)


def highest(answer: Optimum) -> Table:
    """The places of the largest powers that the engine itself evaluated, as far as they differ in print."""
    known = [(p.power, p) for p in answer.own_points if p.power is not None]
    known.sort(key=lambda pair: -pair[0].value)
    places = [[key.range.value(float(u)) for key, u in zip(answer.keys, p.u, strict=True)] for _, p in known]
    columns = [Column(key.key, [place[k] for place in places], key.unit) for k, key in enumerate(answer.keys)]
    columns.append(Column("mean_power", [power for power, _ in known], answer.unit_names.power))
    found = Table(tuple(columns), f"the highest of what {answer.engine} evaluated")
    rows = dict(reversed([(tuple(row), k) for k, row in enumerate(found.shown()[1])]))  # the first of those alike
    return found.rows(sorted(rows.values())[:BEST])
