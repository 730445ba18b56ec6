"""First passages of known paths, and the reports on runs that have none."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import binomtest
from scipy.stats import t as student_t

from harvester.cosimulation.charging import first_passages
from harvester.studies.charging.passages import Passages, share_interval

LEVELS = np.array([1.0, 2.0])


def passages(times, coarse=None):
    at = np.linspace(0.0, 10.0, 11)
    times = np.array(times)
    coarse = times if coarse is None else np.array(coarse)
    return Passages(LEVELS, times, coarse, at, np.zeros((len(times), 11)), 10.0, 2.0, 1, 0.0)


def test_first_passages_of_a_path():
    """The first time counts, between points along the line; a level at the beginning, and one that is never reached."""
    t = np.array([0.0, 1.0, 2.0, 3.0])
    u = np.array([0.0, 2.0, -1.0, 3.0])
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


def test_a_target_that_no_run_reaches_has_the_time_watched_without_an_error():
    """Whatever they reach before: an error of 0 would state that the time is known."""
    stated = passages([[1.0, math.inf], [3.0, math.inf]]).at_least()
    assert (stated.value, stated.stderr, stated.bias) == (10.0, None, None)


def test_a_target_that_coarser_runs_alone_reach_has_the_error_of_the_step():
    """At a smaller step no run is there in time, so that the time depends on the step."""
    never = [[1.0, math.inf], [3.0, math.inf]]
    stated = passages(never, [[1.0, math.inf], [3.0, 9.0]]).at_least()
    assert stated.value == pytest.approx(10.0) and stated.bias >= 0.5


@pytest.mark.parametrize(("reached", "runs"), [(0, 16), (7, 16), (16, 16), (250, 256)])
def test_interval_of_a_share(reached, runs):
    known = binomtest(reached, runs).proportion_ci(0.95, "exact")
    assert share_interval(reached, runs) == pytest.approx((known.low, known.high))


def covered(alike, runs_a_record, records=8, repeats=600, true=0.6):
    """How many 95 % intervals of the fraction that arrives hold the true one, over repeats, as z of a binomial count.

    First as stated, then as if all runs were independent; the chance of a record's runs is drawn
    from a beta law, whose spread is the greater the more ``alike`` they are.
    """
    rng = np.random.default_rng(1)
    held = np.zeros(2)
    for _ in range(repeats):
        chance = rng.beta(true / alike, (1.0 - true) / alike, records)
        there = rng.random((records, runs_a_record)) < chance[:, None]
        times = np.where(there, 1.0, math.inf).reshape(-1, 1)
        found = dataclasses.replace(passages(times), together=runs_a_record)
        naive = share_interval(int(there.sum()), there.size)
        held += [low <= true <= high for low, high in (found.reached_between(), naive)]
    return (held - 0.95 * repeats) / math.sqrt(repeats * 0.95 * 0.05)


@pytest.mark.parametrize("alike", [0.05, 0.5])
def test_runs_on_one_record_are_no_independent_ones(alike):
    """The interval of a share holds the true one as often as it states, where independent runs would claim too much."""
    stated, naive = covered(alike, 64)
    assert stated > -4.0
    assert naive < -4.0


def test_records_without_a_likeness_say_as_much_as_their_runs():
    """If runs on a record are as independent as others, their interval is not much wider; all alike count as one."""
    rng = np.random.default_rng(2)
    times = np.where(rng.random((64 * 64, 1)) < 0.3, 1.0, math.inf)
    apart = passages(times)
    together = dataclasses.replace(passages(times), together=64)
    narrow, wide = (np.diff(one.reached_between())[0] for one in (apart, together))
    assert narrow <= 1.001 * wide < 1.4 * narrow
    every = dataclasses.replace(passages(np.ones((128, 1))), together=64)
    assert every.reached_between() == pytest.approx(share_interval(2, 2))


def test_runs_that_are_all_alike_on_their_record_are_as_many_as_records():
    """A record whose runs all arrive, or none, is one run: the interval is about that of so many independent ones."""
    arrives = np.repeat([1.0] * 12 + [math.inf] * 12, 50)
    alike = dataclasses.replace(passages(np.column_stack([arrives, arrives])), together=50)
    low, high = alike.reached_between()
    known = share_interval(12, 24)
    assert (low, high) == pytest.approx(known, abs=0.02)
    alone_low, alone_high = dataclasses.replace(alike, together=1).reached_between()
    assert alone_high - alone_low < 0.25 * (high - low)


@pytest.mark.parametrize("records", [4, 25])
def test_records_with_the_same_share_count_each_once(records):
    """Their shares have no spread, from which nothing can be estimated."""
    arrives = np.tile([1.0, math.inf], 50 * records)
    same = dataclasses.replace(passages(np.column_stack([arrives, arrives])), together=100)
    assert same.reached_between() == pytest.approx(share_interval(0.5 * records, records))


def test_one_run_has_its_own_share():
    """Without noise there is one run, which arrives or does not."""
    assert passages([[1.0, 3.0]]).reached_between() == (1.0, 1.0)
    assert passages([[1.0, math.inf]]).reached_between() == (0.0, 0.0)


def arrivals(records):
    """Passages of runs on one record each, of which some arrive: a list of records of 0 and 1."""
    times = [[1.0, 2.0 if run else math.inf] for record in records for run in record]
    return dataclasses.replace(passages(times), together=len(records[0]))


def test_runs_that_are_alike_on_each_record_are_worth_the_records():
    """Runs of one record that all arrive or all fail count once: n - 1 records by their spread.

    The uncertainty of that spread costs the square of the ratio of Student's quantiles.
    """
    (n, m, come) = (10, 4, 3)
    found = arrivals([[number < come] * m for number in range(n)])
    worth = (n - 1) * (student_t.ppf(0.975, n * m - 1) / student_t.ppf(0.975, n - 1)) ** 2
    assert found.reached == pytest.approx(0.3)
    assert found.reached_between() == pytest.approx(share_interval(0.3 * worth, worth), rel=1e-9)


def test_records_with_one_share_are_worth_their_number():
    """No spread of the records shows that their runs are independent."""
    found = arrivals([[1, 0, 0, 1]] * 6)
    assert found.reached_between() == pytest.approx(share_interval(3.0, 6))


def test_runs_are_worth_no_more_than_their_number():
    """Records that differ less than independent runs would are no more than these."""
    found = arrivals([[1, 0] * 8] * 5 + [[1, 1] + [1, 0] * 7])
    assert found.reached_between() == pytest.approx(share_interval(49.0, 96))


def test_two_runs_have_an_interval():
    """One run of noise-free excitation is certain; one of two that arrives leaves much open."""
    assert arrivals([[1], [0]]).reached_between() == pytest.approx(share_interval(1.0, 2))
    assert arrivals([[1]]).reached_between() == (1.0, 1.0)
