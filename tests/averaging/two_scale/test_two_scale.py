"""Impact-aware averaging: cycles against closed forms, the law against Gibbs, E[V^2] against the coupled equations."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipk

import harvester as hv
from harvester.averaging.two_scale import densities
from harvester.averaging.two_scale.cycles import Orbits
from harvester.averaging.two_scale.law import solve, solve_many
from harvester.averaging.two_scale.second_order import stated_error
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError, UnboundedResponseError
from tests.support.coupled import coupled
from tests.support.systems import PAPER, PAPER_V2, changed, linear, linear_v2, scene

A = np.geomspace(1e-3, 1e3, 13)


def chi(m):
    """1 - 4 m coth(pi m/2)/(pi (1 + m^2)): what the stop leaves of the harmonic <V^2>."""
    return 1 - 4 * m / np.tanh(np.pi * m / 2) / (np.pi * (1 + m * m))


def settled_cycles(eqs, points=16, harmonics=4):
    orbits = Orbits(A, eqs, points, harmonics)
    for _ in range(8):
        orbits.refine(np.zeros_like(A))
    return orbits.averages()


@pytest.mark.parametrize("mu", [None, 1e-6, 1e-3, 0.05, 1.0, 2.1151, 30.0, 3000.0])
def test_voltage_with_a_stop_is_the_closed_form(mu):
    """A^2 chi(m)/(2 (1 + m^2)), <x> = 2 A/pi; without a load V is x less its mean."""
    cycle = settled_cycles(Equations(mu=mu, restitution=1.0))
    expected = chi(mu) / (2 * (1 + mu**2)) if mu else 0.5 - 4 / np.pi**2
    assert pytest.approx(A**2 * expected, rel=1e-6 if mu == 1e-6 else 1e-12) == cycle.V2
    assert cycle.period == pytest.approx(np.pi, rel=1e-13)
    assert cycle.x == pytest.approx(2 * A / np.pi, rel=1e-13)


@pytest.mark.parametrize("mu", [0.05, 1.0, 30.0])
def test_voltage_without_a_stop_is_the_harmonic_one(mu):
    cycle = settled_cycles(Equations(mu=mu))
    assert pytest.approx(A**2 / (2 * (1 + mu**2)), rel=1e-12) == cycle.V2
    assert (cycle.x == 0).all()


@pytest.mark.parametrize("alpha", [0.5, 100.0])
def test_period_of_the_hardening_spring(alpha):
    """T = 4 K(m)/sqrt(1 + alpha A^2), m = alpha A^2/(2 (1 + alpha A^2))."""
    q = 1 + alpha * A**2
    exact = 4 * ellipk(alpha * A**2 / (2 * q)) / np.sqrt(q)
    assert settled_cycles(Equations(alpha=alpha, mu=1.0)).period == pytest.approx(exact, rel=1e-10)
    assert settled_cycles(Equations(alpha=alpha, mu=1.0, restitution=1.0)).period == pytest.approx(
        exact / 2, rel=1e-10
    )


@pytest.mark.parametrize("beta", [0.05, 1.25, 10.0])
def test_frequency_of_the_open_circuit(beta):
    """sqrt(1 + beta), and the energy (1 + beta) A^2/2 shared equally."""
    cycle = settled_cycles(Equations(beta=beta, mu=1e-6))
    assert 2 * np.pi / cycle.period == pytest.approx(np.sqrt(1 + beta), rel=1e-9)
    assert cycle.energy == pytest.approx((1 + beta) * A**2 / 2, rel=1e-9)


@pytest.mark.parametrize("mu", [0.05, 1.0, 10.0])
@pytest.mark.parametrize("r", [None, 0.9])
def test_cycle_by_an_ode_solver(r, mu):
    """<V^2>, period and <x x'^2> of an orbit in a cubic spring by integrating V' + mu V = x' over it until periodic."""
    alpha, amplitude = 2.0, 1.3
    cycle = settled_cycles(Equations(alpha=alpha, mu=mu, restitution=r), 16, 6)
    at = np.argmin(abs(A - amplitude))
    amplitude = A[at]

    def flow(t, y):
        x, v, V, *_ = y
        return [v, -x - alpha * x**3, v - mu * V, V * V, x * x, v * v]

    period = cycle.period[at]
    start = (
        [amplitude, 0.0] if r is None else [0.0, np.sqrt(amplitude**2 + alpha / 2 * amplitude**4)]
    )

    def around(V):
        return solve_ivp(flow, (0, period), [*start, V, 0, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]

    # linear in V: the periodic one follows from two
    V = around(0.0)[2] / (1.0 - (around(1.0)[2] - around(0.0)[2]))
    end = around(V)
    assert end[2] == pytest.approx(V, abs=1e-9)
    assert abs(end[0] - start[0]) < 1e-6  # the period is the orbit's
    assert cycle.V2[at] == pytest.approx(end[3] / period, rel=2e-4)
    assert cycle.x2[at] == pytest.approx(end[4] / period, rel=1e-6)
    assert cycle.v2[at] == pytest.approx(end[5] / period, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.05, 1.0, 10.0])
