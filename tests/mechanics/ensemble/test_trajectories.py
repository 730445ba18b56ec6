"""The ensemble against exact laws: linear statistics, identities, Gibbs moments, hard scenes."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from harvester.equations.coefficients import Equations
from harvester.errors import UnboundedResponseError
from harvester.mechanics.ensemble import burn_in as settling
from harvester.mechanics.ensemble.burn_in import burn_in, cut_window
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.presentation.diagnostic import has
from harvester.uncertainty.value import mean_and_error
from tests.support.systems import PAPER, PAPER_V2, changed, linear, linear_v2, lyapunov, padded, z

pytestmark = pytest.mark.statistics

SEED = np.random.SeedSequence(20261121)


def settled(eqs, trajectories=4096, h=None, factor=4, controlled=False):
    many = Trajectories(eqs, trajectories, SEED, h, controlled=controlled)
    burn_in(many)
    return many.run(factor * many.time)


def voltage(eqs, h, trajectories=1024):
    """E[V^2] and its standard error, with control variates: an eighth of the plain mean's trajectories."""
    return mean_and_error(settled(eqs, trajectories, h, controlled=True).controlled("V2"))


@pytest.mark.parametrize("beta", [0.05, 1.25])
@pytest.mark.parametrize("mu", [0.05, 1.0, 5.0])
def test_linear_statistics(beta, mu):
    """E[V^2], E[x^2], E[x'^2], E[xV], E[x'V] within four standard errors, at half the default step."""
    eqs = linear(beta, mu)
    moments = settled(eqs, h=0.05 / np.sqrt(1 + beta))
    exact = lyapunov(eqs)
    value, error = moments.mean("V2")
    assert error < 0.01 * value
    for name, (i, j) in {
        "V2": (2, 2),
        "x2": (0, 0),
        "v2": (1, 1),
        "xV": (0, 2),
        "vV": (1, 2),
    }.items():
        assert abs(z(moments.mean(name), exact[i, j])) < 4, name
    assert abs(z(moments.mean("V"), 0.0)) < 4


@pytest.mark.thorough("test_linear_statistics")
def test_paper_scene_against_an_independent_monte_carlo():
    value, error = voltage(PAPER, 0.05)
    assert error < 0.001 * value
    assert abs(z((value, error), *PAPER_V2)) < 4
    assert value == pytest.approx(0.0881, rel=0.01)


@pytest.mark.parametrize(
    ("base", "r"),
    [*((PAPER, r) for r in (None, 0.96, 0.0)), *((linear(1.25, 1.0), r) for r in (1.0, 0.5))],
    ids=["paper-None", "paper-0.96", "paper-0.0", "plate-1.0", "plate-0.5"],
)
def test_identities(base, r):
    """E[V] = 0, E[xV] = E[V^2], E[x'V] = mu E[V^2], power in = power out."""
    eqs = changed(base, restitution=r)
    moments = settled(eqs, h=0.03)
    assert abs(z(moments.mean("V"), 0.0)) < 4
    assert abs(z(mean_and_error(moments.balance(eqs)), 0.0)) < 4
    # These two hold path by path up to the ends of the record: the step's bias is the remainder.
    v2 = moments.mean("V2")[0]
    assert mean_and_error(moments.xV - moments.V2)[0] == pytest.approx(0.0, abs=1e-3 * v2)
    assert abs(z(mean_and_error(moments.vV - eqs.mu * moments.V2), 0.0)) < 4


@pytest.mark.thorough("test_linear_statistics")
def test_harvested_power_stays_below_the_power_put_in():
    for mu in (0.1, 1.0, 10.0):
        eqs = changed(linear(1.25, mu, c=0.008), restitution=0.96)
        value, error = settled(eqs, 1024, factor=1).mean("V2")
        assert eqs.beta * mu * (value - 4 * error) < eqs.n1


