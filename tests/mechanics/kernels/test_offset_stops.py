"""Stops at a distance, pressed on the mass, on both sides, or compliant: each drift and each path against its law."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from harvester.equations.coefficients import Equations
from harvester.errors import InputError
from harvester.mechanics import trace as paths
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import Coefficients, State, coefficients
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.offset_stops import between, in_contact, kick_at_stops, move
from tests.support.systems import PAPER, changed, linear, padded

SEED = np.random.SeedSequence(20261123)


def trace(eqs, *arguments):
    """The package's `trace`, by one compiled kernel for each kind of stop."""
    return paths.trace(padded(eqs, linear=1.0, alpha2=0.0), *arguments)


def one_by_one(x, v, V, t, mu, gap, r, high, r_high):
    """Impact after impact, with the exact voltage on every leg: state, number, energy lost."""
    count = 0
    energy = 0.5 * v * v

    def leg(V, v, s):
        return V + v * s if mu is None else V * math.exp(-mu * s) - v * math.expm1(-mu * s) / mu

    while v != 0.0:
        wall = high if v > 0.0 else -gap
        s = (wall - x) / v
        if s >= t:
            break
        x = wall
        V = leg(V, v, s)
        t = t - s
        count = count + 1
        v *= -(r_high if v > 0.0 else r)
    return (x + v * t, v, leg(V, v, t)), count, energy - 0.5 * v * v


@pytest.mark.thorough("test_both_stops_are_each_others_mirror_image")
@pytest.mark.slow
@given(
    x=st.floats(-0.3, 0.5), v=st.floats(-30.0, 30.0), t=st.floats(1e-3, 1.0), mu=st.sampled_from([None, 0.1, 3.0]),
    r=st.sampled_from([0.0, 0.4, 0.9, 1.0]), r_high=st.sampled_from([0.0, 0.5, 1 - 1e-9, 1.0]),
)  # fmt: skip
@settings(deadline=None, max_examples=500, derandomize=True)
def test_between_is_impact_after_impact(x, v, t, mu, r, r_high):
    exact, count, lost = one_by_one(x, v, 0.3, t, mu, 0.3, r, 0.5, r_high)
    (x1, v1, V1), (_, _, impacts, took) = between(
        State(x, v, 0.3), t, Coefficients(mu=mu, gap=0.3, r=r, high=0.5, r_high=r_high)
    )
    if abs(impacts - count) == 1:  # at the very end of the drift
        assert min(x1 + 0.3, 0.5 - x1) < 1e-9
        return
    assert impacts == count
    assert (x1, v1) == pytest.approx(exact[:2], abs=1e-9 * max(1.0, abs(v)))
    assert took == pytest.approx(lost, rel=1e-9, abs=1e-9)
    # the last round, at least; V sees the middle of all rounds
    one = 0.8 / max(abs(v1), 1e-300) * 2.0
    assert (
        pytest.approx(
            exact[2],
            abs=1e-9 + (0.8 * min((mu or 0.0) * min(one, t), 1.0) ** 2 if count > 2 else 0.0),
        )
        == V1
    )


@pytest.mark.parametrize("v", [29.0, -29.0])
@pytest.mark.parametrize("r", [1.0, 0.99])
def test_the_voltage_of_many_rounds_is_that_of_each_impact(v, r):
    """Dozens of impacts, amid which it moves towards the middle of the room, but for (mu T)^2 of a round."""
    exact, count, _ = one_by_one(0.1, v, 0.3, 1.0, 3.0, 0.3, r, 0.5, r)
    (_, _, V1), (_, _, impacts, _) = between(
        State(0.1, v, 0.3), 1.0, Coefficients(mu=3.0, gap=0.3, r=r, high=0.5, r_high=r)
    )
    assert impacts == count > 30
    assert pytest.approx(exact[2], abs=1e-3) == V1


