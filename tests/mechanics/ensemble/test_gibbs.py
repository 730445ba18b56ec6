"""Springs and stops: p(x, x') ~ exp(-c H/N1) for damping c, r = 1 and no coupling; power balances; wells."""

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.stats import kstest

from harvester.averaging.kramers import hopping_rates
from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble import burn_in as settling
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.hopping import hopping
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.trace import trace
from harvester.uncertainty.value import mean_and_error
from tests.support.systems import PAPER, changed, padded, z

pytestmark = pytest.mark.statistics

SEED = np.random.SeedSequence(20261124)
C, N1 = 0.1, 0.02
SPRING = {"linear": 1.0, "alpha2": 0.0}
BASE = padded(Equations(c1=-C, n1=N1), **SPRING)
BISTABLE = changed(BASE, linear=-1.0, alpha=1.0)
SCENES = {
    "bistable": BISTABLE,
    "asymmetric": changed(BISTABLE, alpha2=0.15),
    "quadratic": changed(BASE, alpha2=1.2, alpha=0.5),
    "at a distance": changed(BASE, restitution=1.0, gap=0.3),
    "preload": changed(BASE, restitution=1.0, gap=-0.5),
    "both sides": changed(
        BASE, restitution=1.0, gap=0.2, opposite_gap=0.5, opposite_restitution=1.0
    ),
    "softening between stops": changed(
        BASE, alpha=-1.5, restitution=1.0, gap=1.0, opposite_gap=0.8, opposite_restitution=1.0
    ),
    "bistable at a stop": changed(BISTABLE, restitution=1.0, gap=0.7),
    "compliant": changed(BASE, stop_stiffness=30.0, gap=0.2),
}


def energy(eqs, x):
    """Energy of spring and compliant stop."""
    u = (
        0.5 * (eqs.linear or 1.0) * x**2
        + (eqs.alpha2 or 0.0) / 3 * x**3
        + 0.25 * (eqs.alpha or 0.0) * x**4
    )
    return u + 0.5 * (eqs.stop_stiffness or 0.0) * np.minimum(x + (eqs.gap or 0.0), 0.0) ** 2


def exact(eqs):
    """Grid, density and distribution function of x."""
    low = -6.0 if eqs.restitution is None else -(eqs.gap or 0.0)
    high = 6.0 if eqs.opposite_gap is None else eqs.opposite_gap
    x = np.linspace(low, high, 40_001)
    p = np.exp(-C / N1 * (energy(eqs, x) - energy(eqs, x).min()))
    whole = cumulative_trapezoid(p, x, initial=0.0)
    return x, p / whole[-1], whole / whole[-1]


@pytest.mark.thorough("test_gibbs_law_with_a_stop")
@pytest.mark.parametrize("name", SCENES)
def test_gibbs_law(name):
    """Kolmogorov-Smirnov at 1 % with one sample a trajectory, of x and of x'; E[x'^2] = N1/c; rate of impacts."""
    eqs = changed(SCENES[name], c1=-2.0 * C, n1=2.0 * N1)  # the same law, and sooner
    many = Trajectories(eqs, 8192, SEED, 0.04)
    assert burn_in(many) == []
    x, v, _ = many.snapshot()
    grid, p, cdf = exact(eqs)
    assert kstest(x, lambda at: np.interp(at, grid, cdf)).pvalue > 0.01
    assert kstest(v / math.sqrt(N1 / C), "norm").pvalue > 0.01
    moments = many.run(50.0)
    assert abs(z(moments.mean("v2"), N1 / C)) < 4
    # flux p(x_stop) E[|v|]/2 at each stop, both ways where the stop is compliant
    places = [-(eqs.gap or 0.0)] if eqs.restitution or eqs.stop_stiffness else []
    places += [eqs.opposite_gap] if eqs.opposite_gap is not None else []
    rate = sum(np.interp(place, grid, p) for place in places) * math.sqrt(N1 / C / (2 * math.pi))
    assert abs(z(moments.mean("impacts"), rate)) < 4 if places else moments.impacts.max() == 0.0
    assert abs(moments.impact_loss).max() < 1e-12


@pytest.mark.thorough("test_identities")
@pytest.mark.parametrize(
    "changes",
    [
        {"gap": 0.4, "alpha2": 0.5},
        {"gap": -0.2},
        {"gap": 0.3, "opposite_gap": 0.5, "opposite_restitution": 0.6},
        {"gap": 0.3, "opposite_gap": -0.1, "opposite_restitution": 0.3},
        {"restitution": None, "stop_stiffness": 1e4, "stop_damping": 5.0},
        {"restitution": None, "stop_stiffness": 3.0, "stop_damping": 1.0, "gap": -0.1},
        {"restitution": None, "linear": -1.0, "alpha": 2.0},
        {
            "n1": None,
            "n2": 0.4,
            "c1": -0.01,
            "gap": 0.3,
            "opposite_gap": 0.5,
            "opposite_restitution": 0.6,
        },
        {
            "n1": None,
            "n2": 0.4,
            "c1": -0.01,
            "gap": -0.2,
            "opposite_gap": 9.0,
            "opposite_restitution": 0.6,
        },
    ],
    ids=str,
)
def test_power_balance_and_identities(changes):
    """Input = friction + load + stops, and E[V] = 0, E[xV] = E[V^2], E[x'V] = mu E[V^2]."""
    eqs = padded(changed(PAPER, beta=0.3, mu=0.4, **changes), **SPRING)
    many = Trajectories(eqs, 2048, SEED, 0.02)
    burn_in(many)
    moments = many.run(200.0)
    assert abs(z(mean_and_error(moments.balance(eqs)), 0.0)) < 4
    assert abs(z(moments.mean("V"), 0.0)) < 4
    v2, error = moments.mean("V2")
    assert abs(z(mean_and_error(moments.vV - eqs.mu * moments.V2), 0.0)) < 4
    assert mean_and_error(moments.xV - moments.V2)[0] == pytest.approx(
        0.0, abs=1e-3 * v2 + 4 * error
    )


