"""The law of one parabola per key, its check by devices, and the polynomial through the rest."""

import numpy as np
import pytest

from harvester.answers.estimate import Estimate
from harvester.studies.tolerance import answer_levels, curved_law
from harvester.uncertainty.value import Value

ENDS = np.array([[1.0, 2.0], [0.5, 2.0], [1.7, 2.0], [1.0, 1.8], [1.0, 2.6]])
DEVICES = np.random.default_rng(1).uniform([0.5, 1.8], [1.7, 2.6], (60, 2))


def separate(x):
    """A sum of two parabolas."""
    return 3.0 + 0.4 * x[:, 0] - 0.7 * x[:, 0] ** 2 + 0.2 * x[:, 1] + 0.5 * x[:, 1] ** 2


def joint(x):
    """With a term of both keys, which no run of one key alone shows."""
    return separate(x) + 0.6 * (x[:, 0] - 1.0) * (x[:, 1] - 2.0)


def test_parabolas_are_found_between_and_beyond_uneven_ends():
    """A wrong divided difference would be off for ends at unequal distances from the middle."""
    law = curved_law.through_ends(ENDS, separate(ENDS))
    beyond = np.array([[0.1, 3.0], [2.5, 1.0]])
    assert law(DEVICES) == pytest.approx(separate(DEVICES), rel=1e-12)
    assert law(beyond) == pytest.approx(np.maximum(separate(beyond), 0.0), rel=1e-12)
    assert curved_law.checked(law, DEVICES, separate(DEVICES), ENDS, DEVICES).scatter < 1e-12


def test_an_end_at_the_middle_has_no_slope():
    """A measured list may have its middle value at one end."""
    ends = np.array([[1.0], [1.0], [1.5]])
    law = curved_law.through_ends(ends, np.array([2.0, 2.0, 3.0]))
    assert law(np.array([[1.25]]))[0] == pytest.approx(2.5)


def test_few_devices_state_the_error_and_many_bring_the_rest():
    """Two keys together move the value: the scatter holds 95 % of other devices, and a polynomial removes it."""
    law = curved_law.through_ends(ENDS, joint(ENDS))
    few = curved_law.checked(law, DEVICES[:6], joint(DEVICES[:6]), ENDS, DEVICES)
    off = np.abs(few(DEVICES) - joint(DEVICES))
    assert few.rest is None and (off < few.scatter).mean() > 0.9
    assert few.scatter < 10.0 * np.sqrt(np.mean(off**2))
    many = curved_law.checked(law, DEVICES[:40], joint(DEVICES[:40]), ENDS, DEVICES)
    assert many.rest is not None and many.unexplained < 1e-6
    assert many(DEVICES) == pytest.approx(joint(DEVICES), rel=1e-6)


def peak(x):
    """A power with a peak, below 0 for the parabolas at many devices."""
    return 6e-6 / np.prod(1.0 + ((x - 0.01) / 0.1) ** 2, axis=1)


def test_a_rest_belongs_to_the_sum_that_may_be_below_zero():
    """A rest of the law that is clipped at 0 would be added to a sum far below 0."""
    ends = np.array([[0.0, 0.0], [-0.18, 0.0], [0.18, 0.0], [0.0, -0.18], [0.0, 0.18]])
    x = np.random.default_rng(3).uniform(-0.2, 0.2, (4000, 2))
    law = curved_law.through_ends(ends, peak(ends))
    assert (law.sum_at(x) < 0.0).mean() > 0.02
    found = curved_law.checked(law, x[:72], peak(x[:72]), ends, x)
    assert found.rest is not None
    share = (peak(x) > 1.5e-6).mean()
    assert abs((found(x) > 1.5e-6).mean() - share) < 0.03
    assert (np.abs(found(x) - peak(x)) < found.scatter).mean() > 0.9


def test_places_that_show_nothing_do_not_make_the_scatter_small():
    """Both corners are exact: they do not count as sampled, and the curvatures state the error of few devices."""
    law = curved_law.through_ends(ENDS, joint(ENDS))
    corners = np.array([[1.0, 2.0], [1.0, 2.0]])
    x = np.vstack([corners, DEVICES[:6]])
    alone = curved_law.checked(law, x[2:], joint(x[2:]), ENDS, DEVICES)
    both = curved_law.checked(law, x, joint(x), ENDS, DEVICES, corners=2)
    assert both.scatter == pytest.approx(alone.scatter, rel=1e-12)
    bend = np.quantile(np.abs(law.bend(DEVICES)), 0.95)
    none = curved_law.checked(law, corners, joint(corners), ENDS, DEVICES, corners=2)
    assert none.scatter == pytest.approx(bend, rel=1e-9)
    assert curved_law.checked(law, x[:0], joint(x[:0]), ENDS, DEVICES).unexplained == 1.0


