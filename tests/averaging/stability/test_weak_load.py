"""A load with a vanishing coupling leaves the motion its exponent, and the voltage another."""

import pytest

from harvester.averaging.stability import averaged_exponent as formula
from harvester.equations.coefficients import Equations


@pytest.mark.parametrize("c1", [-0.05, -0.1, -0.2, -0.4])
@pytest.mark.parametrize("mu", [0.01, 0.02, 2.0])
def test_a_weak_load_leaves_the_larger_of_two_exponents(c1, mu):
    """Without coupling the motion has its exponent, the voltage -mu: the noise decides which is the larger.

    With c1 = -0.05 the motion fades faster than the voltage, and grows with noise.
    """
    eqs = Equations(c1=c1, mu=mu, beta=1e-7, n2=0.3)
    motion = float(formula.decoupled(c1, 1.0, 0.3, None))
    assert float(formula.averaged(eqs)) == pytest.approx(max(motion, -mu), abs=1e-6)
