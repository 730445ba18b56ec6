"""Normalised sensitivities in the elements of a netlist: exact laws of a linear circuit, and which keys there are."""

import math
from dataclasses import replace

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.studies import circuit_sensitivity
from harvester.studies.circuit_sensitivity import ROOT, by_ensembles, keys_with_elements
from harvester.studies.tolerance.spreads import parse
from tests.support.netlists import BRIDGE, STORE, on_plate

LINEAR = "R1 p a 100k\nC2 a n 10n\nRload a n 500k"
FLAT = """.title KiCad schematic
D1 /P /V 1N4148
D2 /N /V 1N4148
D3 GND /P 1N4148
D4 GND /N 1N4148
C1 /V GND 470n
R7 /V GND 1Meg
R9 /P /N 10Meg
.end
"""


def test_every_element_is_a_key(tmp_path):
    """Keys of a subcircuit have their names, of a board from KiCad too, where the load and the
    storage capacitor are R and C."""
    body = BRIDGE.format("1N4148") + STORE + "L3 p q 2\nR4 q n 5k"
    own = dict(keys_with_elements(Problem(on_plate(tmp_path, body))))
    names = {key.removeprefix("load.parameters.") for key in own if key.startswith("load.")}
    assert names == {"L3", "R4", "Csmooth", "Rload"}
    assert own["load.parameters.R4"] == 5e3 and own["oscillator.mass"] == pytest.approx(0.04)
    (tmp_path / "flat.cir").write_text(FLAT)
    load = hv.Load(
        netlist=str(tmp_path / "flat.cir"), terminals=["/P", "/N"], resistor="R7", store="C1"
    )
    scene = hv.Scene(**{**vars(on_plate(tmp_path, LINEAR)), "load": load})
    flat = dict(keys_with_elements(Problem(scene)))
    told = [flat[f"load.parameters.{name}"] for name in ("R9", "R", "C")]
    assert told == pytest.approx([1e7, 1e6, 470e-9], rel=1e-12)
    assert parse("load.parameters.R7=10%", scene, "vary").values == pytest.approx((0.9e6, 1.1e6))
    assert parse("load.parameters.R9=10%", scene, "vary").values == pytest.approx((0.9e7, 1.1e7))
    for key, value in flat.items():
        assert Problem(scene.vary(key, 1.05 * value)).circuit is not None


POWERS = {
    "oscillator.mass": 1,
    "oscillator.stiffness": 1,
    "oscillator.damping": 1,
    "piezo.coupling": 1,
    "piezo.capacitance": 1,
    "load.parameters.C2": 1,
    "load.parameters.R1": -1,
    "load.parameters.Rload": -1,
}  # of kg in the keys' units
VOLTS = {
    "piezo.coupling": -1,
    "load.parameters.R1": 2,
    "load.parameters.Rload": 2,
    "piezo.capacitance": -2,
    "load.parameters.C2": -2,
}  # of V: coupling N/V, capacitance J/V^2, resistance V^2/W
DRIVE = hv.Excitation(acceleration_amplitude="0.2 m/s^2", frequency="3.1 Hz")


def sums(found):
    """The two sums that units determine, each with its right value and its error."""
    of = dict(zip(found.keys, found.elasticities, strict=True))
    for weights, right in ((POWERS, 1.0), (VOLTS, 0.0)):
        value = sum(power * of[key].value for key, power in weights.items())
        sampling = math.hypot(*(power * of[key].sampling95 for key, power in weights.items()))
        steps = sum(abs(power) * of[key].bias for key, power in weights.items())
        yield value, right, 2.0 * sampling + steps


@pytest.mark.thorough("test_every_element_is_a_key")
@pytest.mark.ngspice
def test_a_linear_circuit_has_the_elasticities_that_units_ask_for(tmp_path):
    """Twice the noise is twice the power, and no unit of mass or charge matters: sums of the
    normalised sensitivities are known."""
    found = hv.sensitivity(on_plate(tmp_path, LINEAR))
    of = dict(zip(found.keys, found.elasticities, strict=True))
    assert found.engine == "compiled" and found.mean_power.value > 0.0
    shaking = of["excitation.acceleration_psd"]
    assert abs(shaking.value - 1.0) < 2.0 * shaking.sampling95 + shaking.bias < 5e-3
    for value, right, error in sums(found):
        assert abs(value - right) < error < 0.15


