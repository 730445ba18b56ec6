"""Runs of engines for devices: the same answers by this process, by workers and by an executor."""

import contextlib
import os
import pathlib
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum

import pytest

import harvester as hv
from harvester.engines.device_runs import DeviceRun, DeviceWorkers
from harvester.errors import HarvesterError, SimulationError
from harvester.machine.cores import THREADS_VARIABLE, cores
from tests.support.paths import ROOT

PLATE = hv.load(ROOT / "examples" / "plate.toml")
Kind = Enum("Kind", ["LAST", "FIRST"])


def runs():
    """Three devices in two runs, and one that the engine refuses."""
    scenes = [PLATE.vary("oscillator.damping", value) for value in (5e-3, 6e-3, 7e-3)]
    yield DeviceRun(Kind.LAST, 0, hv.Averaged(), tuple(scenes[:2]))
    yield DeviceRun(Kind.LAST, 2, hv.Averaged(), tuple(scenes[2:]))
    yield DeviceRun(Kind.FIRST, 0, hv.Slow(), (PLATE,))


def computed(execution):
    """The powers by kind and index, and the class of an error."""
    found = {}
    with contextlib.closing(DeviceWorkers(execution)) as workers:
        for each in workers.answers(runs()):
            for index, answer in enumerate(each.answers, each.run.index):
                error = isinstance(answer, HarvesterError)
                found[each.run.kind, index] = type(answer) if error else answer.mean_power.value
            assert each.seconds >= 0.0
    return found


@pytest.mark.slow
def test_whoever_computes_the_answers_are_the_same():
    """An answer under another index, a lost run, or an error that ends the others would differ."""
    alone = computed(hv.Execution(workers=1))
    assert len(alone) == 4 and issubclass(alone[Kind.FIRST, 0], HarvesterError)
    assert alone[Kind.LAST, 0] > alone[Kind.LAST, 1] > alone[Kind.LAST, 2] > 0.0
    assert computed(hv.Execution(workers=2)) == alone
    with ThreadPoolExecutor(2) as executor:
        assert computed(hv.Execution(executor=executor)) == alone


class Counts:
    """An engine whose answer is the number of cores."""

    def run_many(self, scenes):
        """An error with the number."""
        return [SimulationError(str(cores())) for _ in scenes]


def test_an_executor_has_a_run_on_one_core_for_each_of_its_workers(monkeypatch):
    """Runs on all cores in each of more workers than cores would delay each other."""
    monkeypatch.setenv(THREADS_VARIABLE, "2")
    monkeypatch.delenv(THREADS_VARIABLE)
    with ThreadPoolExecutor(3) as executor:
        workers = DeviceWorkers(hv.Execution(executor=executor))
        assert workers.count == 3
        (answer,) = workers.answers(iter([DeviceRun(Kind.LAST, 0, Counts(), (PLATE,))]))
    assert str(answer.answers[0]) == "1"


class Broken:
    """An executor whose runs all end by an error of its own."""

    def __init__(self, error):
        self.error = error

    def submit(self, *_):
        """A job with the error."""
        job = Future()
        job.set_exception(self.error)
        return job


class KilledWorker(Exception):
    """Dask's, of a run that ended several workers."""


def test_errors_of_an_executor_are_no_traceback():
    """A run that ends its workers is an error of that run; an executor that is no more ends the study in one line."""
    found = computed(hv.Execution(executor=Broken(KilledWorker("three times"))))
    assert len(found) == 4 and all(issubclass(answer, HarvesterError) for answer in found.values())
    with pytest.raises(hv.SimulationError, match="the executor has disappeared"):
        computed(hv.Execution(executor=Broken(CancelledError())))
    ended = ThreadPoolExecutor(1)
    ended.shutdown()
    with pytest.raises(hv.SimulationError, match="the executor has disappeared"):
        computed(hv.Execution(executor=ended))


@dataclass(frozen=True)
class Dies:
    """An engine whose process ends until a number of files is there."""

    folder: str
    times: int

    def run_many(self, scenes):
        """An answer, or the end of the process."""
        before = len(list(pathlib.Path(self.folder).iterdir()))
        if before < self.times:
            (pathlib.Path(self.folder) / str(before)).touch()
            os._exit(1)
        return hv.Averaged().run_many(scenes)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, 2])
def test_a_run_whose_process_ends_is_tried_once_more(tmp_path, times):
    with contextlib.closing(DeviceWorkers(hv.Execution(workers=2))) as workers:
        run = DeviceRun(Kind.LAST, 0, Dies(str(tmp_path), times), (PLATE,))
        (answer,) = [each.answers[0] for each in workers.answers(iter([run]))]
    assert isinstance(answer, HarvesterError) == (times == 2)
    assert len(list(tmp_path.iterdir())) == times
