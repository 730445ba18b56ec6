"""The check of a mean current by charges on the same noise: how long its runs are, and at most."""

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_stores import enough_runs
from harvester.storage.measured_current import RUNS, time_constant
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.slow_circuit import JUDGED, noise_check
from tests.support.paths import EXAMPLES


@pytest.mark.parametrize("times_as_many", [1, 2])
def test_its_runs_follow_the_whole_path_at_the_step_at_twice_and_with_own_elements(times_as_many):
    """Ideal elements at two steps, a part of the runs with the netlist's own: each as long as the path."""
    problem = Problem.of(hv.load(EXAMPLES / "plate_bridge.toml"))
    eqs = problem.equations
    one = np.ones(3)
    table = RectifiedCurrent(np.array([0.0, 1.5, 3.0]), 1e-6 * one, None, one, one, 0.0 * one, 0.0)
    length = 0.5 * time_constant(eqs)
    times = np.linspace(0.0, length / problem.scales.frequency, 9)
    path = np.linspace(0.0, 2.0, 9), times
    elements, separation, steps = noise_check(problem, table, path, None, 1, times_as_many)
    of_runs = times_as_many * RUNS * 1.5 + enough_runs(eqs, times_as_many * JUDGED)
    assert steps == pytest.approx(
        of_runs * length / step_from_rest(eqs), rel=0.05
    )  # parts are whole steps
    assert 0.0 < elements < 0.1
    assert separation == 0.0
