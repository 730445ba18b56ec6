"""First passages of known paths, and what is said of runs that have none."""

import math

import numpy as np
import pytest
from scipy.stats import binomtest

from harvester.circuit.charging import first_passages
from harvester.studies.charging.passages import Passages, share_interval

LEVELS = np.array([1.0, 2.0])


def passages(times, coarse=None):
    at = np.linspace(0.0, 10.0, 11)
    times = np.array(times)
    coarse = times if coarse is None else np.array(coarse)
    return Passages(LEVELS, times, coarse, at, np.zeros((len(times), 11)), 10.0, 2.0, 1, 0.0)


def test_first_passages_of_a_path():
    """The first time counts, between points along the line; a level at the beginning, and one that is never reached."""
    t, u = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 2.0, -1.0, 3.0])
    assert first_passages(t, u, np.array([-1.0, 0.5, 2.0, 2.5, 4.0])) == pytest.approx(
        [0.0, 0.25, 1.0, 2.875, math.inf]
    )


def test_means_of_passages():
    found = passages([[1.0, 3.0], [3.0, 5.0]], [[1.2, 3.0], [3.2, 5.0]])
    mean = found.time_to(0)
    assert (mean.value, mean.stderr) == pytest.approx((2.0, 1.0))
    assert mean.bias == pytest.approx(0.2)
    # one more joule takes 2 s either way
    assert found.power_between(1, 1.0).value == pytest.approx(0.5)
    assert found.arrived()[[2, 3, 5]] == pytest.approx([0.0, 0.5, 1.0])


def test_what_never_arrives_has_no_mean():
    found = passages([[1.0, 3.0], [3.0, math.inf]])
    assert found.time_to(1) is None
    assert found.power_between(1, 1.0) is None
    assert found.at_least().value == pytest.approx(6.5)
    assert found.quantile(0.0) == pytest.approx(3.0)
    assert found.quantile(0.95) is None
    unsure = passages([[1.0, 3.0]], [[1.0, math.inf]])
    assert "the step" in unsure.time_to(1).unknown


@pytest.mark.parametrize(("reached", "runs"), [(0, 16), (7, 16), (16, 16), (250, 256)])
def test_interval_of_a_share(reached, runs):
    known = binomtest(reached, runs).proportion_ci(0.95, "exact")
    assert share_interval(reached, runs) == pytest.approx((known.low, known.high))
