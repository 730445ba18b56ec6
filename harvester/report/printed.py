"""The reports of `response`, `motion`, `charge`, `stability`, `optimise` and `tolerance`: sheet, figure, a table."""

import dataclasses

from harvester.equations.problem import Problem
from harvester.presentation.table import Column, Table
from harvester.report.numbers import amount, with_errors
from harvester.report.page import Page
from harvester.report.result import of_result
from harvester.scene.scene import Scene
from harvester.studies.charging.answer import ChargingResult
from harvester.studies.frequency_response.responses import FrequencyResponses
from harvester.studies.motion import Motion
from harvester.studies.optimum.circuit_choice import CircuitChoice
from harvester.studies.optimum.optimum_result import OptimalKey, Optimum
from harvester.studies.optimum.pareto_front import ParetoFront
from harvester.studies.stability.exponent import Stability
from harvester.studies.tolerance.tolerance_result import ToleranceResult

MOST = 6  # peaks that lead a page
BEST = 20  # evaluations of an optimum in its table


def of_response(scene: Scene | Problem, answer: FrequencyResponses, seed: int) -> Page:
    """The page of frequency responses: peaks and bandwidths, hysteresis, and all points with their errors."""
    caption = (
        "Mean power, RMS voltage, RMS displacement and phase against the excitation frequency."
    )
    points = dataclasses.replace(answer.table, title="Points")
    answers = []
    for curve in answer.curves:
        for direction in curve.directions:
            peak = curve.peak(direction)
            of = curve.unit_names
            most = with_errors(peak.mean_power, of.power)
            where = f"at {amount(peak.frequency, of.frequency)}, {direction}"
            answers.append(f"{curve.engine}: largest mean power {most} {where}")
    return of_result(scene, "response", answer, caption, (points,), answers[:MOST], seed=seed)


def of_motion(scene: Scene | Problem, answer: Motion, seed: int) -> Page:
    """The page of one trajectory: its figure, and the range of each of its quantities."""
    caption = (
        "The end of one trajectory over time, its phase plane, and the frequency of each value."
    )
    kind = f"motion, engine {answer.engine}"
    return of_result(scene, kind, answer, caption, (answer.ranges,), seed=seed)


def of_charge(scene: Scene | Problem, answer: ChargingResult, seed: int) -> Page:
    """The page of a storage capacitor that charges: the time to the target, and time and power to each level."""
    caption = "The voltage from empty, the fraction of runs that have been at the target, and the charging power."
    kind = f"charge, engine {answer.engine}"
    return of_result(scene, kind, answer, caption, (answer.ladder,), seed=seed)


def of_stability(scene: Scene | Problem, answer: Stability, seed: int) -> Page:
    """The page of the stability of rest: the exponents, and if it was computed its region in the plane (mu, D22)."""
    caption = "Where rest is stable, in the plane of the time-constant ratio μ and the parametric noise ε2² D22."
    verdict = f"Rest is {answer.verdict}"
    return of_result(
        scene,
        "stability",
        answer,
        caption,
        (answer.table,) * bool(answer.region),
        [verdict],
        seed=seed,
    )


def of_search(scene: Scene | Problem, answer: Optimum | ParetoFront, seed: int) -> Page:
    """The page of any result of `optimise`.

    For one optimum with the evaluations of the largest powers.
    """
    caption = "The evaluations, and the optimum with its interval."
    tables = tuple[Table, ...]()
    answers: list[str] = []
    if isinstance(answer, ParetoFront):
        caption = f"The largest mean power against the {answer.quantity.replace('_', ' ')}."
    elif isinstance(answer, CircuitChoice):
        which = "the best" if answer.best else "that of most power so far"
        caption = f"The evaluations with {next(iter(answer.ranked))}, {which}, and its optimum."
    else:
        tables = (highest(answer),)
        answers = [f"{key.key}: {_interval(key)}" for key in answer.keys]
    kind = f"optimise, engine {answer.engine}"
    return of_result(scene, kind, answer, caption, tables, answers, seed=seed)


def _interval(key: OptimalKey) -> str:
    """The best value of a key, and its place."""
    value = amount(key.value, key.unit)
    if key.low95 is None or key.high95 is None:
        return f"best at {value}"
    return (
        f"best at {value}, between {amount(key.low95, key.unit)} and {amount(key.high95, key.unit)}"
    )


def highest(answer: Optimum) -> Table:
    """The places of the largest powers that the engine itself evaluated, as far as they differ in print."""
    known = [(p.power, p) for p in answer.own_points if p.power is not None]
    known.sort(key=lambda pair: -pair[0].value)
    values = [
        [key.range.value(float(u)) for key, u in zip(answer.keys, p.u, strict=True)]
        for _, p in known
    ]
    columns = [
        Column(key.key, [row[k] for row in values], key.unit) for k, key in enumerate(answer.keys)
    ]
    columns.append(Column("mean_power", [power for power, _ in known], answer.unit_names.power))
    evaluated = Table(tuple(columns), f"the highest powers that {answer.engine} evaluated")
    # the first of those alike
    rows = dict(reversed([(tuple(row), k) for k, row in enumerate(evaluated.shown()[1])]))
    return evaluated.rows(sorted(rows.values())[:BEST])


def of_tolerance(scene: Scene | Problem, answer: ToleranceResult, seed: int) -> Page:
    """The page of how power scatters over devices: quantiles, yield, the keys' bars and shares, and the error."""
    caption = (
        "The distribution of the devices' power. Below, its 5 to 95 % range with one key alone, and that key's "
        "fraction of the variance."
    )
    kind = f"tolerance, engine {answer.engine}"
    count = len(answer.power)
    unit = answer.unit
    low, middle, high = (amount(answer.quantiles[share].value, unit) for share in (0.05, 0.5, 0.95))
    answers = [f"Median mean power: {middle}; 90 % of devices have {low} to {high}"]
    if answer.met is not None:
        answers.append(f"Devices that meet all limits: {100.0 * answer.met.value:.4g} %")
    return of_result(scene, kind, answer, caption, (), answers, seed=seed, samples=count)
