"""The top Lyapunov exponent: formulas against exact laws, Monte Carlo against both."""

import math
import os

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import harvester as hv
from harvester.averaging.published.ito import diffusion, drift
from harvester.averaging.stability import averaged_exponent as formula
from harvester.equations.coefficients import Equations
from harvester.equations.scales import scales
from harvester.errors import CannotServeError, SimulationError
from harvester.mechanics.ensemble import lyapunov
from harvester.mechanics.kernels.coefficients import Coefficients
from harvester.mechanics.kernels.noise import random_words
from harvester.mechanics.kernels.trajectory_batch import Batch
from harvester.studies.stability.exponent import stability
from tests.support.paper import exponent_as_printed, simple_exponent
from tests.support.systems import FIGURE7, changed, scene
from tests.support.to_scene import equations

SEED = np.random.SeedSequence(20261122)
# The linear part of the paper's Figure 7.
COLLAPSE = math.exp(-math.pi / math.sqrt(3.0))  # restitution of inelastic collapse


def measured(eqs, trajectories=512, duration=1000.0, h=0.04):
    return lyapunov.exponent(eqs, SEED, trajectories, duration, h)


def z(growth, exact):
    return (growth.value - exact) / growth.stderr


@pytest.mark.parametrize(
    "c, w2, n2", [(0.5, 1.0, 4.0), (-0.01, 1.0, 0.06), (0.05, 1.04, 1e-3), (3.0, 1.0, 0.5)]
)
@pytest.mark.parametrize("r", [None, 0.9, 0.3])
def test_decoupled_is_its_integrals(c, w2, n2, r):
    """The exact exponent without coupling, by adaptive quadrature; from overdamped to weakly driven."""
    q = w2 - c * c / 4
    s2 = 2 * n2
    moment = lambda k: quad(  # noqa: E731
        lambda y: 2 * y ** (2 * k + 1) * np.exp(-2 / s2 * (q * y**2 + y**6 / 12)), 0, 5
    )[0]
    exact = -c / 2 + moment(0.5) / (2 * moment(-0.5))
    if r is not None:
        exact += np.sqrt(s2 / (2 * np.pi)) / moment(-0.5) * np.log(r)
    assert formula.decoupled(-c, w2, n2, r) == pytest.approx(exact, rel=1e-7)


def test_decoupled_limits():
    """No noise: c1/2 + (w/pi) ln r; noise alone: neutral at the restitution of inelastic collapse (5.9)."""
    assert formula.decoupled(0.02, 1.0, 0.0, 0.9) == pytest.approx(
        0.01 + np.sqrt(1 - 1e-4) / np.pi * np.log(0.9)
    )
    alone = [
        formula.decoupled(-2.0, 1.0, 1.0, r) + 1.0
        for r in (COLLAPSE, 0.99 * COLLAPSE, 1.01 * COLLAPSE)
    ]
    assert alone[0] == pytest.approx(0.0, abs=1e-9)
    assert alone[1] < -1e-3 < 1e-3 < alone[2]


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.statistics
@pytest.mark.parametrize(
    "c1, n2, r",
    [
        (-0.5, 4.0, 0.5),
        (0.01, 0.06, 0.96),
        (-0.05, 0.5, 0.7),
        (-0.1, 1.0, 0.9),
        (-0.2, 2.0, 0.2),
        (-0.1, 1.0, None),
    ],
)
def test_monte_carlo_without_coupling(c1, n2, r):
    """Any noise and restitution, the strongest noise first: lambda = -0.0859."""
    eqs = Equations(c1=c1, n2=n2, restitution=r)
    growth = measured(eqs, duration=2000.0, h=0.015)
    exact = float(formula.decoupled(c1, 1.0, n2, r))
    assert growth.stderr < 5e-4
    assert abs(z(growth, exact)) < 4
    assert formula.averaged(eqs) == pytest.approx(exact, rel=1e-12)
    if n2 == 4.0:
        assert exact == pytest.approx(-0.0859, abs=1e-4)


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.statistics
@pytest.mark.parametrize("r", [0.9, None])
def test_open_circuit_is_a_spring(r):
    """Without a load V = x: W^2 = 1 + beta, in the formula and in the trajectories, however long they shrink."""
    eqs = Equations(c1=-0.1, beta=0.5, n2=0.2, restitution=r)
    exact = float(formula.decoupled(-0.1, 1.5, 0.2, r))
    assert formula.averaged(eqs) == pytest.approx(exact, rel=1e-12)
    growth = measured(eqs)
    assert growth.stderr < 2e-4
    assert abs(z(growth, exact)) < 4


