"""A node on a store against its own arithmetic: the charge that comes is the charge that goes."""

import numpy as np
import pytest

import harvester as hv
from harvester.storage.node_run import NodeRun
from harvester.storage.rectified_current import RectifiedCurrent

C = 1e-4


def run(amperes=1e-5, storage=None, **node):
    """A constant current into 100 uF up to 6 V; a node that sends 10 ms of 5 mA every second, from 4 V to 2 V."""
    volts, one = np.linspace(0.0, 6.0, 12), np.ones(12)
    table = RectifiedCurrent(volts, amperes * one, None, one, one, 0.0 * one, 0.0)
    given = {"wake_voltage": 4.0, "stop_voltage": 2.0, "interval": 1.0, "currents": (5e-3,), "durations": (0.01,)}
    return NodeRun(table, hv.Storage(**{"capacitance": C} | (storage or {})), hv.SensorNode(**given | node))


def test_the_first_packet_is_after_the_charge_to_the_wake_voltage():
    assert run().course(1000.0).first == pytest.approx(4.0 * C / 1e-5 + 0.01, rel=1e-9)
    assert run(storage={"initial_voltage": 3.0}).course(1000.0).first == pytest.approx(1.0 * C / 1e-5 + 0.01, rel=1e-6)


def test_energy_limits_packets_to_what_comes_in():
    """10 uA come, a packet takes 50 uC: in the long run 0.2 packets a second, less what a cut-off packet takes."""
    course = run().course(1e6)
    rate = course.packets / course.end
    cut_off = course.brown_outs / course.packets
    assert 0.2 * (1.0 - cut_off) <= rate <= 0.2
    assert course.given == pytest.approx(1e-5 * 3.0 * 1e6, rel=0.05)  # at about 3 V


def test_a_node_that_gets_more_than_it_takes_keeps_its_interval():
    course = run(amperes=1e-4).course(10_000.0)
    assert course.brown_outs == 0
    assert course.packets == pytest.approx(10_000.0 - 4.0, abs=1.5)
    assert course.ran == pytest.approx(10_000.0 - 4.0, rel=1e-9)
    assert course.volts[-1] <= 6.0 and course.clamped > 0.0


def test_the_energy_that_comes_in_is_stored_or_taken():
    """Behind a regulator a packet takes the same energy at each voltage; what the clamp takes is not counted in."""
    course = run(amperes=1e-4, supply_voltage=1.8, efficiency=0.9).course(10_000.0)
    packet = 5e-3 * 1.8 * 0.01 / 0.9
    stored = 0.5 * C * course.volts[-1] ** 2
    assert course.clamped > 3.0 * course.packets * packet
    assert course.given - course.clamped == pytest.approx(course.packets * packet + stored, rel=2e-3)


def test_repeated_cycles_count_as_if_each_was_followed():
    """The long course jumps over cycles that repeat; the sum of short ones from the same voltage does not."""
    long = run().course(20_000.0)
    per_cycle = run().course(250.0)
    assert long.packets / long.end == pytest.approx(per_cycle.packets / (per_cycle.end - 40.0), rel=0.1)
    assert long.end == pytest.approx(20_000.0)


def test_a_regulator_takes_its_power_over_the_efficiency():
    course = run(amperes=0.0, storage={"initial_voltage": 4.0}, supply_voltage=1.8, efficiency=0.9).course(1.0)
    energy = 5e-3 * 1.8 * 0.01 / 0.9
    assert course.volts[-1] == pytest.approx((4.0**2 - 2.0 * energy / C) ** 0.5, rel=1e-5)


def test_esr_cuts_packets_off_that_the_store_could_give():
    large = {"capacitance": 1.0, "initial_voltage": 4.0}
    assert run(storage={"esr": 390.0, **large}).course(100.0).packets > 0  # 4 V less 1.95 V
    course = run(storage={"esr": 410.0, **large}).course(100.0)
    assert course.packets == 0 and course.brown_outs == 1


def test_leakage_keeps_a_store_from_waking():
    course = run(storage={"leakage_resistance": 390e3}).course(1e5)
    assert course.first is None
    assert course.volts[-1] == pytest.approx(3.9, rel=1e-3)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"wake_voltage": 1.0}, "wake_voltage must be above stop_voltage, 2 V, but is 1.0"),
        ({"packet_energy": 1e-4}, "node must have one of currents, packet_energy and trace"),
        ({"durations": (0.01, 0.02)}, "durations must be as many as node.currents, 1"),
        ({"durations": (2.0,)}, "interval must be longer than a packet's durations together"),
        ({"durations": (-1.0,)}, "must be a time"),
        ({"efficiency": 0.9}, "supply_voltage must be given with efficiency"),
        ({"intervall": 1.0}, "did you mean"),
    ],
)
def test_a_node_that_cannot_be_says_what_is_wrong(keys, message):
    with pytest.raises(hv.InputError, match=message):
        run(**keys)
