"""Two threads that begin and end studies at the same moment: each has its processes, and no error of the other's."""

import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor

import loky
import pytest

from harvester.cosimulation import worker_pool
from harvester.machine import processes


@pytest.fixture
def own_workers(monkeypatch):
    """Two workers at a time, and none of an earlier test."""
    monkeypatch.setattr(worker_pool, "worker_count", lambda: 2)
    monkeypatch.setattr(worker_pool, "idle_workers", processes.idle_processes())
    monkeypatch.setattr(worker_pool, "workers_ahead", deque())
    yield
    for process in worker_pool.idle_workers:
        processes.kill(process)


def begun_and_waiting(begun, end):
    """A job that ends as soon as a file is there."""
    begun.touch()
    while not end.exists():
        time.sleep(0.01)
    return "ended"


@pytest.mark.slow
def test_a_study_that_fails_ends_no_process_of_another(own_workers, tmp_path):
    """The process that one thread had begun with `ahead` runs another's job: it was killed with the first's error.

    That job had ended in "ngspice ended abruptly".
    """
    files = tmp_path / "begun", tmp_path / "end"
    with ThreadPoolExecutor(1) as pool:
        with pytest.raises(ZeroDivisionError), worker_pool.ahead((abs, (-1,))) as first:
            first.result(60)
            answers = pool.submit(
                lambda: list(worker_pool.map_in_workers(begun_and_waiting, [files]))
            )
            while not files[0].exists() and not answers.done():
                time.sleep(0.01)
            raise ZeroDivisionError
        files[1].touch()
        assert answers.result(60) == ["ended"]


def test_a_study_that_fails_leaves_the_processes_ahead_of_another(own_workers):
    """It forgot all of them: nobody waited for the other thread's process, and nobody ended it."""
    other = loky.ProcessPoolExecutor(1), []
    with pytest.raises(ZeroDivisionError), worker_pool.ahead((abs, (-1,))):
        worker_pool.workers_ahead.append(other)
        raise ZeroDivisionError
    assert list(worker_pool.workers_ahead) == [other]
