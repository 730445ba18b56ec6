"""The power tail of the amplitude: against closed forms without a stop, against Monte Carlo of its moments with one."""

import math

import numpy as np
import pytest

from harvester.averaging.stability.power_law_tail import moment_growth, power_tail
from harvester.equations.coefficients import Equations
from harvester.errors import UnboundedResponseError
from harvester.linear.solve import solve
from harvester.mechanics.ensemble.lyapunov import grow
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients
from harvester.mechanics.kernels.noise import random_words
from harvester.mechanics.kernels.trajectory_batch import Batch
from tests.support.systems import PAPER, changed

STOPPED = Equations(c1=-0.05, beta=0.05, mu=0.5, n1=0.01, n2=0.1, restitution=0.95)  # ran for ever


@pytest.mark.parametrize("c, beta", [(0.05, None), (0.3, 0.8)])
def test_mean_square_is_lost_at_the_known_noise(c, beta):
    """x'' + c x' + W^2 x with noise on W^2 keeps its mean square for N2 < c W^2, whatever c; V = x is a spring."""
    edge = c * (1.0 + (beta or 0.0))
    for factor in (0.999, 1.001):
        eqs = Equations(c1=-c, beta=beta, n2=factor * edge)
        assert (moment_growth(eqs, 2) > 0.0) is (factor > 1.0)
        assert power_tail(eqs).moment_diverges(2.0) is (factor > 1.0)


def test_weak_noise_has_a_known_exponent():
    """Lambda(p) = -c p/2 + N2 p (p + 2)/8 of a lightly damped oscillator: q = 4 c/N2 - 2."""
    for c, n2 in ((0.01, 0.0125), (0.01, 0.008), (0.01, 0.005)):
        assert power_tail(Equations(c1=-c, n2=n2)).exponent == pytest.approx(
            4.0 * c / n2 - 2.0, rel=0.002
        )


def test_moments_as_the_exact_engine_finds_them():
    """With a load: the N2 at which the second moments blow up is where the closed form of E[V^2] has no solution."""
    loaded = Equations(c1=-0.02, beta=0.4, mu=1.3, n1=0.01, n2=5.0)
    with pytest.raises(UnboundedResponseError, match="N2 must be below") as refused:
        solve(loaded)
    edge = float(str(refused.value).split("below ")[1].split(",")[0])
    assert abs(moment_growth(changed(loaded, n2=edge), 2)) < 1e-5 * edge
    assert power_tail(changed(loaded, n2=0.999 * edge)).exponent == pytest.approx(2.0, abs=0.01)


def sampled_growth(eqs, power, blocks=8, rounds=10, segments=480):
    """Lambda(power) and its standard error: paths multiply by |z|^power after each segment, and as many continue."""
    rng = np.random.default_rng(3)
    words = np.array([random_words(np.random.SeedSequence([3, k]), BATCH) for k in range(8)])
    phase = rng.uniform(-0.5 * math.pi, 0.5 * math.pi, (blocks, BATCH))
    state = np.stack([np.cos(phase), np.sin(phase), 0.0 * phase], axis=1)
    rates = []
    draws = 4
    h = 0.05
    pushes = np.zeros((3, BATCH))
    c = Coefficients(mu=eqs.mu, beta=eqs.beta, c1=eqs.c1, n2=eqs.n2, r=eqs.restitution)
    for _ in range(segments):
        logs = np.zeros((blocks, BATCH))
        for k in range(blocks):
            batch = Batch(state[k], *words[k])
            grow(batch, logs[k], pushes, rounds, draws, False, h, c)
        weights = np.exp(power * logs.ravel())
        rates.append(math.log(weights.mean()) / (rounds * 2 * draws * h))
        chosen = rng.permutation(
            np.searchsorted(
                np.cumsum(weights) / weights.sum(), (rng.random() + np.arange(512)) / 512
            )
        )
        everybody = np.moveaxis(state, 1, 0).reshape(3, -1)[:, np.minimum(chosen, 511)]
        state = np.ascontiguousarray(np.moveaxis(everybody.reshape(3, blocks, BATCH), 0, 1))
    batches = np.array(rates[segments // 8 :]).reshape(10, -1).mean(axis=1)
    return batches.mean(), batches.std(ddof=1) / math.sqrt(10)


@pytest.mark.statistics
@pytest.mark.parametrize("r, n2", [(0.95, 0.1), (0.8, 0.2)])
def test_moments_with_a_stop_and_a_load(r, n2):
    """E[A^p] fades at the lower end of the exponent and grows at the upper one, beyond four standard errors."""
    eqs = changed(STOPPED, restitution=r, n2=n2)
    tail = power_tail(eqs)
    assert tail.lowest < tail.exponent < tail.highest < math.inf
    (low, low_error), (high, high_error) = (
        sampled_growth(eqs, end) for end in (tail.lowest, tail.highest)
    )
    assert low < -4.0 * low_error
    assert high > 4.0 * high_error


def test_what_has_no_tail():
    """A spring or a friction that grows, a second stop, no parametric noise: all moments exist."""
    growing = {"alpha": 0.5}, {"c2": -0.1}, {"c3": 0.1}, {"n2": None}
    for one in (*growing, {"opposite_gap": 1.0, "opposite_restitution": 0.9}, {"n2": 1e-3}):
        assert power_tail(changed(STOPPED, **one)) is None
    assert power_tail(PAPER) is None


def test_what_is_not_known_of_a_circuit():
    """A circuit draws energy, nobody knows how much: no upper end, and the bare device's as the lower one."""
    tail = power_tail(Equations(c1=-0.05, beta=1.25, n2=0.04), driven=True)
    assert tail.highest == math.inf
    assert (
        tail.lowest
        == power_tail(Equations(c1=-0.05, n2=0.04)).exponent
        == pytest.approx(3.0, rel=0.02)
    )