def test_voltage_bends_the_orbit_with_a_stop(mu):
    """Strong coupling: Galerkin's voltage and the potential that it bends against finite differences in Phi."""
    beta = 0.5
    coarse = settled_cycles(Equations(beta=beta, mu=mu, restitution=1.0), 16, 4)
    fine = settled_cycles(Equations(beta=beta, mu=mu, restitution=1.0), 48, 12)
    for name in ("V2", "period", "wall", "energy", "x"):
        assert getattr(coarse, name) == pytest.approx(getattr(fine, name), rel=3e-3)
    # the same by plain finite differences in Phi, with the voltage stepped around the cycle until
    # periodic
    n = 4000
    phi = (np.arange(n) + 0.5) * np.pi / n - 0.5 * np.pi
    dphi = np.pi / n
    even = np.zeros(n)
    for _ in range(12):
        work = np.cumsum(even * np.sin(phi)) * dphi
        work = work - work[n // 2]
        nu = np.sqrt(1.0 + 2.0 * beta * work / np.sin(phi) ** 2)
        dt = dphi / nu
        decay = np.exp(-mu * dt)
        push = np.sin(phi) * nu * dt

        def around(value, decay=decay, push=push):
            V = np.empty(n)
            for i in range(n):
                V[i] = np.sqrt(decay[i]) * value - 0.5 * push[i]
                value = decay[i] * value - push[i] * np.sqrt(decay[i])
            return V, value

        # it ends where it begins: linear in the beginning
        V, _ = around(around(0.0)[1] / (1.0 - decay.prod()))
        even = 0.5 * (V + V[::-1])
    assert fine.V2[6] / A[6] ** 2 == pytest.approx((V**2 * dt).sum() / dt.sum(), rel=2e-3)
    assert fine.period[6] == pytest.approx(dt.sum(), rel=1e-3)


@pytest.mark.parametrize("r", [None, 1.0])
@pytest.mark.parametrize("alpha", [None, 2.0, 50.0])
def test_gibbs_moments(r, alpha):
    """beta = 0, r = 1: exp(-c H/N1), to 1e-4."""
    c, n1 = 0.05, 0.02
    law = solve(Equations(alpha=alpha, c1=-c, n1=n1, restitution=r, mu=1.0))
    weight = gibbs(alpha, c, n1)
    norm = quad(weight, 0, 20)[0]
    assert law.v2 == pytest.approx(n1 / c, rel=1e-4)
    assert law.x2 == pytest.approx(quad(lambda x: x * x * weight(x), 0, 20)[0] / norm, rel=1e-4)
    if r is not None:
        mean = law.mass @ Orbits(law.A, Equations(alpha=alpha, restitution=1.0)).averages().x
        assert mean == pytest.approx(quad(lambda x: x * weight(x), 0, 20)[0] / norm, rel=1e-4)
        # impacts: one a period, and p(0) <|x'|>/2 twice over by Rice, as motion is on one side only
        assert law.mass @ (1 / law.period) == pytest.approx(
            np.sqrt(n1 / (2 * np.pi * c)) / norm, rel=1e-4
        )


def gibbs(alpha, c, n1):
    return lambda x: np.exp(-c / n1 * (x**2 / 2 + (alpha or 0) * x**4 / 4))


@pytest.mark.parametrize(
    "law_of_f", [{"c3": 0.1}, {"c2": -0.2, "c1": -0.01}, {"c1": 0.02, "c3": 0.1}], ids=str
)
def test_nonlinear_damping_against_the_energy_law(law_of_f):
    """r = 1, beta = 0: p(E) ~ T(E) exp(-int <f v^2>/(N1 <v^2>) dE), by quadrature over harmonic orbits.

    <f v^2>/<v^2> = c3 A^4/8 - c2 A^2/4 - c1 and E = A^2/2, so E[A^2] follows.
    """
    n1 = 0.02
    law = solve(Equations(n1=n1, restitution=1.0, mu=1.0, **law_of_f))
    c1, c2, c3 = (law_of_f.get(name, 0.0) for name in ("c1", "c2", "c3"))
    work = lambda a2: (c3 * a2**3 / 24 - c2 * a2**2 / 8 - c1 * a2) / (2 * n1)  # noqa: E731
    weight = lambda a: a * np.exp(-work(a * a))  # noqa: E731
    a2 = quad(lambda a: a * a * weight(a), 0, 8)[0] / quad(weight, 0, 8)[0]
    assert law.x2 == pytest.approx(a2 / 2, rel=1e-4)


@pytest.mark.parametrize("mu", [0.05, 1.0, 5.0, 50.0])
@pytest.mark.parametrize("c", [0.05, 0.2])
def test_linear_scene_is_exact_where_lines_are_wide(mu, c):
    """Exact also if the published formula is 10 % off, at c = 0.2: the finite width of the line counts."""
    eqs = linear(0.02, mu, c)
    assert solve(eqs).mean_square_voltage == pytest.approx(linear_v2(eqs), rel=5e-3)


@pytest.mark.parametrize("mu", [0.01, 0.05, 0.3, 1.0, 3.0, 10.0])
def test_passive_voltage_with_a_stop(mu):
    """Exact for r = 1, beta = 0: fast and slow voltage together, at any load: within 0.5 % (mu = 10: 0.9 %)."""
    c, n1 = 0.05, 0.01
    wd = np.sqrt(1 - c * c / 4)

    def correlation(s):
        rho = np.exp(-c * s / 2) * (np.cos(wd * s) + c / (2 * wd) * np.sin(wd * s))
        return 2 * n1 / c / np.pi * (np.sqrt(np.maximum(1 - rho**2, 0)) + rho * np.arcsin(rho) - 1)

    edges = np.arange(0, 400, np.pi / 2 / max(1, mu))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    s = edges[:-1, None] + 0.5 * (edges[1] - edges[0]) * (1 + nodes)
    exact = (
        correlation(0.0)
        - mu * (0.5 * (edges[1] - edges[0]) * weights * np.exp(-mu * s) * correlation(s)).sum()
    )
    if mu == 0.05:
        assert exact == pytest.approx(0.055789, rel=1e-4)
    found = solve(Equations(c1=-c, mu=mu, n1=n1, restitution=1.0)).mean_square_voltage
    assert found == pytest.approx(exact, rel=0.009 if mu == 10.0 else 0.005)


def test_a_slow_load_sees_all_of_x():
    """mu -> 0, r = 1, beta = 0: E[V^2] -> Var(x), to 1e-3 of the exact Gibbs value."""
    c, n1 = 0.05, 0.01
    s2 = n1 / c
    found = solve(Equations(c1=-c, mu=1e-7, n1=n1, restitution=1.0)).mean_square_voltage
    assert found == pytest.approx(s2 * (1 - 2 / np.pi), rel=1e-3)


GOOD = [{"restitution": r} for r in (0.99, 0.96, 0.92, 0.9)] + [
    {"mu": mu} for mu in (0.01, 0.2, 1.0)
]
GOOD += [
    {"n1": 0.002},
    {"n1": 0.05},
    {"beta": 0.1},
    {"beta": 0.2},
    {"beta": 0.2, "mu": 0.3},
    {"n12": 0.007},
    {"restitution": None},
    {"alpha": 20.0},
]
PLATE = {"beta": 1.25, "mu": 1.0, "alpha": None, "n2": None, "c2": None, "c1": -0.008, "c3": None}
STRONG = [
    {"beta": 0.5, "mu": 0.3},
    {"beta": 1.0, "mu": 0.2},
    {"beta": 1.0, "mu": 1.0},
    PLATE,
    {"beta": 1.25, "mu": 3.0},
]
FAIR = [
    {"restitution": 0.85},
    {"restitution": 0.8},
    {"mu": 3.0},
    {"mu": 10.0},
    {"restitution": 0.8, "mu": 3.0},
]


@pytest.mark.statistics
@pytest.mark.parametrize(
    "changes, most", [(g, 0.01) for g in GOOD] + [(f, 0.025) for f in FAIR + STRONG], ids=str
)
def test_within_one_per_cent_of_the_coupled_equations(changes, most):
    """Paper's parameters: 1 % for r >= 0.9 and mu <= 1, 2.5 % elsewhere with r >= 0.8 and under strong coupling."""
    eqs = changed(PAPER, **changes)
    value, error = coupled(eqs)
    assert abs(solve(eqs).mean_square_voltage / value - 1) < most + 2 * error / value


@pytest.mark.statistics
@pytest.mark.parametrize(
    "changes",
    [
        {"restitution": 0.8},
        {"restitution": 0.6},
        {"beta": 0.5},
        {"beta": 1.0},
        {"beta": 1.0, "mu": 0.2},
        {"beta": 2.0},
    ],
    ids=str,
)
def test_stated_error_is_the_real_one(changes):
    """The true error is not above the stated one, and that is below 8 % here."""
    eqs = changed(PAPER, **changes)
    value, error = coupled(eqs)
    law = solve(eqs)
    true = abs(law.mean_square_voltage / value - 1)
    assert true < law.bias + 2 * error / value
    assert law.bias < 0.08


def random_scene(rng):
    """Bounded, r from 0.3 to 1, beta from 0.02 to 10, mu from 0.02 to 10, half of them with all further effects."""
    further = rng.random() < 0.5

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    return Equations(
        alpha=between(0.1, 5) if further else None,
        beta=between(0.02, 10),
        mu=between(0.02, 10),
        c1=-between(0.005, 0.2),
        c3=between(0.01, 0.2) if further else None,
        restitution=float(rng.uniform(0.3, 1.0)),
        n1=between(0.002, 0.05),
        n2=between(0.001, 0.02) if further else None,
    )


@pytest.mark.parametrize("mu", [0.05, 1.0])
def test_impacts_that_take_much_are_within_two_per_cent_of_the_density(mu):
    """At r = 0.3, where the correction of second order is 43 and 30 %: against the equation of the density."""
    impacts = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.02, mu=mu, D11=0.01, restitution=0.3))
    exact = hv.Density(within=0.002).run(impacts).mean_square_voltage
    assert exact.known_error95 < 1e-3 * exact.value
    assert hv.Averaged().run(impacts).mean_square_voltage.value == pytest.approx(
        exact.value, rel=0.02
    )