@pytest.mark.thorough("test_every_element_is_a_key")
@pytest.mark.ngspice
@pytest.mark.parametrize("body", [LINEAR, BRIDGE.format("1N4148") + STORE])
def test_the_error_that_is_aimed_at_is_reached(tmp_path, body):
    """At 95 % each sampling error is 0.01 of the larger of 1 and the sensitivity."""
    found = hv.sensitivity(on_plate(tmp_path, body))
    sizes = [max(abs(slope.value), 1.0) for slope in found.elasticities]
    errors = [slope.sampling95 for slope in found.elasticities]
    assert all(error <= 0.01 * size for error, size in zip(errors, sizes, strict=True))
    assert all(0.0 < slope.bias < 0.02 for slope in found.elasticities)
    assert found.mean_power.bias > 0.0 and found.mean_power.error95 < 0.02 * found.mean_power.value


@pytest.mark.ngspice
def test_a_resonance_that_a_key_moves_stays_in_phase_with_its_noise(tmp_path):
    """White noise is the same in any unit of time: with noise in seconds this error was 0.0081,
    over longer windows."""
    found = hv.sensitivity(on_plate(tmp_path, LINEAR))
    of = dict(zip(found.keys, found.elasticities, strict=True))
    assert of["oscillator.mass"].sampling95 < 0.005
    for value, right, error in sums(found):
        assert abs(value - right) < error < 0.15


@pytest.mark.ngspice
def test_under_a_sinusoid_the_elasticities_are_those_of_periodic_responses(tmp_path):
    """No sampling error, but a step error each; twice the amplitude is four times the power."""
    scene = replace(on_plate(tmp_path, LINEAR), excitation=DRIVE)
    found = hv.sensitivity(scene)
    of = dict(zip(found.keys, found.elasticities, strict=True))
    assert found.engine == "compiled"
    assert of["excitation.acceleration_amplitude"].value == pytest.approx(2.0, abs=1e-4)
    assert all(slope.stderr in (None, 0.0) and slope.bias is not None for slope in of.values())
    for value, right, error in sums(found):
        assert abs(value - right) < error < 0.15


@pytest.mark.ngspice
def test_noise_and_a_sinusoid_have_the_elasticities_of_their_powers(tmp_path):
    """A linear circuit has the sum of two powers; ensembles kept the sinusoid of the burn-in,
    so that its amplitude had a sensitivity of 0."""
    device = hv.Oscillator(mass="40 g", stiffness=16.0, damping=0.8)
    plate = replace(on_plate(tmp_path, "Rload p n 500k"), oscillator=device)
    alone = hv.Excitation(acceleration_amplitude="0.2 m/s^2", frequency="3.1 Hz")
    noise = replace(alone, acceleration_psd="3e-5 g^2/Hz")
    found = hv.sensitivity(replace(plate, excitation=noise))
    of = dict(zip(found.keys, found.elasticities, strict=True))
    sinusoid = hv.Compiled().run(replace(plate, excitation=alone)).mean_power
    part = sinusoid.value / found.mean_power.value
    assert 0.2 < part < 0.8
    for key, right in (("acceleration_amplitude", 2.0 * part), ("acceleration_psd", 1.0 - part)):
        slope = of[f"excitation.{key}"]
        error = slope.bias + 2.0 * (
            slope.sampling95 + found.mean_power.sampling95 / found.mean_power.value
        )
        assert abs(slope.value - right) < error < 0.15


@pytest.mark.thorough("test_every_element_is_a_key")
def test_rare_transitions_between_wells_leave_the_elasticities_unknown(tmp_path):
    """The share of each well changes with a key, but hardly a trajectory leaves the well of its start."""
    wells = hv.Oscillator(
        mass="40 g", stiffness=-16.0, quadratic_stiffness=4e3, cubic_stiffness=1e8, damping=0.2
    )
    noise = hv.Excitation(acceleration_psd="1e-6 g^2/Hz")
    scene = replace(on_plate(tmp_path, "Rload p n 500k"), oscillator=wells, excitation=noise)
    done = by_ensembles(Problem(scene), hv.Value(1e-6, bias=0.0), lambda _: None)
    assert done.by_key and not done.failed
    assert all("the share of each well" in slope.unknown for _, slope in done.by_key.values())


