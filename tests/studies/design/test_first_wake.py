"""The time of a node's first packet on a record, found without following it for a month."""

import time

import numpy as np
import pytest

from harvester.scene.sensor_node import SensorNode, Storage
from harvester.storage.node_run import NodeRun
from harvester.storage.recorded_current import RecordedCurrent
from harvester.storage.time_limit import TimeLimit, TooLittleTimeError, limited
from harvester.studies.design.candidate import INSTANT, LONGEST, first_wake

VOLTS = np.linspace(0.0, 5.0, 33)
LOUDNESS = np.array([1.0, 0.5, 0.0, 0.7])  # of the windows of a record
NODE = SensorNode(
    wake_voltage=3.3, stop_voltage=3.0, interval=1.0, currents=(0.0,), durations=(INSTANT,)
)


def run_of(open_voltage, amperes, farads):
    """A node on a record whose windows of 20 s charge up to an open-circuit voltage."""
    charging = amperes * LOUDNESS[:, None] * np.maximum(1.0 - VOLTS / open_voltage, -0.01)
    current = RecordedCurrent(VOLTS, charging, None, 20.0)
    return NodeRun(current, Storage(capacitance=farads), NODE, None)


@pytest.mark.parametrize(
    "open_voltage, amperes, farads", [(4.5, 1e-6, 1e-3), (4.5, 1e-6, 0.1), (4.5, 1e-7, 1.0)]
)
def test_it_is_that_of_a_month(open_voltage, amperes, farads):
    """Within hours, within days, and never within a month."""
    run = run_of(open_voltage, amperes, farads)
    month = run.course(LONGEST).first
    found = first_wake(run)
    assert found == (None if month is None else pytest.approx(month, rel=1e-9))


def test_a_node_that_never_wakes_is_known_to_in_little_time():
    """A month was followed step by step, after the end of each budget: 4.3 s of CPU time for each circuit."""
    run = run_of(2.5, 1e-6, 1e-5)
    begin = time.thread_time()
    assert first_wake(run) is None
    short = time.thread_time() - begin
    begin = time.thread_time()
    assert run.course(LONGEST).first is None
    assert short < 0.1 * (time.thread_time() - begin)


def test_it_ends_with_the_budget():
    with limited(TimeLimit(0.0)), pytest.raises(TooLittleTimeError):
        first_wake(run_of(4.5, 1e-7, 1.0))
