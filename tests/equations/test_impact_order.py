"""The order of the step's bias next to a stop, from the law of the speeds with which a mass returns to it."""

import math

import pytest
from scipy.integrate import quad

from harvester.equations.impact_order import COLLAPSE, accumulation, impact_order, step_order
from tests.support.systems import PAPER, changed


def mean_of_power(s):
    """E[z^s] of McKean's density of the speed ratio z of an integrated Brownian motion that returns to its start."""

    def part(z):
        return 1.5 / math.pi * z ** (1.5 + s) / (1.0 + z**3)

    return quad(part, 0.0, 1.0)[0] + quad(part, 1.0, math.inf)[0]


@pytest.mark.parametrize("s", [-1.0, -0.3, 0.0, 0.4])
def test_moments_of_the_speed_ratio(s):
    """E[z^s] = 1/(2 cos(pi (1 + s)/3)), the density's own integral for s = 0."""
    assert mean_of_power(s) == pytest.approx(0.5 / math.cos(math.pi * (1.0 + s) / 3.0), rel=1e-8)


def test_the_logarithm_of_the_speed_neither_grows_nor_falls_at_collapse():
    """E[ln(r z)] = 0 at r = exp(-pi/sqrt 3), by a difference of E[z^s]."""
    slope = (mean_of_power(1e-4) - mean_of_power(-1e-4)) / 2e-4
    assert math.log(COLLAPSE) + slope == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("r", [0.02, 0.1, 0.162, 0.164, 0.37, 0.5, 0.9])
def test_the_order_solves_its_equation(r):
    """E[(r z)^-a] = 1 for p = 1 + a/2, other than a = 0."""
    a = 2.0 * (impact_order(r) - 1.0)
    assert abs(a) > 1e-4
    assert r**-a * 0.5 / math.cos(math.pi * (1.0 - a) / 3.0) == pytest.approx(1.0, rel=1e-9)


def test_orders_between_no_and_all_restitution():
    """It grows from 0.75 to 2 with the restitution coefficient; a half gives 1.5."""
    orders = [impact_order(0.02 * k) for k in range(51)]
    assert orders == sorted(orders)
    assert (orders[0], orders[25], orders[50]) == pytest.approx((0.75, 1.5, 2.0), abs=1e-9)


def test_only_white_noise_beside_a_rigid_stop_lowers_it():
    strong = changed(PAPER, restitution=0.1)
    assert step_order(strong) == impact_order(0.1)
    assert step_order(changed(strong, opposite_restitution=0.02, opposite_gap=1.0)) == impact_order(
        0.02
    )
    assert (
        step_order(changed(strong, n1=None)) == step_order(changed(PAPER, restitution=None)) == 2.0
    )
    assert accumulation(strong) is not None
    assert accumulation(changed(strong, restitution=0.17)) is None
    assert accumulation(changed(strong, n1=None)) is None
