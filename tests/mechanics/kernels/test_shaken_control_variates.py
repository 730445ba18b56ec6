"""What is new in coloured noise from step to step: distinguished from what was foreseen, on fine
grids and coarse ones."""

import numpy as np
import pytest

from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.forcing import coarse_forcing, filtered, forcing
from harvester.mechanics.kernels.noise import coarsened, three_point_grid
from harvester.mechanics.kernels.shaken_control_variates import martingales, shaken_path_controls
from harvester.mechanics.kernels.shaking import filter_of

H = 0.2
STEPS = 4000
SLOW = Equations(coloured=0.3, correlation_time=2.0)
BAND = Equations(coloured=0.3, centre=1.3, bandwidth=0.4)


def rng():
    return np.random.default_rng(5)


@pytest.mark.parametrize("eqs", [SLOW, BAND], ids=["coloured", "band"])
def test_new_is_what_the_filter_does_not_foretell(eqs):
    """p of the next step less its mean given (p, q); independent of both, and of the variance that the filter has."""
    p, q, new = filtered(eqs, H, STEPS, rng())
    np.testing.assert_array_equal(p, forcing(eqs, H, STEPS, rng()))
    a11, a12, *_, l11 = filter_of(eqs, H)[:5]
    np.testing.assert_allclose(p[1:] - a11 * p[:-1] - (a12 or 0.0) * q[:-1], new[:-1], atol=1e-12)
    assert new.std() == pytest.approx(l11, rel=4.0 / np.sqrt(2.0 * STEPS))
    for known in (p, q):
        assert abs((known * new).mean()) < 4.0 * known.std() * new.std() / np.sqrt(STEPS)


@pytest.mark.parametrize("eqs", [SLOW, BAND], ids=["coloured", "band"])
def test_coarse_member_is_on_the_same_noise(eqs):
    """Every second acceleration of half the step; for Ornstein and Uhlenbeck's with the whole step's variance."""
    coarse = coarse_forcing(eqs, H, 50, rng())
    fine = forcing(eqs, 0.5 * H, 100, rng())
    assert len(coarse) == 51
    ratio = coarse / fine[::2]
    gain = np.sqrt(0.5 * np.tanh(H / 4.0) / np.tanh(H / 8.0)) if eqs is SLOW else 1.0
    np.testing.assert_allclose(ratio, gain, rtol=1e-12)
    noise = three_point_grid(np.random.SeedSequence(2), STEPS)
    assert coarsened(noise).std() == pytest.approx(noise.std(), rel=0.1)
    assert coarsened(noise)[3] == pytest.approx((noise[6] + noise[7]) / np.sqrt(2.0))


def test_columns_of_a_path():
    """Eight sums a block, by hand; and as many rows as the noise has."""
    states, parts = (
        np.random.default_rng(1).normal(size=(4, 2, 6)),
        np.random.default_rng(2).normal(size=(3, 2, 6)),
    )
    (x, v, V, _), (p, q, new) = states, parts
    theta, size = np.arctan2(v, x), np.hypot(x, v)
    g = x, v, V, size, size * np.cos(2 * theta), size * np.sin(2 * theta), p, q
    np.testing.assert_allclose(
        shaken_path_controls(states, parts), [(one * new).sum(axis=1) for one in g], rtol=1e-12
    )
    assert (martingales(coloured=True), martingales(coloured=False)) == (17, 9)
    several = SLOW, Equations(n1=1.0), Equations(n2=1.0), Equations(drive=1.0, drive_frequency=1.0)
    assert [eqs.has_new_noise for eqs in several] == [True, True, True, False]