def test_ends_in_falling_order_are_ends_too():
    """A lognormal spread about a negative value has its larger end first."""
    rising = np.array([[-0.05], [-0.08], [-0.03]])
    falling = rising[[0, 2, 1]]
    laws = [curved_law.through_ends(ends, (ends**2).ravel()) for ends in (rising, falling)]
    x = np.linspace(-0.1, -0.01, 9)[:, None]
    assert laws[1](x) == pytest.approx((x**2).ravel(), rel=1e-9)
    assert laws[0](x) == pytest.approx(laws[1](x))


def test_noise_is_not_a_curvature():
    """A straight line with noise has none; the slope between uneven ends stays."""
    errors = np.array([0.01, 0.01])
    noisy = ENDS @ [0.5, 0.8] + [0.0, 1e-4, 1e-4, -1e-4, 1e-4]
    law = curved_law.through_ends(ENDS, noisy, errors)
    assert not law.curvatures.any()
    assert law(ENDS[2:3]) - law(ENDS[1:2]) == pytest.approx(noisy[2] - noisy[1])
    drawn = 3.0 + np.random.default_rng(6).normal(0.0, 1.0, 100_000)
    squares = curved_law.without_noise(drawn, np.ones(len(drawn))) ** 2
    assert abs(squares.mean() - 9.0) < 4.0 * squares.std() / np.sqrt(len(drawn)) + 0.01
    plain = curved_law.through_ends(ENDS, joint(ENDS))
    sums = [
        np.dot(curved_law.weights(ENDS, k), joint(ENDS[[0, 1 + 2 * k, 2 + 2 * k]]))
        for k in range(2)
    ]
    assert sums == pytest.approx(plain.curvatures)


@pytest.mark.parametrize("count", [24, 72])
def test_the_interval_of_a_rest_holds_95_percent_of_devices(count):
    """Powers of all directions, also beyond the sampled devices; twice the scatter held 70 to 93 %."""
    random = np.random.default_rng(0)
    ends = np.vstack([np.zeros(2), [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    held = []
    for _ in range(30):
        square, cube = random.normal(size=(2, 2)), 0.3 * random.normal(size=(2, 2, 2))

        def power(x, square=square, cube=cube):
            bent = np.einsum("ni,nj,ij->n", x, x, square)
            return 20.0 + x.sum(axis=1) + bent + np.einsum("ni,nj,nk,ijk->n", x, x, x, cube)

        x = random.uniform(-1.05, 1.05, (2000, 2))
        law = curved_law.through_ends(ends, power(ends))
        found = curved_law.checked(law, x[:count], power(x[:count]), ends, x)
        assert found.rest is not None
        held.append((np.abs(found(x) - power(x)) <= found.scatter).mean())
    assert 0.935 < np.mean(held) < 0.995


def test_the_steepest_places_are_those_of_a_linear_law():
    """For independent keys of equal spread the places lie along the slopes, on both sides."""
    x = np.random.default_rng(2).normal(0.0, 1.0, (4000, 2))
    law = curved_law.CurvedLaw(np.zeros(2), 10.0, np.array([3.0, 4.0]), np.zeros(2))
    low, high = curved_law.steepest(law, x, 1.645)
    assert high == pytest.approx(-low)
    assert high / 1.645 == pytest.approx([0.6, 0.8], abs=0.05)


def test_noise_of_slopes_adds_in_quadrature():
    """Two keys whose devices scatter by half of the distance of their ends."""
    ends = np.array([[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    law = curved_law.through_ends(ends, np.arange(5.0))
    x = np.array([[-1.0, -1.0], [1.0, 1.0]])
    assert curved_law.noise(law, [3.0, 4.0], [0.0, 0.0], ends, x) == pytest.approx(2.5)
    assert curved_law.noise(law, [3.0, 4.0], [6.0, 0.0], ends, x) == pytest.approx(6.5)


@pytest.mark.parametrize("known", [0, 1, 2])
def test_the_error_of_a_curvature_is_that_of_its_three_answers(known):
    """The ends count alike: an end twice in place of both would state another end's error, or none."""
    ends = np.array([[1.0], [0.7], [1.2]])
    errors = np.zeros(3)
    errors[known] = 0.1
    power = [Value(2.0 + k, float(error)) for k, error in enumerate(errors)]
    answers = [Estimate("spice", True, each, each, {}, (), 0.0, 0) for each in power]
    (stated,) = answer_levels.bend_errors(ends, answers, "mean_power")
    step = 1e-3
    moved = np.array([each.value for each in power])
    laws = [
        curved_law.through_ends(ends, moved + way * step * np.eye(3)[known]) for way in (-1.0, 1.0)
    ]
    away = np.array([[0.7], [1.0], [1.2]])
    bends = [_bend(law(away)) for law in laws]
    assert stated == pytest.approx(0.1 * abs(bends[1] - bends[0]) / (2.0 * step), rel=1e-6)


def _bend(y):
    """The second divided difference over 0.7, 1 and 1.2, of which a law's curvature is a multiple."""
    return ((y[2] - y[1]) / 0.2 - (y[1] - y[0]) / 0.3) / 0.5
