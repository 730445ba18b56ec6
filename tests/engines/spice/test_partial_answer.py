"""The answer of engine `spice` where its time was over: the best there is, and in words the missing parts."""

from types import SimpleNamespace

import pytest

import harvester as hv
from harvester.engines.spice.estimates import partial_answer
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.problem import Problem
from harvester.errors import OutOfTimeError
from harvester.presentation.diagnostic import warning

PLATE = "examples/plate_recorded.toml"


def out_of_time(so_far):
    error = OutOfTimeError("ngspice stopped at 3 s of 80 s")
    error.so_far = so_far
    return error


def test_what_one_run_had_come_to():
    """In the scene's units, with no error that is stated as a whole."""
    answer = partial_answer("spice", Problem.of(PLATE), out_of_time((2e-6, 0.5, 3.0)), 7.0)
    assert answer.mean_power.value == pytest.approx(2e-6, rel=1e-12)
    assert answer.mean_square_voltage.value == pytest.approx(0.5, rel=1e-12)
    assert answer.mean_power.error95 is None
    assert answer.as_json()["mean_power"]["error95"] is None
    (said,) = map(str, answer.warnings)
    assert "over 3 s of ngspice, while still settling" in said
    assert not answer.is_sound
    assert "a periodic response needs several such runs" in said


def test_the_cheap_model_stands_in():
    """E[P] = beta mu E[V^2] of a load resistor, by the long ensemble, and what it leaves out is named."""
    problem = Problem.of(hv.load(PLATE))
    eqs, units = problem.equations, problem.units
    pair = SimpleNamespace(
        mean=lambda name: (2.0, 0.02),
        bias=lambda name: (0.003, 0.0),
        largest_bias=lambda name: 0.003,
        burn_in=1.0,
        duration=9.0,
    )
    pair.trajectories = SimpleNamespace(count=256, hopping=None, together=1)
    pair.steps = 1000
    setup = SpiceSetup(SimpleNamespace(eqs=eqs, h=0.1), 10.0, [warning("dies_out")], pair, 1.0)
    answer = partial_answer("spice", problem, out_of_time((1.0, 1.0, 1.0)), 7.0, setup)
    assert answer.mean_power.value == pytest.approx(
        2.0 * eqs.beta * eqs.mu * units.watts, rel=1e-12
    )
    assert answer.mean_power.unknown == "leaving ngspice out"
    assert answer.mean_power.error95 is None
    assert not answer.is_sound
    assert answer.warnings[-2].code == "dies_out"
    assert "the mean is that of the same equations, as in engine 'ensemble'" in str(
        answer.warnings[-1]
    )


def test_nothing_is_known_before_the_means_begin():
    with pytest.raises(OutOfTimeError, match="ngspice stopped at 3 s of 80 s"):
        partial_answer("spice", Problem.of(PLATE), out_of_time(None), 7.0)


def test_means_over_less_than_the_slowest_transient_are_no_answer():
    """The plate's load damps small motions within 0.2 s: a mean of the first 0.15 s is one of the start."""
    problem = Problem.of(PLATE)
    with pytest.raises(OutOfTimeError, match="ngspice stopped at 3 s of 80 s"):
        partial_answer("spice", problem, out_of_time((2e-6, 0.5, 0.15)), 7.0)
    # of a nondimensional scene the seconds are those of the stand-in, with w0 = 20 rad/s
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    bare = Problem.of(scene)
    answer = partial_answer("spice", bare, out_of_time((1e-6, 1.0, 2.0)), 7.0)
    assert "while still settling" in str(answer.warnings[0])
    with pytest.raises(OutOfTimeError):
        partial_answer("spice", bare, out_of_time((1e-6, 1.0, 0.5)), 7.0)


@pytest.mark.ngspice
def test_where_the_slow_engine_serves_it_is_named():
    """A chip behind a rectifier needs seconds there; a plain bridge has no such circuit."""
    with pytest.raises(OutOfTimeError, match="; engine 'slow' supports this scene and needs"):
        hv.run("examples/bimorph_ltc3588.toml", "spice", budget="0.02s", seed=1)
    bridge = hv.run("examples/plate_bridge.toml", "spice", trajectories=2, duration=1.0)
    assert not any(said.code == "slow_serves" for said in bridge.notes)
