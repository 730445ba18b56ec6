"""The step: each part against the equation that it solves."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from harvester.mechanics.kernels.equation_of_motion import (
    carried,
    decayed,
    drift,
    drift_at_stop,
    friction,
    impulse,
    intensity,
    kick,
    kick_at_stop,
    meeting,
    push,
    relaxation,
)

NO_EFFECT = {"alpha": None, "beta": None, "c1": None, "c2": None, "c3": None, "n1": None, "n2": None, "n12": None}


@pytest.mark.parametrize("z", [0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 5.0, 20.0, 31.0, 100.0])
def test_decayed_is_one_minus_exp(z):
    assert decayed(z) == pytest.approx(-math.expm1(-z), rel=1e-9, abs=1e-300)


@pytest.mark.parametrize("mu", [None, 1e-4, 0.05, 1.0, 30.0, 1e4])
@pytest.mark.parametrize("x, v", [(0.3, 0.7), (0.05, -0.9), (0.0, -1.0), (1e-9, -1e-12), (2.0, -0.5)])
@pytest.mark.parametrize("r", [None, 0.0, 0.5, 0.96, 1.0])
def test_drift_solves_v_dot_exactly(mu, x, v, r):
    """V' = x' - mu V along the reflected straight line, leg by leg in closed form."""
    h, V = 0.1, 0.4
    rate = mu or 0.0

    def leg(V, speed, time):
        if rate == 0.0:
            return V + speed * time
        return V * math.exp(-rate * time) - speed * math.expm1(-rate * time) / rate

    hit = -x / v if r is not None and v < 0.0 and -x / v < h else h
    expected = leg(leg(V, v, hit), -(r or 0.0) * v, h - hit) if hit < h else leg(V, v, h)
    x1, v1, V1, speed = drift(x, v, V, h, *relaxation(h, mu), mu, r)
    assert pytest.approx(expected, rel=1e-8, abs=1e-10) == V1
    if hit < h:
        assert (x1, v1, speed) == pytest.approx((-r * v * (h - hit), -r * v, -v), abs=1e-15)
    else:
        assert (x1, v1, speed) == (x + h * v, v, 0.0)


@given(x=st.floats(0, 10), v=st.floats(-10, 10), h=st.floats(1e-6, 10), r=st.floats(0, 1))
@settings(deadline=None, max_examples=300)
def test_an_impact_never_raises_energy_and_never_passes_the_stop(x, v, h, r):
    x1, v1, _, speed = drift(x, v, 0.0, h, *relaxation(h, 1.0), 1.0, r)
    assert x1 >= 0.0
    assert abs(v1) <= abs(v)
    assert speed >= 0.0


@pytest.mark.parametrize("f", [0.0, 1e-3, 0.3, -0.3])
def test_kick_is_the_linear_equation_to_third_order(f):
    """v' = -f v - x - alpha x^3 - beta V at fixed x and V: local error of order h^3."""
    x, v, V, alpha, beta = 0.7, -0.4, 0.2, 0.5, 1.25
    errors = []
    for h in (0.1, 0.05):
        force = -x - alpha * x**3 - beta * V
        exact = solve_ivp(lambda _, y: -f * y + force, (0, h), [v], rtol=1e-12, atol=1e-14).y[0, -1]  # noqa: B023
        errors.append(
            abs(kick(x, v, V, 0.0, h, **(NO_EFFECT | {"alpha": alpha, "beta": beta, "c1": -f or None})) - exact)
        )
    assert errors[1] <= errors[0] / 6.5 + 1e-15