@pytest.mark.statistics
@pytest.mark.parametrize("r, value", [(0.96, -0.008174), (0.8, -0.06174)])
def test_without_noise(r, value):
    """The fixed point of the one-impact map, and trajectories that settle on it."""
    eqs = changed(FIGURE7, n2=None, restitution=r)
    exact = formula.noiseless(eqs)
    assert exact == pytest.approx(value, rel=1e-4)
    h = 0.03
    growth = measured(eqs, 64, 1500.0, h)
    assert growth.value == pytest.approx(exact, abs=4 * growth.stderr + 0.02 * h**2)
    assert growth.stderr < 1e-3 * abs(exact)


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.slow
@pytest.mark.parametrize("beta", [0.01, 0.05])
@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0, 5.0])
@pytest.mark.parametrize("r", [0.96, 0.9, 0.8])
def test_averaged_without_noise(beta, mu, r):
    """To 1 % of the exact exponent; the simple formula is not that good."""
    eqs = Equations(c1=0.01, beta=beta, mu=mu, restitution=r)
    exact = formula.noiseless(eqs)
    assert formula.averaged(eqs) == pytest.approx(exact, rel=0.01)
    if beta == 0.05 and mu == 0.1:
        assert abs(simple_exponent(eqs) / exact - 1) > 0.03
    assert formula.checks(eqs).diagnostics == ()


@pytest.mark.parametrize("m", [1e-3, 0.5, 1.0, 3.0])
def test_push_of_the_fast_voltage(m):
    """What noise brings on the orbit that the voltage's even part bends, by an ODE solver, +-beta."""
    even = lambda t: (np.cos(t) - m * np.cosh(m * t) / np.sinh(np.pi * m / 2)) / (1 + m * m)  # noqa: E731

    def gain(beta):
        def rate(t, y):
            x, v = y[:2]
            return [v, -x - beta * even(t), x * x, (x * v) ** 2]

        at_stop = lambda t, y: y[0]  # noqa: E731
        at_stop.terminal = True
        end = solve_ivp(rate, (0, 3), [1.0, 0, 0, 0], events=at_stop, rtol=1e-11, atol=1e-13)
        period = end.t[-1]
        energy = end.y[1, -1] ** 2 / 2
        return 2 * (end.y[2, -1] / energy - end.y[3, -1] / energy**2) / period

    assert gain(0.0) == pytest.approx(1.0, rel=1e-8)
    slope = (gain(1e-4) - gain(-1e-4)) / 2e-4
    assert formula.pushed(np.asarray(m * m)) == pytest.approx(-slope, rel=1e-5)


@pytest.mark.parametrize("beta", [0.04, 0.02])
@pytest.mark.parametrize("n2", [None, 0.04])
def test_slow_load_of_a_growing_motion(beta, n2):
    """Mu -> 0 and lambda > 0: V - x is forgotten and V = x, a spring, but for beta^2 and beta n^2."""
    eqs = Equations(c1=0.3, beta=beta, n2=n2, restitution=0.95)
    spring = formula.averaged(eqs)
    assert formula.averaged(changed(eqs, mu=1e-7)) == pytest.approx(spring, abs=1e-5)
    assert abs(spring - formula.averaged(changed(eqs, beta=None))) > 1e-4


def test_slow_load_under_noise_that_outruns_the_growth():
    """The same where lambda < N2/4, so that the mean of the slow voltage is not a guide to what it does."""
    eqs = changed(FIGURE7, mu=1e-7)
    spring = formula.averaged(changed(eqs, mu=None))
    assert formula.averaged(eqs) == pytest.approx(spring, abs=5e-5)
    assert abs(spring - formula.averaged(changed(eqs, beta=None))) > 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("c1", [0.3, 0.1, -0.05])
@pytest.mark.parametrize("r", [1.0, 0.9])
def test_slow_voltage_under_damping(c1, r):
    """Friction acts on the orbit that the slow voltage has moved."""
    eqs = Equations(c1=c1, beta=0.02, mu=0.15, restitution=r)
    effect = formula.noiseless(eqs) - formula.noiseless(changed(eqs, beta=None, mu=None))
    assert formula.averaged(eqs) == pytest.approx(formula.noiseless(eqs), abs=0.02 * abs(effect))


