"""Clocks of a circuit are counts that rise steadily: a chip's, at given phases."""

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.clocks import Clocks
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from tests.support.paths import EXAMPLES


def clocks_of(**parameters):
    """The clocks of a chip that looks at its input, and its circuit."""
    scene = hv.load(EXAMPLES / "bimorph_bq25570.toml")
    for name, value in parameters.items():
        scene = scene.vary(f"load.parameters.{name}", value)
    problem = Problem.of(scene)
    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    return Clocks(circuit), circuit


def states_at(circuit, phases):
    """States at rest but for the voltage of the chip's clock."""
    unknown = circuit.system.unknowns["xload.xchip.phase"]
    place = circuit.sizes[0] + list(circuit.reduction.columns).index(unknown)
    states = np.tile(circuit.rest, (len(phases), 1))
    states[:, place] = phases
    return states


@pytest.mark.parametrize("every", [16.0, 60.0, 0.5])
def test_the_period_is_that_of_the_netlist(every):
    clocks, circuit = clocks_of(every=every)
    assert clocks
    states = states_at(circuit, [3.0, 4.0, 5.0, 6.0])
    assert clocks.slowest(states, 1.0) == pytest.approx(every, rel=1e-9)
    assert clocks.slowest(states, 0.25) == pytest.approx(every / 4.0, rel=1e-9)


def test_a_count_that_rests_or_wavers_is_no_clock():
    clocks, circuit = clocks_of()
    for phases in ([5.0, 5.0, 5.0, 5.0], [3.0, 3.5, 3.2, 3.4], [6.0, 5.0, 4.0, 3.0]):
        assert clocks.slowest(states_at(circuit, phases), 1.0) == 0.0


def test_a_clock_that_begins_anew_has_its_period():
    """A node's clock returns to 0 whenever the node stops."""
    clocks, circuit = clocks_of(every=8.0)
    states = states_at(circuit, [3.0, 4.0, 0.5, 1.5, 2.5])
    assert clocks.slowest(states, 1.0) == pytest.approx(8.0, rel=1e-9)


def test_a_circuit_that_counts_nothing_has_no_clock():
    problem = Problem.of(hv.load(EXAMPLES / "bimorph_ltc3588.toml"))
    assert not Clocks(compiled_circuit(problem.load_circuit, problem.scales))
