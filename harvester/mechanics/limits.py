"""What bounds a response and a step: the frequency to resolve, friction that feeds energy, steps that feed energy."""

import math

from harvester.errors import UnboundedResponseError
from harvester.scaling import Equations


def typical_frequency(eqs: Equations, x2: float) -> float:
    """Frequency that the step must resolve: w^2 = 1 + beta + 3 alpha E[x^2] (nondimensional)."""
    return math.sqrt(1.0 + (eqs.beta or 0.0) + 3.0 * (eqs.alpha or 0.0) * x2)


def check_bounded(eqs: Equations) -> None:
    """Refuse a friction that feeds energy at every large amplitude.

    Raises
    ------
    UnboundedResponseError
        where the highest term of f(x) = c3 x^4 - c2 x^2 - c1 beyond c1 is negative.
    """
    name, top = _highest(eqs)
    if top < 0.0:
        raise UnboundedResponseError(
            f"the response grows without bound: {name} feeds energy at large amplitude and nothing bounds it; "
            "give a positive damping of a higher power"
        )


def friction_bounds(eqs: Equations) -> bool:
    """Whether the friction grows with the amplitude, so that no noise makes the response grow for ever."""
    return _highest(eqs)[1] > 0.0


def surely_bounded(eqs: Equations) -> bool:
    """Whether the response has a bound for a reason that needs no simulation.

    The friction grows with the amplitude; or it feeds no energy anywhere, something takes energy,
    and the noise does not grow with x.
    """
    takes = (eqs.c1 or 0.0) < 0.0 or (eqs.restitution is not None and eqs.restitution < 1.0)
    takes = takes or (eqs.beta is not None and eqs.mu is not None)
    return friction_bounds(eqs) or (takes and (eqs.c1 or 0.0) <= 0.0 and eqs.n2 is None)


def stable_step(eqs: Equations, h: float) -> bool:
    """Whether a step of length h shrinks small motions of the unloaded linear system (Jury's criterion).

    The matrix of one step, ((1, h), (-b, a - b h)) on (x, x') with a = 1/q, b = h w^2 (1 + y/2)/q,
    q = 1 + y + y^2/2 and y = -c1 h, has its eigenvalues inside the unit circle for b h < 2 (1 + a).
    """
    y = -(eqs.c1 or 0.0) * h
    return (h * typical_frequency(eqs, 0.0)) ** 2 * (1.0 + 0.5 * y) < 2.0 * (2.0 + y + 0.5 * y * y)


def remedy(eqs: Equations, h: float) -> str:
    """What to do about a response that grew at step h."""
    if not stable_step(eqs, h):
        return f"the step itself feeds energy: give a --dt below {2.0 / typical_frequency(eqs, 0.0):.3g}/w0"
    return "add damping that bounds it, or try a smaller --dt if the scene is known to be bounded"


def _highest(eqs: Equations) -> tuple[str, float]:
    """The highest term present of f beyond c1, by its name and sign."""
    if eqs.c3:
        return "damping_x4 (c3)", eqs.c3
    return "damping_x2 (-c2)", -(eqs.c2 or 0.0)
