"""Differences of two models on the same noise: no bias, their stated error, controls, records, half of the runs."""

import math

import numpy as np
import pytest
from scipy import stats

from harvester.uncertainty.paired_difference import (
    difference95,
    enough_entries,
    half_if_enough,
    share95,
)
from harvester.uncertainty.value import Value

RNG = np.random.default_rng(20261127)


def test_it_is_the_paired_t_interval():
    """Against SciPy's, of the pairs alone: the noise that both share is in neither."""
    low = 5.0 + 100.0 * RNG.standard_normal(9)
    high = low + 0.3 + 0.1 * RNG.standard_normal(8 + 1)
    found = difference95(high, low)
    interval = stats.ttest_rel(high, low).confidence_interval(0.95)
    assert found.value == pytest.approx((interval.low + interval.high) / 2.0)
    assert found.sampling95 == pytest.approx((interval.high - interval.low) / 2.0)
    assert share95(found, 5.0) == pytest.approx(max(abs(interval.low), abs(interval.high)) / 5.0)


def test_the_first_of_more_entries_are_the_pairs():
    """Those of the cheap model that the expensive one did not run are left out, with their controls."""
    low = RNG.standard_normal(100)
    controls = RNG.standard_normal((100, 1))
    high = low[:40] + 1.0
    whole = difference95(high, low, (controls[:40], controls))
    assert whole == difference95(high, low[:40], (controls[:40], controls[:40]))
    assert whole.value == pytest.approx(1.0)


@pytest.mark.statistics
@pytest.mark.parametrize("of_each", [True, False], ids=["each mean", "the difference"])
def test_controls_take_noise_away_without_a_bias(of_each):
    """Those that explain the difference, or each mean by itself; the stated error is the scatter of many."""
    found = []
    for _ in range(1000):
        own, other, shared = RNG.standard_normal((3, 32))
        noise = 0.1 * RNG.standard_normal(32)
        high, low = (own, other) if of_each else (shared + own, shared)
        found.append(difference95(high + noise + 2.0, low, (own[:, None], other[:, None])))
    values = np.array([one.value for one in found])
    stated = math.sqrt(np.mean([one.stderr**2 for one in found]))
    assert abs(values.mean() - 2.0) < 4.0 * values.std() / math.sqrt(len(values))
    assert values.std() < 0.4 * math.sqrt(2.0 / 32.0)
    assert 0.9 * values.std() < stated < 1.3 * values.std()


def test_entries_of_one_record_count_once():
    """Two entries that are alike on each record state no more than one of them."""
    high, low = RNG.standard_normal((2, 12))
    twice = difference95(np.repeat(high, 2), np.repeat(low, 2), together=2)
    once = difference95(high, low)
    assert (twice.value, twice.stderr) == pytest.approx((once.value, once.stderr))
    assert twice.dof == once.dof


def test_one_pair_of_noise_does_not_acquit():
    """Its sampling error is unknown, so that no size makes the share small; the pair of an
    excitation is all there is."""
    high, low = np.array([3.0, 3.0]), np.array([1.0, 1.0])
    found = difference95(high, low, together=2)
    assert found.value == 2.0
    assert found.error95 is None and found.unknown
    assert share95(found, 1e9) == math.inf
    certain = difference95(high[:1], low[:1], random=False)
    assert certain == Value(2.0)
    assert share95(certain, 8.0) == 0.25


@pytest.mark.parametrize(
    ("count", "together", "enough"), [(3, 1, 3), (64, 64, 256), (512, 64, 512)]
)
def test_enough_entries_have_some_records(count, together, enough):
    assert enough_entries(count, together) == enough


@pytest.mark.parametrize(("enough", "runs"), [(True, 3), (False, 5)])
def test_half_of_the_jobs_do_if_they_are_enough(enough, runs):
    """The jobs that were run are not run again."""
    calls = []

    def run(jobs):
        calls.extend(jobs)
        return [10 * job for job in jobs]

    found = half_if_enough([1, 2, 3, 4, 5], run, lambda rows: list(rows), lambda _: enough)
    assert calls == [1, 2, 3, 4, 5][:runs]
    assert found == [10, 20, 30, 40, 50][:runs]
