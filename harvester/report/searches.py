"""The report of `optimise`: one optimum, that of most devices, the front of two aims, the best of several circuits."""

from harvester.equations.problem import Problem
from harvester.presentation.table import Column, Table
from harvester.report.numbers import amount
from harvester.report.page import Page
from harvester.report.result import of_result
from harvester.scene.scene import Scene
from harvester.studies.optimum.circuit_choice import CircuitChoice
from harvester.studies.optimum.optimum_result import OptimalKey, Optimum
from harvester.studies.optimum.pareto_front import ParetoFront

BEST = 20  # evaluations of an optimum in its table


def of_search(scene: Scene | Problem, answer: Optimum | ParetoFront, seed: int) -> Page:
    """The page of whatever `optimise` found; of one optimum with the evaluations of the largest powers."""
    caption, tables = "What was evaluated, and the optimum with its interval.", tuple[Table, ...]()
    answers: list[str] = []
    if isinstance(answer, ParetoFront):
        caption = f"The largest mean power against the {answer.quantity.replace('_', ' ')}."
    elif isinstance(answer, CircuitChoice):
        which = "the best" if answer.best else "that of most power so far"
        caption = f"What was evaluated with {next(iter(answer.ranked))}, {which}, and its optimum."
    else:
        tables = (highest(answer),)
        answers = [f"{key.key}: {_interval(key)}" for key in answer.keys]
    kind = f"optimise, engine {answer.engine}"
    return of_result(scene, kind, answer, answer.plot(None), caption, tables, answers, seed=seed)


def _interval(key: OptimalKey) -> str:
    """The best value of a key, and where it lies."""
    value = amount(key.value, key.unit)
    if key.low95 is None or key.high95 is None:
        return f"best at {value}"
    return f"best at {value}, between {amount(key.low95, key.unit)} and {amount(key.high95, key.unit)}"


def highest(answer: Optimum) -> Table:
    """The places of the largest powers that the engine itself evaluated, as far as they differ in print."""
    known = [(p.power, p) for p in answer.own_points if p.power is not None]
    known.sort(key=lambda pair: -pair[0].value)
    values = [[key.range.value(float(u)) for key, u in zip(answer.keys, p.u, strict=True)] for _, p in known]
    columns = [Column(key.key, [row[k] for row in values], key.unit) for k, key in enumerate(answer.keys)]
    columns.append(Column("mean_power", [power for power, _ in known], answer.unit_names.power))
    evaluated = Table(tuple(columns), f"the highest of what {answer.engine} evaluated")
    rows = dict(reversed([(tuple(row), k) for k, row in enumerate(evaluated.shown()[1])]))  # the first of those alike
    return evaluated.rows(sorted(rows.values())[:BEST])
