"""The length of a step: the frequencies that it must resolve, the default, and the remedy if it fails."""

import math

from harvester.equations.bounds import strongest_feed
from harvester.equations.coefficients import Equations
from harvester.equations.impact_order import STRONG, step_order

STEP = 0.1  # default step, in units of 1/(frequency of the response)
# the same of the highest of several modes: no more than 0.2 % of bias, without a stop
STEP_OF_HIGHEST = 0.5
AT_STOP = 0.2  # the same where a stop excites it: 1 % or so
TOLERATED = 1.5  # times the default: a longer step is not kept
FINEST = 64  # steps to a period of the excitation, at least
SHARPEST = 20.0  # a frequency; no step is made shorter for resonances that are sharper
MOST_FED = 0.5  # growth of a speed in a step
IMPACTS = 8.0
FASTEST_CHATTER = 500.0  # a frequency; no step is made shorter for bounces that are faster


def shorter_step(h: float, frequency: float) -> float | None:
    """The step to begin again with where h is too long for a response of that frequency.

    None if h supports.
    """
    return None if h * frequency < TOLERATED * STEP else STEP / frequency


def whole_steps(h: float, repeat: float | None) -> float:
    """The longest step up to h of which the period ``repeat`` takes a multiple of `FINEST`; h if it is None.

    A step that is twice or four times such a one is accepted as it is.
    """
    if repeat is None:
        return h
    parts = repeat / h
    quarter = FINEST // 4
    if (
        parts > 0.5
        and abs(parts / quarter - round(parts / quarter)) < 1e-9 * parts
        and parts > 0.9 * quarter
    ):
        return h
    return repeat / (FINEST * math.ceil(parts / FINEST))


def step_from_rest(eqs: Equations, part: float = 1.0) -> float:
    """A ``part`` of the default step of a trajectory from rest, also for a hardening spring at an amplitude of 1.

    A period of the excitation has whole steps of it.
    """
    far = max(x * x for x in eqs.resting_places)
    h = STEP / typical_frequency(eqs, max(far, 1.0 if eqs.alpha else far))
    return whole_steps(part * h, eqs.shaking_period)


def typical_frequency(eqs: Equations, x2: float, v2: float | None = None) -> float:
    """Frequency that the step must resolve: w^2 = 1 + beta + 3 alpha E[x^2] (nondimensional).

    The default step is `STEP` over it.  ``x2`` is the response's E[x^2], ``v2`` its E[x'^2] if that
    is known.

    For other springs the linear and the quadratic term's slope, with E[x^2]^(1/2), represent the 1
    if they are more. With ``v2`` the bounces of a mass that the spring presses on a stop count too
    (`chatter`), up to `FASTEST_CHATTER`. Band-limited noise asks for its upper end; a harmonic
    excitation of a sharp resonance of loss c asks for 0.2/sqrt(c): the step h detunes it by a part
    h^2/24, which is then a hundredth of its width.  A friction that feeds energy at a rate c asks
    for c h up to `MOST_FED`: from 1 on a kick would remove energy in its place.  Strong impacts
    under white noise, whose bias falls slowly with the step, ask for `IMPACTS` times as many. Among
    further modes the highest asks for `STEP_OF_HIGHEST`, or for `AT_STOP`.
    """
    linear, alpha2, alpha = eqs.spring
    soft = abs(alpha2) + (eqs.softening or 0.0)
    slope = linear + 2.0 * soft * math.sqrt(x2) + 3.0 * abs(alpha) * x2
    bounces = 0.0 if v2 is None else min(chatter(eqs.pressure, eqs.n1, v2), FASTEST_CHATTER)
    grown = 1.0 + abs(eqs.gamma or 0.0) * x2
    frequency = math.sqrt(max(slope, 1.0) + (eqs.beta or 0.0) * grown * grown + bounces**2)
    frequency *= 1.0 + (eqs.inertia or 0.0) * x2
    if eqs.bandwidth is not None:
        frequency = max(frequency, (eqs.centre or 0.0) + eqs.bandwidth)
    if eqs.drive is not None:
        loss = -(eqs.c1 or 0.0) + (eqs.beta or 0.0) * (eqs.mu or 0.0) / (1.0 + (eqs.mu or 0.0) ** 2)
        frequency = max(frequency, min(0.2 / math.sqrt(loss), SHARPEST) if loss > 0.0 else SHARPEST)
    frequency = max(frequency, _of_highest_mode(eqs, max(slope, 1.0)))
    if step_order(eqs) < STRONG:
        frequency *= IMPACTS
    return max(frequency, strongest_feed(eqs) * STEP / MOST_FED)


def _of_highest_mode(eqs: Equations, spring: float) -> float:
    """The demand of the highest of several modes; 0 for one."""
    if eqs.modes is None:
        return 0.0
    part = STEP_OF_HIGHEST if eqs.restitution is None and eqs.stop_stiffness is None else AT_STOP
    return STEP / part * eqs.modes.highest(spring, eqs.beta or 0.0)


def chatter(pressure: float, n1: float | None, v2: float) -> float:
    """Frequency that the step must resolve if noise keeps a mass bouncing that the spring presses on a stop.

    w^2 = F^3/(10 N1 v) for a spring's acceleration F = ``pressure`` there, with v^2 = ``v2`` =
    E[x'^2], but v at least N1/F, which noise gives to a mass that bounces no more.  As the spring
    acts in kicks, each bounce is off by up to F v h in energy, and so many random errors heat the
    mass: by a part F^3 h^2/(10 N1 v), or so, which is 1 % at h = 0.1/w.
    """
    if n1 is None or pressure == 0.0:
        return 0.0
    return math.sqrt(pressure**3 / (10.0 * n1 * max(math.sqrt(v2), n1 / pressure)))


def remedy(eqs: Equations, h: float) -> str:
    """The remedy for a response that grew without bound at step h.

    A shorter step is asked for unless h shrinks small motions of the unloaded linear system (Jury's
    criterion): the matrix of one step, ((1, h), (-b, a - b h)) on (x, x') with a = 1/q, b = h w^2
    (1 + y/2)/q, q = 1 + y + y^2/2 and y = -c1 h, has its eigenvalues inside the unit circle for b h
    < 2 (1 + a).
    """
    y = -(eqs.c1 or 0.0) * h
    frequency = typical_frequency(eqs, 0.0)
    if not (h * frequency) ** 2 * (1.0 + 0.5 * y) < 2.0 * (2.0 + y + 0.5 * y * y):
        return f"the step itself feeds energy: give a `dt` below {2.0 / frequency:.3g}/w0"
    return "add damping that bounds it, or try a smaller `dt` if the scene is known to be bounded"
