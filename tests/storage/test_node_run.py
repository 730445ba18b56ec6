"""A node on a storage capacitor against its own arithmetic: the charge that comes is the charge
that leaves."""

import numpy as np
import pytest

import harvester as hv
from harvester.storage.node_run import NodeRun
from harvester.storage.rectified_current import RectifiedCurrent

C = 1e-4


def run(amperes=1e-5, storage=None, **node):
    """A constant current into 100 uF up to 6 V; a node that sends 10 ms of 5 mA every second, from 4 V to 2 V."""
    volts = np.linspace(0.0, 6.0, 12)
    one = np.ones(12)
    table = RectifiedCurrent(volts, amperes * one, None, one, one, 0.0 * one, 0.0)
    given = {
        "wake_voltage": 4.0,
        "stop_voltage": 2.0,
        "interval": 1.0,
        "currents": (5e-3,),
        "durations": (0.01,),
    }
    kept = storage or {}
    capacitor = {} if "battery_voltage" in kept else {"capacitance": C}
    return NodeRun(table, hv.Storage(**capacitor | kept), hv.SensorNode(**given | node))


def test_the_first_packet_is_after_the_charge_to_the_wake_voltage():
    assert run().course(1000.0).first == pytest.approx(4.0 * C / 1e-5 + 0.01, rel=1e-9)
    assert run(storage={"initial_voltage": 3.0}).course(1000.0).first == pytest.approx(
        1.0 * C / 1e-5 + 0.01, rel=1e-6
    )


def test_energy_limits_packets_to_what_comes_in():
    """10 uA come, a packet needs 50 uC: in the long run 0.2 packets per second, less the charge of a cut-off packet."""
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
    """Behind a regulator a packet draws the same energy at each voltage; what the clamp dissipates
    is not counted in."""
    course = run(amperes=1e-4, supply_voltage=1.8, efficiency=0.9).course(10_000.0)
    packet = 5e-3 * 1.8 * 0.01 / 0.9
    stored = 0.5 * C * course.volts[-1] ** 2
    assert course.clamped > 3.0 * course.packets * packet
    assert course.given - course.clamped == pytest.approx(
        course.packets * packet + stored, rel=2e-3
    )


def test_repeated_cycles_count_as_if_each_was_followed():
    """The long course jumps over cycles that repeat; the sum of short ones from the same voltage does not."""
    long = run().course(20_000.0)
    per_cycle = run().course(250.0)
    assert long.packets / long.end == pytest.approx(
        per_cycle.packets / (per_cycle.end - 40.0), rel=0.1
    )
    assert long.end == pytest.approx(20_000.0)


def test_a_regulator_takes_its_power_over_the_efficiency():
    course = run(
        amperes=0.0, storage={"initial_voltage": 4.0}, supply_voltage=1.8, efficiency=0.9
    ).course(1.0)
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


def test_charge_that_moves_into_pores_is_that_of_a_line():
    """300 sections of a line next to the capacitor, from another code: the storage voltage alone for two hours."""
    storage = {
        "diffusion_capacitance": 0.4 * C,
        "diffusion_resistance": 3600.0 / (0.4 * C),
        "initial_voltage": None,
    }
    course = run(amperes=1e-7, storage=storage, wake_voltage=6.0).course(7200.0)
    n = 300
    h = 5.0
    g = n / storage["diffusion_resistance"]
    c = storage["diffusion_capacitance"] / n
    matrix = np.zeros((n + 1, n + 1))
    for k in range(n):
        part = 2.0 * g if k == 0 else g  # the first capacitor is half a section away
        matrix[k, k] -= part
        matrix[k + 1, k + 1] -= part
        matrix[k, k + 1], matrix[k + 1, k] = part, part
    held = np.diag([C, *n * [c]])
    step = held / h - 0.5 * matrix
    v = np.zeros(n + 1)
    found = []
    forward = np.linalg.solve(step, held / h + 0.5 * matrix)
    kick = np.linalg.solve(step, np.eye(n + 1)[0] * 1e-7)
    for _ in range(round(7200.0 / h)):
        v = forward @ v + kick
        found.append(v[0])
    at = np.array([600.0, 3600.0, 7190.0])
    expected = np.interp(at, h * np.arange(1, len(found) + 1), found)
    assert np.interp(at, course.t, course.volts) == pytest.approx(expected, rel=4e-3)
    # which the capacitor alone has
    assert (np.interp(at, course.t, course.volts) < 0.93 * 1e-7 * at / C).all()


def test_a_store_with_pores_discharges_by_itself():
    """At rest the charge is that of the beginning, spread over both capacitances."""
    storage = {"diffusion_capacitance": C, "diffusion_resistance": 10.0 / C}
    one = run(amperes=0.0, storage={**storage, "initial_voltage": 3.0})
    assert one.course(1000.0).volts[-1] == pytest.approx(3.0, rel=1e-9)
    charged = run(amperes=1e-4, storage=storage, stopped_current=1e-4).course(100.0)
    assert charged.volts[-1] == 0.0


