"""An outage of the excitation: how long a node continues from its storage capacitor, and which store
or interval would outlast it."""

import dataclasses
import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import harvester as hv
from harvester.cli import cli
from harvester.presentation.diagnostic import note
from harvester.storage.node_run import NodeRun
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.supply import chip_of
from tests.support.paths import EXAMPLES

SCENE = EXAMPLES / "bimorph_packets.toml"
C = 1e-3


def run(outage, storage=None, chip=None, amperes=1e-4, **node):
    """A constant current into 1 mF up to 6 V; a node that draws 100 uA of sleep, and 1 mA for 10 ms each 10 s."""
    volts = np.linspace(0.0, 6.0, 12)
    one = np.ones(12)
    table = RectifiedCurrent(volts, amperes * one, None, one, one, 0.0 * one, 0.0)
    given = {"wake_voltage": 4.0, "stop_voltage": 2.0, "interval": 10.0, "currents": (1e-3,)}
    given |= {"durations": (0.01,), "sleep_current": 2e-5}
    store = hv.Storage(**{"capacitance": C} | (storage or {}))
    return NodeRun(table, store, hv.SensorNode(**given | node), chip, outage)


def test_a_node_lasts_as_long_as_its_charge():
    """From 6 to 2 V: 4 mC at a mean current of 20 uA + 10 uC/10 s."""
    course = run(3600.0).course(10_000.0)
    drawn = (1e-3 * 0.01 + 2e-5 * 9.99) / 10.0
    assert course.left.on and course.left.volts == pytest.approx(6.0, rel=1e-3)
    assert course.lasts == pytest.approx(C * 4.0 / drawn, abs=10.0)
    assert not course.survived and course.outage_packets == pytest.approx(
        course.lasts / 10.0, abs=1
    )
    assert run(100.0).course(10_000.0).survived
    assert run(100.0).course(10_000.0).outage_packets == 10


def test_a_leak_alone_takes_the_time_of_its_logarithm():
    """With sleep of almost nothing V = 6 V exp(-t/(R C)), so that the node stops after R C ln 3."""
    leaks = run(3600.0, {"leakage_resistance": 1e6}, sleep_current=1e-12, interval=1e5)
    course = leaks.course(1e5)
    assert course.lasts == pytest.approx(1e6 * C * math.log(course.left.volts / 2.0), rel=0.01)


def test_a_chip_takes_its_own_current_in_the_dark():
    own = hv.HarvestingChip(start_voltage="4 V", stop_voltage="2 V", own_current="20 uA")
    course = run(3600.0, chip=chip_of(own, None), amperes=3e-4).course(10_000.0)
    drawn = (1e-3 * 0.01 + 2e-5 * 9.99) / 10.0 + 2e-5
    assert course.lasts == pytest.approx(C * (course.left.volts - 2.0) / drawn, rel=0.02)


def test_a_node_that_does_not_run_lasts_no_time():
    course = run(3600.0, amperes=1e-7).course(1000.0)
    assert not course.left.on and course.lasts == course.survived == course.outage_packets == 0.0


def test_what_comes_is_used_clamped_leaked_or_stored():
    course = run(None, {"leakage_resistance": 1e6, "clamp_voltage": 5.0}).course(10_000.0)
    stored = 0.5 * C * course.left.volts**2
    spent = course.used + course.clamped + course.leaked + stored
    assert min(course.used, course.clamped, course.leaked) > 0.01 * course.given
    assert course.given == pytest.approx(spent, rel=2e-3)


@pytest.mark.slow
def test_the_store_that_is_offered_lasts_and_the_next_smaller_does_not():
    found = hv.node(SCENE, days=0.02, stop="2h")
    scene = hv.load(SCENE)
    assert "no, the storage lasts" in str(found.answer)
    assert found.lasts.value < 7200.0 == found.outage
    lasts = []
    for farads in (found.capacitance_to_last, found.capacitance_to_last / 1.5):
        # charged when it begins
        storage = {"capacitance": farads, "initial_voltage": 5.0}
        other = dataclasses.replace(scene, storage=dataclasses.replace(scene.storage, **storage))
        lasts.append(hv.node(other, days=0.02, stop=7200.0).lasts.value)
    assert lasts[0] >= 7200.0 > lasts[1]


