"""Means over records of tabulated noise: trajectories that share one count once, and together see all of it."""

import numpy as np
import pytest

from harvester.engines.sampling import mean_with_errors
from harvester.mechanics.ensemble.hopping import Hopping
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.records.records import TabulatedDensity
from tests.support.systems import PAPER, changed, linear, linear_v2

LEVEL = TabulatedDensity(np.array([0.02, 1.0]), np.array([0.04, 0.04]))
STOP = changed(PAPER, n1=None, n2=None, density=LEVEL, restitution=0.7)
LINEAR = changed(linear(0.05, 0.05), n1=None, density=LEVEL)
SEEN_ONCE = 128.0  # 1/w0: the record's period over the trajectories that share it


def powers(eqs, seeds, count, duration):
    """The powers of several seeds, with their sampling errors."""
    found = []
    for seed in range(seeds):
        many = Trajectories(eqs, count, np.random.SeedSequence(seed), 0.1)
        many.run(600.0)
        found.append(many.run(duration).averaged(many.together).mean("V2"))
    return np.array(found).T


@pytest.mark.thorough("test_entries_of_wells_are_independent_ones")
@pytest.mark.statistics
@pytest.mark.parametrize("duration", [SEEN_ONCE, 1000.0])
def test_errors_are_the_true_spread_of_seeds(duration):
    """Past a stop that dissipates energy all on one record come to do the same: their number makes no mean surer.

    By 64 independent entries a block, the errors were too small by 2.5 over 1000/w0.
    """
    seeds = 24
    mean, error = powers(STOP, seeds, 4 * BATCH, duration)
    ratio = np.log(mean.var(ddof=1) / (error**2).mean())
    # its own spread, by chi-square
    assert abs(ratio) < 4.0 * np.sqrt(2.0 / (seeds - 1) + 2.0 / (3 * seeds))


def test_places_apart_see_the_whole_record():
    """Each line has its power in every record: the linear mean over all of it does not vary; random places, by 2 %."""
    mean, error = powers(LINEAR, 1, 2 * BATCH, SEEN_ONCE)
    assert error[0] < 1e-3 * mean[0]
    assert mean[0] == pytest.approx(linear_v2(LINEAR), rel=0.005)


@pytest.mark.statistics
def test_more_effort_takes_more_records():
    """On the same records a mean would not become surer than they are; and others are as unbiased."""
    pair = RichardsonPair(Trajectories(LINEAR, 2 * BATCH, np.random.SeedSequence(1), 0.1), 190.0)
    assert len(pair.entries("V2")) == 2
    steps = pair.steps
    pair.extend(7.0 * pair.duration)
    assert pair.steps == pytest.approx(8 * steps, rel=0.02)
    assert pair.duration == pytest.approx(8 * 190.0, rel=0.01)
    assert len(np.unique(pair.entries("V2"))) == 16
    value = mean_with_errors(pair, "V2")
    assert value.dof == 15
    assert (
        abs(value.value - value.bias - linear_v2(LINEAR)) < 4.0 * value.stderr + 0.003 * value.value
    )


def test_entries_of_wells_are_independent_ones():
    """Trajectories begin in two wells in turn: in each, those on one record are one entry."""
    began = np.array([0, 1, 0, 1])
    hops = Hopping(0, 4, 1.0, 0.0, began, np.full(4, True))
    entries = np.array([1.0, 5.0, 3.0, 7.0, 2.0, 6.0, 6.0, 6.0])  # of two records of four
    value = hops.mean(entries, 4)
    assert (value.value, value.model) == (4.5, 1.5)
    assert value.stderr == pytest.approx(np.std([2.0, 4.0], ddof=1) / np.sqrt(2.0))
