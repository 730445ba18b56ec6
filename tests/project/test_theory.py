"""The equations of docs/theory.md, its pages and docs/lockstep.md, written again and compared with the engines.

Each numbered equation of these pages is named by a test here (`checks`), or the last test fails.
"""

import re
from functools import cache

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad, simpson
from scipy.linalg import expm, solve_banded
from scipy.optimize import brentq, minimize_scalar

import harvester as hv
from harvester.averaging.kramers import hopping_rates
from harvester.averaging.published import ito, orbit, stationary
from harvester.averaging.stability import averaged_exponent as stability
from harvester.averaging.stability import power_law_tail as tail
from harvester.averaging.two_scale.cycles import Orbits, quarter
from harvester.averaging.two_scale.law import solve
from harvester.equations.coefficients import Equations
from harvester.equations.impact_order import impact_order
from harvester.equations.power_bound import power_bound
from harvester.equations.problem import Problem
from harvester.equations.scales import scales
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.hopping import Hopping
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.trace import trace
from harvester.records.records import Record
from tests.support.pages import theory_pages
from tests.support.paper import simple_exponent
from tests.support.paths import ROOT
from tests.support.systems import PAPER, changed, linear_v2
from tests.support.to_scene import equations, physical

CHECKED = set()


def checks(*labels):
    """The test compares these equations of the pages."""
    CHECKED.update(labels)
    return lambda test: test


def coefficients(eqs):
    return tuple(
        getattr(eqs, name) or 0.0
        for name in ("alpha", "beta", "mu", "c1", "c2", "c3", "n1", "n2", "n12")
    )


@checks("numbers", "noise", "components")
def test_components_to_numbers_and_back():
    M = 0.022
    k = 40.0
    k3 = 3e5
    b1 = 0.1
    b2 = 5.0
    b4 = 2e6
    theta = 4.57e-3
    Cp = 43e-9
    R = 2e5
    G = 0.3
    scene = hv.Scene(
        oscillator=hv.Oscillator(
            mass=M, stiffness=k, cubic_stiffness=k3, damping=b1, damping_x2=b2, damping_x4=b4
        ),
        piezo=hv.Piezo(coupling=theta, capacitance=Cp),
        excitation=hv.Excitation(acceleration_psd=G),
        load=hv.Load(resistance=R),
    )
    e, s = equations(scene), scales(scene)
    w0 = np.sqrt(k / M)
    length = np.sqrt(G / (4 * w0**3))
    assert (s.length, e.n1) == pytest.approx((length, 1.0), rel=1e-12)
    assert (e.beta, e.mu) == pytest.approx((theta**2 / (k * Cp), 1 / (R * Cp * w0)), rel=1e-12)
    cubic = k3 * length**2 / k
    damping = -b1 / (M * w0), -b2 * length**2 / (M * w0), b4 * length**4 / (M * w0)
    assert (e.alpha, e.c1, e.c2, e.c3) == pytest.approx((cubic, *damping), rel=1e-12)
    assert s.watts == pytest.approx(M * w0**3 * length**2, rel=1e-12)
    assert equations(scene, 3e-3).n1 == pytest.approx(G / (4 * 3e-3**2 * w0**3), rel=1e-12)
    V = 1.7  # v^2/R of the same voltage
    assert (s.volts * V) ** 2 / R == pytest.approx(s.watts * e.beta * e.mu * V**2, rel=1e-12)
    back = physical(e, s)
    assert back.piezo.coupling == pytest.approx(np.sqrt(e.beta * k * Cp), rel=1e-12)
    assert back.load.resistance == pytest.approx(1 / (e.mu * Cp * w0), rel=1e-12)
    # open and short circuit
    flow = [np.array([[0, 1, 0], [-1, 0, -e.beta], [0, 1, -mu]]) for mu in (0.0, 1e9)]
    open_, short = (np.abs(np.linalg.eigvals(one).imag).max() for one in flow)
    assert (open_ / short) ** 2 - 1 == pytest.approx(e.beta, rel=1e-6)


@pytest.mark.statistics
@checks("identities", "balance")
@pytest.mark.parametrize("beta, mu, harvested", [(0.05, 0.05, 0.01), (1.25, 1.0, 0.9)])
def test_stationary_identities(beta, mu, harvested):
    """Monte Carlo with a stop, a cubic spring and both noises; the load draws little of the power, or most of it."""
    eqs = changed(PAPER, beta=beta, mu=mu)
    many = Trajectories(eqs, 2048, np.random.SeedSequence(5), 0.05)
    burn_in(many)
    m = many.run(1600.0)
    given = eqs.n1 + eqs.n2 * m.x2
    taken = m.damped + beta * mu * m.V2 + m.impact_loss
    assert (beta * mu * m.V2).mean() > harvested * given.mean()
    assert m.balance(eqs) == pytest.approx((given - taken) / given.mean(), rel=1e-9, abs=1e-12)
    for values in (m.V, m.xV - m.V2, m.vV - mu * m.V2, given - taken):
        assert (
            abs(values.mean()) < 4 * values.std(ddof=1) / np.sqrt(len(values)) + 2e-3 * m.V2.mean()
        )


