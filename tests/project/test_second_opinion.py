"""A small part of the second opinion, by means that share nothing with the package but the reader of scenes."""

import ast
import importlib
import sys

import pytest

import harvester as hv
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
second = importlib.import_module("second_opinion")

pytestmark = [pytest.mark.slow, pytest.mark.thorough("test_trajectories.py")]
LITTLE = {"trajectories": 256, "duration": 150.0, "burn_in": 60.0, "within": 0.01}


@pytest.mark.parametrize("name", ["stop", "two stops"])
def test_noise_and_stops(name):
    """Heun's rule on its own noise: the same E[V^2]."""
    found = second.noisy(name, **LITTLE)
    assert abs(found.z) < 4, str(found)
    assert found.their_error < 0.03 * found.theirs


def test_it_would_see_a_wrong_answer():
    """The same rule for a stop that needs 8 % of the speed instead of 4: far off, in standard errors."""
    wrong = hv.Scene(
        nondimensional=hv.Nondimensional(**second.SCENES["stop"] | {"restitution": 0.92})
    )
    theirs, error = second.by_heun(wrong, 2, 256, 150.0, 60.0)
    assert abs(theirs - 0.08814) > 8 * error  # E[V^2] of the stop's scene, tests/support/systems.py


@pytest.mark.ngspice
def test_a_bridge():
    """Engine `spice` and the whole device as one netlist: within 0.2 % and their errors."""
    found = second.circuit("bridge", 256)
    assert abs(found.ours - found.theirs) < 4 * (found.our_error + found.their_error)
    assert found.ours == pytest.approx(found.theirs, rel=2e-3)


def test_it_uses_nothing_of_the_package():
    """No inner part is imported; among the public names only the reader of scenes and the engines that are judged."""
    tree = ast.parse((ROOT / "benchmarks" / "second_opinion.py").read_text())
    imported = {
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name for name in imported if name.startswith("harvester")} == {"harvester"}
    attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    used = {
        node.attr
        for node in attributes
        if isinstance(node.value, ast.Name) and node.value.id == "hv"
    }
    assert used == {"Scene", "Nondimensional", "load", "loads", "Ensemble", "Spice"}
