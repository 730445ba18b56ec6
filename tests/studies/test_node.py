"""`harvester node`: what limits a sensor node, and its packets against the charge that the rectifier gives."""

import dataclasses
import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import harvester as hv
from harvester.cli import cli
from harvester.equations.problem import Problem
from harvester.storage.direct_node import direct_course
from harvester.storage.fluctuating_node import Lived
from harvester.storage.measured_current import measured
from harvester.storage.node_course import NodeCourse
from harvester.storage.node_run import NodeRun
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.supply import chip_of
from harvester.storage.tracked_input import tracked_input
from harvester.studies import node
from harvester.studies.node_current import Known
from harvester.uncertainty.value import mean_and_error, stderr_of95
from tests.support.direct_nodes import direct_nodes
from tests.support.own_board import noisy_node
from tests.support.paths import EXAMPLES

SCENE = EXAMPLES / "bimorph_packets.toml"


PAIR = "bridge", "doubler"


def changed(**keys):
    scene = hv.load(SCENE)
    tables = {}
    for key, value in keys.items():
        table, _, name = key.partition("__")
        tables.setdefault(table, {})[name] = value
    return dataclasses.replace(
        scene,
        **{
            name: dataclasses.replace(getattr(scene, name), **values)
            for name, values in tables.items()
        },
    )


def test_a_current_that_may_be_higher_counts_as_well():
    """A node that sends nothing with its current, nor with less, has an error from more alone."""
    columns = np.ones(3)
    table = RectifiedCurrent(
        np.arange(3.0), columns, None, 0.0 * columns, columns, columns, ring_up=0.0
    )
    parts = node.Parts(None, None, None)

    def live(current, parts):
        return Lived(NodeCourse(packets=max(float(current.current[0]) - 1.0, 0.0), end=1.0))

    base = live(table, parts)
    variants = node.changed_courses(Known(table, table, 0), parts, base, 0.1, live)
    packets = node.NodeReading(base, variants, None, "").value(lambda course: course.packets)
    assert packets.value == 0.0 and packets.model == pytest.approx(0.1)


@pytest.mark.slow
def test_a_node_with_enough_sends_every_interval():
    found = hv.node(SCENE, days=0.1)
    assert found.limit == "interval" and "closed form" not in str(found)
    assert found.packets_per_hour.value == pytest.approx(360.0, rel=0.02)
    assert found.share_running.value == pytest.approx(1.0, abs=1e-6)
    charge = hv.charge(
        dataclasses.replace(hv.load(SCENE), load=hv.Netlist("bridge", R="5 Mohm", C="470 uF")),
        to="4.2 V",
    )
    packet = 0.015
    assert (
        abs(found.first_packet.value - packet - charge.time.value)
        < 2 * found.first_packet.known_error95 + 0.05
    )


def test_energy_limits_one_that_sends_too_often():
    """Packets an hour are then what is harvested over what each draws at the storage capacitor,
    less those that are cut off."""
    found = hv.node(changed(node__interval=0.2, node__sleep_current=0.0), days=0.2)
    assert found.limit == "energy"
    packet = (4e-3 * 0.01 + 20e-3 * 0.005) * 2.2 / 0.85
    most = found.harvested.value / packet * 3600.0
    assert most - found.brown_outs - 0.01 * most < found.packets_per_hour.value < 1.001 * most
    assert 0.0 < found.share_running.value < 1.0


def test_a_weak_vibration_never_wakes_it():
    found = hv.node(changed(excitation__acceleration_amplitude=0.4), days=0.1)
    assert (
        found.limit == "wake_voltage"
        and found.first_packet is None
        and found.packets_per_hour.value == 0.0
    )
    assert "below the wake voltage" in str(found)
    storage = dataclasses.replace(changed().storage, clamp_voltage=None)
    far = hv.node(dataclasses.replace(changed(node__wake_voltage=1e6), storage=storage), days=0.1)
    # a grid of volts up to 1e6 gave 34
    assert far.limit == "wake_voltage" and far.share_of_possible < 0.2


def test_a_doubler_without_a_clamp_charges_to_twice_the_voltage():
    storage = dataclasses.replace(changed().storage, clamp_voltage=None, leakage_resistance=None)
    scene = dataclasses.replace(changed(node__wake_voltage=1e3), storage=storage)
    volts = [
        hv.node(dataclasses.replace(scene, load=hv.Netlist(name)), days=0.2).voltage[-1]
        for name in PAIR
    ]
    assert 1.5 < volts[1] / volts[0] < 2.1