def test_simple_is_its_terms():
    """Without coupling; and with a spring's coupling, W^2 = 1 + beta."""
    for eqs, w in (
        (Equations(c1=0.02, n2=0.06, restitution=0.9), 1.0),
        (Equations(beta=0.44, n2=0.06), 1.2),
    ):
        exact = (
            (eqs.c1 or 0) / 2 + 0.015 / w**2 + (w / np.pi * np.log(0.9) if eqs.restitution else 0)
        )
        assert simple_exponent(eqs) == pytest.approx(exact, rel=1e-12)


def test_averaged_is_first_order_in_coupling():
    """The error against the exact exponent falls by four when beta is halved."""
    errors = [
        abs(formula.averaged(eqs) - formula.noiseless(eqs))
        for eqs in (
            Equations(c1=0.01, beta=b, mu=0.3, restitution=0.97) for b in (0.08, 0.04, 0.02)
        )
    ]
    assert errors[0] > 3.3 * errors[1] > 3.3 * 3.3 * errors[2]


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.statistics
@pytest.mark.parametrize(
    "change",
    [{"restitution": r} for r in (0.9, 0.93, 0.96, 1.0)]
    + [{"n2": n2} for n2 in (0.02, 0.04, 0.1)]
    + [{"mu": 0.02}],
    ids=str,
)
def test_figure_7(change):
    """Ours is inside the Monte Carlo error, three times finer than the paper could see; the paper's is far outside."""
    eqs = changed(FIGURE7, **change)
    growth = measured(eqs, duration=2000.0)
    assert growth.stderr < 6e-5
    assert abs(z(growth, float(formula.averaged(eqs)))) < 4
    assert abs(z(growth, float(formula.published(eqs)))) > 8
    assert formula.checks(eqs).error < 1e-4


@pytest.mark.statistics
@pytest.mark.parametrize("mu", [0.5, 1.0, 2.0, 5.0])
def test_fast_loads_are_within_the_stated_error(mu):
    """Where the noise in the slow voltage is only a fit."""
    eqs = changed(FIGURE7, mu=mu)
    growth = measured(eqs)
    assert abs(growth.value - formula.averaged(eqs)) < 4 * growth.stderr + formula.checks(eqs).error


@pytest.mark.statistics
@pytest.mark.parametrize("mu, n2", [(0.1, 0.06), (1.0, 0.06)])
def test_without_a_stop(mu, n2):
    """Monte Carlo against modes and first-order noise; without noise the roots of the characteristic polynomial."""
    eqs = changed(FIGURE7, mu=mu, n2=n2, restitution=None, c1=-0.02, beta=0.2)
    growth = measured(eqs, duration=1500.0, h=0.03)
    assert growth.stderr < 5e-5
    assert (
        abs(growth.value - float(formula.averaged(eqs)))
        < 4 * growth.stderr + formula.checks(eqs).error
        < 4e-4
    )
    roots = np.roots([1.0, 0.02 + mu, 1.0 + 0.2 + 0.02 * mu, mu])
    assert formula.noiseless(eqs) == pytest.approx(roots.real.max(), rel=1e-9)
    assert formula.averaged(eqs, n2=0.0) == pytest.approx(roots.real.max(), rel=1e-9)


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.statistics
@pytest.mark.parametrize("n2, beta", [(0.2, 0.2), (0.5, 0.2), (0.5, 0.04)])
def test_strong_noise_without_a_stop_is_within_the_stated_error(n2, beta):
    eqs = changed(FIGURE7, mu=1.0, n2=n2, restitution=None, c1=-0.02, beta=beta)
    growth = measured(eqs, h=0.02)
    assert abs(growth.value - formula.averaged(eqs)) < 4 * growth.stderr + formula.checks(eqs).error


def test_published_is_the_papers():
    """As printed 0.00514 at Figure 7; corrected, the linearisation of the package's own Eqs. 23 and 24 (mu << 1)."""
    assert exponent_as_printed(FIGURE7) == pytest.approx(0.00514, abs=5e-6)
    A = np.array([1e-6])
    for r in (0.9, None):
        eqs = changed(FIGURE7, mu=1e-3, beta=0.3, restitution=r)
        exponent = drift(A, eqs) / A - sum(diffusion(A, eqs)) / (2 * A**2)
        assert formula.published(eqs) == pytest.approx(exponent[0], rel=1e-5)


