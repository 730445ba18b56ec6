"""The error that engine `ideal` states of its elements covers the answers of the compiled circuit and ngspice."""

import dataclasses

import pytest

import harvester as hv
from harvester.presentation.diagnostic import has
from tests.support.paths import EXAMPLES

BRIDGE = hv.load(EXAMPLES / "plate_bridge.toml")
DRIVEN = hv.Scene(
    oscillator=hv.Oscillator(mass=5e-3, stiffness=710.6, damping=0.0471),
    piezo=hv.Piezo(coupling=8.02e-4, capacitance=30e-9),
    excitation=hv.Excitation(frequency=59.0, acceleration_amplitude=2.942),
    load=hv.Load(netlist="parallel_sshi", parameters={"R": 142e3, "L": 2.0, "Rcoil": 1200.0}),
)


@pytest.mark.slow
def test_the_error_of_ideal_diodes_is_measured():
    """A bridge at some volts: less than 0.3 % beside the 0.5 % of the reference, which is more than
    a target of 0.1 %."""
    answer = hv.Ideal(seed=1, trajectories=128, duration=4.0, within="0.1%", dt=3e-3).run(BRIDGE)
    assert has(answer.warnings, "elements_beyond")
    power = answer.mean_power
    assert power.error95 is not None and answer.mean_square_voltage.error95 is not None
    assert 0.005 * power.value < power.model < 0.008 * power.value
    assert has(answer.diagnostics, "ideal_difference")


def test_what_is_not_measured_is_a_warning():
    answer = hv.Ideal(seed=1, trajectories=32, duration=2.0, judged=False).run(BRIDGE)
    assert answer.mean_power.error95 is None and has(answer.warnings, "ideal_elements")
    assert hv.Ideal().at_many_points == hv.Ideal(judged=False)


@pytest.mark.thorough("test_the_error_of_ideal_diodes_is_measured")
@pytest.mark.ngspice
@pytest.mark.slow
def test_of_weak_shaking_it_is_large():
    """A SECE at 0.7 V leaves much in its diodes, which ideal ones do not."""
    sece = hv.load(EXAMPLES / "plate_sece.toml")
    weak = dataclasses.replace(
        sece.excitation, acceleration_psd=sece.excitation.acceleration_psd / 16.0
    )
    scene = dataclasses.replace(sece, excitation=weak)
    ours = hv.Ideal(seed=1, trajectories=128, duration=10.0).run(scene).mean_power
    theirs = hv.Compiled(seed=2, trajectories=128, duration=10.0).run(scene).mean_power
    assert ours.model > 0.05 * ours.value
    assert abs(ours.value - theirs.value) < ours.error95 + theirs.known_error95


@pytest.mark.thorough("test_the_error_of_ideal_diodes_is_measured")
@pytest.mark.ngspice
@pytest.mark.slow
def test_a_slow_switching_is_in_the_error():
    """Under a sinusoid an inductor that takes a tenth of half a period: 8 % more power than ngspice has."""
    ideal, ngspice = (one.run(DRIVEN).mean_power for one in (hv.Ideal(), hv.Spice(within="1%")))
    assert abs(ideal.value - ngspice.value) > 0.04 * ngspice.value
    assert abs(ideal.value - ngspice.value) < ideal.error95 + ngspice.error95


@pytest.mark.ngspice
@pytest.mark.slow
def test_the_judge_of_a_driven_mass_beside_a_stop_has_steps_of_its_own():
    """At the step of ideal elements the compiled circuit itself is 2 % off there."""
    sece = hv.load(EXAMPLES / "plate_sece.toml")
    driven = hv.Excitation(frequency="3.2 Hz", acceleration_amplitude="0.01 g")
    scene = dataclasses.replace(sece, excitation=driven)
    ideal, compiled = (
        one.run(scene).mean_power for one in (hv.Ideal(trajectories=64), hv.Compiled())
    )
    assert abs(ideal.value - compiled.value) < ideal.error95 + compiled.known_error95


@pytest.mark.thorough("test_the_judge_of_a_driven_mass_beside_a_stop_has_steps_of_its_own")
@pytest.mark.ngspice
@pytest.mark.slow
def test_noise_beside_the_drive_leaves_the_error_whole():
    """A SECE and its compiled circuit, 5 % apart in a longer run, of which `ideal` states 4 % as its model's."""
    sece = hv.load(EXAMPLES / "plate_sece.toml")
    driven = hv.Excitation(
        frequency="3.2 Hz", acceleration_amplitude="0.01 g", acceleration_psd="1e-6 g^2/Hz"
    )
    scene = dataclasses.replace(sece, excitation=driven)
    ideal = hv.Ideal(trajectories=128, duration=20.0).run(scene).mean_power
    compiled = hv.Compiled(trajectories=64, duration=10.0).run(scene).mean_power
    assert 0.0 < ideal.model < 0.1 * ideal.value
    assert abs(ideal.value - compiled.value) < ideal.error95 + compiled.known_error95
