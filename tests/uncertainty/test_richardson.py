"""The limit of numbers at halved steps, and what its error is where the order holds and where it does not."""

import numpy as np
import pytest

from harvester.uncertainty.richardson import extrapolated, limit, step_bias
from harvester.uncertainty.value import mean_and_error


def test_second_order_is_extrapolated():
    """With a part of fourth order the error is what the finest step changed, and covers the truth."""
    values = [2.0 + 0.3 * h**2 + 0.1 * h**4 for h in (0.4, 0.2, 0.1)]
    value, error = limit(values)
    assert 0.0 < abs(value - 2.0) < error < 1e-3
    assert limit([5.0, *values]) == (value, error)


@pytest.mark.parametrize(
    "values", [(1.0, 1.01, 1.0), (1.0, 1.0, 1.01), (1.03, 1.01, 1.0), (1.1, 1.01, 1.0)]
)
def test_no_order_no_extrapolation(values):
    """The last number, with its change or a quarter of the change before."""
    change, before = abs(values[2] - values[1]), abs(values[1] - values[0])
    assert limit(values) == (values[2], pytest.approx(max(change, 0.25 * before)))


def test_equal_numbers_have_no_error():
    assert limit([1.5, 1.5, 1.5]) == (1.5, 0.0)


def test_three_steps_tell_both_parts_of_the_bias():
    """Orders 1 and 2, entry by entry; with opposite signs they count as if they had one, each entry with both."""
    rng = np.random.default_rng(4)
    truth = 2.0 + rng.normal(size=60)
    first = 1.0 + rng.normal(size=60)
    second = -3.0 + rng.normal(size=60)
    values = [truth + first * h + second * h**2 for h in (0.1, 0.2, 0.4)]
    assert extrapolated(values, 1.0) == pytest.approx(truth)
    bias, error = step_bias(values, 1.0)
    assert bias == pytest.approx(0.1 * first.mean() - 0.01 * second.mean())
    assert error == pytest.approx(mean_and_error(0.1 * first + 0.01 * second)[1])
    assert step_bias(values[:2], 1.0) == pytest.approx(mean_and_error(0.1 * first + 0.03 * second))
