"""Anderson's acceleration of a period map: maps with slow, turning and noisy modes, and one without a fixed point."""

import numpy as np
import pytest

from harvester.errors import CircuitError
from harvester.mechanics.periodic import MOST, Secants, Settling

SLOW = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
GROUPS = np.array([0, 0, 1])


def settling(rate, noise=0.0, push=0.0):
    """A motion that spirals in, a slow capacitor that it charges, and a node that is their sum; what was met."""
    fixed = np.array([1.0, -0.5, 3.0])
    rng = np.random.default_rng(1)
    calls = []
    matrix = np.array([[0.6, -0.5, 0.02], [0.5, 0.6, 0.0], [0.05, 0.0, rate]])

    def turn(y):
        calls.append(y)
        new = (
            fixed
            + matrix @ (y[:3] - fixed)
            + push * (y[2] - fixed[2]) ** 2 * np.array([0.0, 0.0, -1.0])
        )
        new *= 1.0 + noise * rng.standard_normal(3)
        return np.append(new, new.sum()), np.array([new[2] ** 2, 1.0])

    return Settling(turn, SLOW, GROUPS, np.zeros(4)), fixed, calls


@pytest.mark.parametrize("rate, push", [(0.9, 0.0), (0.99, 0.0), (0.999, 0.0), (0.9, 0.01)])
def test_a_slow_mode_takes_a_few_periods(rate, push):
    """Alone it would take 1400 periods at 0.99 to come to 1e-6."""
    settled, fixed, calls = settling(rate, push=push)
    assert settled.reach()
    assert settled.state[:3] == pytest.approx(fixed, rel=3e-5)
    assert settled.state[3] == pytest.approx(fixed.sum(), rel=3e-5)
    assert len(calls) < 30


def test_what_is_left_is_told_from_what_the_last_periods_did():
    """A state off the fixed point: how far it and the square of its capacitor's voltage are from there."""
    settled, fixed, _ = settling(0.99)
    assert settled.reach()
    off = np.append(fixed + np.array([1e-3, 2e-3, 5e-3]), 0.0)
    after, means = settled.turn(off)
    state, change = settled.left(SLOW @ (after - off))
    assert state[:3] == pytest.approx(after[:3] - fixed, rel=1e-2)
    assert 0.4 < change[0] / (means[0] - fixed[2] ** 2) < 2.5  # a square, from periods farther off


@pytest.mark.parametrize("angle", [0.05, 0.1, 0.3])
def test_a_mode_that_turns_slowly_is_not_told_by_one_change(angle):
    """It loses 7 % a period: one change states where it moves now, not where it ends, and the way seemed over."""
    fixed = np.array([1.0, -0.5])
    (c, s) = (np.cos(angle), np.sin(angle))

    def turn(y):
        new = fixed + 0.93 * np.array([[c, -s], [s, c]]) @ (y - fixed)
        return new, np.array([new[0] ** 2])

    for begin in np.linspace(0.0, 6.0, 13):
        aside = 3e-4 * np.array([np.cos(begin), np.sin(begin)])
        settled = Settling(turn, np.eye(2), np.array([0, 0]), fixed + aside, slowest=14.0)
        assert settled.reach(1e-4)
        assert np.linalg.norm(settled.state - fixed) < 1e-4 * np.linalg.norm(fixed)


def test_what_no_change_explains_counts_for_as_long_as_the_slowest_mode_lasts():
    settled = Settling(
        lambda y: (y, np.ones(1)), np.eye(2), np.array([0, 0]), np.array([3.0, 4.0]), slowest=20.0
    )
    assert settled.unexplained(np.array([0.05, 0.0])) == pytest.approx(20.0 * 0.05 / 5.0)
    along = np.array([[0.1, 0.0]])
    settled.known = Secants(along, along, np.ones((1, 1)))
    assert settled.unexplained(np.array([0.05, 0.0])) < 1e-2 * 20.0 * 0.05 / 5.0
    assert settled.unexplained(np.array([0.0, 0.05])) == pytest.approx(20.0 * 0.05 / 5.0)


def test_noise_ends_the_way_where_it_lets_nothing_be_won():
    settled, fixed, calls = settling(0.9, noise=1e-6)
    assert settled.reach()
    assert settled.state[:3] == pytest.approx(fixed, rel=1e-3)
    assert len(calls) < MOST


def test_a_map_that_never_comes_back_is_told():
    rng = np.random.default_rng(2)
    settled = Settling(lambda y: (rng.standard_normal(4), np.zeros(2)), SLOW, GROUPS, np.zeros(4))
    assert not settled.reach()


def test_a_state_that_the_circuit_cannot_begin_with_is_gone_around():
    """A combination that the circuit refuses is left out; refused on the plain way, the error is reported."""
    settled, fixed, _ = settling(0.9)
    plain = settled.turn
    refused = []

    def turn(y):
        if y[2] > 2.2 and len(refused) < 2:
            refused.append(y)
            raise CircuitError("it did not converge")
        return plain(y)

    settled.turn = turn
    assert settled.reach()
    assert settled.state[:3] == pytest.approx(fixed, rel=1e-5)
    assert len(refused) == 2

    def never(y):
        raise CircuitError("it did not converge")

    settled.turn = never
    with pytest.raises(CircuitError):
        settled.reach()


@pytest.mark.parametrize("period", [2, 3, 4])
def test_a_circuit_that_fails_where_nothing_is_won(period):
    """Combinations are refused now and then on a way that comes no nearer: it continues, and has no fixed point."""
    rng = np.random.default_rng(3)
    last = [np.zeros(4)]
    calls = []

    def turn(y):
        calls.append(y)
        if len(calls) % period == 0 and y is not last[0]:
            raise CircuitError("it did not converge")
        last[0] = rng.standard_normal(4)
        return last[0], np.zeros(2)

    assert not Settling(turn, SLOW, GROUPS, np.zeros(4)).reach()
    assert len(calls) >= MOST
