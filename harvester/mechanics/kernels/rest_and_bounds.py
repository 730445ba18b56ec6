"""Where the mass rests, where the stops are, and what keeps the response from growing without bound."""

import math

import numpy as np

from harvester.equations.scaling import Equations
from harvester.errors import UnboundedResponseError


def rigid_stop_places(eqs: Equations) -> tuple[float, float]:
    """Least and most x that the rigid stops allow; infinite where there is none."""
    low = -math.inf if eqs.restitution is None else 0.0 - (eqs.gap or 0.0)
    high = math.inf if eqs.opposite_restitution is None else eqs.opposite_gap or 0.0
    return low, high


def stop_places(eqs: Equations) -> tuple[float, float]:
    """Places of the stops, rigid or compliant; infinite where there is none."""
    low, high = rigid_stop_places(eqs)
    return (low if eqs.stop_stiffness is None else -(eqs.gap or 0.0)), high


def spring_coefficients(eqs: Equations) -> tuple[float, float, float]:
    """Linear, quadratic and cubic coefficient of the spring, 0 where absent."""
    return 1.0 if eqs.linear is None else eqs.linear, eqs.alpha2 or 0.0, eqs.alpha or 0.0


def spring_force(eqs: Equations, x: float) -> float:
    """Force of the spring at x; 0 at infinity, where no stop is."""
    linear, alpha2, alpha = spring_coefficients(eqs)
    return -x * (linear + x * (alpha2 + x * alpha)) if math.isfinite(x) else 0.0


def resting_places(eqs: Equations) -> list[float]:
    """Where the mass can rest without voltage: minima of the spring's energy, and stops that it is pressed on.

    In ascending order; two or more for a bistable spring.  A mass pressed on a compliant stop is placed at its edge.
    """
    linear, alpha2, alpha = spring_coefficients(eqs)
    low, high = stop_places(eqs)
    pressed = {x for x, inward in ((low, 1.0), (high, -1.0)) if inward * spring_force(eqs, x) < 0.0}
    roots = np.roots([alpha, alpha2, linear, 0.0])
    free = roots.real[roots.imag == 0.0]
    minimum = linear + free * (2.0 * alpha2 + 3.0 * alpha * free) > 0.0
    return sorted(pressed | {float(x) for x in free[minimum] if low <= x <= high})


def unlike_wells(eqs: Equations) -> bool:
    """Whether the mass has several resting places that are not mirror images of each other."""
    stop, opposite = (eqs.restitution, eqs.gap), (eqs.opposite_restitution, eqs.opposite_gap)
    mirrored = stop == opposite and eqs.alpha2 is None and eqs.n12 is None and eqs.stop_stiffness is None
    return len(resting_places(eqs)) > 1 and not mirrored


def check_bounded(eqs: Equations) -> None:
    """Refuse a friction that feeds energy at every large amplitude, and a spring that pushes the mass away for good.

    Raises
    ------
    UnboundedResponseError
        where the highest term of f(x) = c3 x^4 - c2 x^2 - c1 beyond c1 is negative, or where the spring's energy falls
        without bound on a side without a stop.
    """
    name, top, cure = _loss_at_large_amplitude(eqs)
    if top < 0.0:
        raise UnboundedResponseError(
            f"the response grows without bound: {name} feeds energy at large amplitude and nothing bounds it; "
            f"give {cure}"
        )
    linear, alpha2, alpha = spring_coefficients(eqs)
    low, high = rigid_stop_places(eqs)
    above = alpha or alpha2 or linear
    below = alpha or -alpha2 or linear + (eqs.stop_stiffness or 0.0)
    for side, pull, end, stop in (("above", above, high, "opposite_stop"), ("below", below, low, "stop")):
        if pull < 0.0 and math.isinf(end):
            raise UnboundedResponseError(
                f"the response grows without bound: far {side} rest the spring pushes the mass away and nothing holds "
                f"it; give a cubic_stiffness above 0, or a rigid {stop}"
            )


def friction_bounds(eqs: Equations) -> bool:
    """Whether friction, or what impacts take between two stops, grows so that no noise makes the response endless."""
    return _loss_at_large_amplitude(eqs)[1] > 0.0


def surely_bounded(eqs: Equations) -> bool:
    """Whether the response has a bound for a reason that needs no simulation.

    The friction grows with the amplitude; or it feeds no energy anywhere, something takes energy,
    and the noise does not grow with x.
    """
    takes = (eqs.c1 or 0.0) < 0.0 or (eqs.restitution is not None and eqs.restitution < 1.0)
    takes = takes or (eqs.beta is not None and eqs.mu is not None)
    return friction_bounds(eqs) or (takes and (eqs.c1 or 0.0) <= 0.0 and eqs.n2 is None)


def _loss_at_large_amplitude(eqs: Equations) -> tuple[str, float, str]:
    """What takes (positive) or feeds (negative) energy at large amplitudes: its name, its size, and a cure.

    The highest term present of f beyond c1; between two stops their losses, or the mean of f where they lose nothing.
    """
    low, high = rigid_stop_places(eqs)
    if math.isfinite(high - low):
        if (eqs.restitution or 0.0) * (eqs.opposite_restitution or 0.0) < 1.0:
            return "impact", 1.0, ""
        terms = ((-(eqs.c1 or 0.0), 1), (-(eqs.c2 or 0.0), 3), (eqs.c3 or 0.0, 5))
        mean = sum(c / n * (high**n - low**n) for c, n in terms)
        return "the damping between the stops", mean, "a positive damping, or a restitution below 1"
    if eqs.c3:
        return "damping_x4 (c3)", eqs.c3, "a positive damping of a higher power"
    return "damping_x2 (-c2)", -(eqs.c2 or 0.0), "a positive damping of a higher power"