def test_gibbs_law_with_a_stop():
    """r = 1, beta = 0: x and x' from exp(-c H/N1) on x > 0; impact rate 1/pi without cubic stiffness."""
    from scipy.integrate import quad

    alpha = 2.0
    c = 0.05
    n1 = 0.02
    eqs = padded(Equations(alpha=alpha, c1=-c, n1=n1, restitution=1.0))
    moments = settled(eqs, h=0.04)
    weight = lambda x: np.exp(-c / n1 * (x**2 / 2 + alpha * x**4 / 4))  # noqa: E731
    norm = quad(weight, 0, np.inf)[0]
    for name, power in (("x", 1), ("x2", 2)):
        exact = quad(lambda x: x**power * weight(x), 0, np.inf)[0] / norm  # noqa: B023
        assert abs(z(moments.mean(name), exact)) < 4
    assert abs(z(moments.mean("v2"), n1 / c)) < 4
    # Rice: rate of impacts = p(0) E[|v|]/2, twice over because motion is on one side only
    rate = np.sqrt(n1 / (2 * np.pi * c)) / norm
    assert abs(z(moments.mean("impacts"), rate)) < 4
    straight = settled(changed(eqs, alpha=0.0), h=0.04)
    assert abs(z(straight.mean("impacts"), 1 / np.pi)) < 4


@pytest.mark.thorough("test_passive_voltage_with_a_stop")
def test_passive_voltage_with_a_stop():
    """beta -> 0, r = 1, c = mu = 0.05, N1 = 0.01: E[V^2] = 0.055789 by the correlation of |y|."""
    from scipy.integrate import quad

    c = mu = 0.05
    n1 = 0.01
    wd = np.sqrt(1 - c * c / 4)

    def correlation(s):
        rho = np.exp(-c * s / 2) * (np.cos(wd * s) + c / (2 * wd) * np.sin(wd * s))
        return 2 * n1 / c / np.pi * (np.sqrt(1 - rho**2) + rho * np.arcsin(rho) - 1)

    tail = quad(lambda s: np.exp(-mu * s) * correlation(s), 0, 600, limit=3000)[0]
    exact = correlation(0.0) - mu * tail
    assert exact == pytest.approx(0.055789, rel=1e-4)
    found = voltage(Equations(c1=-c, mu=mu, n1=n1, restitution=1.0), 0.04)
    assert abs(z(found, exact)) < 4
    assert found[1] < 0.003 * exact


@pytest.mark.thorough("test_linear_statistics")
@pytest.mark.parametrize("h, most", [(0.2, 0.015), (0.1, 0.005)])
def test_bias_of_coarse_steps(h, most):
    """paper parameters."""
    value, error = voltage(PAPER, h)
    assert abs(value / PAPER_V2[0] - 1) < most + 2 * error / value


def test_richardson_bias_is_the_real_one():
    """The stated bias of a coarse step covers the true one, on the scene where it is largest."""
    eqs = changed(linear(1.25, 1.0, c=0.008), restitution=0.96)
    fine = voltage(eqs, 0.02)
    pair = RichardsonPair(Trajectories(eqs, 2048, SEED, 0.1, controlled=True), 800.0)
    true = pair.mean("V2")[0] - fine[0]
    bias, error = pair.bias("V2")
    assert true == pytest.approx(bias, abs=4 * error + 0.2 * bias)
    assert bias > 5 * error  # the test can fail
    assert abs(z(pair.extrapolated("V2"), *fine)) < 4


def test_the_same_noise_at_twice_the_step():
    """Two variates of the fine ensemble make one of the coarse one: the paths stay together."""
    eqs = linear(0.5, 1.0, c=0.05)
    many = Trajectories(eqs, 256, SEED, 0.02)
    coarse = many.coarser()
    for one in (many, coarse):
        one.run(100.0)
    assert one.h == 2 * many.h
    assert one.time == pytest.approx(many.time, rel=1e-12)
    for fine, other in zip(many.snapshot(), coarse.snapshot(), strict=True):
        assert np.std(other - fine) < 0.03 * np.std(fine)


