"""What bounds a response and a step: resting places, stops, the frequency to resolve, what feeds energy."""

import math

import numpy as np

from harvester.equations.scaling import Equations
from harvester.errors import UnboundedResponseError

SHARPEST = 20.0  # a frequency; no step is made shorter for resonances that are sharper
FASTEST_CHATTER = 500.0  # a frequency; no step is made shorter for bounces that are faster


def room(eqs: Equations) -> tuple[float, float]:
    """Least and most x that the rigid stops allow; infinite where there is none."""
    low = -math.inf if eqs.restitution is None else 0.0 - (eqs.gap or 0.0)
    high = math.inf if eqs.opposite_restitution is None else eqs.opposite_gap or 0.0
    return low, high


def spring_force(eqs: Equations, x: float) -> float:
    """Force of the spring at x; 0 at infinity, where no stop is."""
    linear, alpha2, alpha = _spring(eqs)
    return -x * (linear + x * (alpha2 + x * alpha)) if math.isfinite(x) else 0.0


def resting_places(eqs: Equations) -> list[float]:
    """Where the mass can rest without voltage: minima of the spring's energy, and stops that it is pressed on.

    In ascending order; two or more for a bistable spring.  One pressed on a compliant stop is said to be at its edge.
    """
    linear, alpha2, alpha = _spring(eqs)
    low, high = _stops(eqs)
    places = {x for x, inward in ((low, 1.0), (high, -1.0)) if inward * spring_force(eqs, x) < 0.0}
    found = np.roots([alpha, alpha2, linear, 0.0])
    inner = found.real[found.imag == 0.0]
    curved = linear + inner * (2.0 * alpha2 + 3.0 * alpha * inner) > 0.0
    return sorted(places | {float(x) for x in inner[curved] if low <= x <= high})


def unlike_wells(eqs: Equations) -> bool:
    """Whether the mass has several resting places that are not mirror images of each other."""
    stop, opposite = (eqs.restitution, eqs.gap), (eqs.opposite_restitution, eqs.opposite_gap)
    mirrored = stop == opposite and eqs.alpha2 is None and eqs.n12 is None and eqs.stop_stiffness is None
    return len(resting_places(eqs)) > 1 and not mirrored


def typical_frequency(eqs: Equations, x2: float, v2: float | None = None) -> float:
    """Frequency that the step must resolve: w^2 = 1 + beta + 3 alpha E[x^2] (nondimensional).

    For other springs the linear and the quadratic term's slope, with E[x^2]^(1/2), stand for the 1 where they are more.
    Where E[x'^2] is given, the bounces of a mass that the spring presses on a stop count too (`chatter`), up to
    `FASTEST_CHATTER`.  Noise of a band asks for its upper end; a harmonic drive of a sharp resonance of loss c asks for
    .2/sqrt(c): the step h detunes it by a part h^2/24, which is then a hundredth of its width.
    """
    linear, alpha2, alpha = _spring(eqs)
    slope = linear + 2.0 * abs(alpha2) * math.sqrt(x2) + 3.0 * abs(alpha) * x2
    bounces = 0.0 if v2 is None else min(chatter(eqs, v2), FASTEST_CHATTER)
    frequency = math.sqrt(max(slope, 1.0) + (eqs.beta or 0.0) + bounces**2)
    if eqs.bandwidth is not None:
        frequency = max(frequency, (eqs.centre or 0.0) + eqs.bandwidth)
    if eqs.drive is not None:
        loss = -(eqs.c1 or 0.0) + (eqs.beta or 0.0) * (eqs.mu or 0.0) / (1.0 + (eqs.mu or 0.0) ** 2)
        frequency = max(frequency, min(0.2 / math.sqrt(loss), SHARPEST) if loss > 0.0 else SHARPEST)
    return frequency