@checks("decoupled", "omega", "drift", "diffusion", "noisemean")
@pytest.mark.parametrize("r", [None, 0.9])
def test_published_averaging(r):
    eqs = changed(PAPER, alpha=0.7, beta=0.4, mu=0.6, n12=0.004, restitution=r)
    alpha, beta, mu, c1, c2, c3, n1, n2, n12 = coefficients(eqs)
    n12 = 0.0 if r is None else n12

    def parts(A):
        s = 1 + 0.75 * alpha * A**2
        w2 = 0.5 * (s + beta - mu**2 + np.sqrt((s + beta - mu**2) ** 2 + 4 * mu**2 * s))
        C, K = beta * mu / (mu**2 + w2), beta * w2 / (mu**2 + w2)
        return w2, C, 1 + K, 1 + K + alpha * A**2

    def diffusion(A):
        _, _, k, Q = parts(A)
        cubic = alpha * A**2
        external = n1 * (k + 5 / 8 * cubic)
        parametric = n2 * A**2 / 4 * (k + 3 / 4 * cubic)
        return (external + parametric + 8 / (3 * np.pi) * n12 * A * (k + 7 / 10 * cubic)) / Q**2

    A = np.geomspace(0.05, 4.0, 9)
    w2, C, k, Q = parts(A)
    cubic = alpha * A**2
    noise = (
        n1 * (k + 3 / 4 * cubic)
        + n2 * A**2 * (k / 2 + 7 / 16 * cubic)
        + 4 / np.pi * n12 * A * (k + 5 / 6 * cubic)
    )
    slope = (diffusion(A * 1.00001) - diffusion(A * 0.99999)) / (2e-5 * A)
    b = -c3 * (16 * A**5 * k + 13 * alpha * A**7) / 256 + c2 * (
        A**3 * k / 8 + 3 / 32 * alpha * A**5
    )
    b += (c1 - C) * (8 * A * k + 5 * alpha * A**3) / 16
    if r is not None:
        b -= (1 - r) / np.pi * A * (k + cubic / 2) ** 1.5
    b = b / Q + slope / 4 + noise / (2 * A * Q**2)
    assert ito.drift(A, eqs) == pytest.approx(b, rel=1e-7)
    assert sum(ito.diffusion(A, eqs)) == pytest.approx(diffusion(A), rel=1e-12)
    assert orbit.omega2(A, alpha, beta, mu) == pytest.approx(w2, rel=1e-12)
    assert orbit.decoupled(A, 0.3 * A, w2, mu) == pytest.approx(
        (w2 * A + mu * 0.3 * A) / (mu**2 + w2), rel=1e-12
    )


@checks("mostwhite", "mostdamped", "moststroke")
def test_the_most_that_a_device_can_take():
    """On the path of a driven mass between stops each step of the derivation holds, and the bound is the least one."""
    F = 0.7
    W = 1.1
    c = 0.08
    D = 0.4
    table = {"c1": -c, "beta": 0.3, "mu": 0.8, "drive": F, "drive_frequency": W}
    table |= {"restitution": 0.7, "gap": D, "opposite_restitution": 0.7}
    eqs = equations(hv.Scene(nondimensional=hv.Nondimensional(**table, opposite_gap=D)))
    h = 2 * np.pi / W / 4096
    path = trace(eqs, np.zeros(4096 * 200), h)
    last = slice(-4096 * 100, None)
    a = F * np.cos(W * h * np.arange(1, 4096 * 200 + 1))[last]
    x = path.x[last]
    v = np.gradient(path.x, h)[last]
    given = np.mean(a * v)
    taken = c * np.mean(v**2)
    stroke = D * np.mean(np.abs(np.gradient(a, h)))
    damped = np.mean(a**2) / (4 * c)
    assert given == pytest.approx(-np.mean(np.gradient(a, h) * x), rel=0.02)
    assert 0.3 * 0.8 * np.mean(path.V[last] ** 2) < given - taken < min(damped, stroke)
    assert (damped, stroke) == pytest.approx((F**2 / (8 * c), 2 / np.pi * D * F * W), rel=1e-5)

    def most(**changes):
        return power_bound(
            Problem.of(hv.Scene(nondimensional=hv.Nondimensional(**table | changes)))
        ).value

    assert most(opposite_gap=D) == pytest.approx(min(damped, stroke), rel=1e-5)
    assert most(opposite_gap=10.0) == pytest.approx(damped, rel=1e-5)
    assert most(opposite_gap=D, D11=0.2) == pytest.approx(0.2 + min(damped, stroke), rel=1e-5)
    assert most(opposite_gap=D, D11=0.2, drive=None, drive_frequency=None) == pytest.approx(0.2)


@checks("published")
def test_published_power():
    """The density and the mean square voltage from the page's integrals, over amplitudes and over the phase."""
    alpha, beta, mu, *_ = coefficients(PAPER)
    u = np.linspace(np.log(1e-4), np.log(12.0), 4001)
    A = np.exp(u)
    diffusion = sum(ito.diffusion(A, PAPER))
    log_p = cumulative_simpson(2 * ito.drift(A, PAPER) / diffusion * A, x=u, initial=0.0) - np.log(
        diffusion
    )
    p = np.exp(log_p - log_p.max())
    w2 = orbit.omega2(A, alpha, beta, mu)
    k = 1 + orbit.K(A, alpha, beta, mu)
    phi = (np.arange(64) + 0.5) * np.pi / 64
    nu2 = (k + 0.75 * alpha * A**2)[:, None] + 0.25 * (alpha * A**2)[:, None] * np.cos(2 * phi)
    weight = nu2**-0.5 / (nu2**-0.5).sum(axis=1, keepdims=True)
    x2 = A**2 * (weight * np.cos(phi) ** 2).sum(axis=1)
    v2 = A**2 * (weight * nu2 * np.sin(phi) ** 2).sum(axis=1)
    on_orbit = (w2**2 * x2 + mu**2 * v2) / (mu**2 + w2) ** 2
    mean = simpson(p * A * on_orbit, x=u) / simpson(p * A, x=u)
    assert stationary.mean_square_voltage(PAPER) == pytest.approx(mean, rel=1e-5)
    assert hv.Published().run(
        hv.load(ROOT / "examples/paper_figure3.toml")
    ).mean_power.value == pytest.approx(
        beta
        * mu
        * stationary.mean_square_voltage(equations(hv.load(ROOT / "examples/paper_figure3.toml"))),
        rel=1e-12,
    )


def chi(m):
    return 1 - 4 * m / np.tanh(np.pi * m / 2) / (np.pi * (1 + m * m))