def test_a_shared_noise_makes_the_bias_precise():
    """Without a stop the paths of both steps stay together: the bias has a smaller error than either mean."""
    pair = RichardsonPair(Trajectories(linear(1.25, 1.0, c=0.05), 4096, SEED, 0.1), 400.0)
    assert pair.bias("V2")[1] < 0.1 * pair.mean("V2")[1]
    exact = linear_v2(linear(1.25, 1.0, c=0.05))
    assert abs(z(pair.extrapolated("V2"), exact)) < 4
    assert abs(z(pair.bias("V2"), pair.mean("V2")[0] - exact, pair.mean("V2")[1])) < 4


@pytest.mark.thorough("test_linear_statistics")
def test_a_resting_pair_keeps_its_bias():
    pair = RichardsonPair(Trajectories(PAPER, 512, SEED, 0.1), 50.0)
    pair.extend(50.0)
    before = pair.bias("V2")
    steps = pair.steps
    pair.stop_coarse()
    assert pair.steps == steps
    pair.extend(50.0)
    assert pair.coarse_is_stopped
    assert pair.bias("V2") == before
    assert pair.steps == pytest.approx(steps + 512 * 50.0 / 0.1, rel=0.01)
    assert pair.duration == pytest.approx(150.0, rel=0.01)


@pytest.mark.thorough("test_linear_statistics")
def test_a_mean_of_windows_of_different_length():
    """One long run, and the same in pieces."""
    whole = Trajectories(PAPER, 64, SEED, 0.1).run(120.0)
    many = Trajectories(PAPER, 64, SEED, 0.1)
    first, second = many.run(40.0), many.run(80.0)
    for name in ("V2", "impacts", "impact_loss"):
        assert getattr(first.mixed(second, 2 / 3), name) == pytest.approx(
            getattr(whole, name), rel=1e-12
        )


def test_a_pair_in_windows_is_one_of_the_whole_time():
    """One long pair, and the same in pieces: the mean, and the bias of the step."""
    whole, many = (
        RichardsonPair(Trajectories(PAPER, 64, SEED, 0.1), duration) for duration in (160.0, 40.0)
    )
    many.extend(120.0)
    assert many.duration == pytest.approx(whole.duration, rel=1e-12)
    assert pytest.approx(whole.moments.V2, rel=1e-12) == many.moments.V2
    assert many.bias("V2") == pytest.approx(whole.bias("V2"), rel=1e-9)


def test_answer_does_not_depend_on_threads(monkeypatch):
    answers = []
    for cores in (1, 2, 3):
        monkeypatch.setattr(os, "cpu_count", lambda: cores)  # noqa: B023
        answers.append(Trajectories(PAPER, 300, SEED, 0.1).run(20.0).V2)
    assert (answers[0] == answers[1]).all()
    assert (answers[0] == answers[2]).all()


@pytest.mark.thorough("test_linear_statistics")
def test_many_at_once_do_not_disturb_each_other():
    with ThreadPoolExecutor(4) as pool:
        answers = list(
            pool.map(lambda _: Trajectories(PAPER, 128, SEED, 0.1).run(20.0).V2, range(4))
        )
    assert all((a == answers[0]).all() for a in answers)


def test_removing_an_effect_equals_never_having_it():
    with_zero = changed(PAPER, n12=0.0, restitution=1.0)
    without = changed(PAPER, n12=None, restitution=1.0)
    a, b = (Trajectories(e, 64, SEED, 0.1).run(50.0) for e in (with_zero, without))
    assert pytest.approx(b.V2, rel=1e-12) == a.V2