def chatter(eqs: Equations, v2: float) -> float:
    """Frequency that the step must resolve where noise keeps a mass bouncing that the spring presses on a stop.

    w^2 = F^3/(10 N1 v) for a spring's acceleration F there, with v^2 = E[x'^2], but v at least N1/F, which is what
    noise gives to a mass that bounces no more.  As the spring acts in kicks, each bounce is off by up to F v h in
    energy, and so many random errors heat the mass: by a part F^3 h^2/(10 N1 v), or so, which is 1 % at h = .1/w.
    """
    low, high = _stops(eqs)
    pressed = max(0.0, -spring_force(eqs, low), spring_force(eqs, high))
    if eqs.n1 is None or pressed == 0.0:
        return 0.0
    return math.sqrt(pressed**3 / (10.0 * eqs.n1 * max(math.sqrt(v2), eqs.n1 / pressed)))


def slowest(eqs: Equations) -> float:
    """Longest time constant of small motions about x = 0 off the stops that die out; 0 where some do not.

    Without a load the voltage is a spring.
    """
    linear = 1.0 if eqs.linear is None else eqs.linear
    beta, mu = eqs.beta or 0.0, eqs.mu
    matrix = [[0.0, 1.0], [-linear - beta, eqs.c1 or 0.0]]
    if mu is not None:
        matrix = [[0.0, 1.0, 0.0], [-linear, eqs.c1 or 0.0, -beta], [0.0, 1.0, -mu]]
    rate = -float(np.linalg.eigvals(matrix).real.max())
    return 1.0 / rate if rate > 1e-9 else 0.0


def check_bounded(eqs: Equations) -> None:
    """Refuse a friction that feeds energy at every large amplitude, and a spring that pushes the mass away for good.

    Raises
    ------
    UnboundedResponseError
        where the highest term of f(x) = c3 x^4 - c2 x^2 - c1 beyond c1 is negative, or where the spring's energy falls
        without bound on a side without a stop.
    """
    name, top, cure = _highest(eqs)
    if top < 0.0:
        raise UnboundedResponseError(
            f"the response grows without bound: {name} feeds energy at large amplitude and nothing bounds it; "
            f"give {cure}"
        )
    linear, alpha2, alpha = _spring(eqs)
    low, high = room(eqs)
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
        return f"the step itself feeds energy: give a `dt` below {2.0 / typical_frequency(eqs, 0.0):.3g}/w0"
    return "add damping that bounds it, or try a smaller `dt` if the scene is known to be bounded"


def _highest(eqs: Equations) -> tuple[str, float, str]:
    """What bounds or feeds large energies: its name, its sign, and a cure.

    The highest term present of f beyond c1; between two stops their losses, or the mean of f where they lose nothing.
    """
    low, high = room(eqs)
    if math.isfinite(high - low):
        if (eqs.restitution or 0.0) * (eqs.opposite_restitution or 0.0) < 1.0:
            return "impact", 1.0, ""
        terms = ((-(eqs.c1 or 0.0), 1), (-(eqs.c2 or 0.0), 3), (eqs.c3 or 0.0, 5))
        mean = sum(c / n * (high**n - low**n) for c, n in terms)
        return "the damping between the stops", mean, "a positive damping, or a restitution below 1"
    if eqs.c3:
        return "damping_x4 (c3)", eqs.c3, "a positive damping of a higher power"
    return "damping_x2 (-c2)", -(eqs.c2 or 0.0), "a positive damping of a higher power"


def _spring(eqs: Equations) -> tuple[float, float, float]:
    """Linear, quadratic and cubic coefficient of the spring."""
    return 1.0 if eqs.linear is None else eqs.linear, eqs.alpha2 or 0.0, eqs.alpha or 0.0


def _stops(eqs: Equations) -> tuple[float, float]:
    """Places of the stops, rigid or compliant; infinite where there is none."""
    low, high = room(eqs)
    return (low if eqs.stop_stiffness is None else -(eqs.gap or 0.0)), high
