"""Tolerances of first order: the linear law of the power from its gradient, and its remainder.

About the middle x0 of all spreads an engine with a gradient gives P0 and g = dP/dx; for a netlist g
is the slope between each key's 5 % and 95 % points, on the same noise.  Each device has

    P1(x) = P0 + g (x - x0)

Each key alone at its 5 % and 95 % points is computed as well, which gives its curvature c_k, and so
are the two places

    x0 -+ 1.645 C g/sqrt(g C g),    C the covariance of the keys,

at which, of all devices of a power that 5 % and 95 % are below, most lie (first-order reliability,
Hasofer and Lind, J. Eng. Mech. 100, 1974).  With P2(x) = P1(x) + sum_k c_k (x_k - x0_k)^2/2, the
power error is the level that 95 % of |P2 - P1| are below, with the larger |P - P2| of the two
places and the engine's own error.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines import ENGINES
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import Engine
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError
from harvester.machine.progress import Progress
from harvester.presentation.diagnostic import note
from harvester.scene.scene import Scene
from harvester.studies.tolerance import design
from harvester.studies.tolerance.curved_law import without_noise
from harvester.studies.tolerance.samples import Samples, cheapest
from harvester.studies.tolerance.study import ToleranceRequest, ToleranceRuns, answer_at
from harvester.studies.tolerance.surface import Polynomial, exponents
from harvester.uncertainty.value import half95, mean_and_error

SECANT_WITHIN = 0.01  # of a power whose engine samples, if none is asked for
FIRST_ORDER = "first-order"  # in place of a number of runs
WITHIN = 1e-3  # of a power that is computed, if none is asked for
# standard deviations of the two places, and the share of the errors that is stated
FAR, MOST = 1.645, 0.95
STEP = 1e-4  # relative change of a key, by which P/E[V^2] is seen to change


def engine_with_gradient(which: Named | None, within: float | str | None) -> Engine:
    """The engine of a first-order study; InputError for one that has no gradient."""
    known = [name for name, kind in ENGINES.items() if kind.has_gradient]
    chosen = engine_of(which or known[0], within=WITHIN if within is None else within)
    if not chosen.has_gradient:
        raise InputError(
            f"`engine` must have a gradient of the power for `runs` {FIRST_ORDER!r}, such as {known[0]!r}, but is "
            f"{chosen.NAME!r}"
        )
    return chosen


def first_order_engine(
    problem: Problem, which: Named | None, within: float | str | None, seed: int
) -> Engine:
    """The engine of a first-order study: for a netlist that of ideal elements, or the cheapest.

    Raises InputError for one that has no gradient.
    """
    if Ideal.refusal(problem) is None and which is None:
        return Ideal(within=SECANT_WITHIN if within is None else within, seed=seed).at_many_points
    if which is None:
        kind = cheapest(problem)
        if kind.needs_netlist:
            chosen: Engine = kind(seed=seed)
            return chosen
    return engine_with_gradient(which, within)


@dataclass(frozen=True)
class _Slopes:
    """Answers in the middle, then of each key at its low and its high end, and the slopes of first order.

    ``power`` and ``voltage`` are the slopes of mean power and mean square voltage, ``alone`` the
    powers; ``errors`` are the standard errors of the powers' slopes, shape (keys,), and
    ``bend_errors`` those of the sum of both ends' distances from the line.
    """

    middle: Estimate
    power: Floats
    voltage: Floats
    alone: Floats
    errors: Floats
    bend_errors: Floats


def _by_secants(
    engine: Engine, request: ToleranceRequest, ends: Floats, away: Floats, report: Any
) -> _Slopes:
    """The slopes between the ends of each key, ``away`` from its middle, on common noise."""
    width = away[:, 1] - away[:, 0]
    scenes = [_scene(request, row) for row in ends]
    answers: list[Estimate] = []
    size = engine.many_at_once(Problem(scenes[0]))
    for first in range(0, len(scenes), size):
        for answer in engine.run_many(scenes[first : first + size]):
            answers.append(answer_at(request.keys, ends[len(answers)], answer))
        report(len(answers))
    powers = np.array([answer.mean_power.value for answer in answers])
    voltages = np.array([answer.mean_square_voltage.value for answer in answers])
    pairs = [*zip(answers[1::2], answers[2::2], strict=True)]
    slopes = [(values[2::2] - values[1::2]) / width for values in (powers, voltages)]
    # of the two ends about the line of the slope through the middle
    leans = away.sum(axis=1) / width
    bends = [
        error_of_sum((answers[0], low, high), (-2.0, 1.0 + lean, 1.0 - lean))
        for (low, high), lean in zip(pairs, leans, strict=True)
    ]
    return _Slopes(
        middle=answers[0],
        power=slopes[0],
        voltage=slopes[1],
        alone=powers,
        errors=np.array([error_of_difference(low, high) for low, high in pairs]) / width,
        bend_errors=np.array(bends),
    )


def error_of_difference(low: Estimate, high: Estimate, quantity: str = "mean_power") -> float:
    """The standard error of a difference of a quantity, of trajectories on common noise if any."""
    return error_of_sum((low, high), (-1.0, 1.0), quantity)


def error_of_sum(
    answers: Sequence[Estimate], weights: Sequence[float], quantity: str = "mean_power"
) -> float:
    """The standard error of a weighted sum of answers, of trajectories on common noise if any."""
    name = "power_samples" if quantity == "mean_power" else "samples"
    entries = [getattr(answer, name) for answer in answers]
    values = [getattr(answer, quantity) for answer in answers]
    if all(each is not None and len(each) == len(entries[0]) for each in entries):
        # entries may be nondimensional, and have the scale of the mean
        scales = [
            weight * value.value / (float(each.mean()) or 1.0)
            for weight, value, each in zip(weights, values, entries, strict=True)
        ]
        return mean_and_error(np.asarray(scales) @ np.stack(entries))[1]
    pairs = zip(weights, values, strict=True)
    return math.hypot(*(weight * (value.stderr or 0.0) for weight, value in pairs))


def _scene(request: ToleranceRequest, values: Floats) -> Scene:
    return request.scene.varied(dict(zip(request.keys, map(float, values), strict=True)))


def linear_law(request: ToleranceRequest, engine: Any, progress: Progress) -> ToleranceRuns:
    """The linear law's powers of all devices.

    Raises the engine's errors, and InputError for a key that is 0.
    """
    keys = request.keys
    x = design.values_at(request.spreads, request.u)
    ends = design.values_at(request.spreads, design.one_by_one(len(keys)))
    x0 = ends[0]
    n_runs = len(ends) + 2
    if not x0.all():
        key = keys[int(np.argmin(np.abs(x0)))]
        raise InputError(
            f"{key} must not be 0 in the middle of its spread for `runs` {FIRST_ORDER!r}, but is"
        )

    def report(done: int) -> None:
        progress.step(done / n_runs)

    away = (ends[1:] - x0)[np.arange(2 * len(keys)), np.repeat(np.arange(len(keys)), 2)].reshape(
        -1, 2
    )
    if engine.has_gradient:
        first_order = _by_gradient(engine, request, ends, report)
    else:
        first_order = _by_secants(engine, request, ends, away, report)
    middle = first_order.middle
    slopes = first_order.power
    alone = first_order.alone
    p0 = middle.mean_power.value
    rest = alone[1:].reshape(-1, 2) - p0 - slopes[:, None] * away
    per_bend = 2.0 / (away**2).sum(axis=1)
    curvature = without_noise(per_bend * rest.sum(axis=1), per_bend * first_order.bend_errors)
    spread = np.atleast_2d(np.cov(x.T)) @ slopes
    steepest = FAR * spread / max(float(np.sqrt(slopes @ spread)), 1e-300)
    edges = np.array([part.ends for part in request.spreads])
    corners = np.clip(x0 + np.outer([-1.0, 1.0], steepest), edges[:, 0], edges[:, 1])
    exact = np.array([_run(engine, request, row).mean_power.value for row in corners])
    report(n_runs)
    first = p0 + (x - x0) @ slopes
    second = 0.5 * (x - x0) ** 2 @ curvature
    second_order = p0 + (corners - x0) @ slopes + 0.5 * (corners - x0) ** 2 @ curvature
    beyond = float(np.abs(exact / second_order - 1.0).max())
    missed = float(np.quantile(np.abs(second), MOST)) / p0
    noise = half95(float(np.linalg.norm(first_order.errors * x.std(axis=0)))) / p0
    level = _error_of_level(engine, request, middle, x0)
    off = None if level is None else missed + beyond + noise + level
    voltage = middle.mean_square_voltage.value + (x - x0) @ first_order.voltage
    half = np.maximum(np.abs(edges - x0[:, None]).max(axis=1), np.abs(x - x0).max(axis=0))
    linear = exponents(len(keys), 1)
    unexplained = float(second.var() / max((first + second).var(), 1e-300))
    coefficients = np.append(p0, slopes * half)
    surface = Polynomial(
        middle=x0,
        half=half,
        powers=linear,
        coefficients=coefficients,
        scatter=float(second.std()),
        unexplained=unexplained,
        factor=np.zeros((len(linear), 1)),
    )
    law = note(
        "linear_law", missed=missed, mean=float(second.mean()) / p0, beyond=beyond, runs=n_runs
    )
    values = {"mean_power": np.maximum(first, 0.0), "mean_square_voltage": np.maximum(voltage, 0.0)}
    checks = (law,) if off is not None else (law, note("no_error_stated"))
    samples = Samples(
        engine.NAME, values, np.ones(len(x), dtype=bool), dict.fromkeys(values, off), checks
    )
    return ToleranceRuns(
        samples=samples,
        x=x,
        surface=surface,
        alone=alone,
        failed=0,
        warnings=(),
        peaks={},
        peaks_off={},
    )


def _run(engine: Any, request: ToleranceRequest, values: Floats) -> Estimate:
    """The answer of one device; its error names the keys' values."""
    try:
        answer: Estimate = engine.run(_scene(request, values))
    except HarvesterError as error:
        return answer_at(request.keys, values, error)
    return answer