@pytest.mark.slow
def test_the_answer_comes_first_and_powers_stand_apart():
    done = CliRunner().invoke(cli, ["node", str(SCENE), "--days", "0.02", "--stop", "1 min"])
    assert done.exit_code == 0, done.output
    second = done.output.splitlines()[1]
    assert "yes: 8,640 packets per day, one every 10 s" in second
    assert "an outage of 1 min: yes, the storage lasts" in second
    for words in ("used by the node", "dissipated by the clamp", "leaked"):
        assert words in done.output
    done = CliRunner().invoke(cli, ["node", str(SCENE), "--days", "0.02", "--json"])
    answer = json.loads(done.output)
    assert "outage" not in answer and answer["used"]["value"] < answer["clamped"]["value"]


@pytest.mark.slow
def test_the_end_of_a_node_that_outlasts_ten_outages_is_not_known():
    """It is followed no longer, so that its time is the least, without an error."""
    found = hv.node(SCENE, days=0.02, stop="1 s")
    assert "the storage lasts longer than 10 s" in str(found.answer)
    assert found.lasts.value == pytest.approx(10.0)
    assert found.lasts.error95 is None and "above ten outages" in found.lasts.format("s")
    ends = hv.node(SCENE, days=0.02, stop="1 min").lasts
    assert ends.value < 600.0 and not ends.unknown


@pytest.mark.parametrize("stop", ["never", "-1 s", "0 s", "3 V", "2 years"])
def test_an_outage_that_is_none_is_refused(stop):
    with pytest.raises(hv.InputError, match="`stop` must be") as refused:
        hv.node(SCENE, stop=stop)
    assert repr(stop) in str(refused.value)


def test_more_of_almost_nothing_is_stated_in_packets():
    from harvester.presentation.diagnostic import note

    said = str(note("node_change_helps", "node.wake_voltage", gain=5.6e6, packets=1e-5))
    assert "56 packets per hour" in said and "%" not in said.replace("10 %", "")
    assert "11.1 % more" in str(note("node_change_helps", "node.interval", gain=0.111, packets=1.0))


@pytest.mark.parametrize("clamp", [5.0, 30.0])
def test_the_energies_are_those_of_the_store(clamp):
    """The sum over steps was the current at their middle: 0.2 % more than the storage capacitor and the node had."""
    volts = np.linspace(0.0, 6.0, 60)
    one = np.ones(60)
    falling = 8e-5 * (1.0 - volts / 7.0)  # as of a rectifier
    table = RectifiedCurrent(volts, falling, None, one, one, 0.0 * one, 0.0)
    store = hv.Storage(capacitance=470e-6, leakage_resistance=5e6, clamp_voltage=clamp)
    node = hv.SensorNode(
        wake_voltage=4.2,
        stop_voltage=2.4,
        interval=10.0,
        currents=(1e-2,),
        durations=(0.02,),
        sleep_current=2e-6,
    )
    course = NodeRun(table, store, node, None, None).course(20_000.0)
    stored = 0.5 * 470e-6 * course.left.volts**2
    spent = course.used + course.clamped + course.leaked + stored
    assert course.given == pytest.approx(spent, rel=2e-5)


@pytest.mark.parametrize(
    ("lasts", "error", "survived", "verdict"),
    [
        (7300.0, 50.0, None, "yes"),
        (7300.0, 200.0, None, "uncertain"),
        (7100.0, 200.0, None, "uncertain"),
        (7000.0, 50.0, None, "no"),
        (7300.0, 50.0, 0.6, "in 60 % of cases"),
        (7300.0, 50.0, 1.0, "yes"),
    ],
)
def test_the_answer_of_an_outage_has_its_error(lasts, error, survived, verdict):
    """A mean time within its own error of the outage was a yes or a no."""
    answer = note(
        "node_answer",
        sent="all",
        per_day=8640.0,
        error=0.0,
        interval=10.0,
        begins=0.0,
        days=1.0,
        outage=7200.0,
        lasts=lasts,
        lasts_error=error,
        survived=survived,
        longest=False,
    )
    assert f"an outage of 2 h: {verdict}, the storage lasts" in str(answer)
