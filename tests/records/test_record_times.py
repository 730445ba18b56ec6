"""Times of a record whose sampling rate changes: refused, with both parts, unlike gaps and coarse clocks."""

import re

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.records.record_times import BLOCK, even

RNG = np.random.default_rng(61)


def times(steps):
    return np.concatenate([[0.0], np.cumsum(steps)])


def times_at_two_rates(first, before, second, after):
    return times(np.concatenate([np.full(before, 1.0 / first), np.full(after, 1.0 / second)]))


@pytest.mark.parametrize("ratio", [0.25, 0.8, 1.25, 2.0])
@pytest.mark.parametrize("before", [BLOCK, BLOCK + 1, 2 * BLOCK - 1, 333, 1000])
def test_a_rate_that_changes_is_refused_where_it_does(ratio, before):
    """The parts that the message offers lie on either side of the change, no more than a block apart.

    The first had half a block at the other rate, read as gaps or as rows written twice.
    """
    time = times_at_two_rates(100.0, before, 100.0 * ratio, 500)
    with pytest.raises(InputError, match="one sampling rate") as refused:
        even(time, RNG.standard_normal(len(time)), [])
    numbers = re.search(
        r"from (\S+) to (\S+) Hz after .*`to` (\S+) .*`from` (\S+)", str(refused.value)
    )
    first, second, end, begin = (float(part.rstrip(":")) for part in numbers.groups())
    assert (first, second) == pytest.approx((100.0, 100.0 * ratio), rel=1e-3)
    assert end <= time[before] * (1.0 + 1e-5) and begin >= time[before] * (1.0 - 1e-5)
    assert np.searchsorted(time, begin) - np.searchsorted(time, end) <= BLOCK + 1
    for part in (time <= end, time >= begin):
        spacing, values = even(time[part], RNG.standard_normal(part.sum()), [])
        assert spacing == pytest.approx(0.01 if part[0] else 0.01 / ratio, rel=1e-6)
        assert len(values) == part.sum()


@pytest.mark.parametrize("count", [BLOCK, 2 * BLOCK - 1, 2 * BLOCK, 10 * BLOCK + 1])
def test_an_even_record_has_one_rate(count):
    time = times(np.full(count, 0.01))
    assert even(time, RNG.standard_normal(len(time)), [])[0] == pytest.approx(0.01)


def test_a_rate_that_comes_back_is_no_change_for_good():
    """A logger that pauses for a moment has one rate."""
    steps = np.full(20 * BLOCK, 0.01)
    steps[5 * BLOCK + 3] = 0.05
    time = times(steps)
    assert even(time, RNG.standard_normal(len(time)), [])[0] == pytest.approx(0.01)


def test_a_coarse_clock_has_one_rate():
    """Times in whole hundredths of a second of a record at 73 Hz: its steps are 0.01 and 0.02 s."""
    time = np.round(np.arange(4000) / 73.0, 2)
    assert even(time, RNG.standard_normal(len(time)), [])[0] == pytest.approx(1.0 / 73.0, rel=1e-4)


@pytest.mark.parametrize("pattern", [(0.008, 0.008, 0.014), (0.012, 0.012, 0.006)])
def test_steps_of_one_mean_are_of_one_rate(pattern):
    """A logger that becomes uneven keeps its rate: its typical step changes, and not its mean step."""
    time = times(np.concatenate([np.full(6 * BLOCK, 0.01), np.tile(pattern, 2 * BLOCK)]))
    spacing, values = even(time, RNG.standard_normal(len(time)), [])
    assert spacing == pytest.approx(0.01, rel=1e-3) and len(values) == len(time)
