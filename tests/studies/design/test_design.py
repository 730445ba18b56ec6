"""`harvester design`: what it states is available and its yield against other engines, and
requirements nobody meets."""

import dataclasses
import json
import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.machine.progress import NoProgress
from harvester.storage.bought_parts import CHIPS, COILS
from harvester.storage.measured_current import measured
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.supply import Supply
from harvester.uncertainty.value import stderr_of95
from tests.support.paths import EXAMPLES

SCENE = EXAMPLES / "bimorph_sensor.toml"
NEEDS = "40 uW at 3.3 V"
DEVICES = 10_000  # of `tolerance`


def into(circuit, resistance, **parameters):
    """The scene with a circuit and a load."""
    return dataclasses.replace(hv.load(SCENE), load=hv.Netlist(circuit, R=resistance, **parameters))


@pytest.fixture(scope="module")
def bridge():
    return hv.design(SCENE, needs=NEEDS, wake="2 s", spread="frequency=2Hz", circuits=["bridge"])


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.slow
def test_what_is_available_is_what_another_engine_finds(bridge):
    """A resistor that dissipates all of it at 3.3 V holds the storage capacitor there."""
    all_of_it = 3.3**2 / bridge.available.value
    other = hv.run(into("bridge", all_of_it, C=3.3e-6), engine="ideal")
    # ideal diodes: 0.6 % off here
    assert bridge.available.value == pytest.approx(other.mean_power.value, rel=0.02)
    assert (
        bridge.verdict == {NEEDS: True, "awake in 2 s": True}
        and bridge.bound.value > bridge.available.value
    )


def test_its_progress_begins_once_and_ends():
    told, shares = [], []

    class Told(NoProgress):
        def start(self, total=None, what="", done=0):
            told.append("start")

        def step(self, done=1, what=""):
            told.append(what)
            shares.append(done)

        def close(self):
            told.append("close")

    hv.design(SCENE, needs=NEEDS, circuits=["bridge"], execution=hv.Execution(progress=Told()))
    assert [told[0], *set(told[1:-1]), told[-1]] == ["start", "bridge", "close"]
    assert shares == sorted(shares) and shares[0] < 0.1 and shares[-1] == 1.0


def deviation_of_yield(decision, watts, **settings):
    """The yield of a decision less that of `tolerance` for the load that draws the requirement, in standard errors.

    That of a share p of n devices is binomial, as if one at least did not meet the requirement.
    """
    scene = into(decision.circuit, decision.load_resistance, C=3.3e-6, **settings)
    keys = {
        "vary": ["frequency=2 Hz"],
        "limits": f"mean_power > {watts} W",
        "engine": "ideal",
        "checks": 0,
        "runs": 24,
    }
    other = hv.tolerance(scene, samples=DEVICES, **keys).met.value
    binomial = max(other * (1.0 - other), 1.0 / DEVICES) / DEVICES
    curve = stderr_of95(0.5 * (decision.met.high - decision.met.low))
    return (decision.met.value - other) / math.sqrt(binomial + curve**2)


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.slow
def test_the_yield_is_that_of_tolerance(bridge):
    """Devices whose load of the requirement gets it: the bridge's voltage is then 3.3 V or more."""
    assert abs(deviation_of_yield(bridge, 40e-6)) < 4.0 and 0.5 < bridge.met.value < 0.95


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.statistics
@pytest.mark.parametrize(("watts", "share"), [(40e-6, 1.0), (120e-6, 0.73)])
def test_a_decision_is_confirmed_by_run_and_tolerance(watts, share):
    """The engineer's case, and one with a yield: the circuit, inductor and load that were chosen, by ideal elements."""
    decision = hv.design(
        SCENE,
        needs=f"{watts} W at 3.3 V",
        spread="frequency=2Hz",
        circuits=["bridge", "parallel_sshi"],
    )
    power = hv.run(
        into("parallel_sshi", 3.3**2 / decision.available.value, C=3.3e-6, **decision.settings),
        "ideal",
    )
    stated = math.hypot(power.mean_power.known_error95, decision.available.known_error95)
    assert decision.circuit == "parallel_sshi" and decision.load_resistance == pytest.approx(
        3.3**2 / watts
    )
    assert (
        abs(power.mean_power.value - decision.available.value)
        < stated
        < 0.03 * decision.available.value
    )
    assert abs(deviation_of_yield(decision, watts, **decision.settings)) < 4.0
    assert decision.met.value == pytest.approx(share, abs=0.01)


