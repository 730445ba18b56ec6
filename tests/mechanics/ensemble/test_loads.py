"""Mechanics with its load: one object states what trajectories need, for each pair of modes and load."""

import re

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.circuits.idealised import ideal_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.loads import loaded
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.moments import Moments
from tests.support.paths import ROOT

ONE = (ROOT / "examples" / "plate_bridge.toml").read_text().partition("[load]")[0]
TWO = (ROOT / "examples" / "two_modes_with_stop.toml").read_text().partition("[load]")[0]
RESISTOR = '[load]\nresistance = "100 kohm"\n'
BRIDGE = '[load]\nnetlist = "bridge"\nparameters = { R = "100 kohm", C = "1 uF" }\n'


SWITCHED = BRIDGE.replace("bridge", "parallel_sshi")
DRIVE = 'acceleration_amplitude = "0.1 g"\nfrequency = "{}"\n'
CIRCUITS = {
    "resistor": lambda problem: None,
    "ideal": lambda problem: ideal_circuit(problem.circuit, problem.scales),
    "compiled": lambda problem: compiled_circuit(problem.circuit, problem.scales),
}


@pytest.mark.slow
@pytest.mark.parametrize("mechanics", [ONE, TWO], ids=["one mode", "two modes"])
@pytest.mark.parametrize("load", CIRCUITS)
def test_a_path_goes_on_as_its_trajectory_does(mechanics, load):
    """From a state after a kick, by a kernel of its own, to the state that the trajectory has a period later."""
    drive = DRIVE.format("3 Hz" if mechanics is ONE else "45 Hz")
    shaken = re.sub(r"acceleration_psd.*\n", drive, mechanics)
    text = {"resistor": RESISTOR, "ideal": SWITCHED, "compiled": BRIDGE}[load]
    problem = Problem.of(hv.loads(shaken + text))
    eqs = problem.equations
    trajectories = Trajectories(
        eqs, 8, np.random.SeedSequence(3), h=0.02, circuit=CIRCUITS[load](problem)
    )
    trajectories.run(30.0)
    before = trajectories.state.copy()
    angle = np.arctan2(*trajectories.filter[0, ::-1, 2])
    turn = round(eqs.shaking_period / trajectories.h)
    shaking = eqs.drive * np.cos(angle + 2.0 * np.pi * np.arange(turn + 1.0) / turn)
    trajectories.run(eqs.shaking_period)
    path = trajectories.loaded.follow(before[0, :, 2], np.zeros(turn), trajectories.h, shaking)
    x, _, voltage = trajectories.state[0, :3, 2]
    assert abs(voltage) > 1e-3
    assert path.samples[-1, :2] == pytest.approx([x, voltage], rel=1e-6)


@pytest.mark.parametrize("mechanics", [ONE, TWO], ids=["one mode", "two modes"])
@pytest.mark.parametrize("load", ["resistor", "ideal", "compiled"])
def test_rows_that_a_load_begins_are_those_that_it_has(mechanics, load):
    """x, x' and V stay; the storage capacitor is empty, or absent; every further row has a
    value."""
    problem = Problem.of(hv.loads(mechanics + (RESISTOR if load == "resistor" else BRIDGE)))
    circuit = CIRCUITS[load](problem)
    pair = loaded(problem.equations, circuit)
    further = 0 if mechanics is ONE else 2  # the second mode's coordinate and speed
    below = {"resistor": 3, "ideal": 5, "compiled": getattr(circuit, "rows", 0)}[load]
    assert pair.rows == below + further
    state = np.zeros((2, pair.rows, BATCH))
    state[:, :3] = np.arange(3.0)[:, None]
    pair.begin(state)
    assert (state[:, :3] == np.arange(3.0)[:, None]).all()
    assert np.isfinite(state).all()
    block = pair.batch(state[0], np.zeros((2, BATCH), np.uint64), None, None)
    assert np.shares_memory(block.state, state[0])
    assert pair.is_dear == (load == "compiled")
    memory = 1.0 / problem.equations.mu if circuit is None else circuit.memory
    assert (pair.memory, pair.constant) == (memory, "1/mu" if circuit is None else "R C w0")
    state[:, 3:] = 2.0
    means = Moments(*np.ones((12, 2 * BATCH)))
    powers = [now for _, now in pair.powers(means, state)]
    assert len(powers) == (circuit is not None)
    assert all((power == 4.0 * circuit.mu).all() for power in powers)
    rows = len(pair.boundary(np.ones((pair.rows, 4))))
    assert rows == {("resistor", 0): 4, ("resistor", 2): 1}.get((load, further), 9)


def test_controls_of_a_circuit_stand_beside_their_changes():
    """With a circuit each change follows its martingale; with a resistor all changes follow all martingales."""
    martingale, change = np.zeros((2, 3)), np.ones((2, 3))
    equations = Problem.of(hv.loads(ONE + RESISTOR)).equations
    problem = Problem.of(hv.loads(ONE + BRIDGE))
    circuit = ideal_circuit(problem.circuit, problem.scales)
    apart = loaded(equations, None).controls(martingale, change)
    together = loaded(problem.equations, circuit).controls(martingale, change)
    assert apart[:, 0].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert together[:, 0].tolist() == [0.0, 1.0, 0.0, 1.0]
