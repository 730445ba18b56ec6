"""Runs of engines for devices: the same answers by this process, by workers and by an executor."""

import contextlib
from concurrent.futures import ThreadPoolExecutor
from enum import Enum

import pytest

import harvester as hv
from harvester.engines.device_runs import DeviceRun, DeviceWorkers
from harvester.errors import HarvesterError
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