@pytest.mark.thorough("test_a_small_gap_or_preload_is_a_stop_at_rest")
def test_preload_converges_with_the_step():
    """E[(x + gap)^2] of a pressed mass: exact at the chosen step to the bias of some per cent that it represents.

    At the step of a scene without preload it is half as large again: bounces shorter than the step
    are heated.
    """
    eqs = changed(BASE, restitution=1.0, gap=-1.5)
    grid, p, _ = exact(eqs)
    y2 = np.trapezoid((grid - 1.5) ** 2 * p, grid)
    many = Trajectories(eqs, 8192, SEED)
    burn_in(many)
    assert many.h < 0.03
    found = mean_and_error((many.snapshot()[0] - 1.5) ** 2)
    assert abs(found[0] / y2 - 1.0) < 0.03 + 4 * found[1] / y2
    coarse = Trajectories(eqs, 8192, SEED, 0.1)
    coarse.run(100.0)
    assert mean_and_error((coarse.snapshot()[0] - 1.5) ** 2)[0] > 1.3 * y2


@pytest.mark.thorough("test_burn_in_waits_for_rare_hops")
def test_on_top_of_the_barrier():
    """Without noise the mass stays for ever; noise sends it into both wells alike."""
    assert not trace(
        changed(BISTABLE, n1=None), np.zeros(2000), 0.05, 1, (0.0, 0.0, 0.0)
    ).samples.any()
    many = Trajectories(changed(BISTABLE, n1=1e-5), 8192, SEED, 0.05, np.zeros(3))
    many.run(200.0)
    x, _, _ = many.snapshot()
    assert np.abs(np.abs(x) - 1.0).max() < 0.2
    assert abs(z(mean_and_error((x > 0.0).astype(float)), 0.5)) < 4


def test_burn_in_waits_for_rare_hops():
    """Two unlike wells, rarely left: begun half in each, E[x] after the burn-in is that of Gibbs."""
    eqs = changed(BISTABLE, alpha2=0.12, n1=0.006)
    many = Trajectories(eqs, 4096, SEED, 0.06)
    assert sorted(set(many.start[0])) == pytest.approx([-1.062, 0.942], abs=1e-3)
    assert burn_in(many) == []
    x = np.linspace(-4, 4, 40_001)
    p = np.exp(-C / eqs.n1 * energy(eqs, x))
    mean = np.trapezoid(x * p, x) / np.trapezoid(p, x)
    assert mean < -0.3  # far from the start's
    assert abs(z(mean_and_error(many.snapshot()[0]), mean)) < 4


def test_hops_that_are_waited_for_take_their_own_time():
    """Some tens of correlation times: what a look at their rate found does not count as one of these."""
    many = Trajectories(changed(BISTABLE, alpha2=0.12, n1=0.0045), 1024, SEED, 0.06)
    assert burn_in(many) == []
    assert many.time < 2e4


@pytest.mark.thorough("test_gibbs_law_with_a_stop")
def test_hops_too_rare_to_wait_for(monkeypatch):
    """E[x^2] of Gibbs lies between those of the two wells, which are known long before the shares of the wells are."""
    monkeypatch.setattr(settling, "LONGEST", 4e3)
    eqs = changed(BISTABLE, alpha2=0.12, n1=0.003)
    many = Trajectories(eqs, 4096, SEED, 0.06)
    assert burn_in(many) == []
    assert many.time < 1e3
    value = many.hopping.mean(many.run(200.0).x2)
    x = np.linspace(-4, 4, 40_001)
    p = np.exp(-C / eqs.n1 * energy(eqs, x))
    away = np.trapezoid(x * x * p, x) / np.trapezoid(p, x) - value.value
    assert 20.0 * value.stderr < value.model
    # the left well is far the deeper one
    assert 0.5 * value.model < away < value.model + 4.0 * value.stderr


@pytest.mark.thorough("test_gibbs_law_with_a_stop")
@pytest.mark.parametrize(("c", "alpha2"), [(0.05, 0.05), (1.0, 0.05)])
def test_hops_are_as_rare_as_kramers_says(c, alpha2):
    """Weak and strong damping, wells eight times deeper than the noise is strong: to a sixth, as 1/8 is left out."""
    plain = Equations(linear=-1.0, alpha=1.0, alpha2=alpha2, c1=-c, n1=0.03 * c)
    eqs = padded(plain)
    many = Trajectories(eqs, 8192, SEED, 0.06)
    many.run(500.0)  # until the wells are stationary
    early = hopping(eqs, many.start[0], many.snapshot()[0], many.time)
    many.run(1500.0)
    late = hopping(eqs, many.start[0], many.snapshot()[0], many.time)
    gone = [-math.log(1.0 - one.rate * one.time) for one in (early, late)]
    rate = (gone[1] - gone[0]) / 1500.0
    scatter = 1.0 / math.sqrt(late.hops - early.hops)
    assert abs(rate / sum(hopping_rates(plain)) - 1.0) < 1.0 / 6.0 + 2.0 * scatter < 0.3
