"""Means with honest errors: orders of convergence, burn-in, coverage, densities, power balance."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi2, norm

from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.moments import correlation_time, from_path
from harvester.mechanics.kernels.noise import gaussian_grid, refined
from harvester.mechanics.trace import trace
from harvester.uncertainty.value import mean_and_error
from tests.support.histograms import densities
from tests.support.systems import PAPER, changed, linear, linear_v2, lyapunov, padded, z

pytestmark = pytest.mark.statistics

SEED = np.random.SeedSequence(20261123)
PLATE = changed(linear(1.25, 1.0, c=0.008), restitution=0.96)


def averages(eqs, trajectories, h, burn_in, duration, seed=SEED):
    many = Trajectories(eqs, trajectories, seed, h)
    many.run(burn_in)
    return many.run(duration)


def controlled(eqs, h, names):
    """Means and standard errors after a burn-in, with control variates: as sharp as the plain means of 16384."""
    many = Trajectories(eqs, 1024, SEED, h, controlled=True)
    many.run(500.0)
    moments = many.run(1000.0)
    return {name: mean_and_error(moments.controlled(name)) for name in names}


# Orders of convergence


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
@pytest.mark.parametrize(
    "eqs, names, steps",
    [
        (PAPER, ("v2", "impacts"), (0.6, 0.45, 0.3)),
        (PLATE, ("V2", "x2", "v2"), (0.4, 0.28, 0.2, 0.14)),
    ],
    ids=["paper", "plate"],
)
def test_weak_order_with_the_stop(eqs, names, steps):
    """The error of stationary means falls with the square of the step."""
    reference = controlled(eqs, 0.04, names)
    coarse = [controlled(eqs, h, names) for h in steps]
    for name in names:
        exact, exact_error = reference[name]
        errors = np.array([abs(m[name][0] - exact) for m in coarse])
        sampling = np.array([np.hypot(m[name][1], exact_error) for m in coarse])
        assert (errors > 4 * sampling).all(), name  # or there is no order to see
        slope, doubt = fit(steps, errors, sampling)
        assert 1.8 - 2 * doubt < slope < 3.0, name
        assert slope > 1.8, name


def fit(steps, errors, sampling):
    """Order of convergence and its standard error, weighted by the errors' own precision."""
    weights = errors / sampling
    (slope, _), cov = np.polyfit(np.log(steps), np.log(errors), 1, w=weights, cov="unscaled")
    return slope, np.sqrt(cov[0, 0])


