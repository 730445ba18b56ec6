"""The shares that trajectories report: early ones with a slow circuit, a third for one window."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.machine.progress import listening
from harvester.mechanics.ensemble import trajectories
from harvester.mechanics.ensemble.burn_in import until_steady
from harvester.mechanics.ensemble.trajectories import Trajectories

SEED = np.random.SeedSequence(1)


@pytest.fixture
def told(monkeypatch):
    """A list of shares, to which each report comes, however soon after another one."""
    monkeypatch.setattr(trajectories, "REPORTED", 0.0)
    return list[float]()


def run_of_board(told, deadline=math.inf):
    """Trajectories of a board after some steps, and the means of their last ones."""
    problem = Problem.of(hv.load("examples/bimorph_board.toml"))
    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    of_board = Trajectories(problem.equations, 16, SEED, circuit=circuit)
    of_board.run(60.0, told.append, deadline)
    return of_board, of_board.run(0.5)


def test_a_slow_circuit_reports_its_first_steps(told):
    """The first report came after 4,096 steps: 5 s on a board with a chip."""
    of_board, means = run_of_board(told)
    assert told[0] < 0.02 and told == sorted(told)
    watched, same = run_of_board(told, 1e12)
    assert np.array_equal(of_board.state, watched.state)
    assert np.array_equal(means.V2, same.V2)


def test_the_first_window_is_a_third_of_a_burn_in(told):
    """It needs two windows at least, the second of twice the length; the first alone reported all of it."""
    scene = Problem.of(hv.load("examples/plate_with_stop.toml"))
    with listening(told.append):
        until_steady(Trajectories(scene.equations, 256, SEED))
    after_first = told.index(1.0 / 3.0)
    assert told[0] == 0.0 and told[-1] == pytest.approx(1.0)
    assert max(told[:after_first]) <= 1.0 / 3.0 < told[-2]
