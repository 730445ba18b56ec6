"""How far a cheap engine's samples are from a dearer one's, in dependence of the keys, and what shares make of it."""

import numpy as np
import pytest

import harvester as hv
from harvester.studies.tolerance.ratio import plane
from harvester.studies.tolerance.samples import Samples
from harvester.studies.tolerance.spreads import PartSpread
from harvester.studies.tolerance.variance_shares import indices
from tests.support.paths import EXAMPLES

RNG = np.random.default_rng(5)
X = RNG.uniform([0.5e-3, 0.7, 0.8], [1.5e-3, 0.9, 1.2], (8, 3))


def test_a_bias_along_a_key_is_a_plane():
    """Which predicts other samples; ratios without a trend have their mean, whose error is the wider."""
    ratios = 1.0 + 20.0 * (X[:, 0] - 0.5e-3) + 1e-3 * RNG.standard_normal(8)
    found = plane(X, ratios)
    others = RNG.uniform([0.5e-3, 0.7, 0.8], [1.5e-3, 0.9, 1.2], (200, 3))
    off = found(others) - (1.0 + 20.0 * (others[:, 0] - 0.5e-3))
    assert len(found.coefficients) == 4 and found.share == 0.5
    assert (np.abs(off) <= found.width95).mean() >= 0.95
    assert found.width95 < 0.4 * np.ptp(ratios)
    flat = plane(X, 1.01 + 1e-3 * RNG.standard_normal(8))
    assert len(flat.coefficients) == 1
    assert flat(others) == pytest.approx(1.01, abs=2e-3)
    few = plane(X[:4], ratios[:4])  # too few for a plane
    assert len(few.coefficients) == 1


def test_intervals_of_a_mean_ratio_are_those_of_a_sample():
    """Of 2000 sets of 4 ratios 95 % of a further one lie inside, within 4 standard errors."""
    inside = []
    for _ in range(2000):
        ratios = 1.0 + 0.01 * RNG.standard_normal(5)
        found = plane(X[:4, :1], ratios[:4])
        inside.append(abs(ratios[4] - float(found(X[:1, :1])[0])) <= found.width95)
    share = np.mean(inside)
    assert share > 0.95 - 4.0 * np.sqrt(0.95 * 0.05 / 2000)


def test_shares_of_the_variance_hold_the_error_of_the_engine():
    """A cheap engine that is 4 % high at one end of a key and exact at the other changes that key's share."""
    scatter = (
        PartSpread("stop.gap", "uniform", (0.8e-3, 1.2e-3), ""),
        PartSpread("stop.restitution", "uniform", (0.855, 0.945), ""),
    )

    def true(x):
        return 1.0 + 0.10 * (x[:, 0] / 1e-3 - 1.0) / 0.2 + 0.08 * (x[:, 1] / 0.9 - 1.0) / 0.05

    def cheap(x):
        return true(x) * (1.02 - 0.02 * (x[:, 0] / 1e-3 - 1.0) / 0.2)

    many = np.stack([part.at(RNG.uniform(size=4096)) for part in scatter], axis=1)
    ratios = true(many[:8]) / cheap(many[:8])
    spread = ratios.std(ddof=1) * np.sqrt(1.0 + 1.0 / 8)
    samples = Samples(
        "cheap", {"mean_power": cheap(many)}, many[:, 0] > 0.0, {"mean_power": 0.1}, (), spread
    )
    exact = indices(true, scatter)["stop.gap"]
    alone = indices(cheap, scatter)["stop.gap"]
    assert abs(alone.first - exact.first) > alone.first_error95  # what was stated before
    whole = indices(cheap, scatter, by_engine=samples.share_error)["stop.gap"]
    assert abs(whole.first - exact.first) < whole.first_error95 < 0.6


@pytest.mark.slow
@pytest.mark.statistics
def test_the_share_of_a_gap_is_that_of_an_own_sampler():
    """A plate with a gap of 0.5 to 1.5 mm, restitution 0.7 to 0.9, coupling +-20 %: 0.59 +- 0.012, by 95 %."""
    scene = hv.load(EXAMPLES / "plate_with_stop.toml").replace(
        stop=hv.Stop(restitution=0.8, gap="1 mm")
    )
    vary = {"stop.gap": "0.5 mm:1.5 mm", "stop.restitution": "0.7:0.9", "piezo.coupling": "20%"}
    found = hv.tolerance(scene, vary=vary, seed=1).sensitivity["stop.gap"]
    assert abs(found.first - 0.59) < found.first_error95 + 0.012
    assert found.first_error95 < 0.2
