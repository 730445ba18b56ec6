"""A user's bridge of four diodes alike: ngspice runs with the circuit of ideal diodes, as with the package's."""

import math

import pytest

import harvester as hv
from harvester.engines.spice.setup import set_up
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from tests.support.netlists import BRIDGE, STORE, on_plate

BOARD = BRIDGE.format("BAT54") + STORE


@pytest.mark.ngspice
def test_its_runs_are_short_without_a_stop_alone(tmp_path):
    """Next to a stop, where two paths part, the compiled circuit runs with it."""
    free = set_up(Problem(on_plate(tmp_path, BOARD)), hv.Spice(within="5%"), settled=True)
    assert isinstance(free.device.ideal, IdealCircuit) and free.stays_together
    scene = on_plate(tmp_path, BOARD).replace(stop=hv.Stop(restitution=0.9))
    stopped = set_up(Problem(scene), hv.Spice(), settled=True)
    assert not isinstance(stopped.device.ideal, IdealCircuit) and not stopped.stays_together


@pytest.mark.ngspice
@pytest.mark.statistics
@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_answer_is_that_of_the_compiled_circuit(tmp_path, seed):
    """The ideal circuit leaves out series resistance and capacitances of the BAT54: ngspice adds what they do."""
    scene = on_plate(tmp_path, BOARD)
    answer = hv.Spice(within="1%", seed=seed).run(scene)
    beside = hv.Compiled(within="0.8%", seed=10).run(scene)
    powers = answer.mean_power, beside.mean_power
    known = 4.0 * math.hypot(*(power.stderr for power in powers)) + sum(
        power.bias for power in powers
    )
    assert abs(powers[0].value - powers[1].value) < known < 0.02 * powers[1].value
    assert answer.details["control_correlation"] > 0.999
    assert answer.steps < 1.5e5
