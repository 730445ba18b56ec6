"""The control variate: no bias, the standard error that it states, and the split of effort that costs least."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from harvester.uncertainty.control_variate import (
    controlled,
    differing,
    explained_and_controlled,
    split,
)
from harvester.uncertainty.value import Value

RNG = np.random.default_rng(20261121)


def pairs(n, correlation, slope=0.7):
    """(high, low) of n pairs: E[high] = 3, E[low] = 5, deviations 2 and 2/slope."""
    low = RNG.standard_normal(n)
    high = correlation * low + math.sqrt(1.0 - correlation**2) * RNG.standard_normal(n)
    return 3.0 + 2.0 * high, 5.0 + 2.0 / slope * low


def many(count, n, correlation, error, square=False):
    """Estimates of E[high] from as many independent experiments; ``square`` makes high depend on low squared."""
    found = []
    for _ in range(count):
        high, low = pairs(n, correlation)
        if square:
            high = high + 0.5 * ((low - 5.0) ** 2 - (2.0 / 0.7) ** 2)
        found.append(controlled(high, low, Value(5.0 + error * RNG.standard_normal(), error)))
    return found


@pytest.mark.statistics
@pytest.mark.parametrize("n", [8, pytest.param(16, marks=pytest.mark.thorough("test_no_bias"))])
def test_no_bias(n):
    """The best weight is unknown and high is not linear in low; a weight of the same pairs would be 16 sigma off."""
    values = np.array([one.value.value for one in many(2500, n, 0.9, 0.1, square=True)])
    assert abs(values.mean() - 3.0) < 4.0 * values.std() / math.sqrt(len(values))


@pytest.mark.statistics
@pytest.mark.parametrize(
    "correlation", [pytest.param(0.0, marks=pytest.mark.thorough("test_stated_error")), 0.999]
)
def test_stated_error(correlation):
    """The 95 % interval with Student's quantile holds the truth in 95 % of the cases, with 16 pairs as with many.

    As 8 pairs weigh the other 8, the squared error that is stated is 8 to 15 % above the variance;
    for 4000 variances the scatter is 2.3 %.
    """
    found = many(4000, 16, correlation, 0.02)
    inside = np.mean([abs(one.value.value - 3.0) < one.value.sampling95 for one in found])
    assert abs(inside - 0.95) < 0.015
    squares = np.mean([one.value.stderr**2 for one in found])
    values = np.array([one.value.value for one in found])
    assert 0.99 < squares / values.var() < 1.24


def test_weight_and_correlation():
    high, low = pairs(20_000, 0.9)
    found = controlled(high, low, Value(5.0, 0.0))
    assert found.correlation == pytest.approx(0.9, abs=0.01)
    assert found.weight == pytest.approx(0.9 * 0.7, abs=0.01)
    assert found.residual == pytest.approx(4.0 * (1 - 0.81), rel=0.05)


def test_degrees_of_freedom():
    """n - 2 where the cheap mean is exact; those of the cheap mean too where its error counts."""
    high, low = pairs(16, 0.9)
    assert controlled(high, low, Value(5.0, 0.0)).value.dof == pytest.approx(14.0, rel=1e-12)
    assert controlled(high, low, Value(5.0, 1e6, dof=3.0)).value.dof == pytest.approx(3.0, rel=1e-6)


def test_nothing_to_gain():
    """A cheap model that is constant, or has nothing to do with it, leaves the plain mean."""
    high, _ = pairs(16, 0.0)
    constant = controlled(high, np.ones(16), Value(1.0, 0.0))
    assert (constant.value.value, constant.weight, constant.correlation) == (
        pytest.approx(high.mean()),
        0.0,
        0.0,
    )
    assert constant.value.stderr == pytest.approx(high.std(ddof=1) / 4.0, rel=0.2)


@pytest.mark.parametrize(
    ("residual", "pair_cost", "spread", "time_cost"),
    [(1.0, 2.0, 30.0, 0.01), (0.01, 5.0, 1.0, 1.0)],
)
def test_split_is_the_cheapest(residual, pair_cost, spread, time_cost):
    """Against a search over all ways to reach the same variance."""
    variance = 1e-4
    n, duration = split(variance, residual, pair_cost, spread, time_cost)
    assert residual / n + spread / duration == pytest.approx(variance)

    def cost(share):  # of the variance that the pairs may have
        return (
            residual / (share * variance) * pair_cost
            + spread / ((1.0 - share) * variance) * time_cost
        )

    best = minimize_scalar(
        cost, bounds=(1e-6, 1.0 - 1e-6), method="bounded", options={"xatol": 1e-10}
    )
    assert n * pair_cost + duration * time_cost == pytest.approx(best.fun, rel=1e-6)
    gain = 1.0 / (math.sqrt(0.5) + math.sqrt(0.5 * 0.01)) ** 2
    high, low = pairs(40_000, math.sqrt(0.5))
    assert controlled(high, low, Value(5.0, 0.0)).gain(0.01) == pytest.approx(gain, rel=0.05)


@pytest.mark.statistics
def test_what_is_known_to_be_explained_is_not_fitted():
    """Eight runs, whose six entries are correlated: less than half of the variance, and an honest interval.

    The controls' weights are those of many other entries, here the true ones; if they explain
    nothing, they are weighed by the entries.
    """
    fitted = []
    known = []
    useless = []
    for _ in range(600):
        explained, of_low, of_high = (np.repeat(RNG.standard_normal(8), 6) for _ in range(3))
        low, high = 5.0 + explained + 0.3 * of_low, 3.0 + explained + 0.3 * of_high
        mean = Value(5.0, 1e-3)
        fitted.append(controlled(high, low, mean, explained[:, None], 6).value)
        known.append(explained_and_controlled(high, low, mean, explained, 6).value)
        useless.append(
            explained_and_controlled(
                high, low, mean, 50.0 * np.repeat(RNG.standard_normal(8), 6), 6
            ).value
        )
    of_fitted, of_known, of_useless = (
        np.array([one.value for one in each]) for each in (fitted, known, useless)
    )
    assert of_known.var() < 0.5 * of_fitted.var()
    assert of_useless.var() < 4.0 * of_fitted.var()
    assert abs(of_known.mean() - 3.0) < 4.0 * of_known.std() / math.sqrt(600)
    inside = np.mean([abs(one.value - 3.0) < one.sampling95 for one in known])
    assert 0.93 < inside < 0.99


def test_what_short_pairs_lack_of_a_difference_is_a_part_of_the_bias():
    """E[low] + E[high - low], and what they may lack next to the bias of low."""
    low = RNG.standard_normal(400)
    high = low + 0.01 + 1e-3 * RNG.standard_normal(400)
    found = differing(high, low, Value(2.0, 0.02, 0.001, dof=50.0), 0.003)
    off = float(np.mean(high - low))
    assert found.value.value == 2.0 + off
    assert found.value.bias == pytest.approx(0.001 + 0.006)
    assert found.value.stderr == pytest.approx(math.hypot(0.02, np.std(high - low, ddof=1) / 20.0))
    assert found.weight == 1.0 and found.residual == pytest.approx(np.var(high - low, ddof=1))
