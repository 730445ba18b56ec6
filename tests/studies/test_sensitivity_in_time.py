"""Sensitivities within a budget: keys without time are named, and the warnings of the power are repeated."""

from dataclasses import replace

import pytest

import harvester as hv
from tests.support.netlists import on_plate
from tests.support.paths import EXAMPLES


@pytest.mark.thorough("test_every_element_is_a_key")
@pytest.mark.ngspice
def test_a_budget_leaves_keys_out_and_names_them(tmp_path):
    """If the first ensemble spends the budget, its power is reported, and every key is named in a warning."""
    scene = on_plate(tmp_path, "R1 p a 100k\nC2 a n 10n\nRload a n 500k")
    damped = replace(scene, oscillator=hv.Oscillator(mass="40 g", stiffness=16.0, damping=0.2))
    found = hv.sensitivity(damped, budget=1e-3)
    (left_out,) = (one for one in found.diagnostics if one.code == "keys_left_out")
    assert found.keys == () and found.mean_power.value > 0.0
    assert (
        " 0 s" not in str(left_out)
        and "oscillator.mass" in str(left_out)
        and "load.parameters.R1" in str(left_out)
    )


@pytest.mark.thorough("test_every_element_is_a_key")
@pytest.mark.ngspice
def test_the_warnings_of_the_power_are_repeated(tmp_path):
    """Runs of `density`, `slow` and `compiled` that miss their target or their time."""
    heated = {"c1": -0.05, "beta": 0.05, "mu": 1.0, "D11": 0.01, "D22": 0.07}
    density = hv.Scene(nondimensional=hv.Nondimensional(**heated, restitution=0.9))
    linear = on_plate(tmp_path, "R1 p a 100k\nC2 a n 10n\nRload a n 500k")
    damped = replace(linear, oscillator=hv.Oscillator(mass="40 g", stiffness=16.0, damping=0.2))
    for scene, options, code in (
        (density, {"within": 1e-3}, "density_not_reached"),
        (hv.load(EXAMPLES / "bimorph_board.toml"), {"budget": 0.01}, "quick_in_budget"),
        (damped, {"budget": 1e-3}, "target_missed"),
    ):
        found = hv.sensitivity(scene, **options)
        (doubt,) = (one for one in found.diagnostics if one.code == code)
        assert doubt in found.warnings
