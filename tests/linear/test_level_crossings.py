"""Rice's rate and the largest value over a time, against a long path of the same linear device."""

import math
from dataclasses import replace

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.linear.level_crossings import GaussianPeaks, peaks
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.mechanics.trace import trace
from tests.support import systems

EQS = systems.linear(0.5, 1.0, 0.1)
TWO = Problem(systems.BEAM).equations  # of two modes
# kicks of a block, which is 1200/w0
STEP = 0.02
BLOCK = 60_000
COUNT = 60


@pytest.fixture(scope="module", params=[EQS, TWO], ids=["one", "two"])
def path(request):
    """The peaks of x and V, and their values in blocks of a long path, each of shape (COUNT, BLOCK)."""
    found = trace(
        request.param, gaussian_grid(np.random.SeedSequence(3), (COUNT + 1) * BLOCK), STEP
    )
    blocks = (values[BLOCK:].reshape(COUNT, BLOCK) for values in (found.x, found.V))
    return list(zip(peaks(request.param), blocks, strict=True))


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("level", [0.5, 1.5, 2.5])
def test_passages_of_a_level(path, which, level):
    """Upward passages of |x| and |V| in each block; a wrong moment or factor of two is far beyond |z| of 4."""
    one, values = path[which]
    y = np.abs(values)
    above = y > level * one.deviation
    counts = (above[:, 1:] & ~above[:, :-1]).sum(axis=1)
    expected = one.rice(level * one.deviation) * BLOCK * STEP
    z = (counts.mean() - expected) / (counts.std(ddof=1) / math.sqrt(COUNT))
    assert abs(z) < 4.0


@pytest.mark.parametrize("which", [0, 1])
def test_largest_in_a_time(path, which):
    """Half of the blocks stay below the level with the clumps; the bound is above it, and most stay below that."""
    one, values = path[which]
    largest = np.abs(values).max(axis=1)
    time = BLOCK * STEP
    share = (largest < one.largest(0.5, time)).mean()
    assert abs(share - 0.5) < 4.0 * 0.5 / math.sqrt(COUNT)
    assert one.bound(0.5, time) > one.largest(0.5, time)
    assert (largest < one.bound(0.5, time)).mean() > 0.5 - 4.0 * 0.5 / math.sqrt(COUNT)


def test_bandwidth_of_a_sharp_resonance():
    """q^2 = 4 zeta/pi for a lightly damped oscillator (Vanmarcke, 1972), c = 2 zeta."""
    x, _ = peaks(systems.linear(1e-9, 1.0, 0.002))
    assert x.bandwidth == pytest.approx(math.sqrt(4.0 * 0.001 / math.pi), rel=0.02)


@pytest.mark.parametrize("damping", [1e-6, 1e-3, 0.3])
@pytest.mark.parametrize(("beta", "mu"), [(None, None), (0.1, 1e-3)])
def test_bandwidth_by_its_closed_form(damping, beta, mu):
    """q^2 = 1 - (1 - (2/pi) arctan(z/sqrt(1 - z^2)))^2/(1 - z^2), z the damping ratio; the load dissipates as well."""
    stiffness = 1.0 + (beta or 0.0)
    dissipated = damping + (beta or 0.0) * (mu or 0.0) / stiffness
    z = 0.5 * dissipated / math.sqrt(stiffness)
    angle = 2.0 / math.pi * math.atan(z / math.sqrt(1.0 - z * z))
    q = math.sqrt(1.0 - (1.0 - angle) ** 2 / (1.0 - z * z))
    eqs = replace(systems.linear(0.0, 1.0, damping), beta=beta, mu=mu)
    assert peaks(eqs)[0].bandwidth == pytest.approx(q, rel=2e-3)


def test_short_times_have_no_peak():
    one = GaussianPeaks(1.0, 0.3, 0.1)
    assert one.bound(0.5, 1e-3) == one.largest(0.5, 1e-3) == 0.0


def test_no_response():
    with pytest.raises(hv.SimulationError, match="no stationary response"):
        peaks(systems.changed(EQS, n1=None))