@checks("orbit", "chi", "matched")
@pytest.mark.parametrize("m", [0.05, 1.0, 2.115, 8.0])
def test_voltage_of_a_linear_orbit(m):
    """Solves V' + m V = x', is periodic, has no mean, and its square is the package's."""
    tau = np.linspace(-np.pi / 2, np.pi / 2, 20001)
    V = (np.cos(tau) - m * np.sin(tau) - m * np.exp(-m * tau) / np.sinh(np.pi * m / 2)) / (1 + m**2)
    assert np.gradient(V, tau, edge_order=2) + m * V == pytest.approx(-np.sin(tau), abs=1e-4)
    assert V[0] == pytest.approx(V[-1], abs=1e-12)
    assert simpson(V, x=tau) == pytest.approx(0.0, abs=1e-9)
    square = chi(m) / (2 * (1 + m**2))
    assert simpson(V**2, x=tau) / np.pi == pytest.approx(square, rel=1e-8)
    (found,) = Orbits(np.ones(1), Equations(mu=m, restitution=1.0)).averages().V2
    assert found == pytest.approx(square, rel=1e-10)
    best = minimize_scalar(
        lambda m: -m * chi(m) / (1 + m**2), bounds=(0.5, 5.0), options={"xatol": 1e-8}
    ).x
    assert best == pytest.approx(2.115, abs=5e-4)
    assert (
        1 / chi(1e-6)
        == pytest.approx(1 / (1 - 8 / np.pi**2), rel=1e-5)
        == pytest.approx(5.3, abs=0.05)
    )


def by_differences(phi, nu, mu, stop):
    """P of p'' - mu^2 p = -sin Phi nu with P'(tau) = 0 (no stop) or P(tau) = 0, on a fine grid, and dP/dt."""
    h = phi[1] - phi[0]
    between = 0.5 * (nu[1:] + nu[:-1])
    diagonal = np.zeros(len(phi))
    off = -between / h
    diagonal[:-1] += between / h
    diagonal[1:] += between / h
    load = np.sin(phi) * h
    mass = mu**2 * h / nu
    mass[-1] *= 0.5
    load[-1] *= 0.5
    keep = slice(1, -1 if stop else None)
    bands = np.zeros((3, len(phi[keep])))
    bands[0, 1:] = bands[2, :-1] = off[1 : 1 + len(phi[keep]) - 1]
    bands[1] = (diagonal + mass)[keep]
    P = np.zeros(len(phi))
    P[keep] = solve_banded((1, 1), bands, load[keep])
    return P, nu * np.gradient(P, phi, edge_order=2)


@cache
def orbits_of(stop):
    """A law of the package, its orbits on a fine grid of Phi, and p, dp/dt there: for the equations below."""
    eqs = changed(PAPER, beta=0.3 if stop else 0.1, mu=0.4, restitution=0.9 if stop else None)
    law = solve(eqs)
    phi = np.linspace(0.0, np.pi / 2, 1201)
    to_grid = np.polynomial.legendre.legvander(4 * phi / np.pi - 1, 15) @ np.linalg.inv(
        np.polynomial.legendre.legvander(4 * quarter(16, 4).phi / np.pi - 1, 15)
    )
    nu = law.nu @ to_grid.T
    p, slope = zip(*(by_differences(phi, one, eqs.mu, stop) for one in nu), strict=True)
    return eqs, law, phi, nu, np.array(p), np.array(slope)


def averages(eqs, law, phi, nu, p, slope, stop):
    """The page's integrals over each orbit in time: everything that b and sigma are made of."""
    alpha, _, mu, c1, c2, c3, *_ = coefficients(eqs)
    A = law.A[:, None]
    x = A * np.cos(phi)
    v = -A * np.sin(phi) * nu
    tau = simpson(1 / nu, x=phi)

    def mean(values):
        return simpson(values / nu, x=phi) / tau

    # the two parts of V = A (p' - mu p) are even and odd
    V2 = A[:, 0] ** 2 * mean(slope**2 + (mu * p) ** 2)
    return {
        "T": (2 if stop else 4) * tau,
        "x": mean(x) if stop else 0.0 * tau,
        "x2": mean(x**2),
        "v2": mean(v**2),
        "x2v2": mean((x * v) ** 2),
        "damped": mean((c3 * x**4 - c2 * x**2 - c1) * v**2),
        "V2": V2,
        "spring": mean(x**2 + 0.5 * alpha * x**4),
        "wall": 0.5 * v[:, -1] ** 2,
        "tau": tau,
    }


@checks("bvp", "vsquare")
@pytest.mark.parametrize("stop", [False, True])
def test_cycle(stop):
    """<V^2> of V = A (p' - mu p) is that of P less the stop's term, and that of the package."""
    eqs, law, phi, nu, p, slope = orbits_of(stop)
    at = int(law.mass.argmax())
    found = averages(eqs, law, phi, nu, p, slope, stop)
    free, _ = by_differences(phi, nu[at], eqs.mu, False)
    tau = found["tau"][at]
    square = (
        simpson(np.sin(phi) * free, x=phi) - stop * eqs.mu / np.tanh(eqs.mu * tau) * free[-1] ** 2
    )
    assert law.A[at] ** 2 * square / tau == pytest.approx(found["V2"][at], rel=1e-4)
    fast = (law.mass * found["V2"]).sum()
    assert fast * widths(eqs, law, found, stop) == pytest.approx(law.fast, rel=2e-3)


def widths(eqs, law, found, stop):
    """The factor of the lines' widths, from the page's c and w."""
    _, beta, mu, *_, n1, n2, _ = coefficients(eqs)

    def mean(values):
        return (law.mass * values).sum()

    _, Vs2, _ = slow_voltage(eqs, law, found, stop)
    lost = n1 + n2 * mean(found["x2"]) - beta * mu * (mean(found["V2"]) + mean(Vs2))
    c = max(lost, 0.0) / mean(found["v2"])
    w = (1 if stop else 2) * np.pi / mean(found["T"])
    n = np.arange(2.0, 60.0, 2.0) if stop else np.ones(1)
    s = n**2 / (n**2 - 1) ** 2 if stop else np.ones(1)
    whole = s / (n**2 * w**2 + mu**2 + n * c * mu)
    return whole.sum() / (s / (n**2 * w**2 + mu**2)).sum()