@pytest.mark.parametrize("h", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("x", [5.0, 30.0, 1e4])
def test_stiff_damping_stops_the_mass_at_any_step(x, h):
    """f h from 1 to 1e17: |v| never grows, and the force's share stays below the quasi-static F/f."""
    f = friction(x, None, None, 0.1)
    v1 = kick(x, 1.0, 0.0, 0.0, h, **(NO_EFFECT | {"c3": 0.1}))
    assert abs(v1) <= 1.0 / (1.0 + f * h) + x / f * (1 + 1e-12)


def test_noise_intensity_is_that_of_the_correlated_sum():
    """Var(eps1 xi1 + x eps2 xi2) / 2 for correlated noises."""
    assert intensity(0.3, 0.01, 0.04, 0.005) == pytest.approx(0.01 + 2 * 0.3 * 0.005 + 0.09 * 0.04)


@pytest.mark.parametrize("n12", [None, 0.003, -0.02])
@pytest.mark.parametrize("x", [-2.0, 0.0, 0.3])
def test_one_variate_a_noise_has_the_law_of_the_correlated_sum(n12, x):
    """Over all nine pairs of three-point variates: odd moments 0, variance 2 h N(x), fourth moment that of a Gaussian.

    Correlation at its bound, n12^2 = n1 n2, leaves a single noise.
    """
    h, n1, n2 = 0.1, 0.01, 0.04
    points = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))
    moments = [
        sum(p * q * impulse(x, xi, h, n1, n2, n12, other) ** k for xi, p in points for other, q in points)
        for k in (1, 2, 3, 4)
    ]
    variance = 2.0 * h * intensity(x, n1, n2, n12)
    assert moments == pytest.approx([0.0, variance, 0.0, 3.0 * variance**2], rel=1e-12, abs=1e-15)


def test_a_lone_noise_needs_no_other_variate():
    assert impulse(0.3, 1.2, 0.1, 0.01, None, None, 9.0) == impulse(0.3, 1.2, 0.1, 0.01, None, None)
    assert impulse(0.3, 1.2, 0.1, None, 0.04, None, 9.0) == impulse(0.3, 1.2, 0.1, None, 0.04, None)


def test_compiled_and_interpreted_step_agree():
    arguments = (0.7, -0.4, 0.2, 1.3, 0.1, 0.5, 0.05, 0.01, 0.05, 0.1, 0.01, 0.02, 0.003)
    assert kick(*arguments) == pytest.approx(kick.py_func(*arguments), rel=1e-14)
    arguments = (0.01, -0.4, 0.2, 0.1, *relaxation(0.1, 0.05), 0.05, 0.96)
    assert drift(*arguments) == pytest.approx(drift.py_func(*arguments), rel=1e-14)


def test_absent_equals_never_having_it():
    """None gives bit for bit what a coefficient of zero gives, so nothing else depends on it."""
    x, v, V, xi, h = np.float64(0.7), -0.4, 0.2, 1.3, 0.1
    zero = dict.fromkeys(NO_EFFECT, 0.0)
    given = {"n1": 0.01, "c1": -0.05}
    assert kick(x, v, V, xi, h, **(NO_EFFECT | given)) == kick(x, v, V, xi, h, **(zero | given))


@pytest.mark.parametrize("mu", [None, 1e-4, 0.3, 50.0])
@pytest.mark.parametrize("way, t", [(0.7, 0.1), (-0.7, 2.0), (0.3, 0.0), (0.0, 1.0)])
def test_carried_solves_v_dot_exactly(mu, way, t):
    """V' = way/t - mu V; a jump of x at once is one of V."""
    exact = 0.4 + way
    if mu is not None and t > 0.0:
        exact = 0.4 * math.exp(-mu * t) - way / t * math.expm1(-mu * t) / mu
    assert carried(0.4, way, t, mu) == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize(
    "x, v, a", [(0.02, -0.5, -1.0), (0.02, -0.5, 1.0), (0.02, 0.02, -4.0), (0.0, 0.1, -3.0), (0.02, -0.5, 0.0)]
)
def test_meeting_is_on_the_parabola(x, v, a):
    """x + u s + a s^2/2 = 0, and u + a s is minus the speed there, with u = v - a h/2."""
    h = 0.1
    u = v - 0.5 * a * h
    s, speed = meeting(x, v, h, a)
    assert s > 0.0
    assert x + u * s + 0.5 * a * s * s == pytest.approx(0.0, abs=1e-15)
    assert u + a * s == pytest.approx(-speed, abs=1e-14)