def test_a_piezo_that_holds_too_much_adds_the_whole_at_most():
    """Beyond q = 0.22 the stated error grows by a term that reaches 1, and grows no further by the impacts' loss."""
    without, half, much = stated_error(np.full(3, 0.5), np.array([0.22, 0.32, 2.0]), np.zeros(3))
    per_q = 0.2 * (1.0 + 0.5)
    assert half - without == pytest.approx(per_q * 0.1 + 8.0 * 0.1 * 0.6)
    assert much - without == pytest.approx(per_q * 1.78 + 1.0)


@pytest.mark.thorough("test_stated_error_is_the_real_one")
@pytest.mark.statistics
def test_stated_error_covers_random_scenes():
    """The error that the theory states of itself is not exceeded; 3 % for r >= 0.6 and beta <= 2."""
    rng = np.random.default_rng(11)
    shares = []
    for _ in range(11):
        eqs = random_scene(rng)
        value, error = coupled(eqs)
        law = solve(eqs)
        shares.append(abs(law.mean_square_voltage / value - 1) / law.bias)
        assert shares[-1] < 1 + 2 * error / value / law.bias, eqs
        if eqs.restitution >= 0.6 and eqs.beta <= 2:
            assert abs(law.mean_square_voltage / value - 1) < 0.03 + 2 * error / value, eqs
            assert law.bias < 0.1
    assert np.mean(shares) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "stop", [{}, {"restitution": 0.9, "gap": 3.0}], ids=["none", "out of reach"]
)
def test_stated_error_covers_linear_scenes(stop):
    """54 of 620 random scenes were off by more than they stated, 8 % with 0.4 and 13 % with 0.6
    (the first two here)."""
    rng = np.random.default_rng(1)
    drawn = 10 ** rng.uniform((-2, -2, -3), (1, 1.3, -0.5), (60, 3)) * (1.0, 1.0, -1.0)
    hard = [
        (0.423, 1.285, 0.1711),
        (5.006, 0.013, 0.0071),
        (9.933, 0.073, -0.1961),
        (4.579, 5.724, 0.3312),
    ]
    for beta, mu, c1 in [*hard, *drawn]:
        # of x
        reach = 6.5 * linear_v2(linear(beta, mu, c=-c1)) ** 0.5 * (1.0 + mu * mu - c1 * mu) ** 0.5
        table = stop | ({"gap": reach} if stop else {})
        try:
            found = (
                hv.Averaged()
                .run(scene(changed(linear(beta, mu, c=-c1), **table)))
                .mean_square_voltage
            )
        except UnboundedResponseError:
            # one of the widest orbits that are searched has too little load
            assert stop and c1 > 0.0
            continue
        assert abs(found.value - linear_v2(linear(beta, mu, c=-c1))) < found.model, (beta, mu, c1)