@pytest.mark.parametrize("r", [1.0, 0.9, 1e-3, 0.0])
def test_a_gap_of_a_nanometre_costs_no_more(r):
    """1e8 impacts in a step: the law of the speed, L/v grows by (1/q - 1) t, and no time is spent on them."""
    (x1, v1, V1), (_, _, impacts, lost) = between(
        State(0.0, 1.0, 0.0), 0.1, Coefficients(mu=0.5, gap=0.0, r=r, high=1e-9, r_high=r)
    )
    assert 0.0 <= x1 <= 1e-9
    assert abs(V1) < 1e-9
    assert lost == pytest.approx(0.5 * (1.0 - v1 * v1))
    if r == 1.0:
        assert impacts == pytest.approx(1e8)
    elif r > 0.0:  # all legs but the first and the last: L (1/v1 - 1/v0) = (1/r - 1) t, to a leg
        assert 1e-9 / abs(v1) == pytest.approx((1.0 / r - 1.0) * 0.1, rel=1.0 / r - 1.0 + 1e-6)
    else:
        assert (v1, impacts) == (0.0, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [None, 0.2, 50.0])
@pytest.mark.parametrize("k, c", [(400.0, 4.0), (400.0, 0.0), (25.0, 9.0)])
@pytest.mark.parametrize(
    "y, v", [(0.05, -1.0), (-0.03, -0.5), (-0.03, 0.9), (0.0, -1e-9), (0.4, 1.0), (0.05, -0.3)]
)
def test_contact_is_the_equation(mu, k, c, y, v):
    """y, y', V against an ODE solver through a whole drift; the energy that the damping dissipated
    closes the balance."""
    t = 0.3
    gap = 0.7
    V = 0.4

    def rates(_, z):
        contact = -k * z[0] - c * z[1] if z[0] < 0.0 else 0.0
        return [z[1], contact, z[1] - (mu or 0.0) * z[2], c * z[1] ** 2 if z[0] < 0.0 else 0.0]

    def edge(_, z):
        return z[0]

    state = np.array([y, v, V, 0.0])
    now = 0.0
    edge.terminal = True
    while now < t:
        leg = solve_ivp(rates, (now, t), state, "DOP853", events=edge, rtol=1e-11, atol=1e-14)
        now = leg.t[-1]
        state = leg.y[:, -1].copy()
        if leg.status == 1:  # on with it, clearly on the other side
            state[0] = math.copysign(1e-15, state[1])
    (x1, v1, V1), (first, speed, impacts, lost) = in_contact(
        y, v, V, t, Coefficients(gap=gap, mu=mu, k=k, c=c)
    )
    assert (x1 + gap, v1, V1, lost) == pytest.approx(state, abs=1e-8)
    entered = y >= 0.0 and y + t * v < 0.0
    assert (speed, impacts) == ((-v, 1.0) if entered else (0.0, 0.0))
    assert first == pytest.approx(-y / v if entered else 0.0)


def test_contact_longer_than_a_step_goes_on_in_the_next():
    """A soft stop: one drift of length 1, and 100 drifts of 0.01 that begin and end in contact, are the same."""
    c = Coefficients(gap=0.0, mu=0.3, k=4.0, c=0.4)
    whole = in_contact(0.1, -1.0, 0.2, 1.0, c)
    x = 0.1
    v = -1.0
    V = 0.2
    took = 0.0
    for _ in range(100):
        (x, v, V), did = in_contact(x, v, V, 0.01, c)
        took += did[3]
    assert whole[0][0] < 0.0
    assert (x, v, V, took) == pytest.approx((*whole[0], whole[1][3]), abs=1e-12)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.5, 0.95])
def test_a_whole_contact_has_the_restitution_of_its_damping_ratio(zeta):
    """r = exp(-pi zeta/sqrt(1 - zeta^2)), at any stiffness, for steps however much longer."""
    r = math.exp(-math.pi * zeta / math.sqrt(1 - zeta * zeta))
    for k in (1e4, 1e12, 1e40):
        c = Coefficients(gap=0.0, mu=0.5, k=k, c=2.0 * zeta * math.sqrt(k))
        _, v, _ = in_contact(0.02, -1.0, 0.0, 0.2, c)[0]
        assert v == pytest.approx(r, rel=1e-11)