def slow_voltage(eqs, law, found, stop):
    """(mean, E[V_s^2]'s integrand, S) at each energy, with the generator on a grid of energies by finite volumes."""
    _, _, mu, *_, n1, n2, _ = coefficients(eqs)
    xt = found["x"] - (law.mass * found["x"]).sum()
    if not stop:
        return xt, xt, xt
    E = energy(eqs, law, found, 0.0)
    for _ in range(4):  # the energy holds the slow voltage
        sigma2 = 2 * n1 * found["v2"] + 2 * n2 * found["x2v2"]
        # L is symmetric in the law: current p sigma^2/2 dy/dE between neighbours
        dE = np.diff(E)
        density = law.mass / np.gradient(E)
        flow = 0.5 * np.sqrt((density * sigma2)[1:] * (density * sigma2)[:-1]) / dE
        L = np.zeros((len(E), len(E)))
        for i, j in enumerate(flow):
            L[i, i] -= j
            L[i + 1, i + 1] -= j
            L[i, i + 1] += j
            L[i + 1, i] += j
        y1 = np.linalg.solve(np.diag(mu * law.mass) - L, law.mass * mu * xt)
        y2 = np.linalg.solve(np.diag(2 * mu * law.mass) - L, law.mass * 2 * mu * xt * y1)
        mean = xt - y1
        E = energy(eqs, law, found, np.maximum(mean, -0.3 * law.A / eqs.beta))
    square = xt**2 - 2 * xt * y1 + y2
    return mean, xt * mean, square / (1 + (mu * found["T"] / (2 * np.pi)) ** 2)


def energy(eqs, law, found, offset):
    return 0.5 * (found["v2"] + found["spring"] + eqs.beta * (found["V2"] + offset**2))


@checks("grazing")
def test_order_of_the_step_beside_a_stop():
    for r in (0.05, 0.1, 0.37, 0.7):
        a = 2.0 * (impact_order(r) - 1.0)
        assert 2.0 * r**a * np.cos(np.pi * (1.0 - a) / 3.0) == pytest.approx(1.0, rel=1e-9)
        assert abs(a) > 1e-3
    assert (impact_order(0.0), impact_order(0.5), impact_order(1.0)) == pytest.approx(
        (0.75, 1.5, 2.0), abs=1e-9
    )


@checks(
    "bend",
    "energy",
    "edrift",
    "edensity",
    "resolvent",
    "slow",
    "widths",
    "sum",
    "small",
    "second",
    "bias",
)
@pytest.mark.parametrize("stop", [False, True])
def test_two_scales(stop):
    """From the package's orbits nu(A, Phi) alone: the bent orbit itself, the law, both voltages, the stated error."""
    eqs, law, phi, nu, p, slope = orbits_of(stop)
    alpha, beta, mu, *_, n1, n2, _ = coefficients(eqs)
    found = averages(eqs, law, phi, nu, p, slope, stop)
    likely = law.mass > 0.02 * law.mass.max()

    mean, slow, paid = slow_voltage(eqs, law, found, stop)
    pushed = (
        np.maximum(mean, -0.3 * law.A / beta)[:, None] * (1 - np.cos(phi)) / law.A[:, None]
        if stop
        else 0.0
    )
    work = cumulative_simpson(slope * np.sin(phi), x=phi, initial=0.0) + pushed
    with np.errstate(invalid="ignore"):
        bent = (
            1
            + 0.5 * alpha * law.A[:, None] ** 2 * (1 + np.cos(phi) ** 2)
            + 2 * beta * work / np.sin(phi) ** 2
        )
    inside = slice(40, None)
    assert nu[likely, inside] ** 2 == pytest.approx(bent[likely, inside], rel=5e-3, abs=3e-3)

    E = energy(eqs, law, found, pushed[:, -1] * law.A if stop else 0.0)
    b = -found["damped"] - beta * mu * (found["V2"] + paid) + n1 + n2 * found["x2"]
    r2 = (eqs.restitution or 1.0) ** 2
    b = b - 2 * (1 - r2) / (1 + r2) * found["wall"] / found["T"]
    sigma2 = 2 * n1 * found["v2"] + 2 * n2 * found["x2v2"]
    log_p = (
        cumulative_simpson(2 * b / sigma2, x=E, initial=0.0)
        - np.log(sigma2)
        + np.log(np.gradient(E))
    )
    mass = np.exp(log_p - log_p.max())
    mass /= mass.sum()
    assert mass[likely] == pytest.approx(law.mass[likely], rel=0.04)

    def whole(values):
        return (law.mass * values).sum()

    w = (1 if stop else 2) * np.pi / whole(found["T"])
    slow = whole(slow) / (1 + (mu / (2 * w)) ** 2) if stop else 0.0
    fast = whole(found["V2"]) * widths(eqs, law, found, stop)

    T = whole(found["T"])
    energy_mean = whole(E)
    power_in = n1 + n2 * whole(found["x2"])
    e = power_in * T / energy_mean
    i = 2 * (1 - r2) / (1 + r2) * whole(found["wall"] / found["T"]) * T / energy_mean
    q = 0.5 * beta * (fast + slow) / energy_mean
    o = e - i - beta * mu * (fast + slow) * T / energy_mean
    assert (law.exchange, law.impact_loss, law.stored) == pytest.approx(
        (e, i if stop else 0.0, q), rel=3e-3
    )
    if stop:
        k = (0.056 + 0.077 / (1 + mu / w)) * i**2 - 0.11 * q * (1 + 3 * i) / (1 + (q / 0.2) ** 4)
        beyond = min(8 * max(q - 0.22, 0) * (i + 0.1), 1)
        bias = (
            0.005
            + 0.03 * i
            + 0.02 * i**2
            + 0.01 * min(max(o, 0.0), 1.5) ** 2
            + 0.2 * q * (1 + i)
            + beyond
        )
        bias *= 1 + max(-o, 0.0) / e
    else:
        k = 0.0
        bias = 0.002 + 0.01 * min(e, 1) + 0.01 * q
    assert law.bias == pytest.approx(bias, rel=5e-3)
    assert law.slow == pytest.approx(slow, rel=1e-2, abs=1e-12)
    assert law.mean_square_voltage == pytest.approx(np.exp(k) * (fast + slow), rel=3e-3)


