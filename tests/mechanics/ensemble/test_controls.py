"""Controls from Ito's formula: no bias, honest intervals, and means that are worth many times as many trajectories."""

import numpy as np
import pytest

from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.uncertainty.controls import controlled_mean
from harvester.uncertainty.value import mean_and_error
from tests.support.systems import COLOURED, DRIVEN, PAPER, changed, linear, linear_v2, z

LINEAR = linear(0.05, 0.05)
WELLS = Equations(linear=-1.0, alpha=1.0, beta=0.1, mu=0.5, c1=-0.1, n1=0.05)
THOROUGH = pytest.mark.thorough("test_mean_square_voltage_is_worth_many_times_as_many_trajectories")
NAMES = ("V", "V2", "load", "x", "x2", "v2", "xV", "impacts")


def stationary(eqs, count, seed=1, h=None):
    many = Trajectories(eqs, count, np.random.SeedSequence(seed), h, controlled=True)
    burn_in(many)
    return many


def controlled(moments, name):
    """Mean and standard error with controls."""
    return mean_and_error(moments.controlled(name))


def gain(moments, name):
    """Variance of the plain mean over that with controls."""
    return (mean_and_error(getattr(moments, name))[1] / controlled(moments, name)[1]) ** 2


def test_absent_when_not_asked_for():
    """A sum of controls changes nothing of the path nor of the moments, and without a wish there is none."""
    seed = np.random.SeedSequence(3)
    plain, wished = (
        Trajectories(PAPER, 64, seed, 0.1, controlled=wish).run(40.0) for wish in (False, True)
    )
    assert plain.controls is None
    assert wished.controls.shape == (64, 13)
    np.testing.assert_allclose(plain.V2, wished.V2, rtol=1e-9)
    still = changed(PAPER, n1=None, n2=None, drive=0.1, drive_frequency=1.0)
    assert not Trajectories(still, 64, seed, 0.1, controlled=True).controlled


def test_controls_of_windows_add_up():
    """Two windows of the same trajectories make the controls of one window of both: both kinds."""
    one, two = (
        Trajectories(PAPER, 64, np.random.SeedSequence(3), 0.1, controlled=True) for _ in range(2)
    )
    whole = one.run(80.0)
    halves = two.run(40.0).mixed(two.run(40.0), 0.5)
    np.testing.assert_allclose(halves.controls, whole.controls, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    "eqs, floor",
    [
        (PAPER, 40.0),
        pytest.param(changed(PAPER, restitution=None), 80.0, marks=THOROUGH),
        pytest.param(LINEAR, 100.0, marks=THOROUGH),
        pytest.param(changed(PAPER, mu=3.0), 100.0, marks=THOROUGH),
        (changed(PAPER, gap=0.5), 25.0),
        pytest.param(WELLS, 20.0, marks=THOROUGH),
        (COLOURED, 8.0),
        pytest.param(changed(DRIVEN, n1=0.01), 8.0, marks=THOROUGH),
    ],
    ids=["paper", "without-stop", "linear", "fast-load", "gap", "wells", "coloured", "driven"],
)
def test_mean_square_voltage_is_worth_many_times_as_many_trajectories(eqs, floor):
    """The variance of E[V^2] over 400 time units falls by the factor that docs and benchmarks promise."""
    assert gain(stationary(eqs, 2048).run(400.0), "V2") > floor


def test_linear_mean_is_exact():
    """A linear scene's E[V^2], extrapolated to a step of 0, against its closed form: a few parts in 1e4."""
    pair = RichardsonPair(stationary(LINEAR, 2048), 400.0)
    value, error = pair.extrapolated("V2")
    assert error < 7e-4 * value
    assert abs(z((value, error), linear_v2(LINEAR))) < 4.0


@pytest.mark.thorough("test_a_shared_noise_makes_the_bias_precise")
@pytest.mark.statistics
@pytest.mark.parametrize("h", [0.1, 0.3])
def test_no_bias_at_any_step(h):
    """At a large step too the controlled means are those of a long plain run at that step."""
    short = stationary(PAPER, 2048, 5, h).run(200.0)
    long = stationary(PAPER, 4096, 6, h).run(3000.0)
    for name in NAMES:
        assert abs(z(controlled(short, name), *long.mean(name))) < 4.0, name


def test_plain_and_controlled_means_agree_after_a_burn_in():
    """Boundaries take a stationary path for granted: after a burn-in plain and controlled means agree."""
    for seed in range(4):
        many = stationary(PAPER, 1024, 100 + seed).run(100.0)
        for name in NAMES:
            assert abs(z(mean_and_error(getattr(many, name)), *controlled(many, name))) < 4.0, name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("eqs", "entries"),
    [
        (PAPER, 128),
        pytest.param(
            changed(PAPER, restitution=0.7), 128, marks=pytest.mark.thorough("test_intervals_hold")
        ),
        pytest.param(LINEAR, 256, marks=pytest.mark.thorough("test_intervals_hold")),
    ],
    ids=["paper", "r=.7", "linear"],
)
def test_intervals_hold(eqs, entries):
    """95 % intervals of small ensembles hold the mean in 92 to 98 % of 200 repeats."""
    many = stationary(eqs, 200 * entries, 7).run(100.0)
    truth, doubt = controlled(many, "V2")
    held = 0
    for k in range(200):
        part = slice(k * entries, (k + 1) * entries)
        value, error = controlled_mean(many.V2[part], many.controls[part])
        held += abs(value - truth) < 1.96 * np.hypot(error, doubt)
    assert 0.92 <= held / 200 <= 0.98


def test_bias_of_the_step_is_cheaper_too():
    """The difference of both steps of a pair has controls of its own at both."""
    pair = RichardsonPair(stationary(PAPER, 1024, 8), 200.0)
    fine, coarse = pair._moments_of_all
    plain = mean_and_error(coarse.V2 - fine.V2)
    bias, error = pair.bias("V2")
    assert error < 0.6 * plain[1] / 3.0
    assert abs(z((bias, error), plain[0] / 3.0, plain[1] / 3.0)) < 4.0