def _error_of_level(
    engine: Any, request: ToleranceRequest, middle: Estimate, x0: Floats
) -> float | None:
    """The relative power error in the middle, by a reference if necessary.

    None if it is not known.
    """
    p0 = middle.mean_power.value
    error = middle.mean_power.error95
    if error is not None or getattr(engine, "judged", True):
        return None if error is None else error / p0
    judged = _run(replace(engine, judged=True), request, x0).mean_power
    error = judged.error95
    return None if error is None else (error + abs(judged.value - p0)) / p0


def _by_gradient(engine: Any, request: ToleranceRequest, ends: Floats, report: Any) -> _Slopes:
    """The slopes by the gradient of an engine without noise, and the powers at the keys' ends."""
    x0 = ends[0]
    keys = request.keys
    middle, gradient = engine.run_with_slopes(_scene(request, x0))
    p0 = middle.mean_power.value
    slopes = p0 * np.array([gradient.elasticity(key) for key in keys]) / x0
    alone = [p0]
    for row in ends[1:]:
        report(len(alone))
        alone.append(_run(engine, request, row).mean_power.value)
    per_square = np.array([_change_of_ratio(request, x0, k) for k in range(len(keys))])
    voltage = middle.mean_square_voltage.value * (slopes / p0 - per_square)
    none = np.zeros(len(keys))
    return _Slopes(middle, slopes, voltage, np.array(alone), errors=none, bend_errors=none)


def _change_of_ratio(request: ToleranceRequest, x0: Floats, k: int) -> float:
    """The derivative of ln(P/E[V^2]), 1/R in SI units, in a key."""

    def ratio(change: float) -> float:
        changed = np.where(np.arange(len(x0)) == k, x0 * (1.0 + change), x0)
        problem = Problem(_scene(request, changed))
        eqs, units = problem.equations, problem.units
        return float(np.log((eqs.beta or 0.0) * (eqs.load or 0.0) * units.watts / units.volts**2))

    return (ratio(STEP) - ratio(-STEP)) / (2.0 * STEP * float(x0[k]))
