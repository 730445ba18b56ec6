"""A charge in a budget: as many runs as fit, and a lower bound if none arrives in time."""

import math

import pytest
from click.testing import CliRunner

import harvester as hv
from harvester.cli import cli
from harvester.errors import InputError, SimulationError
from tests.support.paths import EXAMPLES

BRIDGE = EXAMPLES / "plate_bridge.toml"
SENSOR = EXAMPLES / "bimorph_sensor.toml"


def codes(found):
    return [diagnostic.code for diagnostic in found.diagnostics]


@pytest.mark.slow
def test_fewer_runs_fit_into_a_short_budget_and_agree_with_all():
    """Their mean time is within four standard errors of that of all runs."""
    whole = hv.charge(BRIDGE, "2 V", engine="ideal", trajectories="60s", seed=1)
    short = hv.charge(
        BRIDGE, "2 V", engine="ideal", trajectories=f"{0.1 * whole.seconds} s", seed=2
    )
    assert whole.runs == 2048 and "runs_in_budget" not in codes(whole)
    assert 32 <= short.runs < 1024
    assert codes(short).count("runs_in_budget") == 1
    if short.time is None:  # the machine was slower than for the first
        assert short.at_least.value < 2.0 * whole.time.value
        return
    assert short.seconds < 0.5 * whole.seconds
    apart = short.time.value - whole.time.value
    assert abs(apart) < 4.0 * math.hypot(short.time.stderr, whole.time.stderr)
    assert short.time.stderr > whole.time.stderr


@pytest.mark.slow
@pytest.mark.parametrize("budget", ["0.001 s", "0.000001 s"])
def test_a_budget_that_ends_before_all_arrive_leaves_a_lower_bound(budget):
    """The second is over before the first look."""
    short = hv.charge(BRIDGE, "2.6 V", engine="ideal", trajectories=budget)
    assert short.time is None and short.reached < 1.0
    assert short.at_least.value <= short.duration < 7.5
    assert "watched_in_budget" in codes(short) and "runs_in_budget" in codes(short)


@pytest.mark.ngspice
def test_runs_of_ngspice_that_are_too_long_for_a_budget_are_not_begun():
    """The answer is that of the longest runs that ended; none at all is an error of one line."""
    scene = hv.load(SENSOR)
    hv.charge(scene, "1 V", engine="spice", duration="0.1s")  # starts the workers
    short = hv.charge(scene, "3.3 V", engine="spice", duration="2000s", trajectories="10s")
    assert short.seconds < 15.0 and "watched_in_budget" in codes(short)
    assert short.time is not None and short.time.value == pytest.approx(0.137875, rel=1e-3)
    with pytest.raises(SimulationError, match=r"no charge in a `budget` of 0.001 s"):
        hv.charge(scene, "3.3 V", engine="spice", trajectories="0.001 s")


@pytest.mark.slow
def test_a_budget_is_a_time_without_a_number_of_runs():
    with pytest.raises(InputError, match=r"`budget` must be"):
        hv.charge(BRIDGE, "2 V", trajectories="-1 s")
    given = ["charge", str(BRIDGE), "--to", "2V", "--budget", "3s", "--trajectories", "64"]
    answer = CliRunner().invoke(cli, given)
    assert isinstance(answer.exception, InputError)
    assert "`budget` must be left out if `trajectories` is given" in str(answer.exception)
