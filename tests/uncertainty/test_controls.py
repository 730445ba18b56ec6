"""A mean with controls of known mean zero: no bias, and no controls where they are too many or worth nothing."""

import numpy as np
import pytest

from harvester.uncertainty.controls import controlled_mean, scaled_least_squares
from harvester.uncertainty.value import mean_and_error


def entries(n, columns, noise, seed=1):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, columns))
    return 3.0 + x.sum(axis=1) + noise * rng.standard_normal(n), x


def test_gain_is_that_of_the_unexplained_variance():
    values, x = entries(4000, 4, 0.1)
    mean, error = controlled_mean(values, x)
    assert abs(mean - 3.0) < 4.0 * error
    assert 0.95 < error / (0.1 / np.sqrt(4000)) < 1.1


@pytest.mark.slow
def test_no_bias_from_few_entries_that_are_not_gaussian():
    """Coefficients of the same entries would be biased: here values and squares of the controls are correlated."""
    found = []
    for seed in range(2000):
        x = np.random.default_rng(seed).exponential(1.0, (40, 1)) - 1.0
        found.append(controlled_mean(x[:, 0] ** 2 + x[:, 0], x)[0])
    mean, error = mean_and_error(np.array(found))
    assert abs(mean - 1.0) < 4.0 * error


def test_too_many_controls_for_the_entries_are_left_out():
    """The first ones are used; with too few entries for one column none."""
    values, x = entries(64, 13, 0.1)
    assert controlled_mean(values, x) == pytest.approx(controlled_mean(values, x[:, :8]), rel=1e-12)
    assert (
        controlled_mean(values[:6], x[:6])
        == controlled_mean(values[:6], None)
        == mean_and_error(values[:6])
    )


def test_controls_without_spread_or_use_change_nothing():
    values, x = entries(400, 2, 0.1)
    assert controlled_mean(values, np.hstack([x, np.zeros((400, 1))])) == controlled_mean(values, x)
    other = np.random.default_rng(9).standard_normal((400, 2))
    assert controlled_mean(values, other)[1] <= mean_and_error(values)[1]
    assert controlled_mean(np.ones(400), x) == (1.0, 0.0)


def test_scaled_least_squares_leaves_a_constant_column_and_the_units_of_the_others():
    """y = 3 + 2 x_0 - 0.5 x_2, exactly; x_1 is constant, and x_2 a million times smaller."""
    x = np.random.default_rng(4).standard_normal((50, 3)) * [1.0, 0.0, 1e-6] + [0.0, 7.0, 5.0]
    values = 3.0 + 2.0 * x[:, 0] - 0.5 * x[:, 2]
    assert scaled_least_squares(values, x) == pytest.approx([2.0, 0.0, -0.5], rel=1e-6)