def test_packets_that_nobody_answers_are_sent_again():
    """With losses p and n retries 1 - p^(n + 1) arrive, of (1 - p^(n + 1))/(1 - p) tries each."""
    battery = {"battery_voltage": 5.0, "battery_charge": 1e4}
    course = run(amperes=0.0, storage=battery, lost_share=0.4, retries=2).course(20_000.0)
    share = 0.4**3
    assert course.lost / 20_000.0 == pytest.approx(
        share, abs=4.0 * (share * (1 - share) / 20_000.0) ** 0.5
    )
    spent = (1.0 - course.volts[-1] / 5.0) * 1e4
    assert spent == pytest.approx(20_000.0 * 5e-5 * (1.0 - share) / 0.6, rel=0.015)
    assert course.interval(0.5) == pytest.approx(1.0, rel=1e-3) and course.interval(1.0) > 1.9


def test_a_battery_keeps_its_voltage_and_runs_empty():
    """50 uC each second out, 10 uA in: 1 mC lasts 25 s; a full one accepts no more."""
    course = run(storage={"battery_voltage": 5.0, "battery_charge": 1e-3}).course(24.0)
    assert course.brown_outs == 0 and course.packets == 24
    course = run(storage={"battery_voltage": 5.0, "battery_charge": 1e-3}).course(60.0)
    assert course.brown_outs >= 1 and 24 <= course.packets < 40
    course = run(amperes=1e-4, storage={"battery_voltage": 5.0, "battery_charge": 1e-3}).course(
        1000.0
    )
    assert course.packets == 1000 and course.clamped == pytest.approx(5.0 * (0.1 - 0.05), rel=2e-3)


def test_a_flag_of_low_energy_spares_packets():
    """10 uA feed 50 uC every 5 s for ever: with the flag no packet is cut off, and the rate is what comes in."""
    course = run(low_voltages=(3.0, 3.5), low_interval=20.0).course(1e5)
    assert course.brown_outs == 0
    assert course.packets / 1e5 == pytest.approx(0.2, rel=0.01)
    assert course.interval(0.3) == pytest.approx(1.0, rel=1e-6)
    assert course.interval(1.0) == pytest.approx(20.0, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"capacitance": 1e-4, "battery_voltage": 3.0},
            "either capacitance or battery_voltage, but both are",
        ),
        ({}, "either capacitance or battery_voltage, but neither is"),
        ({"battery_voltage": 3.0}, "battery_charge must be given with battery_voltage"),
        (
            {"capacitance": 1e-4, "diffusion_resistance": 1e3},
            "diffusion_capacitance must be given with",
        ),
        (
            {"battery_voltage": 3.0, "battery_charge": 10.0, "clamp_voltage": 3.0},
            "clamp_voltage must be left out of a",
        ),
    ],
)
def test_a_store_that_cannot_be_says_what_is_wrong(keys, message):
    with pytest.raises(hv.InputError, match=message):
        hv.Storage(**keys)


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
        ({"retries": 2}, "lost_share must be given with retries"),
        ({"retries": 2.5, "lost_share": 0.1}, "retries must be a whole number"),
        (
            {"retries": 100, "lost_share": 0.1, "durations": (0.1,)},
            "longer than a packet's durations together and its",
        ),
        ({"low_voltages": (3.0, 2.5), "low_interval": 5.0}, "low_voltages must ascend"),
        ({"low_voltages": (2.5, 3.0)}, "low_interval must be given with low_voltages"),
    ],
)
def test_a_node_that_cannot_be_says_what_is_wrong(keys, message):
    with pytest.raises(hv.InputError, match=message):
        run(**keys)


def test_currents_between_the_voltages_of_a_table_are_straight():
    """At each voltage of the table its own current, halfway the mean of two, beyond its ends the last one."""
    node = run(storage={"leakage_resistance": 1e6})
    table = node.charging[0]
    middle = 0.5 * (node.volts[1:] + node.volts[:-1])
    at = np.array([node.at(table, float(v)) for v in node.volts])
    between = np.array([node.at(table, float(v)) for v in middle])
    np.testing.assert_allclose(at, table, rtol=1e-9)
    np.testing.assert_allclose(between, 0.5 * (table[1:] + table[:-1]), rtol=1e-9)
    assert node.at(table, 2.0 * node.top) == table[-1]
    assert node.at(table, -1.0) == table[0]


@pytest.mark.parametrize("amperes", [1e-4, 1.3e-5, 6e-6])
def test_intervals_between_packets_add_up_to_the_time_from_the_first_to_the_last(amperes):
    """One fewer than packets, however long each is, also if cycles repeat themselves."""
    course = run(amperes=amperes).course(20_000.0)
    means, numbers = course.intervals
    assert numbers.sum() == pytest.approx(course.packets - 1.0, rel=1e-9)
    assert (means * numbers).sum() == pytest.approx(course.last - course.first, rel=1e-9)
    assert means.min() > 0.99  # of its interval of 1 s


def test_an_aged_storage_capacitor_is_a_smaller_one():
    """Half of the capacitance is charged in half of the time."""
    new, aged = (
        run(storage={"capacitance_left": left} if left else None).course(1000.0).first - 0.01
        for left in (None, 0.5)
    )
    assert aged == pytest.approx(0.5 * new, rel=1e-9)