@pytest.mark.parametrize("r", [0.99, 0.96, 0.9, None])
def test_boundary(r):
    """Lambda is zero on it, below above it; the paper's Figure 9: less restitution, more stable."""
    eqs = changed(FIGURE7, restitution=r, c1=-0.01)
    mu = np.array([0.02, 0.1, 0.5, 1.0, 3.0])
    edge = formula.boundary(eqs, mu)
    assert formula.published(eqs, mu, edge.published) == pytest.approx(0.0, abs=1e-12)
    assert formula.averaged(eqs, mu, edge.averaged) == pytest.approx(0.0, abs=1e-9)
    assert (formula.averaged(eqs, mu, 1.1 * edge.averaged) > 0).all()
    if r is not None:
        assert (
            formula.boundary(changed(eqs, restitution=r - 0.02), mu).averaged > edge.averaged
        ).all()


def test_boundary_at_its_ends():
    """Zero where rest is unstable without noise, infinite if no noise can unsettle it."""
    assert (
        formula.boundary(changed(FIGURE7, restitution=1.0), np.array([0.1, 0.2])).averaged == 0
    ).all()
    for share in (0.9, 0.5):
        below = Equations(c1=-0.1, restitution=share * COLLAPSE)
        assert np.isinf(formula.boundary(below, np.array([0.1])).averaged).all()


@pytest.mark.parametrize("r", [0.9, None])
def test_arrays_are_the_scalars(r):
    mu = np.array([[0.05], [0.5]])
    n2 = np.array([0.01, 0.05, 0.2])
    for of in (formula.published, formula.averaged, simple_exponent):
        field = of(changed(FIGURE7, restitution=r), mu, n2)
        for i, j in np.ndindex(field.shape):
            one = changed(FIGURE7, restitution=r, mu=mu[i, 0], n2=n2[j])
            assert field[i, j] == pytest.approx(float(of(one)), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        {"beta": 10.0},
        {"beta": 1.0},
        {"restitution": 0.1},
        {"restitution": 0.0},
        {"mu": 1e-6},
        {"mu": 1e6},
        {"c1": -5.0},
        {"n2": 4.0, "c1": -0.5},
        {"n2": 1e4},
        {"beta": 10.0, "restitution": None},
    ],
    ids=str,
)
def test_hard_scenes_stay_finite(change):
    eqs = changed(FIGURE7, **change)
    values = [
        formula.averaged(eqs),
        formula.published(eqs),
        lyapunov.exponent(eqs, SEED, 64, 100.0).value,
    ]
    assert np.isfinite(values).all()
    assert formula.checks(eqs).diagnostics or "mu" in change or eqs.restitution is None


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.statistics
@pytest.mark.parametrize(
    "eqs", [FIGURE7, changed(FIGURE7, restitution=None)], ids=["stop", "no stop"]
)
def test_exponent_is_worth_twenty_five_times_as_many_trajectories(eqs):
    """Sums of mean zero of the path's own noise: the same exponent within the plain error, a fifth of that error."""
    growth = lyapunov.exponent(eqs, SEED, 1024, 400.0)
    plain = growth.samples.std(ddof=1) / math.sqrt(len(growth.samples))
    assert plain > 5.0 * growth.stderr
    assert abs(growth.value - growth.samples.mean()) < 4.0 * plain
    assert (
        np.abs(growth.pushed.mean(axis=0))
        < 4.0 * growth.pushed.std(axis=0) / math.sqrt(len(growth.pushed))
    ).all()


def test_at_rest_on_the_stop_only_the_voltage_is_left():
    """V > 0 holds the mass at the stop, and the size decays as e^(-mu t)."""
    state = np.repeat([[0.01], [0.0], [10.0]], 64, axis=1)
    batch, logs, pushes = Batch(state, *random_words(SEED, 64)), np.zeros(64), np.zeros((3, 64))
    c = Coefficients(mu=0.1, r=0.5, beta=1.0, c1=0.0)
    lyapunov.grow(batch, logs, pushes, 50, 10, False, 0.01, c)
    logs[:] = 0.0
    lyapunov.grow(batch, logs, pushes, 500, 10, False, 0.01, c)
    assert logs / 100.0 == pytest.approx(-0.1, rel=1e-3)


