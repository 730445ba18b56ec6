"""The map of a period: a further load is one class, whose response has the power of the closed form."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

import harvester as hv
from harvester.circuits.circuit_period import CircuitMap, CircuitStart
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.cosimulation.periodic_responses import Neighbour
from harvester.cosimulation.poincare_sections import CoupledState
from harvester.equations.problem import Problem
from harvester.mechanics.periodic import WANDERS, Secants
from tests.support.resistor_map import ResistorMap


@pytest.fixture
def problem():
    return Problem.of(hv.load("examples/plate_harmonic.toml").with_load(resistance=1e6))


def test_a_load_of_ones_own_comes_to_the_closed_form(problem):
    """A wrong order, size or weight of the parts would lead elsewhere, or need many periods."""
    found = ResistorMap(problem, problem.equations.shaking_period / 512).settling(1)
    assert found.reach()
    power = hv.Exact().run(problem.scene).mean_power.value
    assert found.means[0] == pytest.approx(power, rel=1e-4)


def test_the_way_near_a_response_ends_when_it_comes_back(problem):
    """A motion that never comes back is given up after so many tries."""
    path = ResistorMap(problem, problem.equations.shaking_period / 64)
    assert path.come_near() == 1
    assert path.wandered < WANDERS
    path.step = expm(np.array([[0, 1, 0], [-1, 1e-3, 0], [0, 1, -1]]) * path.h)  # it grows
    path.wandered = 0
    assert path.come_near() == 0
    assert path.wandered == WANDERS


SECANTS = Secants(np.eye(2, 3), np.ones((2, 2)), np.array([[0.1, 1.0 / 3.0], [2.0, 3.0]]))


@pytest.mark.parametrize(
    "start",
    [
        CircuitStart(np.array([0.1, 0.2, 1.0 / 3.0, -2e-7]), np.array([1.0 / 7.0, 3.0]), 2),
        Neighbour(CoupledState(0.1, 1.0 / 3.0, {"p": 0.7}), 0.25, 3, SECANTS, 1e-6, 0.4),
        Neighbour(CoupledState(0.1, 1.0 / 3.0, {"p": 0.7}), 0.25, 3, None, 1e-6, 0.4),
        Neighbour(
            CoupledState(0.1, 1.0 / 3.0, {"p": 0.7}, higher_modes=(0.2, -1e-7)),
            0.25,
            3,
            None,
            1e-6,
            0.4,
        ),
    ],
)
def test_a_start_from_its_numbers_is_the_same(start):
    """To the last bit, so that a resumed study has the answers of an undisturbed one."""
    assert repr(type(start).from_json(start.to_json())) == repr(start)


@pytest.mark.parametrize(
    "wrong",
    [
        {"turns": 0},
        {"turns": 9},
        {"phase": math.nan},
        {"section": {"x": 0, "v": 0, "nodes": {"a b": 1}}},
        {"section": {"x": 0, "v": 0, "nodes": {}, "higher_modes": [1.0]}},
    ],
)
def test_what_is_no_start(wrong):
    start = Neighbour(CoupledState(0.1, 0.2, {"p": 0.7}), 0.25, 3, None, 1e-6, 0.4)
    with pytest.raises(ValueError, match="no state of mass and circuit"):
        Neighbour.from_json({**start.to_json(), **wrong})


def test_a_circuit_is_a_map_of_the_same_kind(problem):
    """The map of a compiled bridge counts its capacitor last, in units of the energy that passes."""
    scene = problem.scene.with_load(netlist="bridge", parameters={"R": "1 Mohm"})
    bridge = Problem.of(scene)
    circuit = compiled_circuit(bridge.load_circuit, bridge.scales)
    path = CircuitMap(circuit, bridge.equations, bridge.equations.shaking_period / 64, None)
    settling = path.settling(1)
    last = np.flatnonzero(settling.slow[-1])
    assert last == [path.coordinates_and_speeds + circuit.charge_at("csmooth")]
    assert settling.groups[-1] != settling.groups[0]
    assert settling.stored > 0.0
