"""Noise: moments of the weak variates, the strong grid and its refinement."""

import numpy as np
import pytest
from numba import njit

from harvester.mechanics.kernels.noise import (
    gaussian_grid,
    random_words,
    refined,
    shuffle,
    three_point_grid,
    two_variates,
)


@njit
def _draw(s0, s1, n):
    out = np.empty(2 * n)
    for i in range(n):
        bits, s0, s1 = shuffle(s0, s1)
        out[2 * i], out[2 * i + 1] = two_variates(bits)
    return out


@pytest.fixture(scope="module")
def weak():
    words = random_words(np.random.SeedSequence(1), 1)
    return _draw(words[0, 0], words[1, 0], 2_000_000)


@pytest.mark.parametrize("power, exact", [(1, 0), (2, 1), (3, 0), (4, 3), (5, 0)])
def test_weak_variates_have_gaussian_moments_up_to_the_fifth(weak, power, exact):
    values = weak**power
    assert abs(values.mean() - exact) < 4 * values.std() / np.sqrt(values.size)


def test_weak_variates_are_three_points_with_the_right_probabilities(weak):
    values, counts = np.unique(weak, return_counts=True)
    assert values == pytest.approx([-np.sqrt(3), 0, np.sqrt(3)])
    expected = weak.size * np.array([1 / 6, 2 / 3, 1 / 6])
    # chi^2, 2 degrees of freedom, p = 1e-4
    assert ((counts - expected) ** 2 / expected).sum() < 18.4


@pytest.mark.parametrize("lag", [1, 2, 3, 64])
def test_weak_variates_are_uncorrelated(weak, lag):
    product = weak[lag:] * weak[:-lag]
    assert abs(product.mean()) < 4 / np.sqrt(product.size)


def test_lanes_have_different_streams():
    words = random_words(np.random.SeedSequence(1), 64)
    draws = np.array([_draw(a, b, 500) for a, b in words.T])
    correlation = np.corrcoef(draws) - np.eye(64)
    assert abs(correlation).max() < 5 / np.sqrt(1000)


def test_the_grid_is_seeded():
    a, b, c = (gaussian_grid(np.random.SeedSequence(s), 100) for s in (1, 1, 2))
    assert (a == b).all()
    assert not (a == c).any()


@pytest.mark.slow
def test_refinement_keeps_the_path_and_stays_white():
    coarse = gaussian_grid(np.random.SeedSequence(3), 200_000)
    fine = refined(coarse, np.random.default_rng(4))
    # W at the old grid points: sqrt(h) sum(coarse) = sqrt(h/2) sum(fine)
    assert fine.reshape(-1, 2).sum(axis=1) / np.sqrt(2) == pytest.approx(coarse, abs=1e-12)
    assert abs(fine.var() - 1) < 4 * np.sqrt(2 / fine.size)
    assert abs((fine[1:] * fine[:-1]).mean()) < 4 / np.sqrt(fine.size)


@pytest.mark.parametrize("steps", [1, 7, 1559])
def test_a_grid_of_an_odd_number_of_kicks_is_that_of_one_more_without_its_last(steps):
    """Whatever the memory held before: arrays of large numbers of that length are left behind first."""
    for _ in range(8):
        np.full(steps, 1e247)
    found, more = (
        three_point_grid(np.random.SeedSequence(5), count) for count in (steps, steps + 1)
    )
    assert found.tolist() == more[:-1].tolist()
