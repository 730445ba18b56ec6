"""Charging by the rectifier's mean current, beside direct runs of mass and circuit.

Kept of ngspice 39.3 alone, 23 November 2026, `python benchmarks/slow_circuits.py` on the scene below for 14.5 s, with
steps of 40 us and reltol 1e-5: 20 V after 13.3077 s and 10 V after 5.7299 s.
"""

import pytest

import harvester as hv
from harvester.presentation.diagnostic import has
from tests.support.paths import EXAMPLES

TO_20_V, NGSPICE_CHANGES = 13.3077, 0.01


def bimorph(amplitude="1 g", **load):
    return hv.Scene(
        oscillator=hv.Oscillator(mass="16.542 g", stiffness=1364.1, damping_ratio=0.027),
        piezo=hv.Piezo(coupling=2.5261e-3, capacitance="41.259 nF"),
        excitation=hv.Excitation(frequency=46.0, acceleration_amplitude=amplitude),
        load=hv.Netlist("bridge", **load),
    )


@pytest.mark.slow
def test_a_large_store_takes_what_it_takes_in_ngspice():
    found = hv.charge(bimorph(R="10 Mohm", C="470 uF"), to="20 V")
    assert found.engine == "slow"
    assert abs(found.time.value - TO_20_V) < found.time.error95 + NGSPICE_CHANGES
    assert found.time.error95 < 0.01 * TO_20_V


@pytest.mark.slow
def test_a_farad_takes_its_charge_over_the_current():
    """The mean current between 0 and 3.3 V is that into 1/1000 of the capacitance: a thousand times the time."""
    large = hv.charge(bimorph("0.15 g", R="1 Gohm", C=1.0), to="3.3 V")
    small = hv.charge(bimorph("0.15 g", R="1 Gohm", C="1 mF"), to="3.3 V", engine="slow")
    assert large.time.value == pytest.approx(1e3 * small.time.value, rel=0.01)
    assert large.reached == 1.0 and large.time.value > 3e4


@pytest.mark.thorough("test_a_large_store_takes_what_it_takes_in_ngspice")
def test_where_time_scales_are_not_apart_both_run_together():
    scene = hv.load(EXAMPLES / "plate_bridge.toml").with_load(netlist="bridge", parameters={"R": 1e9, "C": 1e-4})
    found = hv.charge(scene, to="1 V", trajectories=128)
    assert found.engine == "ideal" and has(found.notes, "charge_not_slow")
    slow = hv.charge(scene, to="1 V", engine="slow", trajectories=512)
    assert has(slow.warnings, "charge_not_slow")
    assert slow.time.value == pytest.approx(found.time.value, rel=0.15)


def test_what_it_cannot_charge_it_refuses():
    with pytest.raises(hv.HarvesterError):
        hv.charge(EXAMPLES / "plate_recorded.toml", to="1 V", engine="slow")


@pytest.mark.thorough("test_a_large_store_takes_what_it_takes_in_ngspice")
@pytest.mark.slow
@pytest.mark.ngspice
def test_a_circuit_with_transistors():
    """It is there before transients have gone, which is said, and the time holds what ngspice says."""
    scene = EXAMPLES / "bimorph_self_powered_sshi.toml"
    found, judge = (hv.charge(scene, to="1 V", engine=name) for name in ("slow", "spice"))
    assert has(found.warnings, "charge_not_slow")
    assert abs(found.time.value - judge.time.value) < found.time.known_error95 + judge.time.error95
