"""The load resistor by ngspice's rule: ngspice's path to rounding, a lane's path, the exact update's mean."""

import re

import numpy as np
import pytest

from harvester.cosimulation import runs as worker
from harvester.cosimulation.ngspice.deck import integration_options
from harvester.engines import Spice
from harvester.engines.spice.setup import set_up
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.moments import from_path
from harvester.mechanics.kernels.ngspice_rule import rule_weight
from harvester.mechanics.kernels.noise import fill_three_point, three_point_grid
from harvester.mechanics.trace import trace
from harvester.scene.toml import load
from tests.support.systems import changed, z

SEED = np.random.SeedSequence(20261121)
PLATE = Equations(beta=1.245, c1=-0.008, n1=1.0)
THOROUGH = pytest.mark.thorough("test_a_resistor_makes_the_steps_of_ngspice")


@pytest.mark.ngspice
@pytest.mark.parametrize(
    "given",
    [
        "plate_with_stop",
        pytest.param("paper_figure3", marks=THOROUGH),
        pytest.param("plate", marks=THOROUGH),
    ],
)
def test_a_resistor_makes_the_steps_of_ngspice(given):
    """Its integration rule, at impacts and readings too: the same path to rounding, once the first steps are forgotten.

    ngspice's first step is of first order; the load forgets that in time constants 1/mu.
    """
    scene = load(f"examples/{given}.toml")
    device = set_up(Problem(scene), Spice()).device
    noise = three_point_grid(SEED, round(600.0 / device.h / device.stride) * device.stride // 2 * 2)
    theirs = worker.path_in_worker(device, noise)
    ours = trace(device.eqs, noise, device.h, device.stride, ngspice_rule=True)
    late = slice(len(ours.t) * 4 // 5, None)
    assert np.std(ours.V[late] - theirs.V[late]) < 1e-8 * np.std(ours.V)
    exact = trace(device.eqs, noise, device.h, device.stride)
    if scene.stop is not None or device.eqs.restitution is not None:
        assert len(ours.impacts) == len(theirs.impacts) > 50
    assert np.std(exact.V[late] - theirs.V[late]) > 10.0 * np.std(ours.V[late] - theirs.V[late])


@pytest.mark.parametrize("z", [1e-6, 0.01, 1.0, 50.0, 1e4])
def test_deck_has_the_weight_of_the_compiled_steps(z):
    """The options card's xmu is the weight that the kernels compute, to rounding."""
    xmu = re.search(r"xmu=(\S+)", integration_options(z, 1.0, 1.0, 1.0, 1e-4))
    assert float(xmu[1]) == pytest.approx(rule_weight(z), rel=1e-12)


@pytest.mark.parametrize("r", [None, 0.9])
def test_a_lane_with_ngspices_rule_is_its_path(r):
    """Readings are landings: the state continues from mid-drift, over calls of `run` as well."""
    eqs = changed(PLATE, restitution=r, mu=1.0)
    h = 0.07
    many = Trajectories(eqs, 64, SEED, h, ngspice_rule=True)
    words = many.words[0].copy()
    first, second = many.run(12.0), many.run(24.0)
    moments = first.mixed(second, 24.0 / 36.0)
    for lane in (0, 63):
        noise = np.empty(round(many.time / h))
        fill_three_point(noise, *words[:, lane])
        path = trace(eqs, noise, h, many.stride, ngspice_rule=True)
        same = from_path(eqs, path, 0.0, 1)
        for name in ("V2", "load", "x2", "impacts"):
            assert getattr(same, name)[0] == pytest.approx(
                getattr(moments, name)[lane], rel=0.01
            ), name
        assert pytest.approx(many.snapshot()[:, lane], rel=1e-6) == path.samples[-1, 2:]


@pytest.mark.thorough("test_a_resistor_makes_the_steps_of_ngspice")
@pytest.mark.statistics
def test_the_rule_costs_what_the_step_costs():
    """The exact update and ngspice's rule have the same E[V^2] within the step's bias."""
    eqs = changed(PLATE, mu=1.0, restitution=0.96)
    exact = RichardsonPair(Trajectories(eqs, 4096, SEED, 0.05), 400.0)
    other = RichardsonPair(Trajectories(eqs, 4096, SEED, 0.05, ngspice_rule=True), 400.0)
    assert abs(z(other.extrapolated("V2"), *exact.extrapolated("V2"))) < 4
