"""Shares of the variance against functions whose shares are known, and what a polynomial states of its own error."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.studies.tolerance import design
from harvester.studies.tolerance.spreads import PartSpread
from harvester.studies.tolerance.surface import fit
from harvester.studies.tolerance.variance_shares import indices, turned

ISHIGAMI = tuple(PartSpread(name, "uniform", (-math.pi, math.pi), "") for name in "abc")
# Ishigami and Homma (1990) with a = 7, b = 0.1: D = a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2.
WHOLE = 49.0 / 8.0 + 0.1 * math.pi**4 / 5.0 + 0.01 * math.pi**8 / 18.0 + 0.5
FIRST = [0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2 / WHOLE, 49.0 / 8.0 / WHOLE, 0.0]
BOTH = 0.01 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0) / WHOLE  # of the first and the third together
TOTAL = [FIRST[0] + BOTH, FIRST[1], BOTH]


def ishigami(x):
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def check(found):
    for key, first, total in zip("abc", FIRST, TOTAL, strict=True):
        assert abs(found[key].first - first) < found[key].first_error95 * 1.5
        assert abs(found[key].total - total) < found[key].total_error95 * 1.5
        assert found[key].first_error95 < 0.06


def test_indices_of_ishigami():
    check(indices(ishigami, ISHIGAMI))


@pytest.mark.slow
def test_indices_of_ishigami_by_its_surface():
    """The polynomial through 512 samples misses a fraction of the variance, which widens the intervals."""
    x = design.values_at(ISHIGAMI, design.sobol_points(512, 3, 0))
    surface = fit(x, ishigami(x))
    assert 1e-5 < surface.unexplained < 0.02
    check(indices(surface, ISHIGAMI, surface.unexplained))


def test_surface_knows_what_it_misses():
    """A polynomial is met to rounding; with noise about it, the scatter is that of the noise."""
    x = np.random.default_rng(0).random((400, 2))
    y = 1.0 + x[:, 0] - 3.0 * x[:, 0] * x[:, 1] ** 2
    assert fit(x, y).unexplained < 1e-20
    noisy = fit(x, y + np.random.default_rng(1).normal(size=400) * 0.1)
    assert noisy.scatter == pytest.approx(0.1, rel=0.15)
    fresh = np.random.default_rng(2).random((2000, 2))
    missed = noisy(fresh) - (1.0 + fresh[:, 0] - 3.0 * fresh[:, 0] * fresh[:, 1] ** 2)
    assert missed.std() < 0.05


def test_surface_of_a_key_with_two_values():
    """High powers of it are not new functions, and must not blow up."""
    x = np.column_stack([np.repeat([0.0, 1.0], 50), np.linspace(0.0, 1.0, 100)])
    assert fit(x, x[:, 0] * 2.0 + x[:, 1] ** 3).unexplained < 1e-12


def test_too_few_samples():
    with pytest.raises(hv.SimulationError, match="too few samples"):
        fit(np.zeros((3, 2)), np.zeros(3))


def test_no_shares_of_what_does_not_change():
    assert indices(lambda x: np.ones(len(x)), ISHIGAMI) == {}


def test_shares_turn_by_the_error_of_the_function():
    """An error along the worst direction reaches the stated distance, and no random one exceeds it."""
    rng = np.random.default_rng(4)
    places = rng.random((4096, 2))
    one, other = (places - places.mean(axis=0)).T / places.std(axis=0)[:, None]
    other = other - one * (one @ other) / (one @ one)
    other /= other.std()
    share, ratio = 0.36, 0.2
    y = np.sqrt(share) * one + np.sqrt(1.0 - share) * other
    stated = float(turned(np.array([share]), ratio)[0])

    def moved(error):
        changed = y + ratio * error / error.std()
        return (one @ changed) ** 2 / (one @ one) / (changed @ changed) - share

    turns = [moved(np.cos(a) * one + np.sin(a) * other) for a in np.linspace(0.0, 6.3, 400)]
    assert max(np.abs(turns)) == pytest.approx(stated, rel=1e-3)
    assert max(abs(moved(rng.normal(size=4096))) for _ in range(20)) < stated