@pytest.mark.thorough("test_every_element_is_a_key")
def test_the_step_error_is_that_of_the_ensembles(tmp_path):
    """The power is extrapolated to a step of 0, and its step error is a quarter of theirs."""
    damped = hv.Oscillator(mass="40 g", stiffness=16.0, damping=0.05)
    problem = Problem(replace(on_plate(tmp_path, LINEAR), oscillator=damped))
    engine = hv.Compiled(within=0.01, judged=False)
    circuit = engine.model(problem).circuit
    ensemble = Trajectories(problem.equations, 128, ROOT, circuit=circuit, controlled=True)
    burn_in(ensemble)
    pair = RichardsonPair(ensemble, 4.0 * ensemble.time)
    bias, error = pair.relative_bias("load")
    assert pair.extrapolates and 4.0 * error < bias
    power = hv.Value(1e-6, bias=1e-6 * bias)
    done = by_ensembles(problem, power, lambda _: None)
    assert all(slope.bias > 2.0 * bias for _, slope in done.by_key.values())


@pytest.mark.thorough("test_every_element_is_a_key")
@pytest.mark.ngspice
def test_a_bridge_has_the_elasticity_of_runs_on_other_noise(tmp_path):
    """Two runs by `compiled`, each with its own noise, at a load a quarter larger and smaller."""
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    found = hv.sensitivity(scene)
    key = "load.parameters.Rload"
    elasticity = found.elasticities[found.keys.index(key)]
    value = found.values[found.keys.index(key)]
    powers = [
        hv.Compiled(within="1%", seed=seed).run(scene.varied({key: factor * value})).mean_power
        for seed, factor in ((5, 0.8), (6, 1.25))
    ]
    secant = math.log(powers[1].value / powers[0].value) / math.log(1.25 / 0.8)
    error = math.hypot(*(power.stderr / power.value for power in powers)) / math.log(1.25 / 0.8)
    assert error < 0.03
    assert (
        abs(secant - elasticity.value)
        < 4.0 * math.hypot(error, elasticity.stderr) + elasticity.bias + 0.01
    )


@pytest.mark.thorough("test_every_element_is_a_key")
@pytest.mark.ngspice
def test_stated_errors_hold_for_other_noise(tmp_path, monkeypatch):
    """From 24 seeds: the spread is at most the stated standard error, within its own sampling error."""
    problem = Problem(on_plate(tmp_path, LINEAR))
    power = hv.Value(1e-6, bias=0.0)
    by_key = {}
    for seed in range(24):
        monkeypatch.setattr(circuit_sensitivity, "ROOT", np.random.SeedSequence(seed))
        done = by_ensembles(problem, power, lambda _: None)
        assert not done.failed
        for key, (_, slope) in done.by_key.items():
            by_key.setdefault(key, []).append(slope)
    for key, slopes in by_key.items():
        if key == "excitation.acceleration_psd":  # 1, whatever the noise is
            assert all(abs(slope.value - 1.0) < 1e-5 + slope.bias for slope in slopes)
            continue
        spread = np.std([slope.value for slope in slopes], ddof=1)
        stated = math.sqrt(np.mean([slope.stderr**2 for slope in slopes]))
        assert spread < stated * (1.0 + 4.0 / math.sqrt(2.0 * 23.0)), key
        assert spread > 0.2 * stated, key


def test_a_circuit_advances_some_of_its_trajectories(tmp_path):
    """The others keep their states; those advanced are the same as among all."""
    problem = Problem(on_plate(tmp_path, LINEAR))
    circuit = hv.Compiled().model(problem).circuit
    both = [Trajectories(problem.equations, 64, ROOT, circuit=circuit) for _ in range(2)]
    both[1].moving = 32
    before = both[1].state.copy()
    whole, part = (each.run(5.0) for each in both)
    assert np.array_equal(both[0].state[..., :32], both[1].state[..., :32])
    assert np.array_equal(before[..., 32:], both[1].state[..., 32:])
    assert np.array_equal(whole.load[:32], part.load[:32]) and not part.load[32:].any()


def test_options_that_would_do_nothing_are_refused(tmp_path):
    with pytest.raises(InputError, match="`within` must be left out with a netlist"):
        hv.sensitivity(on_plate(tmp_path, LINEAR), within=0.01)