@pytest.mark.slow
def test_the_time_to_wake_is_that_of_charge(bridge):
    scene = into("bridge", 1e12, C=bridge.capacitor * 100)
    assert bridge.wake < hv.charge(scene, to="3.3 V", engine="slow").time.value < 100 * bridge.wake


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.slow
def test_what_nobody_can_meet_gets_the_nearest_in_one_line(harvester):
    status, _, said = harvester(
        "design", SCENE, "--needs", "10 mW at 3.3 V", "--circuits", "bridge,doubler"
    )
    assert status == 2 and said.count("\n") == 1
    assert "nearest is bridge" in said and "no device of this mass absorbs more than 574 uW" in said
    status, _, said = harvester(
        "design", SCENE, "--needs", NEEDS, "--wake", "1 ms", "--circuits", "bridge"
    )
    assert status == 2 and "awake in 1 ms, but after" in said


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"needs": "40 uW"}, "`needs` must be POWER at VOLTAGE"),
        ({"needs": "40 uV at 3 V"}, "`needs` must be a power"),
        ({"needs": "40 uW at -3 V"}, "must be above 0"),
        ({"needs": "40 uW at 1e9 V"}, "must be above 0 and at most 1000"),
        ({}, "`needs` must be given"),
        ({"needs": NEEDS, "circuits": []}, "`circuits` or `chips` must name one"),
        ({"needs": NEEDS, "wake": "soon"}, "`wake` must be a time"),
        ({"needs": NEEDS, "circuits": ["brigde"]}, "did you mean 'bridge'"),
        ({"needs": NEEDS, "chips": ["bq2557"]}, "did you mean 'bq25570'"),
        (
            {"needs": NEEDS, "spread": "frequenzy=2Hz"},
            "unknown scene key 'frequenzy': did you mean 'frequency'",
        ),
        ({"needs": NEEDS, "spread": "frequency=2"}, "the spread of excitation.frequency must be"),
        ({"needs": NEEDS, "limit": "voltage > 3 V"}, "unknown quantity of a limit"),
    ],
)
def test_bad_input_is_one_line(options, said):
    with pytest.raises(hv.InputError, match="(?s)" + said) as error:
        hv.design(SCENE, **options)
    assert "\n" not in str(error.value)


def table(current, top):
    """A current that falls straight to 0."""
    volts = np.linspace(0.0, top, 12)
    none = np.zeros(12)
    return RectifiedCurrent(volts, current * (1 - volts / top), None, none, none, none, 0.0)


def test_supply_of_a_straight_current():
    """I = I0 (1 - V/V0): from the storage capacitor V I, a chip's window has its end at V0/2 of
    most power, and tracking half."""
    some = table(100e-6, 10.0)
    assert Supply(4.0).power(some, 1e-6) == pytest.approx(4.0 * 60e-6, rel=1e-6)
    assert Supply(4.0).wake(some, 1e-4) == pytest.approx(
        1e-4 * 10.0 / 100e-6 * np.log(10.0 / 6.0), rel=1e-3
    )
    ltc = Supply(3.3, CHIPS["ltc3588"], *CHIPS["ltc3588"].thresholds(3.3))
    assert ltc.power(some, 1e-6) == pytest.approx(0.85 * 5.0 * (50e-6 - 950e-9), rel=1e-3)
    bq = CHIPS["bq25570"]
    tracking = Supply(1.8, bq, *bq.thresholds(1.8))
    held = 0.5 * 5.1
    stored = 0.8 * held * ((1 - 0.016) * 100e-6 * (1 - held / 10.0) + 1e-6 * held / 16.0)
    assert tracking.power(some, 1.8 * 32e-6) == pytest.approx(
        0.88 * (stored - 5.0 * 488e-9), rel=1e-3
    )
    assert ltc.power(table(100e-6, 4.0), 1e-6) == 0.0  # its output never begins


