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
from dataclasses import dataclass
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
from harvester.studies.tolerance.samples import Samples, cheapest
from harvester.studies.tolerance.study import ToleranceRequest, ToleranceRuns
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
    powers; ``errors`` are the standard errors of the powers' slopes, shape (keys,).
    """

    middle: Estimate
    power: Floats
    voltage: Floats
    alone: Floats
    errors: Floats


def _by_secants(engine: Engine, scenes: list[Scene], width: Floats, report: Any) -> _Slopes:
    """The slopes between the ends of each key, ``width`` apart, on common noise."""
    answers: list[Estimate] = []
    size = engine.many_at_once(Problem(scenes[0]))
    for first in range(0, len(scenes), size):
        for answer in engine.run_many(scenes[first : first + size]):
            if isinstance(answer, HarvesterError):
                raise answer
            answers.append(answer)
        report(len(answers))
    powers = np.array([answer.mean_power.value for answer in answers])
    voltages = np.array([answer.mean_square_voltage.value for answer in answers])
    pairs = zip(answers[1::2], answers[2::2], strict=True)
    errors = np.array([error_of_difference(low, high) for low, high in pairs])
    slopes = [(values[2::2] - values[1::2]) / width for values in (powers, voltages)]
    return _Slopes(answers[0], slopes[0], slopes[1], powers, errors / width)


def error_of_difference(low: Estimate, high: Estimate, quantity: str = "mean_power") -> float:
    """The standard error of a difference of a quantity, of trajectories on common noise if any."""
    name = "power_samples" if quantity == "mean_power" else "samples"
    before = getattr(low, name)
    after = getattr(high, name)
    if before is not None and after is not None and len(before) == len(after):
        # entries may be nondimensional, and have the scale of the mean
        scales = [
            getattr(of, quantity).value / (float(entries.mean()) or 1.0)
            for of, entries in ((low, before), (high, after))
        ]
        return mean_and_error(scales[1] * after - scales[0] * before)[1]
    return math.hypot(getattr(low, quantity).stderr or 0.0, getattr(high, quantity).stderr or 0.0)


def linear_law(request: ToleranceRequest, engine: Any, progress: Progress) -> ToleranceRuns:
    """The linear law's powers of all devices; raises the engine's errors, and InputError for a key that is 0."""
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

    def scene(values: Floats) -> Scene:
        return request.scene.varied(dict(zip(keys, map(float, values), strict=True)))

    def report(done: int) -> None:
        progress.step(done / n_runs)

    if engine.has_gradient:
        first_order = _by_gradient(engine, scene, ends, keys, report)
    else:
        width = (ends[2::2] - ends[1::2])[np.arange(len(keys)), np.arange(len(keys))]
        first_order = _by_secants(engine, [scene(row) for row in ends], width, report)
    middle = first_order.middle
    slopes = first_order.power
    alone = first_order.alone
    p0 = middle.mean_power.value
    away = (ends[1:] - x0)[np.arange(2 * len(keys)), np.repeat(np.arange(len(keys)), 2)].reshape(
        -1, 2
    )
    rest = alone[1:].reshape(-1, 2) - p0 - slopes[:, None] * away
    curvature = 2.0 * rest.sum(axis=1) / (away**2).sum(axis=1)
    spread = np.atleast_2d(np.cov(x.T)) @ slopes
    steepest = FAR * spread / max(float(np.sqrt(slopes @ spread)), 1e-300)
    edges = np.array([part.ends for part in request.spreads])
    corners = np.clip(x0 + np.outer([-1.0, 1.0], steepest), edges[:, 0], edges[:, 1])
    exact = np.array([engine.run(scene(row)).mean_power.value for row in corners])
    report(n_runs)
    first = p0 + (x - x0) @ slopes
    second = 0.5 * (x - x0) ** 2 @ curvature
    second_order = p0 + (corners - x0) @ slopes + 0.5 * (corners - x0) ** 2 @ curvature
    beyond = float(np.abs(exact / second_order - 1.0).max())
    missed = float(np.quantile(np.abs(second), MOST)) / p0
    noise = half95(float(np.linalg.norm(first_order.errors * x.std(axis=0)))) / p0
    off = missed + beyond + noise + (middle.mean_power.known_error95 / p0)
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
    samples = Samples(
        engine.NAME, values, np.ones(len(x), dtype=bool), dict.fromkeys(values, off), (law,)
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


def _by_gradient(engine: Any, scene: Any, ends: Floats, keys: list[str], report: Any) -> _Slopes:
    """The slopes by the gradient of an engine without noise, and the powers at the keys' ends."""
    x0 = ends[0]
    middle, gradient = engine.run_with_slopes(scene(x0))
    p0 = middle.mean_power.value
    slopes = p0 * np.array([gradient.elasticity(key) for key in keys]) / x0
    alone = [p0]
    for row in ends[1:]:
        report(len(alone))
        alone.append(engine.run(scene(row)).mean_power.value)
    per_square = np.array([_change_of_ratio(scene, x0, k) for k in range(len(keys))])
    voltage = middle.mean_square_voltage.value * (slopes / p0 - per_square)
    return _Slopes(middle, slopes, voltage, np.array(alone), np.zeros(len(keys)))


def _change_of_ratio(scene: Any, x0: Floats, k: int) -> float:
    """The derivative of ln(P/E[V^2]), 1/R in SI units, in a key."""

    def ratio(change: float) -> float:
        problem = Problem(scene(np.where(np.arange(len(x0)) == k, x0 * (1.0 + change), x0)))
        eqs, units = problem.equations, problem.units
        return float(np.log((eqs.beta or 0.0) * (eqs.load or 0.0) * units.watts / units.volts**2))

    return (ratio(STEP) - ratio(-STEP)) / (2.0 * STEP * float(x0[k]))
