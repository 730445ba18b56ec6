"""The known part of a response whose search was cut short."""

import pytest

from harvester.cosimulation.periodic_responses import later_half


def test_the_later_half_counts_by_its_seconds():
    """4 of 8 s: the last two runs of 1 and 3 s, and none of the way from rest."""
    known = later_half([(9.0, 9.0, 4.0), (1.0, 2.0, 1.0), (2.0, 4.0, 3.0)])
    assert known == pytest.approx((1.75, 3.5, 4.0))


def test_a_single_run_is_all_there_is():
    assert later_half([(1.0, 2.0, 3.0)]) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("runs", [[], [(0.0, 0.0, 0.0)]])
def test_nothing_was_covered(runs):
    assert later_half(runs) is None
