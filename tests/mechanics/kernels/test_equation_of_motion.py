"""The step: each part against the equation that it solves."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from harvester.mechanics.kernels import equation_of_motion, intervals, offset_stops
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import interpreted

# In plain Python, for each set of effects would be compiled anew; that compiled ones are the same
# is tested below.
NAMES = (
    "carried",
    "decayed",
    "drift",
    "drift_at_stop",
    "friction",
    "impulse",
    "intensity",
    "kick",
    "meeting",
    "push",
)
carried, decayed, drift, drift_at_stop, friction, impulse, intensity, kick, meeting, push = (
    interpreted(getattr(equation_of_motion, name)) for name in NAMES
)
interval, kick_at_stops = interpreted(intervals.interval), interpreted(offset_stops.kick_at_stops)


@pytest.mark.parametrize("z", [0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 5.0, 20.0, 31.0, 100.0])
def test_decayed_is_one_minus_exp(z):
    assert decayed(z) == pytest.approx(-math.expm1(-z), rel=1e-9, abs=1e-300)


@pytest.mark.parametrize("mu", [None, 1e-4, 0.05, 1.0, 30.0, 1e4])
@pytest.mark.parametrize(
    "x, v", [(0.3, 0.7), (0.05, -0.9), (0.0, -1.0), (1e-9, -1e-12), (2.0, -0.5)]
)
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
    (x1, v1, V1), speed = drift(State(x, v, V), interval(h, h, mu), mu, r)
    assert pytest.approx(expected, rel=1e-8, abs=1e-10) == V1
    if hit < h:
        assert (x1, v1, speed) == pytest.approx((-r * v * (h - hit), -r * v, -v), abs=1e-15)
    else:
        assert (x1, v1, speed) == (x + h * v, v, 0.0)


@given(x=st.floats(0, 10), v=st.floats(-10, 10), h=st.floats(1e-6, 10), r=st.floats(0, 1))
@settings(deadline=None, max_examples=300)
def test_an_impact_never_raises_energy_and_never_passes_the_stop(x, v, h, r):
    (x1, v1, _), speed = drift(State(x, v, 0.0), interval(h, h, 1.0), 1.0, r)
    assert x1 >= 0.0
    assert abs(v1) <= abs(v)
    assert speed >= 0.0


@pytest.mark.parametrize("f", [0.0, 1e-3, 0.3, -0.3])
def test_kick_is_the_linear_equation_to_third_order(f):
    """v' = -f v - x - alpha x^3 - beta V at fixed x and V: local error of order h^3."""
    x = 0.7
    v = -0.4
    V = 0.2
    alpha = 0.5
    beta = 1.25
    errors = []
    for h in (0.1, 0.05):
        force = -x - alpha * x**3 - beta * V
        exact = solve_ivp(lambda _, y: -f * y + force, (0, h), [v], rtol=1e-12, atol=1e-14).y[0, -1]  # noqa: B023
        errors.append(
            abs(
                kick(State(x, v, V), 0.0, h, Coefficients(alpha=alpha, beta=beta, c1=-f or None))
                - exact
            )
        )
    assert errors[1] <= errors[0] / 6.5 + 1e-15


