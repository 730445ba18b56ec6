"""Boards next to a stop: many short runs of ngspice from the compiled circuit's states, on the same noise."""

import dataclasses
import math

import pytest

import harvester as hv
from harvester.engines.spice.setup import set_up
from harvester.equations.problem import Problem
from harvester.uncertainty.value import mean_and_error
from tests.support.netlists import BRIDGE, STORE, on_plate

BOARD = BRIDGE.format("BAT54") + STORE


def beside_a_stop(folder):
    return dataclasses.replace(on_plate(folder, BOARD), stop=hv.Stop(restitution=0.7))


@pytest.mark.thorough("test_netlist_load")
@pytest.mark.ngspice
@pytest.mark.slow
def test_the_answer_is_that_of_the_compiled_circuit(tmp_path):
    """Two independent samples: their difference is within both errors, and ngspice makes few steps for its own."""
    scene = beside_a_stop(tmp_path)
    short, alone = (
        hv.Spice(within="2%", seed=1).run(scene),
        hv.Compiled(within="1%", seed=2).run(scene),
    )
    powers = short.mean_power, alone.mean_power
    stderr = math.hypot(*(one.stderr for one in powers))
    bias = sum(one.bias for one in powers)
    assert abs(powers[0].value - powers[1].value) < 4.0 * stderr + bias
    assert powers[0].known_error95 < 0.02 * powers[0].value
    assert short.details["burn_in"] == 0.0 and short.details["trajectories"] >= 64
    assert short.details["control_correlation"] > 0.99
    assert short.steps < 3e5


@pytest.mark.thorough("test_netlist_load")
@pytest.mark.ngspice
@pytest.mark.slow
def test_a_switched_circuit_begins_settled_at_the_step_of_its_twin():
    """No step fails if the storage capacitor is charged at once by so much, and the power drifts
    no more."""
    pair = set_up(
        Problem(hv.load("examples/plate_parallel_sshi.toml")), hv.Spice(within="1.9%"), settled=True
    ).pair
    assert pair.coarse_is_stopped and pair.trajectories.own_sums[1] == 0.0
    assert 0.0 < abs(pair.relative_bias("load")[0]) < 0.004
    (first, error) = pair.mean("load")
    later = pair.trajectories.run(pair.duration)
    second, other = mean_and_error(later.controlled("load", 1))
    assert abs(first - second) < 4.0 * math.hypot(error, other)


@pytest.mark.thorough("test_netlist_load")
@pytest.mark.ngspice
def test_runs_of_ones_own_are_long(tmp_path):
    """Whoever gives trajectories, or has no stop, gets runs that burn in."""
    scene = beside_a_stop(tmp_path)
    assert set_up(Problem(scene), hv.Spice(), settled=True).short
    assert not set_up(Problem(scene), hv.Spice(trajectories=16), settled=True).short
    assert not set_up(Problem(on_plate(tmp_path, BOARD, "free")), hv.Spice(), settled=True).short