@pytest.mark.parametrize(
    "changes",
    [
        {"alpha": 1e6},
        {"n1": 1e-12, "n2": None},
        {"mu": 1e4},
        {"mu": None},
        {"beta": None},
        {"restitution": 0.0},
        {"beta": 10.0},
    ],
    ids=str,
)
def test_extreme_scenes_have_an_answer(changes):
    law = solve(changed(PAPER, **changes))
    assert np.isfinite([law.mean_square_voltage, law.bias, law.x2, law.v2]).all()
    assert law.mean_square_voltage > 0


GRID = [{"mu": mu} for mu in (1e-3, 0.05, 1.0, 30.0)] + [
    {"beta": 1.0},
    {"beta": None},
    {"restitution": None},
]
GRID += [{"restitution": r} for r in (0.0, 0.8, 1.0)] + [
    {"n1": None},
    {"c3": None},
    {"mu": None},
    {"alpha": 1e6},
]


def test_many_scenes_at_once_are_each_alone():
    """A grid with different effects, scales and failures equals each scene's answer by itself, to rounding."""
    scenes = [changed(PAPER, **changes) for changes in GRID]
    for eqs, answer in zip(scenes, solve_many(scenes), strict=True):
        try:
            alone = solve(eqs)
        except SimulationError as error:
            assert type(answer) is type(error)
            assert str(answer) == str(error)
        else:
            for name in ("mean_square_voltage", "fast", "slow", "x2", "v2", "bias"):
                assert getattr(answer, name) == pytest.approx(
                    getattr(alone, name), rel=1e-9, abs=1e-300
                ), name
    assert solve_many([]) == []


