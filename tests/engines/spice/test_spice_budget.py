"""A budget bounds the compiled circuit that is paired with ngspice."""

import dataclasses
import time

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.engines.spice.cheap_model import cheap_model, ideal_elements, pilot_of
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.burn_in import burn_in
from tests.support.netlists import PLATE

BUDGET = 2.0  # s


def test_a_compiled_circuit_that_settles_for_long_gives_way_to_ideal_elements():
    """It settled for several seconds, whatever the budget, of which half is for it now."""
    scene = PLATE.with_load(netlist="sece", parameters={"R": 2e6, "C": 1e-6})
    problem = Problem.of(dataclasses.replace(scene, stop=hv.Stop(restitution=0.9)))
    options = hv.Spice(within="0.2%", budget=BUDGET)
    ideal = ideal_elements(problem, problem.circuit)
    compiled = compiled_circuit(problem.circuit, problem.scales)
    pilot, _ = pilot_of(problem, options, ideal, False)
    burn_in(pilot)
    begin = time.perf_counter()
    pair, _ = cheap_model(pilot, compiled, pilot.time, compiled.memory, options, begin)
    assert pair.trajectories.circuit is ideal