@pytest.mark.slow
@checks("martingale", "boundary", "controlled")
def test_control_variates():
    """Own paths of a linear device with a stop: both kinds of sums have mean zero, and leave little of the variance."""
    rng = np.random.default_rng(5)
    paths = 4096
    step = 0.1
    n = 0.01
    c = 0.1
    mu = 0.5
    beta = 0.1
    r = 0.9
    x, v, V = np.zeros((3, paths))

    def drift(x, v, V, h):
        v = v - h * (x + c * v + beta * V)
        new = x + h * v
        hit = new < 0.0
        return (
            np.abs(new),
            np.where(hit, -r * v, v),
            (V + np.where(hit, np.abs(new) - x, h * v)) * np.exp(-mu * h),
        )

    def ends():
        E = 0.5 * (v**2 + x**2)
        return np.array([E, np.sqrt(E), E**2, x * v])

    for _ in range(1500):
        x, v, V = drift(x, v + np.sqrt(2 * n * step) * rng.standard_normal(paths), V, step)
    begin = ends()
    sums = np.zeros((9, paths))
    mean = np.zeros(paths)
    for _ in range(2000):
        kick = np.sqrt(2 * n * step) * rng.standard_normal(paths)
        E = 0.5 * (v**2 + x**2)
        sums += kick * np.array(
            [v, v * np.sqrt(E), v * E, v * E**2, v * x, v * V, x, np.sqrt(E), V]
        )
        x, v, V = drift(x, v + kick, V, step)
        mean += V**2 / 2000
    columns = np.vstack([sums, ends() - begin])
    z = columns.mean(axis=1) / columns.std(axis=1) * np.sqrt(paths)
    assert np.abs(z).max() < 4

    half = paths // 2
    weights = np.linalg.lstsq(columns[:, :half].T, mean[:half] - mean[:half].mean(), rcond=None)[0]
    controlled = mean[half:] - weights @ columns[:, half:]
    assert controlled.var() < mean[half:].var() / 10
    assert abs(controlled.mean() - mean.mean()) < 4 * mean.std() / np.sqrt(half)


@pytest.mark.slow
@checks("ito")
def test_ito_with_a_stop():
    """On short steps of an own path: the jumps of h at impacts belong to the identity, and vanish where h is alike."""
    rng = np.random.default_rng(8)
    step = 1e-4
    n = 0.02
    c = 0.2
    r = 0.7
    x = 0.3
    v = 0.0
    kicks = np.sqrt(2 * n * step) * rng.standard_normal(400_000)
    functions = {  # h, its derivatives by x and x', and the second one by x'
        "energy": (lambda x, v: (x * x + v * v) / 2, lambda x, v: (x, v, 1.0)),
        "product": (lambda x, v: x * v, lambda x, v: (v, x, 0.0)),
    }
    sums = dict.fromkeys(functions, 0.0)
    jumps = dict.fromkeys(functions, 0.0)
    begin = {name: h(x, v) for name, (h, _) in functions.items()}
    for kick in kicks:
        for name, (_, slopes) in functions.items():
            by_x, by_v, twice = slopes(x, v)
            sums[name] += step * (v * by_x - (x + c * v) * by_v + n * twice) + by_v * kick
        v += kick - step * (x + c * v)
        x += step * v
        if x < 0.0:
            for name, (h, _) in functions.items():
                jumps[name] += h(0.0, -r * v) - h(0.0, v)
            x, v = -r * x, -r * v
    for name, (h, _) in functions.items():
        change = h(x, v) - begin[name]
        # of the order of the root of the step
        assert abs(change - sums[name] - jumps[name]) < 0.002
    assert jumps["product"] == 0.0
    assert jumps["energy"] < -0.5


@checks("step")
def test_step():
    """A cubic spring with coupling, and a mass that the spring presses on a stop."""
    from harvester.mechanics.kernels.step_size import STEP, typical_frequency

    eqs = Equations(alpha=0.7, beta=0.4, mu=0.6, c1=-0.05, n1=0.01)
    assert STEP == 0.1
    assert typical_frequency(eqs, 1.3) == pytest.approx(np.sqrt(1 + 3 * 0.7 * 1.3 + 0.4), rel=1e-12)
    pressed = Equations(c1=-0.05, n1=0.01, restitution=0.8, gap=-1.5)
    for v2 in (0.2, 1e-6):
        b2 = 1.5**3 / (10 * 0.01 * max(np.sqrt(v2), 0.01 / 1.5))
        assert typical_frequency(pressed, 0.3, v2) == pytest.approx(np.sqrt(1 + b2), rel=1e-12)


@checks("halving")
def test_halved_steps():
    """Sums whose error is c h^2 exactly: both are exact; without noise and without controls."""
    from harvester.uncertainty.richardson import extrapolated, step_bias

    limit = np.array([1.0, 2.5, 0.3])
    c = np.array([0.2, -0.1, 0.4])
    h = 0.3
    fine = limit + c * h**2
    coarse = limit + c * (2 * h) ** 2
    assert step_bias([fine, coarse])[0] == pytest.approx((c * h**2).mean(), rel=1e-12)
    assert extrapolated([fine, coarse]) == pytest.approx(limit, rel=1e-12)


@checks("works", "closure")
def test_ledger():
    """Works of two kicks and an impact by the page, and the residual of made-up powers."""
    from types import SimpleNamespace

    from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger, add_works_of_kick
    from harvester.mechanics.kernels.coefficients import State, coefficients
    from harvester.mechanics.kernels.compiled import interpreted
    from harvester.mechanics.kernels.equation_of_motion import kick as compiled

    h = 0.1
    x = 0.4
    v0 = 0.9
    V = -0.2
    xi = 0.6
    s = SimpleNamespace(noise_work=0.0, spring_work=0.0, voltage_work=0.0, damping_work=0.0)
    v1 = interpreted(compiled)(State(x, v0, V), xi, h, coefficients(PAPER))
    interpreted(add_works_of_kick)(s, v0, v1, x, V, xi, h, coefficients(PAPER))
    mean = (v0 + v1) / 2
    noise = np.sqrt(2 * h * (PAPER.n1 + PAPER.n2 * x**2)) * xi * mean
    spring = -h * (x + PAPER.alpha * x**3) * mean
    voltage = -h * PAPER.beta * V * mean
    assert (s.noise_work, s.spring_work, s.voltage_work) == pytest.approx(
        (noise, spring, voltage), rel=1e-12
    )
    assert sum(vars(s).values()) == pytest.approx((v1**2 - v0**2) / 2, rel=1e-12)
    ledger = EnergyLedger(input=5.0, damping=2.0, impacts=1.0, circuit=0.5, load=1.0, stored=0.4)
    assert ledger.residual == pytest.approx((5.0 - 4.9) / 5.0, rel=1e-12)