@pytest.mark.parametrize("h", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("x", [5.0, 30.0, 1e4])
def test_stiff_damping_stops_the_mass_at_any_step(x, h):
    """f h from 1 to 1e17: |v| never grows, and the force's share stays below the quasi-static F/f."""
    c = Coefficients(c3=0.1)
    f = friction(x, 1.0, c)
    v1 = kick(State(x, 1.0, 0.0), 0.0, h, c)
    assert abs(v1) <= 1.0 / (1.0 + f * h) + x / f * (1 + 1e-12)


@pytest.mark.parametrize("v", [0.0, 0.8, -2.0])
@pytest.mark.parametrize("force", [0.0, 0.5])
def test_quadratic_damping_of_a_kick_is_of_second_order(v, force):
    """v' = F - cv |v| v, for F = 0 v/(1 + cv |v| h): half the step leaves an eighth of its error."""
    errors = []
    for h in (0.1, 0.05):
        c = Coefficients(cv=0.7, beta=1.0)
        exact = solve_ivp(
            lambda _, y: force - 0.7 * np.abs(y) * y, (0, h), [v], rtol=1e-12, atol=1e-14
        ).y[0, -1]
        if not force:
            assert exact == pytest.approx(v / (1.0 + 0.7 * abs(v) * h), rel=1e-9)
        errors.append(abs(kick(State(0.0, v, -force), 0.0, h, c) - exact))
    assert errors[1] <= errors[0] / 6.0 + 1e-15


@pytest.mark.parametrize("cv", [0.05, 0.5])
def test_turning_points_under_quadratic_damping(cv):
    """x'' + cv |x'| x' + x = 0 turns at a and -b with (1 + 2 cv a) exp(-2 cv a) = (1 - 2 cv b) exp(2 cv b)."""
    c = Coefficients(cv=cv)
    h = 2e-3
    half = interval(0.5 * h, h, None)
    whole = interval(h, h, None)
    s = drift(State(1.0, 0.0, 0.0), half, None, None)[0]
    turns = [1.0]
    before = -1.0
    while len(turns) < 5:
        s = State(s.x, kick(s, 0.0, h, c), s.V)
        if s.v * before < 0.0:
            turns.append(abs(s.x))
        before = s.v
        s = drift(s, whole, None, None)[0]
    for a, b in itertools.pairwise(turns):
        assert (1 + 2 * cv * a) * math.exp(-2 * cv * a) == pytest.approx(
            (1 - 2 * cv * b) * math.exp(2 * cv * b), abs=1e-5
        )


def test_noise_intensity_is_that_of_the_correlated_sum():
    """Var(eps1 xi1 + x eps2 xi2) / 2 for correlated noises."""
    c = Coefficients(n1=0.01, n2=0.04, n12=0.005)
    assert intensity(0.3, c) == pytest.approx(0.01 + 2 * 0.3 * 0.005 + 0.09 * 0.04)


@pytest.mark.parametrize("n12", [None, 0.003, -0.02])
@pytest.mark.parametrize("x", [-2.0, 0.0, 0.3])
def test_one_variate_a_noise_has_the_law_of_the_correlated_sum(n12, x):
    """Over all nine pairs of three-point variates: odd moments 0, variance 2 h N(x), fourth moment that of a Gaussian.

    Correlation at its bound, n12^2 = n1 n2, leaves a single noise.
    """
    h = 0.1
    c = Coefficients(n1=0.01, n2=0.04, n12=n12)
    points = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))
    moments = [
        sum(p * q * impulse(x, xi, h, c, other) ** k for xi, p in points for other, q in points)
        for k in (1, 2, 3, 4)
    ]
    variance = 2.0 * h * intensity(x, c)
    assert moments == pytest.approx([0.0, variance, 0.0, 3.0 * variance**2], rel=1e-12, abs=1e-15)


def test_a_lone_noise_needs_no_other_variate():
    for c in (Coefficients(n1=0.01), Coefficients(n2=0.04)):
        assert impulse(0.3, 1.2, 0.1, c, 9.0) == impulse(0.3, 1.2, 0.1, c)


def test_compiled_and_interpreted_step_agree():
    c = Coefficients(alpha=0.5, beta=0.05, c1=0.01, c2=0.05, c3=0.1, n1=0.01, n2=0.02, n12=0.003)
    arguments = State(0.7, -0.4, 0.2), 1.3, 0.1, c
    assert equation_of_motion.kick(*arguments) == pytest.approx(kick(*arguments), rel=1e-14)
    arguments = State(0.01, -0.4, 0.2), interval(0.1, 0.1, 0.05), 0.05, 0.96
    for one, other in zip(equation_of_motion.drift(*arguments), drift(*arguments), strict=True):
        assert one == pytest.approx(other, rel=1e-14)


def test_absent_equals_never_having_it():
    """None gives bit for bit what a coefficient of zero gives, so nothing else depends on it."""
    given = Coefficients(n1=0.01, c1=-0.05)
    zero = Coefficients(*(0.0 if one is None else one for one in given))._replace(linear=None)
    arguments = State(np.float64(0.7), -0.4, 0.2), 1.3, 0.1
    assert kick(*arguments, given) == kick(*arguments, zero)


