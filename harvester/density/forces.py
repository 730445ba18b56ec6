"""What acts on the mass at a displacement x: force, friction, and the intensity of the noise."""

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations


def force(eqs: Equations, x: Floats) -> Floats:
    """The acceleration by the spring, and by a compliant stop while in contact, at v = 0 and without voltage."""
    linear, alpha2, alpha = eqs.spring
    total = -x * (linear + x * (alpha2 + x * alpha))
    if eqs.softening is not None:
        total += eqs.softening * x * np.abs(x)
    if eqs.stop_stiffness is not None:
        total -= eqs.stop_stiffness * np.minimum(x + (eqs.gap or 0.0), 0.0)
    if eqs.mu is None and eqs.beta is not None:
        total -= eqs.beta * x  # V = x: the capacitance is one more spring
    return total


def friction(eqs: Equations, x: Floats) -> Floats:
    """The friction c(x) = c3 x^4 - c2 x^2 - c1, and that of a compliant stop while in contact."""
    total: Floats = sum((f * x ** (2 * i) for i, f in enumerate(eqs.friction)), np.zeros_like(x))
    if eqs.stop_stiffness is not None and eqs.stop_damping is not None:
        total = total + np.where(x + (eqs.gap or 0.0) < 0.0, eqs.stop_damping, 0.0)
    return total


def noise(eqs: Equations, x: Floats) -> Floats:
    """The intensity N(x) = N1 + 2 N12 x + N2 x^2 of the white noise on the velocity."""
    return (eqs.n1 or 0.0) + 2.0 * (eqs.n12 or 0.0) * x + (eqs.n2 or 0.0) * x**2


def heat(eqs: Equations) -> float:
    """The intensity of the noise of the base; of coloured noise that which it has at the resonance."""
    if eqs.coloured is None:
        return eqs.n1 or 0.0
    return eqs.coloured / (1.0 + abs(eqs.spring[0]) * (eqs.correlation_time or 0.0) ** 2)
