"""Engine `compiled`: a bridge agrees with the closed form of ideal diodes, and what it does not know is said."""

import pytest

import harvester as hv
from tests.support.netlists import BRIDGE, STORE, on_plate


def test_a_bridge_is_that_of_engine_ideal_and_the_unknown_part_is_named(tmp_path):
    """Ideal diodes leave out what is below 0.3 % of the power; both are on seeds of their own."""
    body = BRIDGE.format("1N4148") + STORE
    ours = hv.Compiled(within="5%", seed=1).run(on_plate(tmp_path, body))
    ideal = hv.Ideal(within="1%", seed=2).run(
        on_plate(tmp_path, body).with_load(netlist="bridge", parameters={"R": 1.5e6, "C": 1e-6})
    )
    spread = (ours.mean_power.stderr**2 + ideal.mean_power.stderr**2) ** 0.5
    size = ideal.mean_power.value
    assert abs(ours.mean_power.value - size) < 4.0 * spread + 0.003 * size + ours.mean_power.bias
    assert ours.mean_power.error95 is None
    assert "the difference from ngspice" in str(ours)
    assert not any("did not converge" in warning for warning in ours.warnings)


def test_what_it_cannot_serve_is_said_with_the_element(tmp_path):
    scene = on_plate(tmp_path, BRIDGE.format("BAT54") + STORE + "T1 p n a b Z0=50 Td=1n")
    with pytest.raises(hv.CannotServeError, match="element t1 is an element of a kind") as error:
        hv.Compiled().run(scene)
    assert "use engine 'spice'" in str(error.value)