def strong_order(eqs, duration, paths=200, levels=8, first=0.2):
    """Fitted order of the RMS difference in x, x' and V at the end between a step and its half, and mean impacts.

    All start on one quiet trajectory, half a step early as `trace` has it.
    """
    quiet = trace(changed(eqs, n1=None), np.zeros(2000), 2e-4, 1, (1.2, 0.0, 0.0))
    ends = np.empty((paths, levels, 3))
    impacts = 0
    for seed in range(paths):
        noise = gaussian_grid(np.random.SeedSequence(seed), round(duration / first))
        rng = np.random.default_rng(seed)
        for level in range(levels):
            h = first / 2**level
            start = tuple(
                np.interp(0.2 - 0.5 * h, quiet.t, values) for values in quiet.samples[:, 2:].T
            )
            path = trace(eqs, noise, h, 2**level, start)
            ends[seed, level] = path.samples[-1, 2:]
            noise = refined(noise, rng)
        impacts += len(path.impacts)
    rms = np.sqrt((np.diff(ends, axis=1) ** 2).mean(axis=0))
    steps = first / 2 ** np.arange(levels - 1)
    return np.polyfit(np.log(steps[1:]), np.log(rms[1:]), 1)[0], impacts / paths


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
@pytest.mark.parametrize(
    "duration, impacts, lowest, highest",
    [(0.8, 0.0, 0.9, 1.1), (2.0, 1.0, 0.45, 0.65), (4.4, 2.0, 0.3, 0.55)],
)
def test_strong_order_on_shared_noise(duration, impacts, lowest, highest):
    """1 without impact, 1/2 after one, less after more: no scheme with kicks on a grid does better.

    Two paths that meet the stop at times dt apart get noise of opposite sign in between, sqrt(dt)
    of it: an impact halves the order.
    """
    eqs = Equations(alpha=0.5, beta=0.3, mu=0.2, c1=-0.05, n1=0.01, restitution=0.96)
    orders, seen = strong_order(eqs, duration)
    assert seen == pytest.approx(impacts, abs=0.05)
    assert lowest < orders[0] < highest  # x
    assert lowest < orders[2] < highest  # V


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
@pytest.mark.parametrize(
    "eqs", [linear(1.25, 1.0), changed(PAPER, restitution=None)], ids=["linear", "paper"]
)
def test_strong_order_without_a_stop(eqs):
    """Order 1 in x, V and x' over three periods, nonlinear spring and damping and parametric noise included."""
    squares = np.zeros((100, 6, 3))
    for seed in range(100):
        noise = gaussian_grid(np.random.SeedSequence(seed), 100)
        rng = np.random.default_rng(seed)
        before = None
        for level in range(7):
            now = trace(eqs, noise, 0.2 / 2**level, 2**level).samples[:, 2:]
            if before is not None:
                squares[seed, level - 1] = ((now - before) ** 2).mean(axis=0)
            before = now
            noise = refined(noise, rng)
    rms = np.sqrt(squares.mean(axis=0))
    orders = np.polyfit(np.log(0.2 / 2 ** np.arange(6)), np.log(rms), 1)[0]
    assert orders == pytest.approx(1.0, abs=0.1)


def test_both_noise_modes_have_the_same_law():
    """Three-point steps of the ensemble and Gaussian paths give the same moments on the paper's scene."""
    weak = averages(PAPER, 4096, 0.1, 400.0, 400.0)
    paths = [
        trace(PAPER, gaussian_grid(np.random.SeedSequence(k), 40_000), 0.1, 4) for k in range(64)
    ]
    strong = [from_path(PAPER, path, 400.0, 1) for path in paths]
    for name in ("V2", "x", "x2", "v2", "xV", "impacts", "impact_loss"):
        values = np.concatenate([getattr(m, name) for m in strong])
        assert abs(z(mean_and_error(values), *weak.mean(name))) < 4, name


# Burn-in


def test_correlation_time_of_an_exponential_memory():
    """Means over windows of length L of a process with correlation exp(-t): tau = 1, from L = 50."""
    rng = np.random.default_rng(5)
    h = 0.05
    steps = 1000
    values, total = rng.standard_normal(20_000), np.zeros(20_000)
    for _ in range(steps):
        values = np.exp(-h) * values + np.sqrt(-np.expm1(-2 * h)) * rng.standard_normal(20_000)
        total += values
    exact = 1.0 - (1.0 - np.exp(-50.0)) / 50.0
    assert correlation_time(total / steps, values, 50.0) == pytest.approx(exact, rel=0.05)
    assert correlation_time(np.ones(4), np.ones(4), 50.0) == 0.0


