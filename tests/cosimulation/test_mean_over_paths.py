"""`hv.cosimulate` with an asked error: the mean power of closed forms is within it, of step and sampling."""

from dataclasses import replace

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation import Piezo, cosimulate
from harvester.cosimulation.mean_over_paths import MeanOverPaths
from harvester.cosimulation.model_runs import ModelJob, noise_of
from harvester.presentation.diagnostic import has
from tests.support.models import Motion, Oscillator, linear

PIEZO = Piezo(coupling="1 mN/V", capacitance="50.2 nF")
PLATE = Oscillator(m=0.04, k=16.0, c=6.4e-3)
START = Motion(1e-3, 0.05)
OHMS = 1e6
JOB = ModelJob(
    model=None,
    start=None,
    load=None,
    port=PIEZO,
    h=0.1,
    steps=512,
    stride=1,
    seed=7,
    tolerances=(1e-4, 1.0),
    probes=(),
    compiled=False,
)
LOAD = hv.Load(resistance=OHMS)


def matrix(m):
    """The linear equations of displacement, velocity and voltage."""
    theta, farads = PIEZO.coupling, PIEZO.capacitance
    return np.array(
        [
            [0, 1, 0],
            [-m.k / m.m, -m.c / m.m, -theta / m.m],
            [0, theta / farads, -1 / (OHMS * farads)],
        ]
    )


@pytest.mark.ngspice
def test_a_ring_down_has_its_closed_form_within_the_error_of_the_step():
    found = cosimulate(PLATE, LOAD, PIEZO, START, "2 s", "10 ms", within="0.1%", every=10)
    times = np.linspace(0.0, 2.0, 40001)
    volts = linear(matrix(PLATE), [START.x, START.v, 0.0], times)[:, 2]
    exact = np.trapezoid(volts**2, times) / OHMS / 2.0
    power = found.mean_power
    assert power.stderr is None and power.error95 <= 1e-3 * power.value
    assert abs(power.value - exact) <= power.error95
    assert found.step < 0.01 and len(found.time) == 21 and found.time[1] == pytest.approx(0.1)
    assert not has(found.diagnostics, "model_path", "paths_missed")


@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.statistics
def test_the_mean_under_noise_has_both_errors():
    """From rest under white noise, by the covariance of the linear equations; |z| < 4."""
    model = PLATE._replace(c=0.16, noise=1e-4)
    found = cosimulate(model, LOAD, PIEZO, Motion(0.0, 0.0), "5 s", "5 ms", seed=3, within=0.3)
    a, q, h = matrix(model), np.zeros((3, 3)), 1e-3
    q[1, 1] = model.noise / model.m**2
    covariance, total = np.zeros((3, 3)), 0.0
    for _ in range(5000):
        covariance = covariance + h * (a @ covariance + covariance @ a.T + q)
        total += h * covariance[2, 2]
    power = found.mean_power
    assert power.known_error95 <= 0.3 * power.value and power.stderr > 0.0 and power.dof >= 3.0
    exact = total / OHMS / 5.0
    assert abs(power.value - exact) < 4.0 * power.normal_stderr + power.bias + 0.01 * exact


def test_noise_of_half_the_step_is_that_of_the_whole_refined():
    """The halves of a coarse step are fine steps, whose halves add up to it; each path has its own noise."""
    job = JOB
    coarse = noise_of(job)
    fine = noise_of(replace(job, h=0.05, steps=1024, stride=2, halvings=1))
    other = noise_of(replace(job, path=1))
    assert np.allclose(fine.sum(axis=1) / np.sqrt(2.0), coarse.ravel())
    assert abs(np.corrcoef(*fine.T)[0, 1]) < 4.0 / np.sqrt(1024)
    assert abs(fine.std() - 1.0) < 4.0 / np.sqrt(2 * 2048)
    assert abs(np.corrcoef(coarse.ravel(), other.ravel())[0, 1]) < 4.0 / np.sqrt(1024)


def test_each_path_and_each_halving_has_noise_of_its_own():
    """White noise of path 0 refined twice adds to that of its halves; what is added is that of no other path."""
    whole = JOB
    finest = replace(whole, steps=2048, halvings=2)
    added = []
    for path in range(3):
        z = noise_of(replace(finest, path=path)).ravel().reshape(-1, 2)
        added += [noise_of(replace(whole, path=path)).ravel(), (z[:, 0] - z[:, 1])[:1024]]
    correlation = np.corrcoef(added) - np.eye(len(added))
    assert np.abs(correlation).max() < 4.5 / np.sqrt(1024)


class Apart(MeanOverPaths):
    """Paths whose powers part with the step: 1 +- 0.1, independent at each step, without a bias."""

    def _of(self, count, halvings):
        return np.random.default_rng([self.job.seed, halvings]).normal(1.0, 0.1, count)


def test_paths_that_part_with_the_step_ask_for_more_paths():
    """A change that is sampling alone does not make the step smaller."""
    for seed in range(40):
        mean = Apart(replace(JOB, seed=seed))
        power, reached = mean.to(0.05)
        assert reached and mean.halvings <= 3
        assert abs(power.value - 1.0) < 4.0 * power.normal_stderr + power.bias


@pytest.mark.parametrize("within", [0.0, 1.0, "much", float("nan"), -0.1])
def test_what_is_no_accuracy_is_refused(within):
    with pytest.raises(
        hv.InputError, match=r"`within` must be a relative error between 0 and 1, such as 0\.01"
    ):
        cosimulate(PLATE, LOAD, PIEZO, START, "2 s", "10 ms", within=within)


def test_a_path_that_is_too_long_to_be_refined_is_refused():
    """Before anything runs: its noise would fill the memory of several workers."""
    with pytest.raises(
        hv.InputError, match=r"`duration` must have at most 4000000 steps of `step` with"
    ):
        cosimulate(PLATE, LOAD, PIEZO, START, "1000 s", "20 us", within=0.1, every=100)


@pytest.mark.ngspice
@pytest.mark.parametrize("progress", [False, True, None])
def test_a_progress_is_accepted_as_by_the_other_functions(progress):
    """`progress` was an unknown argument of this function alone."""
    plain = cosimulate(PLATE, LOAD, PIEZO, START, "0.2 s", "10 ms")
    found = cosimulate(PLATE, LOAD, PIEZO, START, "0.2 s", "10 ms", progress=progress)
    np.testing.assert_array_equal(found.voltage, plain.voltage)


@pytest.mark.ngspice
@pytest.mark.parametrize("within", [None, "1%"])
def test_a_function_is_told_the_fraction_of_the_trajectories(within):
    told = []
    cosimulate(PLATE, LOAD, PIEZO, START, "0.2 s", "10 ms", within=within, progress=told.append)
    assert told[-1] == 1.0
    assert all(0.0 < part <= 1.0 for part in told)
    assert len(told) == 1 if within is None else len(told) >= 8


@pytest.mark.ngspice
def test_a_progress_that_cannot_be_called_is_refused():
    with pytest.raises(hv.InputError, match="`progress` must be"):
        cosimulate(PLATE, LOAD, PIEZO, START, "0.2 s", "10 ms", progress=3)
