"""Charging under tabulated noise, where trajectories share records: intervals over seeds hold what they state."""

import dataclasses
import math

import numpy as np
import pytest

import harvester as hv
from harvester.studies.charging.passages import share_interval
from tests.support.paths import EXAMPLES

SEEDS = 24


@pytest.mark.thorough("test_charge.py")
@pytest.mark.statistics
def test_shares_that_arrive_over_seeds():
    """The interval holds the share of all seeds as often as it states; that of as many independent runs does not.

    The runs are watched for about as long as a record lasts, so that those on one see the same of
    it.
    """
    noise = hv.Excitation(acceleration_psd_file=str(EXAMPLES / "shake_psd.csv"))
    scene = dataclasses.replace(hv.load(EXAMPLES / "plate_bridge.toml"), excitation=noise)
    found = [
        hv.charge(scene, "4.95 V", engine="ideal", trajectories=256, duration="60 s", seed=seed)
        for seed in range(SEEDS)
    ]
    share = np.mean([one.reached for one in found])
    stated = [one.reached_between for one in found]
    naive = [share_interval(round(one.reached * one.runs), one.runs) for one in found]
    held = np.array([sum(low <= share <= high for low, high in some) for some in (stated, naive)])
    z = (held - 0.95 * SEEDS) / math.sqrt(SEEDS * 0.95 * 0.05)
    assert z[0] > -4.0
    assert z[1] < -4.0
    assert "4 independent noise records" in str(found[0].warnings[-1])
