"""Netlists on which plain ngspice does not converge: a capacitance from each node to ground, and what it changes."""

import dataclasses

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation.runs import CoupledDevice, path_in_worker
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.noise import three_point_grid
from harvester.presentation.diagnostic import has
from tests.support.netlists import on_plate

pytestmark = pytest.mark.ngspice

# Two Zener diodes against each other, without a junction capacitance: nothing holds the node
# between them.
CLAMPED = """.model d D(Is=1e-14)
.model z D(Is=1e-14 Bv=3 Ibv=1m)
D1 p a d
D2 n a d
D3 b p d
D4 b n d
Dz1 m a z
Dz2 m b z
Csmooth a b 1u
Rload a b 1.5Meg
"""


def test_a_shunt_changes_as_much_as_it_is_of_the_piezo(tmp_path):
    """With 1e-5 of Cp at each node the voltage changes by less than 1e-3, and the next run has none."""
    problem = Problem(on_plate(tmp_path, CLAMPED))
    noise = three_point_grid(np.random.SeedSequence(3), 1500)
    plain = CoupledDevice(problem.equations, problem.scales, problem.circuit, 0.0667, 5)
    paths = [
        path_in_worker(dataclasses.replace(plain, shunt=share), noise)
        for share in (0.0, 1e-5, 2e-5, 0.0)
    ]
    none, first, second, last = ((path.V**2).mean() for path in paths)
    assert none > 0.0
    assert len({none, first, second}) == 3
    assert first == pytest.approx(second, rel=1e-3)
    assert last == none


@pytest.mark.thorough("test_a_shunt_changes_as_much_as_it_is_of_the_piezo")
@pytest.mark.slow
def test_what_does_not_converge_is_tried_with_a_shunt(tmp_path):
    """The answer is that of the compiled circuit, which has no shunt, and states what helped."""
    scene = on_plate(tmp_path, CLAMPED)
    found = hv.Spice(trajectories=2, duration="3 s", seed=2).run(scene)
    assert has(found.warnings, "shunted")
    other = hv.Compiled(within="2%", seed=2).run(scene).mean_power
    power = found.mean_power
    assert abs(power.value - other.value) < power.known_error95 + other.known_error95
