"""Tolerances of first order: the linear law of the power from its gradient, and what it leaves out.

About the middle x0 of all spreads an engine with a gradient gives P0 and g = dP/dx, and each device
has

    P1(x) = P0 + g (x - x0)

Each key alone at its 5 % and 95 % points is computed as well, which tells its curvature c_k, and so
are the two places

    x0 -+ 1.645 C g/sqrt(g C g),    C the covariance of the keys,

at which, of all devices of a power that 5 % and 95 % are below, most lie (first-order reliability,
Hasofer and Lind, J. Eng. Mech. 100, 1974).  With P2(x) = P1(x) + sum_k c_k (x_k - x0_k)^2/2, the
error of a power is what 95 % of |P2 - P1| are below, with the larger |P - P2| of the two places and
the engine's own error.
"""

from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.engines import ENGINES
from harvester.engines.protocol import Engine
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.machine.progress import Progress
from harvester.presentation.diagnostic import note
from harvester.scene.scene import Scene
from harvester.studies.tolerance import design
from harvester.studies.tolerance.samples import Samples
from harvester.studies.tolerance.study import ToleranceRequest, ToleranceRuns
from harvester.studies.tolerance.surface import Polynomial, exponents

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


def linear_law(request: ToleranceRequest, engine: Any, progress: Progress) -> ToleranceRuns:
    """What the linear law says of all devices; raises the engine's errors, and InputError for a key that is 0."""
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

    def powers(rows: Floats, done: int) -> Floats:
        values = []
        for row in rows:
            values.append(engine.run(scene(row)).mean_power.value)
            progress.step((done + len(values)) / n_runs)
        return np.array(values)

    middle, gradient = engine.run_with_slopes(scene(x0))
    p0 = middle.mean_power.value
    slopes = p0 * np.array([gradient.elasticity(key) for key in keys]) / x0
    alone = np.append(p0, powers(ends[1:], 1))
    away = (ends[1:] - x0)[np.arange(2 * len(keys)), np.repeat(np.arange(len(keys)), 2)].reshape(
        -1, 2
    )
    rest = alone[1:].reshape(-1, 2) - p0 - slopes[:, None] * away
    curvature = 2.0 * rest.sum(axis=1) / (away**2).sum(axis=1)
    spread = np.atleast_2d(np.cov(x.T)) @ slopes
    steepest = FAR * spread / max(float(np.sqrt(slopes @ spread)), 1e-300)
    edges = np.array([part.ends for part in request.spreads])
    corners = np.clip(x0 + np.outer([-1.0, 1.0], steepest), edges[:, 0], edges[:, 1])
    exact = powers(corners, len(ends))
    first = p0 + (x - x0) @ slopes
    second = 0.5 * (x - x0) ** 2 @ curvature
    second_order = p0 + (corners - x0) @ slopes + 0.5 * (corners - x0) ** 2 @ curvature
    beyond = float(np.abs(exact / second_order - 1.0).max())
    missed = float(np.quantile(np.abs(second), MOST)) / p0
    off = missed + beyond + (middle.mean_power.known_error95 / p0)
    per_square = np.array([_change_of_ratio(scene, x0, k) for k in range(len(keys))])
    voltage = middle.mean_square_voltage.value * (1.0 + (x - x0) @ (slopes / p0 - per_square))
    half = np.maximum(np.abs(edges - x0[:, None]).max(axis=1), np.abs(x - x0).max(axis=0))
    linear = exponents(len(keys), 1)
    unexplained = float(second.var() / max((first + second).var(), 1e-300))
    coefficients = np.append(p0, slopes * half)
    surface = Polynomial(
        x0, half, linear, coefficients, float(second.std()), unexplained, np.zeros((len(linear), 1))
    )
    law = note(
        "linear_law", missed=missed, mean=float(second.mean()) / p0, beyond=beyond, runs=n_runs
    )
    values = {"mean_power": np.maximum(first, 0.0), "mean_square_voltage": np.maximum(voltage, 0.0)}
    samples = Samples(
        engine.NAME, values, np.ones(len(x), dtype=bool), dict.fromkeys(values, off), (law,)
    )
    return ToleranceRuns(samples, x, surface, alone, 0, (), {}, {})


def _change_of_ratio(scene: Any, x0: Floats, k: int) -> float:
    """The derivative of ln(P/E[V^2]), 1/R in SI units, in a key."""

    def ratio(change: float) -> float:
        problem = Problem(scene(np.where(np.arange(len(x0)) == k, x0 * (1.0 + change), x0)))
        eqs, units = problem.equations, problem.units
        return float(np.log((eqs.beta or 0.0) * (eqs.load or 0.0) * units.watts / units.volts**2))

    return (ratio(STEP) - ratio(-STEP)) / (2.0 * STEP * float(x0[k]))