SLOW = {
    "c=1e-2": (Equations(c1=-1e-2, n1=0.01), "v2", 1.0, 1e2),
    "c=1e-3": (Equations(c1=-1e-3, n1=0.01), "v2", 10.0, 1e3),
    "c=2e-4": (Equations(c1=-2e-4, n1=0.01), "v2", 50.0, 5e3),
    "stop, c=1e-3": (Equations(c1=-1e-3, n1=0.01, restitution=1.0), "x2", 10.0, 1e3),
    # loss 2 (1 - r) E an impact and 1/pi impacts a time unit: E = pi N1/(2 (1 - r))
    "r=.999": (Equations(n1=0.01, restitution=0.999), "v2", 0.01 * np.pi / 0.002, 1.6e3),
    "mu=1e-2": (linear(0.05, 1e-2), "V2", linear_v2(linear(0.05, 1e-2)), 1e2),
    "mu=1e-3": (linear(0.05, 1e-3), "V2", linear_v2(linear(0.05, 1e-3)), 1e3),
    "beta=10, mu=1e-2": (linear(10.0, 1e-2), "V2", linear_v2(linear(10.0, 1e-2)), 1e2),
}


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
@pytest.mark.parametrize("name", SLOW)
def test_burn_in_forgets_the_start(name):
    """E of slow scenes right after the burn-in, many small ensembles: no bias against the exact value.

    Energy relaxes at the rate c = N1/E[x'^2] or 2 (1 - r)/pi, the voltage at mu: the burn-in found
    from the data is several times longer than that.
    """
    eqs, moment, exact, memory = SLOW[name]
    values, times = [], []
    for seed in range(16):
        many = Trajectories(eqs, 128, np.random.SeedSequence([seed, 7]))
        assert burn_in(many) == []
        times.append(many.time)
        values.append(many.run(many.time).mean(moment)[0])
    mean, error = mean_and_error(np.array(values))
    assert error < 0.03 * exact
    assert abs(mean - exact) < 4 * error + 0.003 * exact  # the bias of the step
    assert min(times) > 4 * memory


def test_burn_in_lasts_ten_times_the_memory():
    """The energy has the correlation time 1/(c + beta mu/(1 + mu^2)) here: a third is left after one."""
    eqs = changed(linear(1e-3, 1.0), c1=-1e-2)
    for seed in range(16):
        many = Trajectories(eqs, 128, np.random.SeedSequence([seed, 7]))
        assert burn_in(many) == []
        assert many.time > 8 / (0.01 + 0.0005)


# Coverage


@pytest.fixture(scope="module")
def stop_v2():
    """E[V^2] of the paper's scene at step 0.1: value and standard error of a long run."""
    return controlled(PAPER, 0.1, ("V2",))["V2"]


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
@pytest.mark.parametrize("trajectories, duration", [(64, 500.0), (128, 100.0)])
@pytest.mark.parametrize("name", ["linear", "stop"])
def test_intervals_of_95_per_cent_cover(name, trajectories, duration, stop_v2):
    """Over 200 seeds, 90 to 98 % of the intervals E +- 1.96 standard errors hold the exact E[V^2]."""
    eqs, (exact, exact_error) = (
        (PAPER, stop_v2) if name == "stop" else (linear(0.05, 1.0), (None, 0.0))
    )
    h = 0.1 if name == "stop" else 0.03
    exact = linear_v2(eqs) if exact is None else exact
    inside = []
    for seed in range(200):
        moments = averages(
            eqs, trajectories, h, 300.0, duration, np.random.SeedSequence([seed, 11])
        )
        value, error = moments.mean("V2")
        assert error > 4 * exact_error
        inside.append(abs(value - exact) < 1.96 * error)
    assert 0.90 <= np.mean(inside) <= 0.98


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_intervals_cover_after_a_burn_in_found_from_the_data():
    """The same with `settle`: stopping when windows agree does not select lucky ones."""
    eqs = linear(0.05, 1.0, c=0.1)
    inside = []
    for seed in range(200):
        many = Trajectories(eqs, 64, np.random.SeedSequence([seed, 13]), 0.05)
        assert burn_in(many) == []
        value, error = many.run(many.time).mean("V2")
        inside.append(abs(value - linear_v2(eqs)) < 1.96 * error)
    assert 0.90 <= np.mean(inside) <= 0.98


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_batches_of_one_path_cover():
    """The same for batch means of a single recorded path, as the lock-step with a circuit has them."""
    eqs = linear(0.05, 1.0, c=0.2)
    h = 0.05
    inside = []
    for seed in range(200):
        path = trace(eqs, gaussian_grid(np.random.SeedSequence([seed, 17]), 40_000), h, 8)
        value, error = from_path(eqs, path, 50.0, 16).mean("V2")
        # Student's t with 15 degrees of freedom
        inside.append(abs(value - linear_v2(eqs)) < 2.131 * error)
    assert 0.90 <= np.mean(inside) <= 0.98