@checks("rice", "vanmarcke", "lifetime")
def test_largest_values_of_a_linear_scene():
    """The level of a lifetime from sums over the frequency, with the page's formulas."""
    c = 0.1
    beta = 0.5
    mu = 0.7
    n1 = 0.3
    span = 1e5
    share = 0.95
    w = np.linspace(1e-4, 60.0, 600_001)
    s = 1j * w
    x = 1 / (1 + c * s + s**2 + beta * s / (s + mu))
    found = hv.extremes(
        hv.Scene(nondimensional=hv.Nondimensional(c1=-c, beta=beta, mu=mu, D11=n1)), lifetime=span
    )
    for name, response in (("peak_displacement", x), ("peak_voltage", s / (s + mu) * x)):
        S = 2 * n1 * np.abs(response) ** 2 / np.pi
        l0, l1, l2 = (simpson(w**k * S, x=w) for k in range(3))
        l0 += 2 * n1 / np.pi * 1e-4 * abs(response[0]) ** 2
        level = found.levels[name][share]

        def passages(a, l0=l0, l2=l2):
            return np.sqrt(l2 / l0) / np.pi * np.exp(-(a**2) / (2 * l0))

        a = level.value
        q = np.sqrt(1 - l1**2 / (l0 * l2))
        clumps = (
            passages(a)
            * -np.expm1(-np.sqrt(np.pi / 2) * q**1.2 * a / np.sqrt(l0))
            / -np.expm1(-(a**2) / (2 * l0))
        )
        assert np.exp(-clumps * span) == pytest.approx(share, abs=2e-3)
        assert np.exp(-passages(a + level.model) * span) == pytest.approx(share, abs=2e-3)


@checks("lyapunov", "simple")
def test_exponents():
    eqs = changed(PAPER, n1=None, beta=0.2, mu=0.7)
    _, beta, mu, c1, *_, n2, _ = coefficients(eqs)
    r = eqs.restitution
    k0 = (mu**2 + (1 + beta) ** 2) / (mu**2 + 1 + beta)
    published = (
        c1 / 2
        - beta * mu / (2 * (mu**2 + 1 + beta))
        - (1 - r) / np.pi * np.sqrt(k0)
        + n2 / (4 * k0)
    )
    assert float(stability.published(eqs)) == pytest.approx(published, rel=1e-12)
    w2 = 1.0
    for _ in range(100):
        w2 = 1 + beta * chi(mu / np.sqrt(w2)) * w2 / (mu**2 + w2)
    C = beta * chi(mu / np.sqrt(w2)) * mu / (mu**2 + w2)
    simple = (c1 - C) / 2 + np.sqrt(w2) / np.pi * np.log(r) + n2 / (4 * w2)
    assert float(simple_exponent(eqs)) == pytest.approx(simple, rel=1e-9)


@checks("tail", "moments", "tailstop")
def test_tails():
    """The rate of the second moments, its root without a stop, and the exponent with one."""
    c = 0.05
    w2 = 1.3
    n2 = 0.04
    eqs = Equations(c1=-c, beta=w2 - 1.0, n2=n2)
    matrix = np.array([[0.0, 2.0, 0.0], [-w2, -c, 1.0], [2.0 * n2, -2.0 * w2, -2.0 * c]])
    assert tail.moment_growth(eqs, 2) == pytest.approx(
        np.linalg.eigvals(matrix).real.max(), rel=1e-9
    )
    assert tail.power_tail(changed(eqs, n2=c * w2)).exponent == pytest.approx(2.0, rel=1e-9)
    stopped = Equations(c1=-c, n2=n2, restitution=0.95)
    growth = float(stability.averaged(stopped))
    assert tail.power_tail(stopped).exponent == pytest.approx(-8.0 * growth / n2, rel=1e-9)


@checks("wells")
def test_wells_that_are_left_at_two_rates():
    """p f is the mean of what each well's start gives, at any time, and so lies between these."""
    rates = np.array([[-0.3, 0.3], [0.1, -0.1]])
    f = np.array([2.0, 5.0])
    p = np.array([0.25, 0.75])
    assert p @ rates == pytest.approx(0.0, abs=1e-15)
    for time in (0.0, 0.4, 3.0):
        begun = expm(rates * time) @ f
        assert p @ begun == pytest.approx(p @ f, rel=1e-12)
        entries = np.repeat(begun, 4)
        value = Hopping(0, 8, 1.0, 0.4, np.repeat([0, 1], 4), np.full(8, True)).mean(entries)
        assert (value.value, value.model) == pytest.approx(
            (begun.mean(), 0.5 * np.ptp(begun)), rel=1e-12
        )
        assert abs(p @ f - value.value) <= value.model


@checks("kramers")
@pytest.mark.parametrize("c", [0.01, 0.7])
def test_kramers(c):
    """Wells of x^4/4 - x^2/2: U = 1/4, w = sqrt(2 - c^2/4), w_b = 1, and a turn at the barrier's height of S = 4/3."""
    T = 0.03
    w = np.sqrt(2 - c**2 / 4)

    def taken(d):
        def inner(z):
            return np.log(-np.expm1(-d * (z * z + 0.25))) / (z * z + 0.25)

        return np.exp(quad(inner, 0, np.inf, limit=400)[0] / np.pi)

    d = c * 4 / 3 / T
    A = taken(d) ** 2 / taken(2 * d)
    k = A * (np.sqrt(c**2 / 4 + 1) - c / 2) * w / (2 * np.pi) * np.exp(-0.25 / T)
    assert hopping_rates(Equations(linear=-1.0, alpha=1.0, c1=-c, n1=T * c)) == pytest.approx(
        (k, k), rel=1e-4
    )


