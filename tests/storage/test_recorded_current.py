"""The rectifier's current along a record: against a drive's, at half the windows, and a node against direct runs."""

import dataclasses
import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.measured_current import Rectifier, measured
from harvester.storage.recorded_current import grid_of, recorded, windows_of
from tests.support.bursts import SCENE, bursts, on_record, packets_directly, tone, truck
from tests.support.systems import SECOND


def table_of(scene, farads=470e-6):
    problem = Problem.of(dataclasses.replace(scene, storage=None, node=None))
    return recorded(problem, farads, 5.0), problem


@pytest.mark.slow
@pytest.mark.parametrize("mode", [(), (SECOND,)], ids=["one mode", "two modes"])
def test_a_recorded_tone_gives_the_current_of_the_drive(tmp_path, mode):
    """The windows after the ring-up have I(V) of the excitation, which another code measures with other elements."""
    t = np.arange(0.0, 12.0, 0.002)
    shaken = on_record(tmp_path, t, 1.5 * np.sin(2 * math.pi * 46.0 * t))
    found, _ = table_of(dataclasses.replace(shaken, mode=mode))
    drive = hv.Excitation(acceleration_amplitude=1.5, frequency=46.0)
    scene = dataclasses.replace(SCENE, excitation=drive, storage=None, node=None, mode=mode)
    driven = Problem.of(scene)
    expected = measured(driven, 5.0).best.at(found.best.voltages)
    assert np.abs(found.best.current[3:-2] / expected - 1.0).max() < 0.005
    assert found.separation < 0.02
    assert found.best.length * len(found.best.current) == pytest.approx(12.0, abs=found.best.length)


@pytest.mark.thorough("test_a_recorded_tone_gives_the_current_of_the_drive")
@pytest.mark.slow
def test_the_netlists_own_elements_give_the_current_of_ideal_ones(tmp_path):
    """Both in two threads, from 0 to 5 V, in three windows of a burst: the bridge's differ by 0.1 % at most."""
    t = np.arange(0.0, 4.0, 0.002)
    _, problem = table_of(on_record(tmp_path, t, 1.5 * np.sin(2 * math.pi * 46.0 * t)))
    volts = np.linspace(0.0, 5.0, 64)
    grid = grid_of(problem)._replace(windows=4)
    rectifier = Rectifier(problem)
    circuits = (one(rectifier.held) for one in (rectifier.fast, rectifier.compiled))
    ideal, own = (windows_of(problem, one, volts, grid)[0] for one in circuits)
    assert np.abs(own[1:] / ideal[1:] - 1.0).max() < 0.002


@pytest.mark.slow
def test_a_store_that_is_not_slow_is_found_out(tmp_path):
    found, _ = table_of(on_record(tmp_path, *bursts(30.0, 30.0, 10.0)), farads=1e-7)
    assert found.separation > 0.3


@pytest.mark.slow
def test_windows_are_whole_samples_and_steps(tmp_path):
    _, problem = table_of(on_record(tmp_path, *bursts(30.0, 30.0, 10.0)))
    grid = grid_of(problem)
    record = problem.equations.record
    assert grid.steps * grid.h == pytest.approx(grid.samples * record.spacing, rel=1e-12)
    assert grid.steps % 8 == 0 and grid.windows * grid.samples <= len(record.values)


@pytest.mark.thorough("test_a_recorded_tone_gives_the_current_of_the_drive")
@pytest.mark.slow
@pytest.mark.parametrize("shaking", [tone, truck])
def test_packets_on_bursts_are_those_of_direct_runs(tmp_path, shaking):
    """Ten minutes, a burst of 20 s in every 5 minutes: within 5 %; its error is below 2 %."""
    scene = on_record(tmp_path, *bursts(600.0, 300.0, of=shaking))
    node = scene.node.replace(interval=1.0, currents=(0.4e-3, 2e-3))
    scene = dataclasses.replace(
        scene, node=node, storage=scene.storage.replace(capacitance=100e-6, esr=None)
    )
    found = hv.node(scene, days=600.0 / 86400.0)
    packets = found.packets_per_hour.value / 6.0
    direct = packets_directly(scene, 600.0)
    assert direct > 60
    assert abs(packets - direct) < 0.05 * direct
    assert found.first_packet.known_error95 < 0.02 * found.first_packet.value


@pytest.mark.thorough("test_a_chip_that_cannot_be_is_one_line")
@pytest.mark.slow
def test_of_a_chip_that_looks_at_its_input_a_record_leaves_an_error_unknown(tmp_path):
    """Whether a look falls into a burst or between two is by chance: 80 % of the power in a direct run."""
    scene = on_record(tmp_path, *bursts(60.0, 20.0, 8.0))
    found = hv.node(
        dataclasses.replace(scene, chip=hv.HarvestingChip(name="bq25570", start_voltage=3.5)),
        days=0.02,
    )
    assert found.harvested.value > 0.0 and found.harvested.error95 is None
