"""Times to voltages of a storage capacitor: closed forms, and the law of a random walk with
drift."""

import math

import numpy as np
import pytest

from harvester.cosimulation.charging import first_passages
from harvester.storage.rectified_current import (
    RectifiedCurrent,
    error_of_times,
    random_paths,
    times_to,
)

C, OHM = 1e-4, 1e6


def table(current, density=0.0, stderr=None, lag=0.0, ring_up=0.0):
    volts = np.linspace(0.0, 10.0, 12)
    one = np.ones(len(volts))
    return RectifiedCurrent(
        volts, current(volts) * one, stderr, density * one, one, lag * one, ring_up
    )


def test_a_constant_current_with_a_resistor_charges_exponentially():
    levels = np.array([1.0, 4.0, 7.9])
    found = times_to(levels, table(lambda v: 8e-6 + 0.0 * v), C, OHM)
    assert found == pytest.approx(-OHM * C * np.log(1.0 - levels / 8.0), rel=1e-4)


def test_what_the_current_cannot_reach_takes_for_ever():
    found = times_to(np.array([3.0, 9.0]), table(lambda v: 8e-6 - 1e-6 * v), C, math.inf)
    assert math.isfinite(found[0]) and found[1] == math.inf


def test_the_ring_up_and_the_lag_are_counted():
    """The ring-up is a delay; a lag tau leaves the charge tau (I(V) - I(0)) over, of a current that falls with V."""
    falling = lambda v: 1e-5 - 1e-6 * v  # noqa: E731 - a line
    levels = np.array([5.0])
    plain = times_to(levels, table(falling), C, math.inf)[0]
    assert times_to(levels, table(falling, ring_up=2e-5), C, math.inf)[0] == pytest.approx(
        plain + 2.0, rel=1e-9
    )
    assert times_to(levels, table(falling, lag=3.0), C, math.inf)[0] == pytest.approx(
        plain - 3.0 * math.log(2), rel=1e-4
    )


@pytest.mark.slow
def test_random_paths_pass_as_a_random_walk_with_drift():
    """Mean L/v and variance D L/v^3 of the first passage through L, D being the density of V; the wall at 0 is far."""
    density = (2e-6) ** 2
    level = 8.0
    count = 4096
    t, v = random_paths(
        table(lambda v: 1e-5 + 0.0 * v, density=density), C, math.inf, level, 200.0, count, 3, False
    )
    times = np.array([first_passages(t, one, np.array([level]))[0] for one in v])
    mean = level * C / 1e-5
    variance = density / C**2 * level / (1e-5 / C) ** 3
    assert abs(times.mean() - mean) < 4.0 * math.sqrt(variance / count) + 0.01 * mean
    assert times.var() == pytest.approx(variance, rel=0.1)


def test_random_paths_stay_below_a_clamp_that_answers_within_a_step():
    """Ornstein and Uhlenbeck: where the current falls by g per volt the variance is S/(2 g C), here near 2 V."""
    slope = 1.0
    _, v = random_paths(
        table(lambda v: 1e-5 + slope * (2.0 - v), density=1e-8),
        C,
        math.inf,
        8.0,
        200.0,
        4096,
        3,
        False,
    )
    assert v.max() < 3.0
    settled = v[:, -1]
    deviation = math.sqrt(1e-8 / (2.0 * slope * C))
    assert settled.mean() == pytest.approx(2.0 + 1e-5 / slope, abs=4.0 * deviation / 64.0)
    assert settled.std() == pytest.approx(deviation, rel=4.0 / math.sqrt(2.0 * 4096))


def test_the_error_of_sampling_adds_up_over_independent_voltages():
    """As scattered tables have it, drawn with the standard error that is stated."""
    rng, levels, base = (
        np.random.default_rng(4),
        np.array([8.0]),
        table(lambda v: 1e-5 - 5e-7 * v, stderr=np.full(12, 3e-8)),
    )
    drawn = []
    for _ in range(200):
        noisy = base.current + 3e-8 * rng.standard_normal(12)
        drawn.append(times_to(levels, table(lambda v, noisy=noisy: noisy), C, math.inf)[0])
    assert error_of_times(levels, base, C, math.inf)[0] == pytest.approx(np.std(drawn), rel=0.2)


def test_a_time_that_a_standard_error_makes_infinite_has_an_infinite_error():
    """A storage capacitor whose current at the target is as large as its standard error may not get
    there."""
    wide = np.full(12, 3e-8)
    near = table(lambda v: 1e-5 - (1e-5 - 2e-8) / 8.0 * v, stderr=wide)
    errors = error_of_times(np.array([4.0, 8.0]), near, C, math.inf)
    assert math.isfinite(errors[0])
    assert errors[1] == math.inf
