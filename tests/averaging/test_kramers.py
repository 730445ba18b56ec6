"""Kramers' rate: its limits in closed form, and where it is not known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from harvester.averaging.kramers import hopping_rates, taken_up
from harvester.equations.coefficients import Equations

# U = 1/4, w = sqrt(2), wb = 1; S = 4/3 by hand
WELLS = Equations(linear=-1.0, alpha=1.0, c1=-1e-5, n1=0.02e-5)
U = 0.25
W = math.sqrt(2.0)
WB = 1.0
S = 4.0 / 3.0


def of_damping(g, theta=0.02):
    return Equations(linear=-1.0, alpha=1.0, c1=-g, n1=theta * g)


def test_weak_damping():
    """k = g S/T w/(2 pi) exp(-U/T) out of one well; between two, each mass comes back every other time: half of it."""
    left, right = hopping_rates(of_damping(1e-6))
    expected = 0.5 * 1e-6 * S / 0.02 * W / (2.0 * math.pi) * math.exp(-U / 0.02)
    assert left == pytest.approx(expected, rel=0.01)
    assert right == pytest.approx(left, rel=1e-9)


def test_weak_damping_out_of_uneven_wells():
    """U = -x^2/2 + a x^3/3 + x^4/4: d1 d2/(d1 + d2) w/(2 pi) exp(-U/T), d = g S/T, by SciPy's quadrature of S."""
    a = 0.4
    g = 1e-6
    theta = 0.02
    energy = np.polynomial.Polynomial([0.0, 0.0, -0.5, a / 3.0, 0.25])

    def speed(x):
        return math.sqrt(max(-2.0 * energy(x), 0.0))

    losses = []
    attempts = []
    for side in (-1.0, 1.0):
        rest = 0.5 * (-a + side * math.sqrt(a * a + 4.0))
        end = side * max(side * root.real for root in energy.roots())
        losses.append(g / theta * 2.0 * abs(quad(speed, 0.0, end)[0]))
        w = math.sqrt(energy.deriv(2)(rest))
        attempts.append(w / (2.0 * math.pi) * math.exp(energy(rest) / theta))
    both = losses[0] * losses[1] / sum(losses)
    found = hopping_rates(replace(of_damping(g, theta), alpha2=a))
    assert found == pytest.approx([both * attempt for attempt in attempts], rel=0.01)


def test_strong_damping():
    """k = w wb/(2 pi g) exp(-U/T) far above wb; small motions no longer turn from 2 w on, so that g stays below."""
    g = 2.5
    left, _ = hopping_rates(of_damping(g))
    turning = math.sqrt(W * W - 0.25 * g * g)
    factor = (math.sqrt(0.25 * g * g + WB * WB) - 0.5 * g) / WB
    assert left == pytest.approx(factor * turning / (2.0 * math.pi) * math.exp(-U / 0.02), rel=1e-3)
    assert hopping_rates(of_damping(4.0)) is None


@pytest.mark.parametrize(("d", "value"), [(1e-6, 0.99918e-6), (0.1, 0.0770869), (60.0, 1.0)])
def test_what_a_turn_takes(d, value):
    """Against SciPy's adaptive quadrature of the integral in z."""
    assert taken_up(d) == pytest.approx(value, rel=1e-4)


@pytest.mark.parametrize(
    "other",
    [
        {"linear": None},
        {"n1": None},
        {"c2": -0.1},
        {"beta": 0.1},
        {"beta": 0.2, "mu": 1.0},
        {"c1": 0.1},
    ],
)
def test_where_the_formula_is_not_known(other):
    """One well, no white noise, friction that changes with x, an open circuit, strong coupling, damping that feeds."""
    known = {"linear": -1.0, "alpha": 1.0, "c1": -0.1, "n1": 0.01} | other
    assert hopping_rates(Equations(**known)) is None
