"""Threads of a study end with it."""

import time

import pytest

from harvester.machine.threads import GivenUp, end_if_given_up, in_threads


def test_results_are_in_order():
    with in_threads(lambda x: 2 * x, range(20)) as results:
        assert list(results) == [2 * x for x in range(20)]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_work_ends_if_its_caller_gives_up(error):
    """At once, also in threads of its own, and the rest never begins."""
    ended = []

    def work(number):
        def part(_):
            while True:
                time.sleep(0.001)
                end_if_given_up()

        try:
            if number == 0:
                return
            with in_threads(part, [1, 2]) as parts:
                list(parts)
        except GivenUp:
            ended.append(number)
            raise

    def stop(results):
        next(results)
        time.sleep(0.1)
        raise error

    begin = time.monotonic()
    with pytest.raises(error), in_threads(work, range(9)) as results:
        stop(results)
    assert time.monotonic() - begin < 10.0
    assert 1 <= len(ended) < 8


def test_work_of_nobody_is_never_given_up():
    end_if_given_up()
