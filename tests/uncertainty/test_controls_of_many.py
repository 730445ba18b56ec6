"""Controls and step biases of many sets at a time are those that each set has alone."""

import numpy as np
import pytest

from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.controls_of_many import (
    controlled_entries_of_many,
    means_and_errors,
    step_biases,
)
from harvester.uncertainty.richardson import step_bias
from harvester.uncertainty.value import mean_and_error


def sets(seed, count=5, entries=64, quantities=2, columns=4):
    """Values and controls of sets that differ in noise; each set lacks another column."""
    rng = np.random.default_rng(seed)
    controls = rng.standard_normal((count, entries, columns)) * rng.uniform(0.1, 9.0, columns)
    for one in range(count):
        controls[one, :, (one + 3) % (columns + 2) : (one + 3) % (columns + 2) + 1] = 0.0
    weights = rng.standard_normal((count, columns, quantities))
    noise = rng.standard_normal((count, entries, quantities))
    return 2.0 + controls @ weights + rng.uniform(0.1, 2.0, (count, 1, 1)) * noise, controls


@pytest.mark.parametrize("columns", [1, 4, 11])  # of 64 entries 8 columns are fitted at most
def test_controls_of_many_sets_are_those_of_each(columns):
    values, controls = sets(7, columns=columns)
    many = controlled_entries_of_many(values, controls)
    for one, (value, control) in enumerate(zip(values, controls, strict=True)):
        for quantity in range(values.shape[-1]):
            alone = controlled_entries(value[:, quantity], control)
            assert many[one, :, quantity] == pytest.approx(alone, rel=1e-6, abs=1e-9)


def test_controls_without_spread_leave_the_values():
    values, controls = sets(8)
    assert (controlled_entries_of_many(values, 0.0 * controls) == values).all()


def test_means_and_errors_of_many_sets():
    values, _ = sets(9)
    mean, error = means_and_errors(values)
    for one, value in enumerate(values):
        for quantity in range(values.shape[-1]):
            expected = mean_and_error(value[:, quantity])
            assert (mean[one, quantity], error[one, quantity]) == pytest.approx(expected)


@pytest.mark.parametrize("steps", [2, 3])
def test_step_biases_of_many_sets_are_those_of_each(steps):
    """Also if the paths of the steps part, so that each step is better controlled alone."""
    rng = np.random.default_rng(steps)
    order = np.array([1.9, 1.7, 1.3, 1.0, 1.5])
    parts = [sets(20 + step) for step in range(steps)]
    apart = rng.uniform(0.0, 1.0, 5)[:, None, None] < 0.5
    values = np.array(
        [np.where(apart, part[0], parts[0][0] * (1.0 + 0.1 * k)) for k, part in enumerate(parts)]
    )
    controls = np.array([np.where(apart, part[1], parts[0][1]) for part in parts])
    bias, error = step_biases(values, controls, order)
    for one in range(5):
        beside = np.concatenate([*controls[:, one]], axis=-1)
        for quantity in range(values.shape[-1]):
            alone = step_bias(values[:, one, :, quantity], float(order[one]), beside)
            assert (bias[one, quantity], error[one, quantity]) == pytest.approx(
                alone, rel=1e-5, abs=1e-8
            )