# Densities


def settled_densities(eqs, h, edges, snapshots=40, trajectories=8192):
    many = Trajectories(eqs, trajectories, SEED, h)
    burn_in(many)
    return densities(many, snapshots, 10.0, **edges)


def check(density, mass):
    """Each bin that is not almost empty within four standard errors, and all of them together by chi-square.

    ``mass`` is the probability of a bin from its edges.
    """
    width = np.diff(density.edges)
    exact = (
        np.array([mass(a, b) for a, b in zip(density.edges[:-1], density.edges[1:], strict=True)])
        / width
    )
    enough = exact * width > 1e-4
    scores = (density.value - exact)[enough] / density.stderr[enough]
    assert enough.sum() > 15
    assert abs(scores).max() < 4
    # Bins of one trajectory hang together, so the sum of squares is wider than chi-square: twice
    # the freedom.
    assert (scores**2).mean() < 2 * chi2.ppf(0.999, scores.size) / scores.size


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_densities_of_the_gibbs_law():
    """p(x) ~ exp(-c (x^2/2 + alpha x^4/4)/N1) on x > 0 and Gaussian x', for r = 1 without coupling."""
    alpha = 2.0
    c = 0.05
    n1 = 0.02
    eqs = Equations(alpha=alpha, c1=-c, n1=n1, restitution=1.0)
    weight = lambda x: np.exp(-c / n1 * (x**2 / 2 + alpha * x**4 / 4))  # noqa: E731
    total = quad(weight, 0, np.inf)[0]
    edges = {"x": np.linspace(0, 2, 41), "v": np.linspace(-2.5, 2.5, 41)}
    found = settled_densities(eqs, 0.02, edges)
    check(found["x"], lambda a, b: quad(weight, a, b)[0] / total)
    check(
        found["v"],
        lambda a, b: norm.cdf(b, scale=np.sqrt(n1 / c)) - norm.cdf(a, scale=np.sqrt(n1 / c)),
    )


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_density_of_the_voltage():
    """A linear scene's V is Gaussian with the variance of the Lyapunov equation; so are x and x'."""
    eqs = linear(0.5, 0.5)
    scales = np.sqrt(np.diag(lyapunov(eqs)))
    edges = {
        name: np.linspace(-3.5 * s, 3.5 * s, 36) for name, s in zip("xvV", scales, strict=True)
    }
    found = settled_densities(eqs, 0.02, edges)
    for name, s in zip("xvV", scales, strict=True):
        check(found[name], lambda a, b: norm.cdf(b, scale=s) - norm.cdf(a, scale=s))  # noqa: B023


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_densities_count_what_numpy_counts():
    """Compiled counts of a snapshot against numpy's, and what lies outside the edges."""
    many = Trajectories(PAPER, 256, SEED, 0.1)
    many.run(100.0)
    edges = np.linspace(0.1, 0.7, 8)
    found = densities(many, 1, 0.4, x=edges)["x"]
    x = many.snapshot()[0]
    counts = np.histogram(x, edges)[0]
    assert found.value == pytest.approx(counts / (256 * (edges[1] - edges[0])))
    assert found.entries.shape == (4, 7)
    assert found.centres == pytest.approx(0.5 * (edges[1:] + edges[:-1]))
    assert counts.sum() < 256
    assert np.isinf(
        densities(Trajectories(PAPER, 64, SEED, 0.1), 1, 1.0, V=edges)["V"].stderr
    ).all()


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_density_errors_are_the_real_ones():
    """The stated standard errors are the scatter over independent ensembles."""
    edges = np.linspace(0, 1.2, 13)
    runs = []
    for seed in range(40):
        many = Trajectories(PAPER, 1024, np.random.SeedSequence([seed, 19]), 0.1)
        many.run(300.0)
        runs.append(densities(many, 8, 5.0, x=edges)["x"])
    scatter = np.std([run.value for run in runs], axis=0, ddof=1)
    stated = np.sqrt(np.mean([run.stderr**2 for run in runs], axis=0))
    assert np.mean(stated / scatter) == pytest.approx(1.0, abs=0.1)


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_snapshot_is_the_reading_half_a_step_later():
    """`snapshot` against the same drift on paper: free flight, and the exact decay of V; the state stays as it is."""
    many = Trajectories(changed(PAPER, restitution=None), 128, SEED, 0.1)
    many.run(50.0)
    x, v, V = np.moveaxis(many.state, 1, 0).reshape(3, -1)
    decay = np.exp(-0.05 * 0.05)
    assert many.snapshot() == pytest.approx(
        np.array([x + 0.05 * v, v, decay * V + v * (1 - decay) / 0.05]), abs=1e-12
    )
    assert (np.moveaxis(many.state, 1, 0).reshape(3, -1)[0] == x).all()


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
def test_start_of_every_trajectory():
    """A start each: trajectories keep their places, x = x0 cos t + v0 sin t and V - x = V0 - x0 without a load."""
    x0, v0, V0 = start = np.random.default_rng(1).uniform(0.1, 1.0, (3, 128))
    many = Trajectories(padded(Equations(beta=0.0, n1=1e-12)), 128, SEED, 1e-3, start)
    many.run(1.0)
    x, v, V = many.snapshot()
    t = many.time
    assert x == pytest.approx(x0 * np.cos(t) + v0 * np.sin(t), abs=2e-3)
    assert v == pytest.approx(v0 * np.cos(t) - x0 * np.sin(t), abs=2e-3)
    assert V - x == pytest.approx(V0 - x0, abs=1e-12)


