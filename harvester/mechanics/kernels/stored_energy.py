"""Energies that the springs of the mass hold, whose slopes are the forces of the equation of motion."""

from harvester.mechanics.kernels.compiled import inlined


@inlined
def nonlinear_energy(x, c):
    """Energy of the spring beyond its linear term: alpha2 x^3/3 + alpha x^4/4 - softening |x|^3/3."""
    energy = 0.0
    if c.alpha2 is not None:
        energy += c.alpha2 / 3.0 * x * x * x
    if c.alpha is not None:
        energy += 0.25 * c.alpha * x * x * x * x
    if c.softening is not None:
        energy -= c.softening / 3.0 * x * x * abs(x)
    return energy


@inlined
def spring_energy(x, c):
    """Energy of the whole spring; a linear of None is 1."""
    linear = 0.5 if c.linear is None else 0.5 * c.linear
    return linear * x * x + nonlinear_energy(x, c)


@inlined
def contact_energy(x, c):
    """Energy that a compliant stop stores: k y^2/2."""
    if c.k is None:
        return 0.0
    y = x + c.gap
    return 0.5 * c.k * y * y if y < 0.0 else 0.0