def test_a_store_too_small_for_a_packet():
    found = hv.node(changed(storage__capacitance=22e-6), days=0.1)
    assert found.limit == "store" and found.packets_per_hour.value == 0.0 and found.brown_outs > 0.0


@pytest.mark.slow
def test_the_change_that_helps_most():
    """Where energy limits, packets grow as the current does; if the interval does, a shorter one gives 1/0.9."""
    energy = hv.node(changed(node__interval=0.2, node__sleep_current=0.0), days=0.2)
    assert (
        energy.helps["current"] == pytest.approx(0.1, abs=0.03)
        and energy.helps["node.interval"] < 0.05
    )
    enough = hv.node(SCENE, days=0.1)
    assert (
        enough.helps["node.interval"] == pytest.approx(1 / 0.9 - 1, abs=0.01)
        and enough.helps["current"] < 0.01
    )
    assert enough.notes[-1].about == "node.interval" and enough.plot() is not None


@pytest.mark.slow
def test_an_aged_store_is_a_smaller_one():
    """The rate of a storage capacitor of half the capacitance is the same as of one that has half of its own left."""
    aged, small = (
        hv.node(changed(storage__capacitance_left=0.5)),
        hv.node(changed(storage__capacitance=235e-6)),
    )
    assert aged.first_packet.value == small.first_packet.value < hv.node(SCENE).first_packet.value


@pytest.mark.slow
def test_a_trace_is_as_its_states(tmp_path):
    """A profiler's file of the packet in the scene, at 0.1 ms, gives what the states themselves do."""
    rows = [f"{k * 0.1:.1f},{4.0 if k < 100 else 20.0}" for k in range(150)]
    (tmp_path / "packet.csv").write_text("Timestamp (ms),Current (mA)\n" + "\n".join(rows) + "\n")
    text = SCENE.read_text().replace('currents = ["4 mA", "20 mA"]', 'trace = "packet.csv"')
    (tmp_path / "scene.toml").write_text(text.replace('durations = ["10 ms", "5 ms"]\n', ""))
    found = hv.node(tmp_path / "scene.toml", days=0.05)
    states = hv.node(SCENE, days=0.05)
    assert found.needed == pytest.approx(states.needed, rel=1e-9)
    assert found.packets_per_hour.value == pytest.approx(states.packets_per_hour.value, rel=1e-12)


def test_a_battery_lasts_as_its_charge_does():
    """What the rectifier gives at its voltage is what it gives at a held storage capacitor; the
    rest comes from the battery."""
    scene = changed(node__interval=0.5, node__wake_voltage=3.0, node__sleep_current=None)
    battery = hv.Storage(battery_voltage=3.0, battery_charge=0.3)
    found = hv.node(dataclasses.replace(scene, storage=battery), days=0.01)
    assert found.limit == "battery" and found.brown_outs == 0.0
    lost = 0.3 * 3.0 * (1.0 - found.voltage[-1] / 3.0)
    assert lost == pytest.approx((found.needed - found.harvested.value) * found.t[-1], rel=0.01)
    said = next(one for one in found.diagnostics if one.code == "battery_lasts")
    assert said.numbers["seconds"] == pytest.approx(0.9 / (found.needed - found.harvested.value))
    with pytest.raises(
        hv.InputError, match=r"wake_voltage must be at most storage.battery_voltage, 3 V"
    ):
        dataclasses.replace(changed(), storage=battery)


@pytest.mark.slow
def test_what_is_between_packets_is_said():
    """A flag of low energy limits a node as energy does, and its interval is the longest; lost packets are counted."""
    keys = {"node__low_voltages": (3.0, 3.5), "node__low_interval": 5.0, "node__lost_share": 0.2}
    found = hv.node(changed(node__interval=0.2, **keys), days=0.1)
    assert found.limit == "energy" and found.brown_outs == 0.0
    assert (
        found.interval_median.value < 1.0
        and found.interval_longest.value >= found.interval_95.value > 4.9
    )
    assert found.packets_lost == pytest.approx(0.25 * found.packets_per_hour.value, rel=0.2)
    assert hv.node(SCENE, days=0.05).packets_lost is None