@pytest.mark.thorough("test_supply_of_a_straight_current")
@pytest.mark.slow
def test_what_a_chip_gives_is_the_heaviest_load_that_is_always_on():
    """By `slow`: a lighter load draws what it needs, a far heavier one the energy of a cycle over its time."""
    most = hv.design(SCENE, needs=NEEDS, circuits=[], chips=["ltc3588"]).available.value
    taken = {
        part: hv.run(into("ltc3588", 3.3**2 / (part * most), C=10e-6), "slow").mean_power
        for part in (0.96, 9.0)
    }
    assert taken[0.96].value == pytest.approx(0.96 * most, rel=2e-3)
    problem = Problem.of(into("ltc3588", 1e4))
    own = measured(problem).best
    volts = np.linspace(3.67, 5.05, 2001)
    cycle = 0.85 * (5.05**2 - 3.67**2) / 2 / np.trapezoid(1.0 / (own.at(volts) - 450e-9), volts)
    assert abs(taken[9.0].value - cycle) < taken[9.0].error95 and cycle < 0.95 * most


def test_chips_have_their_outputs_only():
    assert CHIPS["ltc3588"].thresholds(3.0) is None and CHIPS["bq25570"].thresholds(5.0) is None
    assert all(coil.core_resistance > 1e4 and coil.source for coil in COILS.values())


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.ngspice
@pytest.mark.slow
def test_the_engineers_case_in_ngspice():
    """Every default circuit, the machine's frequency within 2 Hz: what is available of each is that of ngspice."""
    asked = {
        "needs": NEEDS,
        "wake": "10 s",
        "spread": "frequency=2Hz",
        "limit": "peak_displacement < 1 mm",
    }
    found = hv.design(SCENE, **asked)
    assert (
        found.circuit == "parallel_sshi" and found.met.value > 0.99 and found.runner_up == "bridge"
    )
    by_name = {one.circuit: one for one in found.candidates}
    for name, own in (("bridge", {}), ("parallel_sshi", found.settings)):
        power = by_name[name].available
        other = hv.run(into(name, 3.3**2 / power.value, C=3.3e-6, **own), engine="spice", budget=60)
        assert power.value == pytest.approx(other.mean_power.value, rel=0.01)


@pytest.mark.slow
def test_a_scene_with_a_node_behind_a_chip_is_a_device_like_any_other():
    """A circuit that is tried is computed without the scene's own [storage], [chip] and [node]."""
    whole = hv.load(SCENE)
    chip = hv.HarvestingChip(start_voltage=3.5, stop_voltage=2.4)
    node = hv.SensorNode(
        wake_voltage=3.3, stop_voltage=2.0, interval=10.0, currents=(4e-3,), durations=(9e-3,)
    )
    whole = dataclasses.replace(whole, storage=hv.Storage(capacitance=1e-4), node=node, chip=chip)
    with pytest.raises(hv.InputError, match="nearest is bridge"):
        hv.design(whole, needs="10 mW at 3.3 V", circuits=["bridge"])


@pytest.mark.slow
def test_the_command_writes_a_scene_that_runs(harvester, tmp_path):
    asked = (
        "--needs",
        NEEDS,
        "--circuits",
        "bridge",
        "--chips",
        "ltc3588",
        "--json",
        "--out",
        tmp_path,
    )
    status, said, _ = harvester("design", SCENE, *asked)
    found = json.loads(said)
    assert (
        status == 0
        and found["circuit"] == "bridge"
        and found["runner_up"] == "ltc3588"
        and found["yield"] is None
    )
    chosen = hv.load(tmp_path / "design.toml")
    assert chosen.load.netlist == "bridge" and chosen.load.parameters["C"] == found["capacitor"]
    assert (
        "<h1" in (tmp_path / "report.html").read_text()
        and len((tmp_path / "design.csv").read_text().split()) > 2
    )


