"""An answer that no device gives says so: a power below 0, or above what white noise of the base can give."""

import pytest

import harvester as hv
from harvester.engines.protocol import estimate, impossible_power
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import has
from harvester.uncertainty.value import Value
from tests.support.paths import EXAMPLES

PLATE = Problem.of(hv.load(EXAMPLES / "plate.toml"))


def test_the_bound_is_mass_times_density_over_four():
    """Whatever stiffness, stop and circuit: what white noise of the base gives is fixed, and the load gets less."""
    scene = PLATE.scene
    bound = scene.oscillator.mass * scene.excitation.acceleration_psd / 4.0
    for share, said in ((0.999, False), (1.001, True)):
        found = impossible_power(PLATE, Value(share * bound / PLATE.units.watts))
        assert (found is not None) == said
    assert found.numbers["bound"] == pytest.approx(bound, rel=1e-9)
    assert "is more than this shaking gives any device" in str(found)
    assert hv.run(scene).mean_power.value < bound


def test_a_power_below_zero_says_so():
    answer = estimate("spice", PLATE, Value(1.0), Value(-1e-6, stderr=1e-5), [], 0.0)
    assert has(answer.diagnostics, "negative_power")
    assert not has(hv.run(PLATE).diagnostics, "negative_power", "power_above_bound")


def test_other_shaking_has_no_such_bound():
    """Of a sinusoid the power depends on the response."""
    table = hv.Nondimensional(c1=0.05, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0)
    assert impossible_power(Problem.of(hv.Scene(nondimensional=table)), Value(1e6)) is None
