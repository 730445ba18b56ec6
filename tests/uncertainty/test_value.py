"""Numbers with their errors: in other units, and over all their errors."""

import dataclasses
import math

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.uncertainty.value import Value, clock, mean_and_error, percent


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
    """The variance of two is their squared distance over 2; from one nothing is known."""
    assert mean_and_error(np.array([1.0, 3.0])) == pytest.approx((2.0, 1.0), rel=1e-12)
    assert mean_and_error(np.array([1.0])) == (1.0, math.inf)


def test_a_value_with_rounding_alone_has_six_digits():
    """No device is known to nine."""
    assert Value(22.27627215e-6, None, 1.3e-18, 0.0).format("W") == "22.2763 uW (closed form)"
    assert Value(10.0, None, 0.0, 0.0).format("s") == "10 s (unaffected by errors)"


def test_a_value_is_a_number_with_a_unit():
    """float(), a format, arrays; without a format the errors and the unit are reported."""
    power = Value(8.4e-6, stderr=1e-8, unit="W")
    assert float(power) == 8.4e-6 and f"{power:.1e}" == "8.4e-06"
    assert (
        f"{power}"
        == str(power)
        == repr(power)
        == power.format("W")
        == "8.4 +- 0.02 (95 %, sampling) uW"
    )
    assert np.array([power, power], dtype=float).tolist() == [8.4e-6, 8.4e-6]
    assert math.isclose(power, 8.4e-6)
    assert power.scaled(1e-3, "J").unit == "J" and power.scaled(2.0).unit == ""


def test_values_are_ordered_by_their_numbers():
    """Whatever their errors are, also among plain numbers; not where they have different units."""
    low = Value(1.0, stderr=5.0, unit="W")
    high = Value(2.0, unit="W")
    assert low < high and high > low and not low > high
    assert (
        low < 1.5 < high
        and low >= 1.0
        and max([low, high]) is high
        and sorted([high, low]) == [low, high]
    )
    assert low != dataclasses.replace(low, stderr=4.0)  # equal are those of equal errors
    with pytest.raises(
        InputError, match="values must have one unit to be ordered, but have W and V"
    ):
        _ = low < Value(2.0, unit="V")
    with pytest.raises(TypeError):
        _ = low < "2.0"


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (0.314, "0.31 s"),
        (12.4, "12 s"),
        (59.6, "1 min"),
        (99.7, "1 min 40 s"),
        (243.0, "4 min 3 s"),
        (7500.0, "2 h 5 min"),
        (47.5 * 3600.0, "47 h 30 min"),
        (48.0 * 3600.0, "2 days"),
        (3e5, "3.47 days"),
        (6.4e8, "20.3 years"),
    ],
)
def test_times_are_told_as_people_say_them(seconds, told):
    assert clock(seconds) == told


@pytest.mark.parametrize(
    ("value", "unit", "told"),
    [
        (Value(260.0, stderr=400.0), "", "260 +- 780 (95 %, sampling)"),
        (Value(780e-6, stderr=1e-3), "W", "780 +- 2000 (95 %, sampling) uW"),
        (Value(780.0, stderr=1000.0), "s", "13 min +- 33 min 20 s (95 %, sampling)"),
        (Value(240.0, unknown="the step"), "s", "4 min (the error of the step is not known)"),
        (
            Value(243.0, stderr=5.0, bias=0.1),
            "s",
            "4 min 3 s +- 9.8 s (95 %, sampling) +- 0.1 s (step)",
        ),
        (Value(243.12, stderr=0.05), "s", "243.12 +- 0.098 (95 %, sampling) s"),
        (Value(7500.0), "s", "2 h 5 min"),
        (Value(10050.01, model=2.5e-6), "s", "2 h 47 min (error below 1 min)"),
        (Value(1234.5678, bias=2e-3), "s", "1234.5678 +- 0.002 (step) s"),
        (Value(0.0123, bias=1e-4), "s", "12.3 +- 0.1 (step) ms"),
    ],
)
def test_no_number_of_a_size_that_people_say_has_an_exponent(value, unit, told):
    """Nor where its error is larger; times of a minute or more are in minutes, unless known to half a second."""
    assert value.format(unit) == told


@pytest.mark.parametrize(
    ("error", "value", "told"),
    [
        (0.05, -2.0, "2.5 %"),
        (0.0, 3.0, "0 %"),
        (1e-9, 2.0, "< 0.001 %"),
        (2.0, 0.01, "20000 %"),
        (1.99, 2.0, "100 %"),
    ],
)
def test_an_error_in_percent(error, value, told):
    assert percent(error, value) == told


def test_normal_standard_error_has_the_same_interval():
    """Student's quantile for 5 degrees of freedom is 2.5706: 0.1 of it is as wide as 0.1312 with 1.96."""
    value = Value(1.0, 0.1, dof=5.0)
    assert value.normal_stderr == pytest.approx(0.1 * 2.570582 / 1.96, rel=1e-6)
    assert Value(1.0, 0.1).normal_stderr == pytest.approx(0.1)


def test_the_root_of_a_mean_square_has_half_its_relative_error():
    """d sqrt(s) = ds/(2 sqrt(s)) for each part, and the relative error of sqrt(s) is half that of s."""
    square = Value(9.0, 0.6, 0.3, 0.12, dof=7.0)
    root = square.root()
    parts = (root.value, root.stderr, root.bias, root.model, root.dof)
    assert parts == pytest.approx((3.0, 0.1, 0.05, 0.02, 7.0), rel=1e-12)
    assert root.known_error95 / root.value == pytest.approx(
        0.5 * square.known_error95 / square.value, rel=1e-12
    )
    assert Value(9.0).root().stderr is None