def test_same_seed_same_answer_whatever_the_threads(monkeypatch):
    answers = []
    for cores in (1, 2, 3):
        monkeypatch.setattr(os, "cpu_count", lambda: cores)  # noqa: B023
        answers.append(lyapunov.exponent(FIGURE7, SEED, 192, 50.0).samples)
    assert (answers[0] == answers[1]).all()
    assert (answers[0] == answers[2]).all()


@pytest.mark.slow
def test_seeds_differ_in_start_and_noise():
    one, two = (
        lyapunov.exponent(FIGURE7, np.random.SeedSequence(k), 512, 1000.0).samples for k in (1, 2)
    )
    assert not (one == two).any()
    assert abs(np.corrcoef(one, two)[0, 1]) < 0.2


@pytest.mark.statistics
def test_stated_bias_is_the_real_one():
    """A step ten times the default's: second order, its error known from twice the step."""
    growth = measured(FIGURE7, duration=2000.0, h=0.3)
    true = measured(FIGURE7, duration=2000.0, h=0.04)
    noise = 4 * math.hypot(growth.stderr, true.stderr)
    assert abs(growth.value - true.value) == pytest.approx(
        growth.bias, abs=noise + 0.4 * growth.bias
    )
    assert growth.bias > 3 * growth.stderr  # the test can fail


def test_both_steps_share_their_noise():
    """At the default step the stated bias is not the noise of two independent runs: far below the plain error."""
    growth = measured(FIGURE7, 512, 500.0)
    assert 0.0 < growth.bias < 0.1 * growth.samples.std() / math.sqrt(512)


def test_stopping_dead_is_a_named_error():
    with pytest.raises(SimulationError, match="restitution above 0"):
        lyapunov.exponent(Equations(c1=0.01, restitution=0.0), SEED, 64, 50.0)


@pytest.mark.slow
def test_a_scene():
    """The three together; nonlinear terms play no part, external excitation is left out with a word."""
    full = changed(FIGURE7, alpha=0.05, c2=0.015, c3=0.025, n1=0.01)
    answer = stability(scene(full), trajectories=512)
    json = answer.as_json()
    assert json["published"] == float(formula.published(FIGURE7))
    assert json["averaged"] == float(formula.averaged(FIGURE7))
    assert abs(json["ensemble"]["value"] - json["averaged"]) < 4 * json["ensemble"]["stderr"]
    assert any("external excitation is left out" in w for w in json["warnings"])
    assert json == stability(scene(full), trajectories=512).as_json()
    assert stability(scene(FIGURE7), trajectories=64, duration=50.0).warnings == ()
    assert "unstable" in str(answer)
    assert "warning: external excitation is left out" in str(answer)


def physical(**load):
    return hv.Scene(
        oscillator=hv.Oscillator(mass=0.04, stiffness=16.0, damping=8e-3),
        piezo=hv.Piezo(coupling=1e-3, capacitance=50.2e-9),
        stop=hv.Stop(restitution=0.96),
        excitation=hv.Excitation(stiffness_noise=0.03),
        load=hv.Load(**load),
    )


def test_a_physical_scene_is_in_si():
    """Per second: w0 times the exponent of Eq. 2."""
    device = physical(resistance=1e6)
    eqs = equations(device)
    w0 = scales(device).frequency
    answer = stability(device, trajectories=256, duration=200.0)
    growth = lyapunov.exponent(eqs, np.random.SeedSequence(0), 256, 200.0)
    assert w0 == pytest.approx(20.0)
    assert answer.ensemble.value == pytest.approx(20.0 * growth.value, rel=1e-12)
    assert answer.ensemble.stderr == pytest.approx(20.0 * growth.stderr, rel=1e-12)
    assert answer.averaged == pytest.approx(20.0 * float(formula.averaged(eqs)), rel=1e-12)
    assert answer.published == pytest.approx(20.0 * float(formula.published(eqs)), rel=1e-12)
    assert answer.model == pytest.approx(20.0 * formula.checks(eqs).error, rel=1e-12)
    assert answer.noiseless == pytest.approx(20.0 * formula.noiseless(eqs), rel=1e-12)
    assert "1/s" in str(answer)


def test_a_netlist_is_refused():
    with pytest.raises(CannotServeError, match="must have a load resistance"):
        stability(physical(netlist="bridge"))
