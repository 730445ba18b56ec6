"""Which trajectories under a steady drive have come to one response."""

import numpy as np

from harvester.mechanics.ensemble.attractors import linked


def test_means_that_scatter_without_a_gap_are_one_response():
    """E[V^2] of starts differs by 3 % by the places of impacts in a step, which were two responses; a gap parts."""
    share = np.linspace(0.0, 0.06, 64)
    means = np.exp(np.outer(share, [1.0, 0.5, 0.0])) * [1e-3, 2.0, 0.0]
    assert set(linked(means)) == {1}
    for column in range(3):
        other = means + 0.0
        if column < 2:
            other[40:, column] *= 1.025
        else:
            other[40:, column] = 0.03 * np.sqrt(means[40:, 1])
        which = linked(other)
        assert len(set(which[:40])) == len(set(which[40:])) == 1
        assert which[0] != which[-1]