def test_the_command_prints_one_object():
    done = CliRunner().invoke(cli, ["node", str(SCENE), "--days", "0.05", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["limit"] == "interval" and found["bound"]["value"] > found["harvested"]["value"]


def test_what_is_missing_is_said():
    scene = hv.load(SCENE)
    with pytest.raises(hv.InputError, match=r"\[storage\] must be given with \[node\]"):
        dataclasses.replace(scene, storage=None)
    with pytest.raises(
        hv.InputError, match=r"must have the tables \[storage\] and \[node\], but lacks \[node\]"
    ):
        hv.node(dataclasses.replace(scene, node=None))
    with pytest.raises(hv.InputError, match="`days` must be above 0"):
        hv.node(scene, days=-1.0)


OWN = {
    "start_voltage": 3.5,
    "stop_voltage": 2.4,
    "full_voltage": 5.0,
    "input_ratio": 0.5,
    "own_current": 0.0,
}


def with_chip(**keys):
    return dataclasses.replace(changed(node__interval=0.2), chip=hv.HarvestingChip(**keys))


@pytest.mark.slow
def test_what_a_chip_stores_goes_as_its_efficiency():
    """Where energy limits the node, so that nothing is clamped."""
    well, badly = (hv.node(with_chip(**OWN, efficiency=share), days=0.1) for share in (0.8, 0.4))
    assert well.limit == badly.limit == "energy"
    assert well.harvested.value == pytest.approx(2.0 * badly.harvested.value, rel=0.02)


@pytest.mark.slow
def test_a_known_chip_says_what_of_it_is_assumed():
    found = hv.node(with_chip(name="bq25570", start_voltage=3.5), days=0.1)
    assert found.packets_per_hour.value > found.packets_per_hour.error95 > 0.0
    assert any(one.code == "chip_by_its_sheet" for one in found.diagnostics)


@pytest.mark.parametrize(
    "keys, said",
    [
        ({"name": "bq2557"}, "did you mean 'bq25570'"),
        ({"input_ratio": 0.8}, "chip.start_voltage must be given for a chip of your own"),
        (
            {"start_voltage": 3.0, "stop_voltage": 2.0, "input_ratio": 2.0},
            "above 0 and at most 1, but is 2",
        ),
        ({"start_voltage": 3.0}, "chip.stop_voltage must be given"),
        ({"start_voltage": 2.0, "stop_voltage": 3.0}, "must be above stop_voltage, 3 V"),
        (
            {"start_voltage": 3.0, "stop_voltage": 2.0, "input_ratio": 0.5},
            "chip.full_voltage must be given",
        ),
        ({"name": "bq25570", "start_voltage": 9.0}, "must be at most the full voltage, 5 V"),
        ({"name": "ltc3588"}, "node.supply_voltage must be one of chip 'ltc3588'"),
        ({"name": "bq25570", "efficiency": 0.5, "efficiency_table": "x.csv"}, "both are given"),
        (
            {"name": "bq25570", "start_voltage": 3.0, "efficiency_table": "x.csv"},
            "must be a readable file",
        ),
    ],
)
def test_a_chip_that_cannot_be_is_one_line(keys, said):
    with pytest.raises(hv.InputError, match=said) as error:
        hv.node(with_chip(**keys), days=0.1)
    assert "\n" not in str(error.value)


# Mean power (W) of the netlists' loads by ngspice alone, as in tests/engines/test_slow.py; output
# (V), load (ohm).
NGSPICE = {
    "ltc3588": (183.465e-6, 3.3, 10e3, "47 uF", 4.4e-9),
    "bq25570": (71.053e-6, 1.8, 5e3, "2.2 uF", 1e-7),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", NGSPICE)
def test_a_chip_by_its_sheet_gives_what_its_netlist_does_in_ngspice(name):
    """A node that draws what the netlist's resistor draws while the output is there, behind the chip's own diodes."""
    power, volts, ohm, store, saturation = NGSPICE[name]
    amperes = volts / ohm
    own = {} if name == "ltc3588" else {"start_voltage": 3.0, "stop_voltage": 2.4}
    node = {"wake_voltage": 0.1, "stop_voltage": 0.05, "interval": 2e-3, "durations": (1e-3,)}
    scene = dataclasses.replace(
        hv.load(EXAMPLES / f"bimorph_{name}.toml"),
        load=hv.Netlist("bridge", Is=saturation, N=1.0),
        storage=hv.Storage(capacitance=store),
        node=hv.SensorNode(
            **node, currents=(amperes,), sleep_current=amperes, supply_voltage=volts
        ),
        chip=hv.HarvestingChip(name=name, **own),
    )
    found = hv.node(scene, days=0.05)
    assert found.share_running.value * volts * amperes == pytest.approx(power, rel=0.02)


def waiting(chip, acceleration, store, amperes=1e-6, interval=1e3, **keys):
    """A scene whose node sends as soon as the chip's output begins; a chip that tracks begins at 3 V."""
    waits, own = (
        {"wake_voltage": 0.1, "stop_voltage": 0.05},
        {"start_voltage": 3.0, "stop_voltage": 2.4},
    )
    tracks = chip != "ltc3588"
    return dataclasses.replace(
        hv.load(EXAMPLES / "bimorph_ltc3588.toml").vary(
            "excitation.acceleration_amplitude", acceleration
        ),
        load=hv.Netlist("bridge", Is=1e-7 if tracks else 4.4e-9, N=1.0),
        storage=hv.Storage(capacitance=store),
        node=hv.SensorNode(
            **waits,
            interval=interval,
            currents=(amperes,),
            durations=(1e-3,),
            supply_voltage=1.8 if tracks else 3.3,
            **keys,
        ),
        chip=hv.HarvestingChip(name=chip, **own if tracks else {}),
    )


# When the netlist's output begins (s) from rest, in ngspice alone as in tests/engines/test_slow.py,
# with steps of 20 us and reltol 1e-5 until then (the LTC3588 at 10 uF: 1e-4).
BEGINS = [
    ("ltc3588", "0.3 g", "10 uF", 0.329),
    ("ltc3588", "0.3 g", "47 uF", 1.162),
    ("ltc3588", "0.15 g", "10 uF", 0.728),
    ("ltc3588", "0.15 g", "47 uF", 3.206),
    ("bq25570", "0.07 g", "2.2 uF", 2.621),
    ("bq25570", "0.07 g", "10 uF", 11.284),
    ("bq25570", "0.1 g", "2.2 uF", 1.788),
    ("bq25570", "0.1 g", "10 uF", 7.057),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    "chip, acceleration, store, seconds",
    [
        BEGINS[0],
        *(
            pytest.param(
                *one,
                marks=pytest.mark.thorough(
                    "test_the_first_packet_is_sent_when_the_netlists_output_begins"
                ),
            )
            for one in BEGINS[1:]
        ),
    ],
)
def test_the_first_packet_is_sent_when_the_netlists_output_begins(
    chip, acceleration, store, seconds
):
    """Within what it states, and 1 ms for the packet."""
    first = hv.node(waiting(chip, acceleration, store), days=0.001).first_packet
    assert abs(first.value - 1e-3 - seconds) < first.error95 + 2e-3
    assert first.error95 < (0.08 if chip == "ltc3588" else 0.25) * seconds


@pytest.mark.slow
def test_a_store_that_is_not_slow_is_run_directly():
    """The node of a load that is too heavy: in its direct run it is on as long as the energy that comes states."""
    found = hv.node(
        waiting("ltc3588", "0.3 g", "10 uF", 330e-6, 2e-3, sleep_current=330e-6), days=0.01
    )
    assert any(one.code == "run_directly" for one in found.notes) and not found.warnings
    taken = found.share_running.value * 330e-6 * 3.3 / 0.85
    assert taken == pytest.approx(found.harvested.value - 950e-9 * 4.4, rel=0.03)


SHEETS = [
    (chip, *case)
    for chip in ("adp5091", "aem30940", "spv1050")
    for case in (("0.07 g", "2.2 uF"), ("0.07 g", "10 uF"), ("0.1 g", "2.2 uF"), ("0.1 g", "10 uF"))
]


@pytest.mark.thorough("test_the_first_packet_is_sent_when_the_netlists_output_begins")
@pytest.mark.parametrize("chip, acceleration, store", SHEETS)
def test_a_chip_without_a_netlist_does_what_its_law_does_with_the_rectifier_itself(
    chip, acceleration, store
):
    """No mean current: the compiled rectifier charges the input, and the chip's table moves that on (20 s of it).

    The looks of an AEM30940, of 5 ms, are shorter than a vibration, and too short to charge the
    input.
    """
    scene = waiting(chip, acceleration, store, 360e-6, 2e-3, sleep_current=360e-6)
    # above where the cold start ends
    scene = dataclasses.replace(scene, chip=scene.chip.replace(stop_voltage=2.7))
    found = hv.node(scene, days=0.01)
    problem = Problem.of(scene)
    law = chip_of(scene.chip, 1.8)
    table = measured(problem).best
    run = NodeRun(table, scene.storage, scene.node, law)
    direct = direct_course(problem, run, 20.0)
    if direct.first is None:
        assert (
            found.first_packet is None
            or found.first_packet.value > 20.0 - found.first_packet.error95
        )
        return
    assert abs(found.first_packet.value - direct.first) < found.first_packet.error95 + 2e-3
    slow = run.course(20.0)
    assert (
        abs(slow.ran - direct.ran)
        < (found.share_running.error95 + 0.03 * found.share_running.value) * 20.0
    )


# When the netlist's store has the voltage (s) under noise, and 95 % errors:
# benchmarks/chips_under_noise.py, `spice`.
NOISY = [("ltc3588", "10 uF", 4.9, 0.681, 0.088), ("bq25570", "2.2 uF", 2.9, 1.36, 0.194)]


@pytest.mark.statistics
@pytest.mark.parametrize(
    "chip, store, volts, seconds, error",
    [
        NOISY[0],
        pytest.param(
            *NOISY[1],
            marks=pytest.mark.thorough(
                "test_under_noise_a_chip_starts_when_its_netlist_does_in_ngspice"
            ),
        ),
    ],
)
def test_under_noise_a_chip_starts_when_its_netlist_does_in_ngspice(
    chip, store, volts, seconds, error
):
    scene = waiting(chip, "0.1 g", store)
    own = scene.chip.replace(start_voltage=volts, stop_voltage=2.4)
    noise = hv.Excitation(acceleration_psd="0.002 g^2/Hz")
    first = hv.node(dataclasses.replace(scene, chip=own, excitation=noise), days=0.001).first_packet
    assert abs(first.value - 1e-3 - seconds) < 4.0 * stderr_of95(math.hypot(first.error95, error))
    assert first.error95 < 0.15 * seconds


def shaken(chip, density, store=1.0):
    """A scene of the same noise, whose storage capacitor is filled so far that the chip is past its cold start."""
    scene = waiting(chip, "0.1 g", store, 1e-9)
    filled = dataclasses.replace(scene.storage, initial_voltage=3.5)
    return dataclasses.replace(
        scene, excitation=hv.Excitation(acceleration_psd=density), storage=filled
    )


@pytest.mark.statistics
@pytest.mark.thorough("test_under_noise_a_chip_that_holds_its_input_states_a_whole_error")
@pytest.mark.parametrize(
    "chip, density, keys",
    [
        ("bq25570", "0.002 g^2/Hz", {"period": 2.0}),
        ("aem30940", "0.002 g^2/Hz", {}),
        ("aem30940", "0.0003 g^2/Hz", {"look": 0.022, "period": 0.2}),
    ],
)
def test_under_noise_a_chip_puts_into_its_store_what_its_law_does_directly(chip, density, keys):
    """Slice by slice, on another noise, by the netlist's own diodes; the looks of the last two are often and short."""
    scene = shaken(chip, density)
    problem = Problem.of(scene)
    law = dataclasses.replace(chip_of(scene.chip, 1.8), **keys)
    table = measured(problem).best
    runs = [
        direct_course(problem, NodeRun(table, scene.storage, scene.node, law), 31.0, seed)
        for seed in range(8)
    ]
    energies = [
        0.5 * float(np.diff(np.interp([3.0, 31.0], one.t, one.volts) ** 2)[0]) for one in runs
    ]
    check = tracked_input(problem, table, law, 0)
    course = NodeRun(table, scene.storage, scene.node, check.correct(law)).course(31.0)
    slow = course.given / 31.0 * 28.0
    sampling = np.std(energies, ddof=1) / math.sqrt(8.0)
    its_own = stderr_of95(check.error + check.elements) * slow
    assert sampling < 0.08 * slow and its_own < 0.03 * slow
    assert abs(np.mean(energies) - slow) < 4.0 * math.hypot(sampling, its_own)


@pytest.mark.statistics
def test_under_noise_a_chip_that_holds_its_input_states_a_whole_error():
    """The law subtracts some per cent where looks find less of the noise than its mean current states."""
    found = hv.node(shaken("aem30940", "0.002 g^2/Hz"), days=0.01)
    assert 0.0 < found.harvested.error95 < 0.4 * found.harvested.value and not found.warnings
    problem = Problem.of(shaken("aem30940", "0.002 g^2/Hz"))
    law = chip_of(hv.HarvestingChip(name="aem30940"), 1.8)
    check = tracked_input(problem, measured(problem).best, law, 0)
    assert -0.06 < check.gain < 0.0 < check.error < 0.03 and check.cold == 1.0


@pytest.mark.statistics
@pytest.mark.thorough("test_the_first_packet_is_sent_when_the_netlists_output_begins")
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("netlist, store, volts", [("bridge", 47e-6, 2.0), ("doubler", 22e-6, 2.5)])
def test_under_noise_a_node_wakes_when_direct_charges_of_the_netlist_do(
    netlist, store, volts, seed
):
    """On another noise, by the netlist's own diodes: node and charge state total errors, which cover the difference."""
    scene = changed(
        storage__capacitance=store,
        storage__leakage_resistance=None,
        storage__esr=None,
        node__wake_voltage=volts,
        node__stop_voltage=0.5,
        node__currents=(1e-6,),
        node__durations=(1e-3,),
        node__sleep_current=0.0,
    )
    noise = {
        "excitation": hv.Excitation(acceleration_psd="0.002 g^2/Hz"),
        "load": hv.Netlist(netlist),
    }
    first = hv.node(dataclasses.replace(scene, **noise), days=0.01, seed=seed).first_packet
    assert first.error95 < 0.15 * first.value and first.bias is None
    alone = dataclasses.replace(
        scene, **noise | {"load": hv.Netlist(netlist, R=1e9, C=store)}, storage=None, node=None
    )
    direct = hv.charge(alone, to=volts, engine="compiled", seed=100 + seed).time
    slow = hv.charge(alone, to=volts, engine="slow", seed=seed).time
    for value, error in ((first.value - 1e-3, first.error95), (slow.value, slow.error95)):
        assert abs(value - direct.value) < 4.0 * stderr_of95(
            math.hypot(error, direct.known_error95)
        )


@pytest.mark.statistics
@pytest.mark.parametrize(
    "interval, level",
    [
        (5.0, "0.0005 g^2/Hz"),
        pytest.param(
            *(1.0, "0.002 g^2/Hz"),
            marks=pytest.mark.thorough(
                "test_under_noise_packets_are_as_many_as_those_of_direct_nodes"
            ),
        ),
    ],
)
def test_under_noise_packets_are_as_many_as_those_of_direct_nodes(interval, level):
    """The first is one that its harvest just feeds: by the mean current alone 580 +- 780 packets per hour."""
    noise = hv.Excitation(acceleration_psd=level)
    scene = noisy_node(node={"interval": interval}, excitation=noise, load=hv.Netlist("bridge"))
    found = hv.node(scene, days=100.0 / 86400.0)
    problem = Problem.of(scene)
    run = NodeRun(measured(problem, count=3, runs=64).best, scene.storage, scene.node)
    direct = direct_nodes(problem, run, 100.0, 128, seed=7)
    counted = mean_and_error(direct.packets / direct.seconds * 3600.0)
    harvest = mean_and_error((direct.given - direct.clamped) / direct.seconds)
    for value, (mean, error), most in (
        (found.packets_per_hour, counted, 0.15),
        (found.harvested, harvest, 0.06),
    ):
        assert abs(value.value - mean) < 4.0 * math.hypot(stderr_of95(value.error95), error)
        assert 0.0 < value.error95 < most * value.value


@pytest.mark.slow
def test_packets_of_each_day():
    """The first day lacks those until the first packet; cycles that repeat are counted day by day."""
    found = hv.node(SCENE, days=3.5)
    assert len(found.days_packets) == 3 and found.day_most == found.day_median == 8640
    assert found.day_fewest == pytest.approx(8640 - found.first_packet.value / 10.0, abs=1.0)
    whole = hv.node(SCENE, days=3.0)
    assert whole.days_packets.sum() == pytest.approx(whole.packets_per_hour.value * 72.0, abs=1.0)
    assert hv.node(SCENE, days=1.5).day_most is None