@pytest.mark.thorough("test_contact_is_the_equation")
def test_compliant_stop_becomes_rigid_at_the_rate_of_its_contact_time():
    """Damped, loaded mass on a stop of stiffness k and zeta = 0.1: |x - x_rigid| falls as k^(-1/2)."""
    zeta = 0.1
    r = math.exp(-math.pi * zeta / math.sqrt(1 - zeta * zeta))
    base = Equations(c1=-0.1, alpha=0.5, beta=0.3, mu=0.4, gap=0.2)
    start = (1.0, 0.0, 0.0)
    h = 0.002
    rigid = trace(changed(base, restitution=r), np.zeros(5000), h, 1, start)
    stiff = (1e3, 1e4, 1e5, 1e6)
    errors = []
    for k in stiff:
        soft = trace(
            changed(base, stop_stiffness=k, stop_damping=2 * zeta * math.sqrt(k)),
            np.zeros(5000),
            h,
            1,
            start,
        )
        errors.append(np.sqrt(np.mean((soft.samples[:, [2, 4]] - rigid.samples[:, [2, 4]]) ** 2)))
        assert len(soft.impacts) == len(rigid.impacts) >= 3
    assert np.polyfit(np.log(stiff), np.log(errors), 1)[0] == pytest.approx(-0.5, abs=0.05)
    assert errors[-1] < 3e-3


@pytest.mark.parametrize("k", [10.0, 1e4, 1e8, 1e12])
def test_no_stiffness_makes_a_step_unstable(k):
    """Steps of 0.1 against contacts of 0.3 down to 3e-6, with and without damping: the energy never grows."""
    for c in (0.0, 0.2 * math.sqrt(k)):
        eqs = Equations(c1=-0.01, stop_stiffness=k, stop_damping=c or None, gap=0.1)
        path = trace(eqs, np.zeros(100_000), 0.1, 1, (1.0, 0.0, 0.0))
        assert np.abs(path.samples[:, 2:4]).max() < 1.02
        assert np.abs(path.samples[-1000:, 2:4]).max() < 0.15


def sinusoids(gap, r, x0, times, room=math.inf, r_high=None):
    """x'' = -x from (x0, 0) with impacts at -gap, and at ``room``: exact, leg by leg; impacts as (time, speed)."""
    x = x0
    v = 0.0
    t = 0.0
    impacts = []
    out = np.empty((len(times), 2))
    while True:
        # x = A cos(s + phase)
        A = math.hypot(x, v)
        phase = math.atan2(-v, x)
        hits = []
        for wall, side in ((-gap, 1), (room, -1)):
            if abs(wall) < A:
                # where x' has the sign of -side
                s = (side * math.acos(wall / A) - phase) % (2 * math.pi)
                hits.append((s if s > 1e-9 else 2 * math.pi, wall))
        s, wall = min(hits, default=(math.inf, 0.0))
        here = (times > t) & (times <= t + s)
        out[here] = np.stack(
            [A * np.cos(times[here] - t + phase), -A * np.sin(times[here] - t + phase)], axis=1
        )
        if times[-1] <= t + s:
            return out, np.array(impacts)
        v1 = -A * math.sin(s + phase)
        t = t + s
        x = wall
        v = -(r if v1 < 0.0 else r_high) * v1
        impacts.append((t, -v1))


@pytest.mark.parametrize(
    "gap, r, room, r_high",
    [
        (0.4, 0.9, math.inf, None),
        (-0.2, 1.0, math.inf, None),
        (-0.2, 0.9, math.inf, None),
        (0.4, 0.9, 0.8, 0.7),
    ],
    ids=["distance", "preload", "preload, loses", "both sides"],
)
def test_linear_paths_are_sinusoids_between_impacts(gap, r, room, r_high):
    """x, x' of a path without noise against the closed form, of second order in h, impacts as well."""
    steps = (0.1, 0.05, 0.025, 0.0125)
    errors = []
    # the kernels of the next test
    eqs = Equations(restitution=r, gap=gap, beta=0.0, mu=1.0, c1=0.0)
    if r_high is not None:
        eqs = changed(eqs, opposite_gap=room, opposite_restitution=r_high)
    for h in steps:
        rows = []
        for x0 in (0.7, 0.72, 0.75, 0.79):
            path = trace(eqs, np.zeros(round(12.0 / h)), h, 1, (x0, 0.0, 0.0))
            exact, impacts = sinusoids(gap, r, x0, path.t, room, r_high)
            assert len(path.impacts) >= 3
            n = min(len(impacts), len(path.impacts))
            apart = abs(path.t[:, None] - impacts[:, 0]).min(axis=1) > 0.11
            rows.append(np.sqrt(np.mean((path.samples[:, 2:4] - exact)[apart] ** 2, axis=0)))
            assert path.impacts[:n] == pytest.approx(impacts[:n], abs=20 * h * h)
        errors.append(np.log(rows).mean(axis=0))
    for column in np.array(errors).T:
        assert np.polyfit(np.log(steps), column, 1)[0] > 1.8


