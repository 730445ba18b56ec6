"""Quadratic damping from the scene to the answer, against an integrator of high order; who does not know it refuses."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import harvester as hv

DRIVEN = hv.Nondimensional(cv=0.5, beta=0.05, mu=1.0, drive=0.4, drive_frequency=1.0)


@pytest.mark.thorough("test_bounds.py")
@pytest.mark.slow
def test_periodic_response_by_dormand_and_prince():
    """E[V^2] at resonance, where quadratic damping alone holds the motion: within what the engine states."""
    period = 2.0 * np.pi

    def rate(t, y):
        x, v, V, _ = y
        return [v, -x - 0.5 * abs(v) * v - 0.05 * V + 0.4 * np.cos(t), v - V, V * V]

    ends = solve_ivp(
        rate, (0.0, 60.0 * period), np.zeros(4), "DOP853", [40.0 * period, 60.0 * period], rtol=1e-9
    ).y[3]
    found = hv.Ensemble(within=1e-3).run(hv.Scene(nondimensional=DRIVEN)).mean_square_voltage
    assert abs(found.value - (ends[1] - ends[0]) / (20.0 * period)) < 2.0 * found.known_error95


@pytest.mark.parametrize("engine", ["density", "averaged", "published", "exact"])
def test_theories_without_it_refuse(engine):
    scene = hv.Scene(nondimensional=hv.Nondimensional(cv=0.5, beta=0.05, mu=1.0, D11=0.01))
    with pytest.raises(hv.CannotServeError, match="damping_v"):
        hv.run(scene, engine)
