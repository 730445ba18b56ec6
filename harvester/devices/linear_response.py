"""Estimates from the linear equations without a stop: how often it will hit its stop, and whether a drive suits.

White noise: the displacement is Gaussian, and passes -gap sqrt(E[x'^2]/E[x^2])/(2 pi) exp(-gap^2/(2
E[x^2])) times a unit of time (Rice).

A harmonic excitation: whether it meets the resonance.  The power at the frequency w is beta mu
|V(w)|^2 of `harvester.linear.transfer.amplitudes`, times the excitation's square.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.linear.transfer import amplitudes, gains, stationary, white
from harvester.presentation.diagnostic import Diagnostic, note, warning

MISSES = 0.1  # of the largest power: below, the drive misses the resonance
# frequencies looked at, over the resonance in short and in open circuit
LOW = 0.5
HIGH = 2.0
POINTS = 4001
OFTEN, SELDOM = 0.1, 1e-3  # times per period


def variances(eqs: Equations) -> tuple[float, float] | None:
    """The variances E[w^2] and E[w'^2] of the linear equations under white noise, without a stop.

    None without.

    The quantity at the stop is w: the displacement x, of several modes phi.y
    (`harvester.equations.modes`).
    """
    if eqs.n1 is None or not (eqs.c1 or 0.0) < 0.0:
        return None
    at_one = white(eqs)
    if eqs.modes is None or not math.isfinite(at_one.x2):
        return eqs.n1 * at_one.x2, eqs.n1 * at_one.speed2
    covariance = stationary(eqs, eqs.modes)
    phi = np.array(eqs.modes.contact)
    n = eqs.modes.count
    return eqs.n1 * float(phi @ covariance[:n, :n] @ phi), eqs.n1 * float(
        phi @ covariance[n : 2 * n, n : 2 * n] @ phi
    )


def amplitude(eqs: Equations) -> float | None:
    """The amplitude at the stop in the linear response without the stop.

    None without a harmonic excitation.
    """
    if eqs.drive is None or eqs.drive_frequency is None:
        return None
    at_stop = amplitudes(eqs, eqs.drive_frequency, eqs.modal.contact)
    return float(eqs.drive * np.abs(at_stop[0]))


def stop_hits(problem: Problem) -> tuple[list[Diagnostic], dict[str, Any]]:
    """How often the stop is hit, and the facts behind it.

    Empty without a stop, and for a ball's box.
    """
    eqs, s = problem.equations, problem.scales
    if eqs.restitution is None or eqs.has_ball:
        return [], {}
    gap = eqs.gap or 0.0
    if gap == 0.0:  # against a stop there a swing lasts half a period
        rate = None if eqs.n1 is None else s.frequency / math.pi
        fact = {} if rate is None else {"stop_hits_a_second": rate}
        return [note("stop_at_rest", "stop", rate=rate)], {"stop": "often"} | fact
    if gap < 0.0:
        force = -gap * s.length * s.mass * s.frequency**2
        return [note("stop_pressed", "stop", force=force)], {"stop": "pressed"}
    moments, peak = variances(eqs), amplitude(eqs)
    distance = gap * s.length
    if moments is not None and math.isfinite(moments[0]) and peak is None:
        return _under_noise(eqs, s, x2=moments[0], v2=moments[1])
    if peak is not None and math.isfinite(peak):
        known = {"peak": peak * s.length, "distance": distance, "is_noisy": bool(eqs.n1)}
        return [note("stop_under_drive", "stop", **known)], {
            "stop": "often" if peak > gap else "seldom or never"
        }
    return [note("stop_distance", "stop", distance=distance)], {"stop": None}


def _under_noise(
    eqs: Equations, s: Scales, x2: float, v2: float
) -> tuple[list[Diagnostic], dict[str, Any]]:
    """How often a stop at a distance is hit, by Rice's formula without it."""
    gap = eqs.gap or 0.0
    rate = math.sqrt(v2 / x2) / (2.0 * math.pi) * math.exp(max(-0.5 * gap * gap / x2, -700.0))
    often, seldom = OFTEN / (2.0 * math.pi), SELDOM / (2.0 * math.pi)
    how = "often" if rate > often else "at times" if rate > seldom else "seldom or never"
    known: dict[str, Any] = {
        "how": how,
        "rms": math.sqrt(x2) * s.length,
        "distance": gap * s.length,
    }
    known |= {"is_open": eqs.mu is None, "rate": rate * s.frequency if rate > seldom else None}
    return [note("stop_under_noise", "stop", **known)], {
        "stop": how,
        "stop_hits_a_second": rate * s.frequency,
    }


def off_resonance(problem: Problem) -> tuple[list[Diagnostic], dict[str, Any]]:
    """A warning if the excitation's frequency gives little of the power that another one would give, and its facts.

    Without a load resistor it is the power of the best one under white noise, mu = sqrt(1 + beta).
    Empty without a harmonic excitation or damping, and if the spring has another linear part than 1
    (two wells).
    """
    eqs = problem.equations
    w = eqs.drive_frequency
    beta = eqs.beta or 0.0
    if eqs.drive is None or w is None or eqs.linear is not None or not (eqs.c1 or 0.0) < 0.0:
        return [], {}
    resistor = eqs if eqs.mu is not None else replace(eqs, mu=math.sqrt(1.0 + beta))
    looked = np.linspace(LOW, HIGH * math.sqrt(1.0 + beta), POINTS)
    power = gains(resistor, looked)[1]
    best = float(looked[power.argmax()])
    share = float(gains(resistor, w)[1]) / float(power.max())
    if share >= MISSES:
        return [], {}
    hertz = problem.scales.frequency / (2.0 * math.pi)
    numbers = {"hertz": w * hertz, "ratio": w, "best": best * hertz, "gain": 1.0 / share}
    remark = warning("drive_off_resonance", "drive", **numbers)
    return [remark], {"drive_share": share, "best_drive_frequency": best * hertz}