@pytest.mark.parametrize("n1", [None, 0.01])
def test_a_stop_at_a_distance_of_zero_is_one_at_rest(n1):
    """The code for stops elsewhere does at gap 0 what the code for a stop at rest does; so does a far opposite stop."""
    base = changed(linear(1.25, 0.3, c=0.05), n1=n1, restitution=0.8)
    noise = np.random.default_rng(2).standard_normal(2000)
    paths = [
        trace(eqs, noise, 0.05, 1, (1.0, 0.0, 0.5))
        for eqs in (
            base,
            changed(base, gap=0.0),
            changed(base, gap=0.0, opposite_gap=50.0, opposite_restitution=0.5),
        )
    ]
    assert len(paths[0].impacts) > 4
    for path in paths[1:]:
        assert path.samples == pytest.approx(paths[0].samples, abs=1e-8)
        assert path.impacts == pytest.approx(paths[0].impacts, abs=1e-8)


@pytest.mark.parametrize("n1", [None, 0.05])
def test_both_stops_are_each_others_mirror_image(n1):
    """x -> -x with the gaps, restitutions and the quadratic spring exchanged: the same path, mirrored."""
    eqs = Equations(
        alpha2=0.3, alpha=0.2, beta=0.4, mu=0.5, c1=-0.02, n1=n1, gap=0.3, opposite_gap=0.5
    )
    a = changed(eqs, restitution=0.9, opposite_restitution=0.6)
    b = changed(
        eqs, alpha2=-0.3, gap=0.5, opposite_gap=0.3, restitution=0.6, opposite_restitution=0.9
    )
    noise = np.random.default_rng(3).standard_normal(800)
    one = trace(a, noise, 0.05, 1, (0.2, 0.7, 0.1))
    other = trace(b, -noise, 0.05, 1, (-0.2, -0.7, -0.1))
    assert (one.impacts[:, 1] > 0).any()
    assert (one.impacts[:, 1] < 0).any()
    assert one.samples == pytest.approx(-other.samples, abs=1e-9)
    assert one.impacts[:, 1] == pytest.approx(-other.impacts[:, 1], abs=1e-9)


@pytest.mark.parametrize("h", [0.5, 0.05, 0.005])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_preloaded_mass_chatters_to_rest_and_stays_until_it_is_freed(h, side):
    """r = 0.5, F = 0.3: chatter ends at the stop; V > 0 fades; a voltage that pulls harder than F frees the mass."""
    eqs = Equations(restitution=0.5, gap=-0.3, beta=1.0, mu=1.0)
    if side < 0.0:  # the same at the opposite stop
        eqs = changed(eqs, gap=5.0, opposite_gap=-0.3, opposite_restitution=0.5)
    path = trace(eqs, np.zeros(round(60.0 / h)), h, 1, (side * 0.5, 0.0, 0.0))
    assert (side * path.x >= 0.3 - 1e-15).all()
    assert path.x[-1] == side * 0.3
    assert path.v[-1] == 0.0
    stays = trace(eqs, np.zeros(round(1.0 / h)), h, 1, (side * 0.3, 0.0, side * -0.29))
    assert (stays.x == side * 0.3).all()
    assert len(stays.impacts) == 0
    leaves = trace(eqs, np.zeros(max(1, round(0.2 / h))), h, 1, (side * 0.3, 0.0, side * -0.5))
    assert (side * leaves.x > 0.3).all()


def test_preload_without_restitution():
    """r = 0: without noise the mass never comes off; with noise it does, and never passes the stop."""
    eqs = Equations(restitution=0.0, gap=-0.2, beta=0.3, mu=0.5, c1=-0.05)
    quiet = trace(eqs, np.zeros(1000), 0.05, 1, (0.8, 0.0, 0.0))
    assert len(quiet.impacts) == 1
    assert (quiet.x[quiet.t > quiet.impacts[0, 0] + 0.1] == 0.2).all()
    many = Trajectories(padded(changed(eqs, n1=0.01)), 256, SEED)
    burn_in(many)
    x, _, _ = many.snapshot()
    assert x.min() >= 0.2
    assert (x > 0.2).mean() > 0.5


