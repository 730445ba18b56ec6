"""What engine `spice` decides before its first run."""

import math

import pytest

import harvester as hv
from harvester.engines.spice.setup import set_up
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.loads import CHARGING_TIMES


@pytest.mark.ngspice
def test_burn_in_under_a_drive_is_of_whole_periods(tmp_path):
    """Charging takes a time of its own, which is rounded up, so that the means are over whole periods."""
    own = tmp_path / "own.cir"
    own.write_text(
        ".subckt own p n\nD1 p a d\nRload a n 1Meg\nCsmooth a n 47.3u\n.model d D\n.ends\n"
    )
    scene = hv.load("examples/plate_harmonic.toml").with_load(hv.Load(netlist=str(own)))
    problem = Problem(scene)
    burn_in = set_up(problem, hv.Spice()).burn_in
    charging = CHARGING_TIMES * 47.3 * problem.scales.frequency
    period = 2.0 * math.pi / problem.equations.drive_frequency
    assert 0.1 * period < burn_in - charging < period
    assert burn_in / period == pytest.approx(round(burn_in / period), abs=1e-9)


@pytest.mark.ngspice
def test_more_steps_than_a_trajectory_may_make():
    """They were an internal error of an array that cannot be."""
    setup = set_up(Problem(hv.load("examples/plate.toml")), hv.Spice())
    with pytest.raises(
        hv.InputError, match=r"`duration` must be at most 1e\+10 steps, but is .*e\+3"
    ):
        setup.n_steps(1e300)
