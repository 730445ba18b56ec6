"""Numbers with their errors: in other units, and over all their errors."""

import math

import numpy as np
import pytest

from harvester.uncertainty.value import Value, mean_and_error


def test_other_units():
    """Every error is multiplied by the size of the factor; the degrees of freedom stay."""
    assert Value(1.0, 0.1, dof=5.0).scaled(2.0) == Value(2.0, 0.2, dof=5.0)
    assert Value(1.0, 0.1, 0.2, 0.3).scaled(-2.0) == Value(-2.0, 0.2, 0.4, 0.6)
    assert Value(1.0).scaled(2.0) == Value(2.0)


def test_error_is_the_sum_of_all():
    """Student's quantile of the sampling error, plus step, plus model."""
    value = Value(1.0, 0.1, 0.02, 0.003, dof=5.0)
    assert value.sampling95 == pytest.approx(2.570582 * 0.1, rel=1e-6)
    assert value.known_error95 == pytest.approx(value.sampling95 + 0.023, rel=1e-12)
    assert Value(1.0, 0.1).known_error95 == pytest.approx(0.196, rel=1e-12)


def test_error_of_few_entries():
    """The variance of two is their squared distance over 2; of one nothing is known."""
    assert mean_and_error(np.array([1.0, 3.0])) == pytest.approx((2.0, 1.0), rel=1e-12)
    assert mean_and_error(np.array([1.0])) == (1.0, math.inf)


def test_a_value_with_rounding_alone_has_six_digits():
    """No device is known to nine."""
    assert Value(22.27627215e-6, None, 1.3e-18, 0.0).format("W") == "22.2763 +- 1.3e-12 (rounding) uW"