def on_record(folder, loud):
    """The scene on 24 s of its excitation as a record, which is there for a part of each 8 s."""
    t = np.arange(0.0, 24.0, 0.001)
    tone = 0.3 * 9.80665 * np.sin(2 * np.pi * 59.0 * t) * (t % 8.0 < 8.0 * loud)
    path = folder / "record.csv"
    rows = [f"{a:.3f},{b:.6f}" for a, b in zip(t, tone, strict=True)]
    path.write_text("\n".join(["time (s),acceleration (m/s^2)", *rows, ""]))
    return dataclasses.replace(
        hv.load(SCENE), excitation=hv.Excitation(acceleration_file=str(path))
    )


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.slow
def test_a_record_of_the_drive_asks_for_the_same_circuit(tmp_path, bridge):
    """A whole one gives the drive's power; half of one gives half, and needs a storage capacitor for the other half."""
    whole, half = (
        hv.design(on_record(tmp_path, part), needs=NEEDS, circuits=["bridge"])
        for part in (1.0, 0.5)
    )
    assert whole.available.value == pytest.approx(bridge.available.value, rel=0.02)
    assert half.available.value == pytest.approx(0.5 * bridge.available.value, rel=0.06)
    assert whole.largest_displacement is None
    assert (
        abs(whole.available.value - bridge.available.value)
        < whole.available.error95
        < 0.1 * whole.available.value
    )
    kept = 0.5 * half.capacitor * 3.3**2 * (1.0 - 0.9**2)
    assert 4.0 * 40e-6 < kept < 3.0 * 4.0 * 40e-6 and half.capacitor > 10.0 * whole.capacitor
    with pytest.raises(hv.InputError, match=r"nearest is bridge, asked for 100 uW at 3\.3 V, but"):
        hv.design(on_record(tmp_path, 0.5), needs="100 uW at 3.3 V", circuits=["bridge"])


@pytest.mark.thorough("test_the_time_to_wake_is_that_of_charge")
@pytest.mark.slow
def test_a_record_of_the_drive_gives_a_chip_the_same(tmp_path):
    """Behind a bridge of its own diodes, which are ideal elements on the record."""
    scenes = (on_record(tmp_path, 1.0), SCENE)
    some = [
        hv.design(one, needs=NEEDS, circuits=[], chips=["ltc3588"]).available.value
        for one in scenes
    ]
    assert some[0] == pytest.approx(some[1], rel=0.02)


def with_node(capacitance="470 uF"):
    """The scene of a node behind a regulator of 1.8 V, which begins at 4.2 V of its storage
    capacitor."""
    scene = hv.load(EXAMPLES / "bimorph_packets.toml")
    return dataclasses.replace(
        scene,
        node=dataclasses.replace(scene.node, supply_voltage=1.8),
        storage=dataclasses.replace(scene.storage, capacitance=capacitance),
    )


@pytest.mark.slow
def test_a_chip_is_asked_for_the_supply_of_the_node():
    """Its output replaces the regulator, so that its efficiency is not needed."""
    scene = with_node()
    found = hv.design(scene, circuits=["bridge"], chips=["ltc3588"])
    assert {each.circuit for each in found.candidates} == {"bridge", "ltc3588"}
    behind = hv.design(scene, circuits=[], chips=["ltc3588"])
    node = scene.node
    mean = (sum(a * s for a, s in node.states) + 2e-6 * (10.0 - 0.015)) / 10.0
    assert behind.power_needed == pytest.approx(1.8 * mean)
    assert behind.load_resistance == pytest.approx(1.8 / mean)
    assert hv.design(scene, circuits=["bridge"]).power_needed == pytest.approx(1.8 / 0.85 * mean)


@pytest.mark.slow
def test_the_capacitor_of_the_scene_is_kept_or_compared():
    kept = hv.design(with_node(), circuits=["bridge"])
    assert kept.capacitor == pytest.approx(470e-6)
    assert "kept: 470 uF is enough" in str(kept)
    small = hv.design(with_node("10 uF"), circuits=["bridge"])
    assert 10e-6 < small.capacitor < 470e-6 and "too small: 10 uF" in str(small)


@pytest.mark.slow
def test_each_chip_that_is_left_out_has_its_reason():
    found = str(hv.design(EXAMPLES / "bimorph_sensor.toml", needs="40 uW at 3 V"))
    assert "ltc3588: left out: chip 'ltc3588' has no output of 3 V" in found
    for chip in ("adp5091", "aem30940", "spv1050"):
        assert f"{chip}: left out: 'harvester node' supports it" in found
