"""Planning towards a target error: the step and the effort that reach it at the least cost."""

import math
import time

import numpy as np
import pytest

from harvester.uncertainty.target import CHANGE, FACTORS, Target, added_effort, best_factor
from harvester.uncertainty.value import Value


def cost(within, bias, factor):
    """Work to reach |b| f^2 + 1.96 sqrt(S/T) = within, up to a constant."""
    room = within - bias * factor**2
    return math.inf if room <= 0.0 else 1.0 / (factor * room**2)


@pytest.mark.parametrize("bias", np.geomspace(1e-6, 0.3, 25))
def test_the_best_step_is_near_the_cheapest(bias):
    """A precisely known bias: never more expensive than by `CHANGE` than the best of all
    factors."""
    chosen = cost(0.01, bias, best_factor(0.01, bias, 0.0))
    assert chosen <= CHANGE * min(cost(0.01, bias, f) for f in FACTORS) * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("bias", "error", "factor"),
    [(0.02, 0.03, 1.0), (0.02, 0.001, 0.25), (0.0, 0.01, 1.0), (0.0, 1e-5, 4.0)],
)
def test_only_what_is_seen_counts(bias, error, factor):
    """Noise does not shorten a step, and a longer one must be known to be good."""
    assert best_factor(0.01, bias, error) == factor


def test_variance_and_reached():
    target = Target(0.01)
    value = Value(100.0, 0.3, bias=0.2)
    assert target.reached(value)
    assert not target.reached(Value(100.0, 0.5, bias=0.2))
    assert target.variance(value) == pytest.approx((0.8 / 1.96) ** 2)
    assert target.variance(Value(100.0, 0.3, bias=1.2)) == 0.0
    few = Value(100.0, 0.3, bias=0.2, dof=5)
    assert target.variance(few) == pytest.approx((0.8 / 2.5706) ** 2, rel=1e-4)
    assert target.seconds_left == math.inf


def test_budget():
    target = Target(0.01, budget=2.0, begin=time.perf_counter() - 1.5)
    assert 0.4 < target.seconds_left < 0.5
    short = target.shortfall(Value(1.0, 0.1))
    assert (short["within"], short["budget"], short["error"]) == (
        target.within,
        2.0,
        pytest.approx(0.196),
    )
    assert 500.0 < short["more"] < 600.0 and short["enough"] > short["more"]
    assert target.shortfall(Value(0.0, 0.1))["error"] is None


def test_further():
    """Neither a trifle nor a leap."""
    assert added_effort(10.0, 10.1) == pytest.approx(1.0)
    assert added_effort(10.0, 20.0) == pytest.approx(11.0)
    assert added_effort(10.0, math.inf) == pytest.approx(80.0)


@pytest.mark.parametrize("within", [0.003, 0.01, 0.2])
def test_another_step_is_taken_only_where_it_pays(within):
    """A step is changed for `CHANGE` times less work and more, never for less; and always for more than that."""
    biases = within * np.geomspace(1e-4, 1e4, 60)
    for bias in biases:
        chosen = best_factor(within, bias, 0.0)
        works = {f: cost(within, bias, f) for f in FACTORS if bias * f**2 < 0.7 * within}
        now = works.get(1.0, math.inf)
        assert chosen == 1.0 or CHANGE * works[chosen] < now * (1.0 + 1e-12)
        assert chosen != 1.0 or CHANGE * min(works.values(), default=math.inf) >= now * (
            1.0 - 1e-12
        )


def test_a_bias_that_takes_seven_tenths_of_the_target_leaves_too_little():
    """At the smallest step that there is: no work reaches the target well, so that the step stays."""
    smallest = min(FACTORS)
    assert best_factor(0.01, 0.69 * 0.01 / smallest**2, 0.0) == smallest
    assert best_factor(0.01, 0.71 * 0.01 / smallest**2, 0.0) == 1.0