@pytest.mark.parametrize("n1", [None, 0.01])
@pytest.mark.parametrize("beta", [None, 0.7])
@pytest.mark.parametrize("r", [None, 0.5])
@pytest.mark.parametrize("x, v", [(0.3, 0.7), (0.05, -0.9), (0.01, -0.9)])
def test_drift_at_stop_is_drift_but_for_a_push(x, v, r, beta, n1):
    """The same, unless an impact happens under a force that no noise drowns."""
    h, V, mu = 0.1, 0.4, 0.3
    e, g = relaxation(h, mu)
    plain = drift(x, v, V, h, e, g, mu, r)
    ours = drift_at_stop(x, v, V, h, h, e, g, mu, r, beta, n1)
    pushed = plain[3] > 0.0 and beta is not None and n1 is None
    assert (ours == plain) != pushed


def test_impact_under_a_push_is_that_of_the_accelerated_motion():
    """Constant a from (x, u): down, reflected, up; the velocity given back is that of the kick at the end less half."""
    h, r, beta, x, V = 0.1, 0.9, 2.0, 0.02, 1.02
    a = push(x, V, beta, None)
    assert a == pytest.approx(-2.0)
    u = -0.5
    x1, v1, _, speed = drift_at_stop(x, u + 0.5 * a * h, V, h, h, 1.0, h, None, r, beta, None)
    w = math.sqrt(u * u - 2 * a * x)
    left = h - (w + u) / -a
    assert speed == pytest.approx(w)
    assert x1 == pytest.approx(r * w * left + 0.5 * a * left**2)
    assert v1 + 0.5 * a * h == pytest.approx(r * w + a * left)
    # V(h) = V exp(-mu h) + int x'(s) exp(-mu (h - s)) ds
    mu, hit = 3.0, h - left
    _, _, V1, _ = drift_at_stop(x, u + 0.5 * a * h, V, h, h, *relaxation(h, mu), mu, r, beta, None)
    way = quad(lambda s: (u + a * s) * math.exp(-mu * (h - s)), 0, hit)[0]
    way += quad(lambda s: (r * w + a * (s - hit)) * math.exp(-mu * (h - s)), hit, h)[0]
    assert pytest.approx(V * math.exp(-mu * h) + way, abs=2e-4) == V1


def test_bounce_shorter_than_a_step_sticks_unless_nothing_is_lost():
    """2 r w/a < h: x = x' = 0 for r < 1; for r = 1 the energy stays."""
    h, V, beta = 0.1, 1.0, 1.0
    v = -0.001 + 0.5 * push(0.0, V, beta, None) * h
    for r in (0.0, 0.5, 1 - 1e-12):
        assert drift_at_stop(0.0, v, V, h, h, 1.0, h, None, r, beta, None)[:2] == (0.0, 0.0)
    v = -0.0013 + 0.5 * push(0.0, V, beta, None) * h
    x1, v1, V1, speed = drift_at_stop(0.0, v, V, h, h, 1.0, h, None, 1.0, beta, None)
    left = h % 0.0026  # of the last of many flights
    assert speed == pytest.approx(0.0013)
    assert x1 == pytest.approx(0.0013 * left - 0.5 * left**2)
    assert 0.5 * (v1 - 0.5 * h) ** 2 + x1 == pytest.approx(0.5 * 0.0013**2)
    assert V1 - x1 == pytest.approx(V)


@pytest.mark.slow
@pytest.mark.parametrize("V, moves", [(1.0, False), (0.0, False), (-1.0, True)])
def test_a_stuck_mass_waits_for_a_pull(V, moves):
    arguments = NO_EFFECT | {"beta": 0.7}
    assert kick_at_stop(0.0, 0.0, V, 0.0, 0.1, 0.5, **arguments) == pytest.approx(0.07 * moves)
    # without a stop, away from it, in motion, or under external noise nothing holds the mass
    free = kick(0.0, 0.0, V, 0.0, 0.1, **arguments)
    assert kick_at_stop(0.0, 0.0, V, 0.0, 0.1, None, **arguments) == free
    assert kick_at_stop(0.0, -1e-9, V, 0.0, 0.1, 0.5, **arguments) == pytest.approx(free - 1e-9)
    assert kick_at_stop(0.0, 0.0, V, -1.0, 0.1, 0.5, **(arguments | {"n1": 0.01})) == pytest.approx(
        free - math.sqrt(0.002)
    )