def test_named_errors():
    with pytest.raises(SimulationError, match="external noise"):
        solve(changed(PAPER, n1=None))
    with pytest.raises(UnboundedResponseError):
        solve(changed(PAPER, c3=None))


def test_engine():
    answer = hv.Averaged().run(scene(PAPER))
    assert answer.mean_square_voltage.value == pytest.approx(PAPER_V2[0], rel=0.01)
    assert answer.mean_square_voltage.stderr is None
    assert not answer.warnings
    assert "(model, estimated)" in str(answer)
    assert "doubtful" in str(hv.Averaged().run(scene(changed(PAPER, restitution=0.5))).warnings[0])
    assert "below 0.3" in str(
        hv.Averaged().run(scene(changed(PAPER, restitution=0.25))).warnings[1]
    )


@pytest.mark.slow
@pytest.mark.parametrize("r", [None, 1.0])
@pytest.mark.parametrize("alpha", [None, 2.0, 1e6])
def test_densities_of_the_gibbs_law(r, alpha):
    """beta = 0, r = 1: p(x, x') = exp(-c H/N1)/Z to 1e-3, and its marginals."""
    c, n1 = 0.05, 0.02
    law = solve(Equations(alpha=alpha, c1=-c, n1=n1, restitution=r, mu=1.0))
    stop = r is not None
    weight = gibbs(alpha, c, n1)
    speed = np.sqrt(n1 / c)
    size = min(speed, (n1 / c / (alpha or 1e-9)) ** 0.25)
    x = np.linspace(0.02, 2.5, 9) * size
    v = np.linspace(-2.5, 2.5, 8) * speed
    p_x = weight(x) / quad(weight, 0 if stop else -9 * size, 9 * size, epsabs=1e-14)[0]
    p_v = np.exp(-(v**2) / (2 * speed**2)) / (np.sqrt(2 * np.pi) * speed)
    assert densities.state_density(x, v, law, stop) == pytest.approx(p_x[:, None] * p_v, rel=1e-3)
    assert densities.displacement_density(x, law, stop) == pytest.approx(p_x, rel=1e-3)
    assert densities.velocity_density(v, law, stop) == pytest.approx(p_v, rel=1e-3)
    assert densities.displacement_density(-x, law, stop) == pytest.approx(
        0.0 * p_x if stop else p_x, rel=1e-3
    )
    if alpha is None:
        per_energy = np.exp(-c * x**2 / (2 * n1)) * x * c / n1
        assert densities.amplitude_density(x, law) == pytest.approx(per_energy, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"beta": 0.3},
        {"restitution": None},
        {"n1": 1e-12, "n2": None},
        {"c1": 0.1},
        {"alpha": 1e6},
    ],
    ids=str,
)
def test_densities_integrate_to_the_moments(changes):
    """One, E[x^2] and E[x'^2], also if the voltage bends the orbits."""
    eqs = changed(PAPER, **changes)
    law = solve(eqs)
    stop = eqs.restitution is not None
    x = law.A[-1] * np.linspace(0 if stop else -1, 1, 201)
    v = law.A[-1] * law.nu[-1].max() * np.linspace(-1.3, 1.3, 801)
    for values, p, square in (
        (x, densities.displacement_density(x, law, stop), law.x2),
        (v, densities.velocity_density(v, law, stop), law.v2),
    ):
        assert np.trapezoid(p, values) == pytest.approx(1.0, rel=2e-3)
        assert np.trapezoid(p * values**2, values) == pytest.approx(square, rel=2e-3)


def test_densities_refuse_orbits_that_cross():
    law = solve(changed(PAPER, beta=1.0))
    with pytest.raises(SimulationError, match="orbits cross"):
        densities.displacement_density(np.array([0.1]), law, True)