@checks("rule", "xmu")
@pytest.mark.parametrize("z", [1e-5, 0.1, 1.0, 50.0])
def test_rule_of_the_resistor(z):
    """v1 - v0 + z [(1 - xmu) v1 + xmu v0] = u1 - u0 is exact for v' + v/(R Cp) = u' of a constant slope."""
    from harvester.mechanics.kernels.ngspice_rule import rule_weight

    xmu = rule_weight(z)
    v0, rise = 0.3, 0.8
    v1 = v0 * np.exp(-z) + rise / z * -np.expm1(-z)
    assert v1 - v0 + z * ((1 - xmu) * v1 + xmu * v0) == pytest.approx(rise, rel=1e-9)
    if z > 1e-3:
        assert xmu == pytest.approx(1 / z - 1 / np.expm1(z), rel=1e-12)


@checks("kick")
def test_kick():
    """The change of velocity, with friction that is large in one step."""
    from harvester.mechanics.kernels.coefficients import State, coefficients
    from harvester.mechanics.kernels.equation_of_motion import kick as compiled

    e = changed(PAPER, n12=0.003)
    x = 1.3
    v = -0.7
    V = 0.4
    xi = 1.0
    h = 0.3
    noise = e.n1 + 2 * e.n12 * x + e.n2 * x**2
    y = (e.c3 * x**4 - e.c2 * x**2 - e.c1) * h
    force = -(x + e.alpha * x**3 + e.beta * V) * h + np.sqrt(2 * noise * h) * xi
    expected = (v + (1 + y / 2) * force) / (1 + y + y**2 / 2)
    assert compiled.py_func(State(x, v, V), xi, h, coefficients(e)) == pytest.approx(
        expected, rel=1e-12
    )


@checks("linear", "response")
def test_linear_scenes():
    """White noise of N1 + N2 E[x^2], and the sum over a record's lines next to it."""
    c = 0.1
    beta = 0.5
    mu = 0.7
    n1 = 0.3
    n2 = 0.02
    n = 40
    v2_at_one = 1 / (c * (1 + beta + mu**2 + c * mu) + beta * mu)
    x2_at_one = v2_at_one * (1 + mu**2 + c * mu)
    a = np.random.default_rng(1).standard_normal(n + 1)
    record = Record(0.25, a)
    s = 2j * np.pi * np.arange(n // 2 + 1) / (0.25 * (n + 1))
    p = np.abs(np.fft.rfft(a) / (n + 1)) ** 2 * np.where(s == 0.0, 1.0, 2.0)
    x = 1 / (1 + c * s + s**2 + beta * s / (s + mu))
    V = s / (s + mu) * x
    x2 = (n1 * x2_at_one + np.abs(x) ** 2 @ p) / (1 - n2 * x2_at_one)
    e = Equations(c1=-c, beta=beta, mu=mu, n1=n1, n2=n2, record=record)
    assert linear_v2(e) == pytest.approx((n1 + n2 * x2) * v2_at_one + np.abs(V) ** 2 @ p, rel=1e-12)


def on_gauss_points(found):
    """Points x and v, weights there, and all modes of a density, from its values at the nodes."""
    from harvester.density.elements import evaluated, quadrature

    mesh = found.form.mesh
    along, across = (
        quadrature(breaks, mesh.degree, mesh.degree + 4)
        for breaks in (mesh.x_breaks, mesh.v_breaks)
    )
    v = across.points.ravel()
    p = np.einsum(
        "keij,qi,rj->keqr",
        found.p,
        along.values,
        evaluated(mesh.v_breaks, mesh.degree, v),
        optimize=True,
    )
    return along.points[:, :, None], v, along.weights[:, :, None] * across.weights.ravel(), p


@pytest.mark.slow
@checks("displaced", "weak", "modes")
def test_weak_form_of_the_density():
    """For ten polynomials g, with the integrals written anew: what the motion and what the impacts make of them."""
    from numpy.polynomial.hermite_e import hermegauss, hermeval

    from harvester.density.box import settled
    from harvester.density.elements import evaluated
    from harvester.density.mesh import RESOLUTIONS, mesh
    from harvester.density.refine import solution

    e = changed(PAPER, restitution=0.7, c1=-0.02, beta=0.4, mu=0.6)
    setting = settled(e, 26.0)
    found = solution(e, setting, mesh(e, setting.box, RESOLUTIONS[0]), 8)
    x, v, weights, modes = on_gauss_points(found)
    frame = setting.frame
    z, gauss = hermegauss(12)
    norms = np.cumprod([1.0, *np.sqrt(np.arange(1.0, 8.0))])
    # p times s exp(z^2/2) sqrt(2 pi) at Gauss points in z, whose weights have that factor.
    series = [hermeval(z, np.eye(8)[k]) / norms[k] for k in range(8)]
    gauss = gauss / np.sqrt(2.0 * np.pi)
    p = np.einsum("keqr,kz->eqrz", modes, series, optimize=True)
    x = x[..., None]
    v = v[:, None]
    weights = weights[..., None] * gauss
    y = frame.slope * x + frame.offset + frame.scale * z
    force = -x - e.alpha * x**3 - e.beta * (x - y)
    loss = e.c3 * x**4 - e.c2 * x**2 - e.c1
    noise = e.n1 + e.n2 * x**2
    low = found.form.mesh.v_breaks
    w = v[v[:, 0] > 0.0]
    half_weights = weights[0, 0, v[:, 0] > 0.0] / (
        found.form.mesh.x_breaks[1] - found.form.mesh.x_breaks[0]
    )
    half_weights = half_weights / half_weights.sum() * low[-1]
    at_wall = np.einsum(
        "kj,rj,kz->rz", found.p[:, 0, 0], evaluated(low, found.form.mesh.degree, -w[:, 0]), series
    )
    y_wall = frame.offset + frame.scale * z
    powers = [
        (1, 0, 0),
        (0, 1, 0),
        (0, 0, 1),
        (2, 0, 0),
        (1, 1, 0),
        (0, 2, 0),
        (1, 0, 1),
        (0, 1, 1),
        (0, 0, 2),
        (1, 2, 0),
    ]
    for i, j, k in powers:
        made = (
            v * i * x ** max(i - 1, 0) * v**j * y**k
            + (force - loss * v) * j * x**i * v ** max(j - 1, 0) * y**k
        )
        made = made + noise * j * (j - 1) * x**i * v ** max(j - 2, 0) * y**k
        made = made + e.mu * (x - y) * k * x**i * v**j * y ** max(k - 1, 0)
        jump = (0.0**i) * ((e.restitution * w) ** j - (-w) ** j) * y_wall**k
        moved = float((p * made * weights).sum())
        hit = float((at_wall * w * jump * half_weights).sum())
        size = float(np.abs(p * made * weights).sum())
        assert abs(moved + hit) < 1e-6 * size, (i, j, k)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("restitution", "near"),
    [
        (0.9, 0.003),
        *(
            pytest.param(*one, marks=pytest.mark.thorough("test_exponent_at_the_grazing_corner"))
            for one in ((0.6, 0.003), (0.37, 0.01))
        ),
    ],
)
@checks("grazing_corner")
def test_exponent_at_the_grazing_corner(restitution, near):
    """The slope of ln p over ln |v| at the stop, on either side of v = 0, on a mesh graded far towards the corner."""
    from harvester.density.box import settled
    from harvester.density.elements import evaluated
    from harvester.density.mesh import Resolution, mesh
    from harvester.density.refine import solution

    e = Equations(c1=-0.1, n1=0.02, restitution=restitution)
    setting = settled(e, 20.0)
    found = solution(e, setting, on := mesh(e, setting.box, Resolution(6, 6, 12)), 1)
    v = np.geomspace(1e-3, 7e-3, 15) * on.v_breaks[-1]
    k = brentq(
        lambda k: 2.0 * np.sin(np.pi / 6.0 - np.pi * k / 3.0) - restitution ** -(2.0 + k),
        -1.99,
        -0.01,
    )
    for way in (-1.0, 1.0):
        p = evaluated(on.v_breaks, on.degree, way * v) @ found.p[0, 0, 0]
        assert np.polyfit(np.log(v), np.log(p), 1)[0] == pytest.approx(k, abs=near)