@pytest.mark.parametrize(
    "eqs",
    [Equations(c1=0.1, c2=0.1, n1=0.01), Equations(c3=-0.1, n1=0.01), Equations(c1=0.01, n1=0.01)],
    ids=["x2-feeds", "x4-feeds", "negative-damping"],
)
def test_unbounded_response_is_a_named_error(eqs, monkeypatch):
    monkeypatch.setattr(settling, "LONGEST", 2e4)
    with pytest.raises(UnboundedResponseError, match="grows without bound"):
        burn_in(Trajectories(eqs, 256, SEED))


@pytest.mark.thorough("test_hard_scenes.py")
@pytest.mark.parametrize("step", [0.5, 0.05])
@pytest.mark.parametrize(
    "eqs",
    [
        changed(PAPER, restitution=0.05, c1=-0.02, c2=None, c3=None, mu=1.0),
        changed(PAPER, restitution=0.0),
        changed(PAPER, mu=1e4),
        changed(PAPER, mu=None),
        changed(PAPER, n1=1e-12, n2=None),
        changed(PAPER, n1=1.0, c3=10.0),
        Equations(alpha=0.5, c1=-0.05, n1=0.01, restitution=0.16),
        linear(10.0, 0.01),
        linear(10.0, 100.0),
    ],
    ids=[
        "r.05",
        "r0",
        "mu1e4",
        "open",
        "quiet",
        "stiff-damping",
        "collapse",
        "beta10",
        "beta10mu100",
    ],
)
def test_hard_scenes_stay_finite_and_positive(eqs, step):
    moments = Trajectories(eqs, 256, SEED, step).run(200.0)
    assert all(np.isfinite(values).all() for values in vars(moments).values() if values is not None)
    assert (moments.x2 > 0).all()
    if eqs.restitution is not None:
        assert (moments.x >= 0).all()


@pytest.mark.thorough("test_linear_statistics")
def test_high_load_rate_gives_the_quasi_static_voltage():
    """mu = 1e4: V -> x'/mu, and the step does not shrink with 1/mu."""
    eqs = changed(linear(0.05, 1e4), restitution=0.96)
    many = Trajectories(eqs, 2048, SEED)
    burn_in(many)
    moments = many.run(many.time)
    assert many.h > 0.05
    assert moments.mean("V2")[0] * 1e8 == pytest.approx(moments.mean("v2")[0], rel=0.02)


@pytest.mark.thorough("test_linear_statistics")
def test_step_adapts_to_a_stiff_spring():
    """alpha = 1e6 against the Gibbs law."""
    many = Trajectories(Equations(alpha=1e6, c1=-0.05, n1=0.01), 4096, SEED)
    burn_in(many)
    moments = many.run(many.time)
    assert many.h < 0.01
    assert abs(z(moments.mean("v2"), 0.2)) < 4


def test_no_noise_dies_out_with_a_word():
    many = Trajectories(Equations(c1=-0.05, mu=1.0, beta=0.05), 64, SEED)
    assert has(burn_in(many), "dies_out")


@pytest.mark.thorough("test_linear_statistics")
def test_limit_cycle_without_noise():
    """c3 A^4/8 - c2 A^2/4 - c1 = 0, r = 1."""
    c1 = 0.02
    c2 = 0.01
    c3 = 0.1
    many = Trajectories(Equations(c1=c1, c2=c2, c3=c3, restitution=1.0), 64, SEED, 0.02)
    burn_in(many)
    moments = many.run(500.0)
    a2 = (c2 / 4 + np.sqrt(c2**2 / 16 + c3 * c1 / 2)) / (c3 / 4)
    assert moments.mean("x2")[0] == pytest.approx(a2 / 2, rel=0.01)


def test_a_window_of_a_burn_in_is_cut_to_its_budget_but_not_to_one_that_shows_nothing():
    """A third window: whole if the budget leaves its time, else the rest, or a quarter of all."""
    whole, burnt_in = 128.0, 96.0
    lengths = [cut_window(whole, burnt_in, share) for share in (5.0, 0.5, 0.0, -0.8)]
    assert lengths == [whole, 48.0, 24.0, 24.0]