@pytest.mark.thorough("test_contact_is_the_equation")
@pytest.mark.slow
@pytest.mark.parametrize("h", [0.5, 0.05])
@pytest.mark.parametrize("r", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("room", [1e-9, 1e-3, 0.1])
def test_between_two_stops_nothing_hangs_or_leaves(h, r, room):
    """However near the stops, and strong the noise and the voltage: inside, and finite."""
    eqs = changed(PAPER, n1=1.0, c1=-0.1, beta=2.0, restitution=r, gap=0.3, opposite_gap=room - 0.3)
    for r_high in (0.0, 1.0):
        many = Trajectories(changed(eqs, opposite_restitution=r_high), 64, SEED, h)
        moments = many.run(100 * h)
        x, _, _ = many.snapshot()
        assert -0.3 <= x.min() <= x.max() <= room - 0.3
        assert np.isfinite(moments.impacts).all()
        quiet = trace(
            changed(eqs, n1=None, n2=None, opposite_restitution=r_high),
            np.zeros(400),
            h,
            1,
            (-0.3, 3.0, 1.0),
        )
        assert np.isfinite(quiet.samples).all()
        assert -0.3 <= quiet.x.min() <= quiet.x.max() <= room - 0.3


@pytest.mark.thorough("test_a_preloaded_mass_chatters_to_rest_and_stays_until_it_is_freed")
@pytest.mark.slow
def test_grazing_is_one_impact():
    """Down to a speed of 1e-12 one event, rigid, compliant or between two stops."""
    eqs = Equations(n1=0.01, gap=0.5)
    for stop in (
        {"restitution": 0.96},
        {"restitution": 0.96, "opposite_gap": 1.0, "opposite_restitution": 0.9},
        {"stop_stiffness": 1e6, "stop_damping": 1e3 * 0.026},
    ):
        e = changed(eqs, **stop)
        s = State(-0.5 + 1e-14, -1e-12, 0.0)
        c = coefficients(e)._replace(mu=None, beta=None)
        (x, v, _), (first, speed, impacts, _) = move(s, interval(0.1, 0.1, None), c)
        assert (first, speed, impacts) == pytest.approx((0.01, 1e-12, 1.0), rel=0.01)
        assert v == pytest.approx(0.96e-12, rel=0.01)
        assert x >= -0.5


def test_a_start_behind_a_stop_is_refused():
    eqs = changed(PAPER, gap=0.2, opposite_gap=0.3, opposite_restitution=1.0)
    for x, line in (
        (-0.21, "at least -0.2, the place of the stop"),
        (0.31, "at most 0.3, the place of the opposite stop"),
    ):
        with pytest.raises(InputError, match=line):
            trace(eqs, np.zeros(4), 0.1, 1, (x, 0.0, 0.0))
        with pytest.raises(InputError, match=line):
            Trajectories(eqs, 64, SEED, 0.1, np.array([x, 0.0, 0.0]))


@pytest.mark.thorough("test_contact_is_the_equation")
@pytest.mark.slow
def test_compiled_and_interpreted_agree():
    for eqs in (
        changed(PAPER, n1=None, gap=0.2, opposite_gap=0.3, opposite_restitution=0.5),
        changed(PAPER, restitution=None, stop_stiffness=100.0, stop_damping=3.0),
        changed(PAPER, gap=-0.2),
    ):
        for x, v in ((0.25, 2.0), (0.25, -2.0), (0.25, 20.0), (0.2, 0.0)):
            s = State(x, v, 0.3)
            c = coefficients(eqs)._replace(c1=None, c2=None, c3=None, linear=-1.0, alpha2=0.2)
            arguments = s, interval(0.1, 0.1, eqs.mu), c
            for one, other in zip(move(*arguments), move.py_func(*arguments), strict=True):
                assert one == pytest.approx(other, rel=1e-12, abs=1e-15, nan_ok=True)
            arguments = s, 0.5, 0.1, c._replace(n2=None)
            assert kick_at_stops(*arguments) == pytest.approx(
                kick_at_stops.py_func(*arguments), rel=1e-12
            )
