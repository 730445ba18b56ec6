"""Normalised sensitivities in the elements of a netlist: exact laws of a linear circuit, and which keys there are."""

import math
from dataclasses import replace

import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.studies.circuit_sensitivity import keys_with_elements
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


def test_options_that_would_do_nothing_are_refused(tmp_path):
    with pytest.raises(InputError, match="`within` must be left out with a netlist"):
        hv.sensitivity(on_plate(tmp_path, LINEAR), within=0.01)
