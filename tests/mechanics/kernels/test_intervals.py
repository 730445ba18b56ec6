"""The voltage at an impact by a straight line: its error has no mean, is small, and harms no mean of an ensemble."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels import intervals
from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.equation_of_motion import drift
from harvester.mechanics.kernels.intervals import (
    EXACT,
    HEAT,
    SLOW,
    Update,
    fitted,
    interval,
    update_of,
)
from tests.support.systems import PAPER, changed, z


@pytest.mark.parametrize("mu", [1e-9, 0.05, 1.0, 5.0])
@pytest.mark.parametrize("r", [0.0, 0.96])
def test_its_error_has_no_mean_and_no_slope_over_the_places_of_an_impact(mu, r):
    """Against the exact drift, over the time that is left after the impact; it is below mu h^2/12 of the speed."""
    h = 0.1
    v = -0.7
    V = 0.2

    def error(a):
        both = interval(h, h, mu, fitted(mu, h)), interval(h, h, mu)
        line, exact = (drift(State(-v * (h - a), v, V), d, mu, r)[0].V for d in both)
        return line - exact

    most = (1.0 + r) * abs(v) * mu * h * h / 12.0
    assert max(abs(error(a)) for a in np.linspace(1e-6 * h, h, 50)) < 1.01 * most + 1e-10
    for weight in (lambda a: 1.0, lambda a: a / h):
        mean = quad(lambda a: error(a) * weight(a), 0.0, h)[0] / h  # noqa: B023
        assert abs(mean) < 1e-6 * most + 1e-10


def test_the_line_is_that_of_a_numerical_fit():
    for mu, h in ((1e-6, 0.1), (0.05, 0.4), (5.0, 0.1)):
        s, weights = np.polynomial.legendre.leggauss(20)
        a = 0.5 * h * (s + 1.0)
        root = np.sqrt(weights)
        matrix = np.array([root, root * a]).T
        expected = np.linalg.lstsq(matrix, root * -np.expm1(-mu * a) / mu, rcond=None)[0]
        assert fitted(mu, h) == pytest.approx(tuple(expected), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    "other",
    [
        {"n1": None},
        {"mu": None},
        {"restitution": None},
        {"mu": 1.01 * SLOW / 0.1},
        {"restitution": 1.0},
        {"beta": 1.01 * math.sqrt(HEAT * (1 - 0.96**2)) / 0.01},
        {"gap": 0.5, "opposite_gap": 0.5, "opposite_restitution": 0.9},
    ],
    ids=["no noise", "no load", "no stop", "fast load", "no loss", "strong coupling", "two stops"],
)
def test_the_voltage_is_exact_where_a_line_might_be_seen(other):
    assert update_of(PAPER, 0.1) == Update(fitted(0.05, 0.1), fitted(0.05, 0.05))
    assert update_of(changed(PAPER, **other), 0.1) == EXACT


def stationary(eqs, h):
    many = Trajectories(eqs, 2048, np.random.SeedSequence(11), h, controlled=True)
    burn_in(many)
    return many.run(400.0)


@pytest.mark.parametrize(
    "other, h",
    [({}, 0.1), ({}, 0.6), ({"mu": 1.0, "restitution": 0.5}, 0.4), ({"gap": 0.5, "mu": 2.0}, 0.2)],
    ids=["paper", "long step", "many losses", "gap"],
)
def test_means_are_those_of_the_exact_voltage(other, h, monkeypatch):
    """Up to their standard errors, a few parts in 1000, at the ends of the line's range."""
    eqs = changed(PAPER, **other)
    ours = stationary(eqs, h)
    monkeypatch.setattr(intervals, "SLOW", 0.0)
    exact = stationary(eqs, h)
    assert not np.array_equal(ours.V2, exact.V2)
    for name in ("V", "V2", "load", "x2", "v2", "xV", "impacts"):
        one, other_one = ours.controlled(name), exact.controlled(name)
        error = math.hypot(
            *(values.std(ddof=1) / math.sqrt(len(values)) for values in (one, other_one))
        )
        assert abs(z((one.mean(), error), other_one.mean())) < 4.0, name
        if name == "V2":
            assert error < 4e-3 * one.mean()
