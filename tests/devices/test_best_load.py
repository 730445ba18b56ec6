"""The best load of a device, by a search with a formula."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.devices.best_load import best_load
from harvester.devices.interpretation import meaning
from tests.support.datasheet import NOISE, SHEET, problem_of


@pytest.mark.slow
@pytest.mark.parametrize("stop", [{}, {"restitution": "0.9"}])
def test_best_load(stop):
    """The search finds the peak that a fine scan finds; without a stop it is the exact mu = sqrt(1 + beta)."""
    problem = problem_of({**SHEET, **NOISE, **stop, "resistance": "1 Mohm"})
    scene = problem.scene
    found = best_load(problem)
    engine = hv.Averaged() if stop else hv.Exact()
    fine = {r: engine.run(scene.with_load(r)).mean_power.value for r in np.geomspace(2e5, 2e6, 60)}
    assert found.power.value >= max(fine.values()) * (1.0 - 1e-6)
    for edge in (found.low, found.high):
        share = engine.run(scene.with_load(edge)).mean_power.value / found.power.value
        assert share == pytest.approx(0.95, abs=0.005)
    if not stop:
        exact = 1.0 / (math.sqrt(1.0 + problem.equations.beta) * scene.piezo.capacitance * 20.0)
        assert found.resistance == pytest.approx(exact, rel=0.005)
    share = meaning(problem).facts["best_load"]["share"]
    assert share == pytest.approx(engine.run(scene).mean_power.value / found.power.value)