# Power balance


def random_scene(rng):
    """A scene of up to eleven random coefficients; it is bounded, and some effects are absent."""
    draw = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))  # noqa: E731
    eqs = Equations(
        alpha=draw(0.05, 5.0),
        beta=draw(0.01, 2.0),
        mu=draw(0.05, 5.0),
        c1=draw(0.01, 0.1) * rng.choice([-1.0, 1.0]),
        c2=draw(0.01, 0.1) * rng.choice([-1.0, 1.0]),
        c3=draw(0.1, 1.0),
        restitution=rng.uniform(0.2, 1.0),
        n1=draw(1e-3, 0.1),
        n2=draw(1e-3, 0.05),
    )
    kind = rng.integers(4)
    if kind == 1:
        return changed(eqs, restitution=None)
    if kind == 2:
        return changed(eqs, c1=-abs(eqs.c1), n2=None)
    if kind == 3:
        return changed(eqs, n12=0.5 * float(np.sqrt(eqs.n1 * eqs.n2)))
    return eqs


def test_power_balance_closes_in_200_random_scenes():
    """Power in = power out within four standard errors, and the errors are neither too small nor too large."""
    rng = np.random.default_rng(29)
    scores, errors = [], []
    for k in range(200):
        eqs = random_scene(rng)
        h = 0.025 / np.sqrt(1 + eqs.beta + 3 * eqs.alpha * min(1.0, eqs.n1 / 0.05))
        balance = averages(eqs, 128, h, 150.0, 500.0, np.random.SeedSequence([k, 31])).balance(eqs)
        value, error = mean_and_error(balance)
        errors.append(error)
        scores.append(value / error)
        assert abs(scores[-1]) < 4, eqs
    assert np.median(errors) < 0.02
    assert np.mean(np.square(scores)) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 200))
