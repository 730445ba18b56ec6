"""The stationary density against closed forms: what it must reach where the answer is known."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

from harvester.density.functionals import NAMES
from harvester.density.refine import refined
from harvester.equations.coefficients import Equations
from tests.support.systems import linear, linear_v2

THOROUGH = pytest.mark.thorough("test_elastic_stop_with_a_passive_load_to_eight_digits")


def means(eqs, within):
    """The means by their names, after a check that their stated error is as small as was asked."""
    answer = refined(eqs, within)
    assert answer.share <= within
    return dict(zip(NAMES, answer.means, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "within", "meshes"), [(1.0, 1e-4, 1), (8.0, 1e-6, 2)])
def test_progress_grows_to_the_whole(mu, within, meshes):
    """A solution reports how far its error has come, in no step backwards, and 1 at its target and there alone."""
    reported = []
    assert refined(linear(0.3, mu), within, progress=reported.append).share <= within
    assert len(reported) >= meshes and reported == sorted(reported)
    assert reported[0] > 0.0
    assert reported.index(1.0) == len(reported) - 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("beta", "mu", "within"),
    [
        (0.05, 1.0, 1e-5),
        pytest.param(0.05, 1.0, 1e-8, marks=pytest.mark.thorough("test_linear_scene")),
        pytest.param(1.2, 0.3, 1e-5, marks=pytest.mark.thorough("test_linear_scene")),
        pytest.param(0.3, 8.0, 1e-6, marks=pytest.mark.thorough("test_linear_scene")),
    ],
)
def test_linear_scene(beta, mu, within):
    """All second moments of a Gaussian density, S = N1/[c (1 + beta + mu^2 + c mu) + beta mu]."""
    eqs = linear(beta, mu)
    c = 0.05
    found = means(eqs, within)
    s = linear_v2(eqs)
    assert found["voltage_squared"] == pytest.approx(s, rel=within)
    assert found["displacement_voltage"] == pytest.approx(s, rel=within)
    assert found["velocity_voltage"] == pytest.approx(mu * s, rel=within)
    assert found["velocity_squared"] == pytest.approx(s * (1 + beta + mu**2 + c * mu), rel=within)
    assert found["displacement_squared"] == pytest.approx(s * (1 + mu**2 + c * mu), rel=within)


def elastic_passive(c, mu, n1):
    """E[V^2] = R(0) - mu int exp(-mu s) R(s) ds of |linear motion|, whose correlation is that of a folded normal."""
    wd = math.sqrt(1.0 - c * c / 4.0)
    variance = n1 / c

    def correlation(s):
        rho = math.exp(-c * s / 2.0) * (math.cos(wd * s) + c / (2.0 * wd) * math.sin(wd * s))
        return (
            2.0
            * variance
            / math.pi
            * (math.sqrt(max(1.0 - rho * rho, 0.0)) + rho * math.asin(rho) - 1.0)
        )

    # Between the extrema of rho, where it touches no bound: the derivative of R jumps at s = k
    # pi/wd only slightly.
    ends = np.arange(0.0, 60.0 / mu, math.pi / wd)
    parts = [
        quad(
            lambda s: math.exp(-mu * s) * correlation(s),
            *pair,
            epsabs=1e-15,
            epsrel=1e-12,
            limit=200,
        )[0]
        for pair in itertools.pairwise(ends)
    ]
    return correlation(0.0) - mu * math.fsum(parts)


@pytest.mark.thorough("test_elastic_stop_with_a_passive_load_to_eight_digits")
@pytest.mark.slow
@pytest.mark.parametrize(("circuit", "within"), [({"beta": 0.5}, 1e-4), ({"mu": 1.0}, 1e-4)])
def test_coloured_noise_of_a_linear_scene(circuit, within):
    """Second moments of (x, v, V, a) by the Lyapunov equation, with V = x in an open circuit, and a passive load."""
    eqs = Equations(c1=-0.1, coloured=0.05, correlation_time=0.7, **circuit)
    beta = eqs.beta or 0.0
    mu = eqs.mu or 0.0
    tau = 0.7
    drift = np.array([[0, 1, 0, 0], [-1, -0.1, -beta, 1], [0, 1, -mu, 0], [0, 0, 0, -1 / tau]])
    kicks = np.diag([0.0, 0.0, 0.0, 2.0 * 0.05 / tau**2])
    if eqs.mu is None:  # V = x has no equation of its own
        drift = np.delete(drift, 2, 0)
        kicks = np.delete(np.delete(kicks, 2, 0), 2, 1)
        drift[:, 0] += drift[:, 2]
        drift = np.delete(drift, 2, 1)
    s = solve_continuous_lyapunov(drift, -kicks)
    found = means(eqs, within)
    assert found["displacement_squared"] == pytest.approx(s[0, 0], rel=2.0 * within)
    assert found["velocity_squared"] == pytest.approx(s[1, 1], rel=2.0 * within)
    assert found["voltage_squared"] == pytest.approx(
        s[0, 0] if eqs.mu is None else s[2, 2], rel=within
    )


@pytest.mark.slow
def test_elastic_stop_with_a_passive_load_to_eight_digits():
    """A stop that loses nothing folds the linear motion: V filters |x|."""
    c = 0.05
    mu = 0.05
    n1 = 0.01
    found = means(Equations(c1=-c, mu=mu, n1=n1, restitution=1.0), 1e-8)
    assert found["voltage_squared"] == pytest.approx(elastic_passive(c, mu, n1), rel=1e-8)
    assert found["impact_rate"] == pytest.approx(1.0 / math.pi, rel=1e-7)
    assert found["velocity_squared"] == pytest.approx(n1 / c, rel=1e-8)


@pytest.mark.thorough("test_elastic_stop_with_a_passive_load_to_eight_digits")
@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"alpha": 0.5},
        {"alpha": 0.5, "gap": 0.3},
        {"alpha2": 0.3, "alpha": 0.2, "gap": -0.2},
        {"gap": 0.2, "opposite_restitution": 1.0, "opposite_gap": 0.4},
        {"linear": -1.0, "alpha": 1.0, "restitution": None},
        {"restitution": None, "gap": 0.2, "stop_stiffness": 30.0},
    ],
    ids=["cubic", "gap", "preload", "two stops", "two wells", "compliant"],
)
def test_gibbs_law_of_any_spring_and_elastic_stop(changes):
    """E[x^2] and the rate of impacts of p ~ exp(-c H/N1), by quadrature; an open circuit is one more spring."""
    c = 0.1
    n1 = 0.02
    beta = 0.1
    eqs = Equations(**({"c1": -c, "n1": n1, "beta": beta, "restitution": 1.0} | changes))
    found = means(eqs, 1e-7)
    linear_part, alpha2, alpha = eqs.spring
    low, high = eqs.rigid_stops
    edge = -(eqs.gap or 0.0)

    def weight(x):
        contact = 0.5 * (eqs.stop_stiffness or 0.0) * min(x - edge, 0.0) ** 2
        energy = (
            x**2 * (0.5 * (linear_part + beta) + x * (alpha2 / 3.0 + x * alpha / 4.0)) + contact
        )
        return math.exp(-c / n1 * energy)

    ends = max(low, -6.0), min(high, 6.0)
    inside = sorted({0.0, edge, -1.0, 1.0} & set(np.clip([0.0, edge, -1.0, 1.0], *ends)))
    whole, square = (
        quad(
            lambda x, power=power: x**power * weight(x),
            *ends,
            points=inside,
            epsabs=0.0,
            epsrel=1e-11,
            limit=500,
        )[0]
        for power in (0, 2)
    )
    assert found["displacement_squared"] == pytest.approx(square / whole, rel=1e-7)
    if eqs.restitution is not None or eqs.stop_stiffness is not None:
        rate = math.sqrt(n1 / c / (2.0 * math.pi)) * weight(edge) / whole
        assert found["impact_rate"] == pytest.approx(rate, rel=1e-5)