@pytest.mark.parametrize("mu", [None, 1e-4, 0.3, 50.0])
@pytest.mark.parametrize("way, t", [(0.7, 0.1), (-0.7, 2.0), (0.3, 0.0), (0.0, 1.0)])
def test_carried_solves_v_dot_exactly(mu, way, t):
    """V' = way/t - mu V; a jump of x at once is one of V."""
    exact = 0.4 + way
    if mu is not None and t > 0.0:
        exact = 0.4 * math.exp(-mu * t) - way / t * math.expm1(-mu * t) / mu
    assert carried(0.4, way, t, mu) == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize(
    "x, v, a",
    [
        (0.02, -0.5, -1.0),
        (0.02, -0.5, 1.0),
        (0.02, 0.02, -4.0),
        (0.0, 0.1, -3.0),
        (0.02, -0.5, 0.0),
    ],
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
    h = 0.1
    V = 0.4
    mu = 0.3
    s, d = State(x, v, V), interval(h, h, mu)
    plain = drift(s, d, mu, r)
    ours = drift_at_stop(s, d, Coefficients(mu=mu, beta=beta, n1=n1), r)
    pushed = plain[1] > 0.0 and beta is not None and n1 is None
    # processors round differently
    same = [*ours[0], ours[1]] == pytest.approx([*plain[0], plain[1]], rel=1e-14)
    assert same != pushed


def test_impact_under_a_push_is_that_of_the_accelerated_motion():
    """Constant a from (x, u): down, reflected, up; the velocity given back is that of the kick at the end less half."""
    h = 0.1
    r = 0.9
    beta = 2.0
    x = 0.02
    V = 1.02
    c = Coefficients(beta=beta)
    a = push(x, V, c)
    assert a == pytest.approx(-2.0)
    u = -0.5
    s = State(x, u + 0.5 * a * h, V)
    (x1, v1, _), speed = drift_at_stop(s, interval(h, h, None), c, r)
    w = math.sqrt(u * u - 2 * a * x)
    left = h - (w + u) / -a
    assert speed == pytest.approx(w)
    assert x1 == pytest.approx(r * w * left + 0.5 * a * left**2)
    assert v1 + 0.5 * a * h == pytest.approx(r * w + a * left)
    # V(h) = V exp(-mu h) + int x'(s) exp(-mu (h - s)) ds
    mu = 3.0
    hit = h - left
    (_, _, V1), _ = drift_at_stop(s, interval(h, h, mu), c._replace(mu=mu), r)
    way = quad(lambda s: (u + a * s) * math.exp(-mu * (h - s)), 0, hit)[0]
    way += quad(lambda s: (r * w + a * (s - hit)) * math.exp(-mu * (h - s)), hit, h)[0]
    assert pytest.approx(V * math.exp(-mu * h) + way, abs=2e-4) == V1


def test_bounce_shorter_than_a_step_sticks_unless_nothing_is_lost():
    """2 r w/a < h: x = x' = 0 for r < 1; for r = 1 the energy stays."""
    h = 0.1
    V = 1.0
    c = Coefficients(beta=1.0)
    d = interval(h, h, None)
    half = 0.5 * push(0.0, V, c) * h
    for r in (0.0, 0.5, 1 - 1e-12):
        assert drift_at_stop(State(0.0, half - 0.001, V), d, c, r)[0][:2] == (0.0, 0.0)
    (x1, v1, V1), speed = drift_at_stop(State(0.0, half - 0.0013, V), d, c, 1.0)
    left = h % 0.0026  # of the last of many flights
    assert speed == pytest.approx(0.0013)
    assert x1 == pytest.approx(0.0013 * left - 0.5 * left**2)
    assert 0.5 * (v1 - 0.5 * h) ** 2 + x1 == pytest.approx(0.5 * 0.0013**2)
    assert V1 - x1 == pytest.approx(V)


@pytest.mark.slow
@pytest.mark.parametrize("V, moves", [(1.0, False), (0.0, False), (-1.0, True)])
def test_a_stuck_mass_waits_for_a_pull(V, moves):
    c = Coefficients(beta=0.7, r=0.5)
    rest = State(0.0, 0.0, V)
    assert kick_at_stops(rest, 0.0, 0.1, c) == pytest.approx(0.07 * moves)
    # without a stop, away from it, in motion, or under external noise nothing holds the mass
    free = kick(rest, 0.0, 0.1, c)
    assert kick_at_stops(rest, 0.0, 0.1, c._replace(r=None)) == free
    assert kick_at_stops(State(0.0, -1e-9, V), 0.0, 0.1, c) == pytest.approx(free - 1e-9)
    assert kick_at_stops(rest, -1.0, 0.1, c._replace(n1=0.01)) == pytest.approx(
        free - math.sqrt(0.002)
    )
