"""The numbers of a compiled part that need no FMU: the frequencies that its inner step resolves."""

import pytest

from harvester.devices.fmu import parts
from harvester.equations.problem import Problem
from harvester.scene.toml import load
from tests.support.paths import EXAMPLES

SCENES = ["plate", "plate_with_stop", "plate_harmonic", "plate_harmonic_stop"]


@pytest.mark.parametrize("name", SCENES)
def test_an_inner_step_resolves_the_scene_s_own_motion(name):
    """Up to the same part of a period, whatever the scene: a smaller step resolves as much more."""
    problem = Problem.of(load(str(EXAMPLES / f"{name}.toml")))
    part = parts.part_of(problem, problem.scales)
    drive = part.plan.outside.drive_frequency or 0.0
    halved = part._replace(plan=part.plan._replace(h=0.5 * part.step))
    assert part.fastest >= max(1.0, drive)
    assert halved.fastest == pytest.approx(max(2.0 * part.fastest, drive))
    assert part.fastest * part.step < 1.0
