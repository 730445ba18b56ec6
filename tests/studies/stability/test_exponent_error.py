"""The error of the Monte Carlo's exponent without noise, where all trajectories come to one path."""

import pytest

import harvester as hv

SHORT = {"trajectories": 128, "duration": 200.0}


def scene(**changes):
    return hv.Scene(
        nondimensional=hv.Nondimensional(**{"c1": 0.01, "beta": 0.04, "mu": 0.1} | changes)
    )


@pytest.mark.parametrize("r", [0.96, 0.8, 0.5, 0.2, 0.1])
def test_the_interval_holds_the_exact_value(r):
    """With a scatter of 1e-7 and less the step alone made the error, which twice the step does not report."""
    found = hv.stability(scene(restitution=r), **SHORT)
    assert abs(found.ensemble.value - found.noiseless) <= found.ensemble.known_error95 * (
        1.0 + 1e-9
    )
    assert found.as_json()["ensemble"]["error95"] == pytest.approx(found.ensemble.known_error95)


def test_an_error_that_nothing_tells_is_not_stated():
    """No fixed point of the map from impact to impact: no exact value, and no +-."""
    found = hv.stability(scene(restitution=0.3, mu=1.0, beta=3.0), **SHORT)
    assert found.noiseless is None
    assert found.as_json()["ensemble"]["error95"] is None
    assert "the step, as impacts can lock to its grid" in str(found)
