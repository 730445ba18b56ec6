"""Sensitivity of a netlist's power within a budget: what there was no time for is named, and not reported."""

from dataclasses import replace

import pytest

import harvester as hv
from tests.support.netlists import on_plate


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
