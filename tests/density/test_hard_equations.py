"""Scenes in which the modes depend strongly on each other, or whose first box is far too large."""

import dataclasses

import numpy as np
import pytest

import harvester as hv
from harvester.density import coupled_modes
from harvester.density.adjoint import adjoint
from harvester.density.box import settled
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.refine import refined, solution
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from tests.support.systems import PAPER, changed, scene


@pytest.mark.slow
def test_all_modes_at_once_are_what_sweeps_over_them_are(monkeypatch):
    """Both solutions of the same equations, and of the transposed ones."""
    eqs = changed(PAPER, beta=1.2, c1=-0.05, restitution=0.7)
    setting = settled(eqs, 20.0)
    on = mesh(eqs, setting.box, RESOLUTIONS[0])
    swept = solution(eqs, setting, on, 5)
    monkeypatch.setattr(coupled_modes, "FEW_SWEEPS", 3)
    joint = solution(eqs, setting, on, 5)
    assert joint.factors.is_joint and not swept.factors.is_joint
    assert np.abs(joint.p - swept.p).max() < 1e-9 * np.abs(swept.p).max()
    right = np.random.default_rng(1).standard_normal(swept.p.shape)
    right[0] -= (
        np.vdot(right, swept.p)
        * coupled_modes.integrals(swept.form)
        / coupled_modes.integrals(swept.form).size
    )
    told = [adjoint(one.factors, right) for one in (swept, joint)]
    assert np.abs(told[0] - told[1]).max() < 1e-6 * np.abs(told[0]).max()


QUICKER = pytest.mark.thorough("test_a_damped_compliant_stop_with_a_quick_load_is_served")


@pytest.mark.slow
@pytest.mark.parametrize("mu", [30.0, *(pytest.param(mu, marks=QUICKER) for mu in (1.0, 1000.0))])
def test_a_damped_compliant_stop_with_a_quick_load_is_served(mu):
    """A stop that dissipates much more energy than the damping, which the first guess of the box does not know.

    With a quick load V = x'/mu, so that mu^2 E[V^2] comes near E[x'^2].
    """
    eqs = Equations(
        c1=-0.008, beta=1.245, mu=mu, n1=1.0, gap=0.577, stop_stiffness=625.0, stop_damping=5.0
    )
    found = refined(eqs, 1e-3)
    assert found.share < 1e-3
    if mu == 1000.0:
        assert mu**2 * found.means[0] == pytest.approx(found.means[3], rel=2e-3)


@pytest.mark.thorough("test_all_modes_at_once_are_what_sweeps_over_them_are")
@pytest.mark.slow
def test_two_keys_of_the_largest_power_are_those_of_a_grid():
    """Newton's optimum over load and gap against the powers around it."""
    eqs = changed(
        PAPER, c1=-0.1, c2=None, c3=None, alpha=None, n2=None, beta=0.02, restitution=0.6, gap=0.3
    )
    keys = {"nondimensional.mu": (0.2, 5.0), "nondimensional.gap": (0.05, 1.0)}
    found = hv.optimise(scene(eqs), vary=keys, engine="density", budget=200.0)
    best = [one.value for one in found.keys]
    power = found.estimate.mean_power

    def at(mu, gap):
        other = dataclasses.replace(eqs, mu=mu, gap=gap)
        return hv.Density(within=1e-4).run(scene(other)).mean_power.value

    around = [(0.85, 0.0), (1.15, 0.0), (1.0, -0.1), (1.0, 0.1), (0.9, 0.1), (1.1, -0.1)]
    grid = [at(best[0] * k, min(max(best[1] + h, 0.05), 1.0)) for k, h in around]
    assert max(grid) <= power.value * (1.0 + 1e-4) + power.known_error95
    assert not [one for one in found.diagnostics if one.code == "search_cut_short"]


def test_a_preload_with_strong_parametric_noise_has_no_box():
    """Once a division by zero: on the coarse mesh the warmth vanished, and with it the box."""
    table = {"c1": -0.0041298, "D11": 0.018061, "beta": 0.020124, "mu": 0.020733}
    table |= {"alpha": 1.2529, "D22": 0.018615, "restitution": 0.61458, "gap": -0.15867}
    preloaded = hv.Scene(nondimensional=hv.Nondimensional(**table))
    with pytest.raises(
        SimulationError, match=r"no box contains the density: use engine 'ensemble'"
    ):
        hv.Density(within=0.01).run(preloaded)
