"""The terms that keep a response from growing without bound, and the refusal of equations if nothing does."""

import math

import numpy as np
from numpy.polynomial import Polynomial

from harvester.arrays import Floats
from harvester.equations.coefficients import FRICTION, Equations
from harvester.equations.effects import LINEAR, unknown_to
from harvester.errors import UnboundedResponseError

# in w0, and of the largest coefficient: eigenvalues are not known better
SLOWEST, ROUNDING = 1e-9, 1e-14


def check_bounded(eqs: Equations, driven: bool = False) -> None:
    """Refuse a friction that feeds energy at every large amplitude, and a spring that pushes the mass away for good.

    ``driven``: by a circuit that is not in the equations, and may dissipate energy.

    Raises UnboundedResponseError if the highest term of f(x) = c3 x^4 - c2 x^2 - c1 beyond c1 is
    negative, if linear equations have an eigenvalue that grows, or if the spring's energy
    falls without bound on a side without a stop.
    """
    feed = -eqs.friction[0]
    growth = None if driven or feed <= 0.0 else linear_growth(eqs)
    if growth is not None and growth > SLOWEST + ROUNDING * (
        feed + (eqs.beta or 0.0) + (eqs.mu or 0.0)
    ):
        raise UnboundedResponseError(
            f"the response grows without bound: the equations are linear, and as the damping is negative, their "
            f"motions grow as exp({growth:.3g} w0 t); give a positive damping, or damping_x2"
        )
    name, top, cure = _loss_at_large_amplitude(eqs)
    if top < 0.0:
        raise UnboundedResponseError(
            f"the response grows without bound: {name} feeds energy at large amplitude and nothing bounds it; "
            f"give {cure}"
        )
    if eqs.is_random or eqs.drive is None or not eqs.resting_places:
        # a drive alone may leave the mass in a well; a path that leaves it ends in an error
        _check_spring(eqs)


def _check_spring(eqs: Equations) -> None:
    """Refuse a spring whose energy falls without bound on a side without a stop."""
    linear, alpha2, alpha = eqs.spring
    soft = eqs.softening or 0.0
    low, high = eqs.rigid_stops
    above = alpha or alpha2 - soft or linear
    below = alpha or -alpha2 - soft or linear + (eqs.stop_stiffness or 0.0)
    for side, pull, end, stop in (
        ("above", above, high, "opposite_stop"),
        ("below", below, low, "stop"),
    ):
        if pull < 0.0 and math.isinf(end):
            raise UnboundedResponseError(
                f"the response grows without bound: far {side} rest the spring pushes the mass away and nothing holds "
                f"it; give a cubic_stiffness above 0, or a rigid {stop}"
            )


def linear_growth(eqs: Equations) -> float | None:
    """The largest real part of the eigenvalues of linear equations (`growth_near`), in w0.

    None if any is not.
    """
    is_linear = eqs.linear is None and unknown_to(LINEAR).isdisjoint(eqs.effects)
    return growth_near(eqs) if is_linear else None


def growth_near(eqs: Equations, x: float = 0.0) -> float:
    """The largest real part of the eigenvalues of `flow`, in w0."""
    return float(np.linalg.eigvals(flow(eqs, x)).real.max())


def flow(eqs: Equations, x: float = 0.0) -> Floats:
    """The matrix of small motions (x, x', V) about a place off the stops.

    Without a load of (x, x'): V is a spring.

    With further modes x and x' are the coordinates and speeds of all.
    """
    mass = 1.0 + (eqs.inertia or 0.0) * x * x
    grown = 1.0 + (eqs.gamma or 0.0) * x * x
    stiffness = eqs.spring_slope(x) / mass
    friction = float(Polynomial(eqs.friction)(x**2)) / mass
    beta = (eqs.beta or 0.0) * grown / mass
    return eqs.modal.flow(stiffness, friction, beta=beta, grown=grown, mu=eqs.mu)


def strongest_feed(eqs: Equations) -> float:
    """The largest of -f(x) over all x, the rate at which friction feeds energy.

    0 if it never does.
    """
    return max(0.0, -least_friction(eqs))


def least_friction(eqs: Equations) -> float:
    """The least of f(x) over all x.

    It is at rest, or if f, a polynomial of x^2, has its least value; an f that falls without end
    is not counted.
    """
    if not any(eqs.friction[1:]):
        return eqs.friction[0]
    friction = Polynomial(eqs.friction)
    turns = friction.deriv().roots().astype(complex)
    return min(
        [
            eqs.friction[0],
            *(float(friction(u.real)) for u in turns if u.imag == 0.0 and u.real > 0.0),
        ]
    )


def friction_bounds(eqs: Equations) -> bool:
    """Whether friction, or the impact loss between two stops, grows enough to bound the response to any noise.

    Quadratic damping does if no higher term feeds energy.
    """
    loss = _loss_at_large_amplitude(eqs)[1]
    return loss > 0.0 or (loss == 0.0 and eqs.cv is not None)


def barriers(eqs: Equations) -> Floats:
    """The places between the resting places at which the spring's energy is largest, in ascending order."""
    rests = eqs.resting_places
    free = eqs.balanced_places
    tops = free[[eqs.spring_slope(float(x)) < 0.0 for x in free]]
    return tops[(tops > rests[0]) & (tops < rests[-1])]


def surely_bounded(eqs: Equations) -> bool:
    """Whether the response has a bound for a reason that needs no simulation.

    The friction grows with the amplitude; or it feeds no energy anywhere, something dissipates
    energy, and the noise does not grow with x.
    """
    c1 = -eqs.friction[0]
    takes = c1 < 0.0 or (eqs.restitution is not None and eqs.restitution < 1.0)
    takes = takes or (eqs.beta is not None and eqs.mu is not None)
    return friction_bounds(eqs) or (takes and c1 <= 0.0 and eqs.n2 is None)


def _loss_at_large_amplitude(eqs: Equations) -> tuple[str, float, str]:
    """The term that dissipates (positive) or feeds (negative) energy at large amplitudes: name, size and cure.

    The highest term present of f beyond c1; between two stops their losses, or the mean of f if
    they lose nothing.
    """
    (low, high), friction = eqs.rigid_stops, eqs.friction
    if math.isfinite(high - low):
        if (eqs.restitution or 0.0) * (eqs.opposite_restitution or 0.0) < 1.0:
            return "impact", 1.0, ""
        mean = sum(
            f / n * (high**n - low**n) for f, n in zip(friction, range(1, 99, 2), strict=False)
        )
        return "the damping between the stops", mean, "a positive damping, or a restitution below 1"
    highest = max((i for i, f in enumerate(friction) if f and i), default=1)
    name, sign = list(FRICTION.items())[highest]
    written = f"damping_x{2 * highest} ({'-' if sign < 0.0 else ''}{name})"
    return written, friction[highest], "a positive damping of a higher power"