@pytest.mark.slow
@checks("adjoint")
def test_adjoint_of_the_density():
    """The transposed equations against the equations themselves, with a density drawn at random; and a derivative."""
    from harvester.density.adjoint import adjoint, gradient
    from harvester.density.box import settled
    from harvester.density.coupled_modes import integrals
    from harvester.density.functionals import functionals
    from harvester.density.mesh import RESOLUTIONS, mesh
    from harvester.density.refine import solution

    e = changed(PAPER, beta=0.4, mu=0.6)
    setting = settled(e, 20.0)
    found = solution(e, setting, mesh(e, setting.box, RESOLUTIONS[0]), 5)
    masses = np.zeros(found.form.shape)
    masses[0] = integrals(found.form)
    right = functionals(e, found.form)[0].reshape(masses.shape) - found.means[0] * masses
    q = adjoint(found.factors, right)
    drawn = np.random.default_rng(1).standard_normal(q.shape)
    assert np.vdot(q, found.form.apply(drawn)) == pytest.approx(np.vdot(right, drawn), rel=1e-7)
    # More noise everywhere is a larger scale: dE[V^2]/dN by its own difference is tested in
    # tests/density.
    assert gradient(e, found, setting)["n1"] > 0.0


@checks("in_time")
def test_density_in_time():
    """The equations of decay, loss and spectrum, as on the page, with what solves them: residuals and a sum rule."""
    from harvester.density.box import settled
    from harvester.density.coupled_modes import Factors, integrals
    from harvester.density.mesh import RESOLUTIONS, mesh
    from harvester.density.refine import solution
    from harvester.density.relaxation import first_passage, slowest_decay, voltage_spectrum
    from harvester.density.weak_form import WeakForm

    e = Equations(c1=-0.5, n1=0.025, linear=-1.0, alpha=1.0)
    setting = settled(e, 20.0)
    found = solution(e, setting, mesh(e, setting.box, RESOLUTIONS[0]), 1)
    form = found.form
    rate, p = slowest_decay(found)
    assert form.apply(p) == pytest.approx(
        -rate * form.mass(p), abs=1e-5 * rate * np.abs(form.mass(p)).max()
    )
    lossy = WeakForm(e, form.mesh, form.frame, 1, (True, True))
    lost = first_passage(lossy, 1.0)
    # With the shape function 1 the form loses what leaves the ends, and the rate is that loss over
    # the mass.
    u = Factors(lossy, None).solve(-form.mass(found.p))
    assert lost * np.vdot(integrals(form), u[0]) == pytest.approx(1.0, rel=0.01)
    assert np.vdot(lossy.loss(), u[0]) == pytest.approx(1.0, rel=1e-6)
    # An open circuit has V = x: at small frequencies S is the Lorentzian of the inter-well
    # transitions, 2 E[x^2] rate/(rate^2 + w^2).
    low = voltage_spectrum(found, [0.5 * rate, rate])
    assert low[0] / low[1] == pytest.approx(2.0 / 1.25, rel=0.01)


def test_every_equation_is_checked():
    """The labels on the pages are those of the tests, and the modules that the pages name are there."""
    pages = [*theory_pages(), ROOT / "docs" / "lockstep.md"]
    text = "".join(page.read_text() for page in pages)
    assert set(re.findall(r"^\$\$ \((\w+)\)$", text, re.MULTILINE)) == CHECKED
    for path in set(re.findall(r"`((?:harvester|cosimulation|engines)/[\w/]+\.py)`", text)):
        assert (ROOT / path).exists() or (ROOT / "harvester" / path).exists(), path
