"""Which trajectories under a steady excitation have come to one response."""

import dataclasses

import numpy as np
import pytest

from harvester.mechanics.ensemble.coexisting_responses import linked, section
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.forcing import forcing
from harvester.records.records import Record
from tests.support.systems import DRIVEN


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


RECORDED = dataclasses.replace(
    DRIVEN, drive=None, drive_frequency=None, record=Record(0.3, np.sin(np.arange(64.0) ** 2 % 7.0))
)


@pytest.mark.parametrize(
    "eqs",
    [
        DRIVEN,
        pytest.param(RECORDED, marks=pytest.mark.thorough("test_a_path_goes_on_from_a_section")),
    ],
    ids=["harmonic", "recorded"],
)
def test_a_path_goes_on_from_a_section(eqs):
    """A period later it is where it began, with the excitation that its part of a period states;
    with another it is not."""
    trajectories = Trajectories(eqs, 8, np.random.SeedSequence(3), h=0.01)
    trajectories.run(400.0)
    h, period = trajectories.h, eqs.shaking_period
    steps = round(period / h)
    whole = forcing(eqs, h, 3 * steps)
    for k in range(trajectories.count):
        state, phase = section(trajectories, k)
        off = []
        for part in (phase, (phase + 0.25) % 1.0):
            shaking = whole[round(part * steps) :][: steps + 2]
            path = trajectories.loaded.follow(state, np.zeros(steps + 1), h, shaking)
            off.append(np.hypot(path.x[-1] - path.x[0], path.V[-1] - path.V[0]))
        assert off[0] < 0.15 * off[1]
