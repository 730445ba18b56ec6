"""Whether the stop will be hit, and how often, from the linear equations without it.

White noise: the displacement is Gaussian, and passes -gap sqrt(E[x'^2]/E[x^2])/(2 pi) exp(-gap^2/(2 E[x^2])) times a
unit of time (Rice).
"""

import math
from typing import Any

import numpy as np

from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.linear.response import amplitudes, white
from harvester.uncertainty.value import Value

OFTEN, SELDOM = 0.1, 1e-3  # times a period


def variances(eqs: Equations) -> tuple[float, float] | None:
    """The variances E[x^2] and E[x'^2] of the linear equations under white noise, without a stop; None without."""
    if eqs.n1 is None or not (eqs.c1 or 0.0) < 0.0:
        return None
    at_one = white(eqs)
    return eqs.n1 * at_one.x2, eqs.n1 * at_one.speed2


def amplitude(eqs: Equations) -> float | None:
    """The amplitude of the linear response to the drive, without a stop; None without a drive."""
    if eqs.drive is None or eqs.drive_frequency is None:
        return None
    return float(eqs.drive * np.abs(amplitudes(eqs, eqs.drive_frequency)[0]))


def stop_hits(problem: Problem) -> tuple[list[str], dict[str, Any]]:
    """A sentence on how often the stop is hit, and the facts behind it; empty without a stop."""
    eqs, s = problem.equations, problem.scales
    if eqs.restitution is None:
        return [], {}
    gap = eqs.gap or 0.0
    if gap == 0.0:
        words = "stop: at the mass's rest, so it is hit in every swing"
        if eqs.n1 is None:
            return [words], {"stop": "often"}
        rate = s.frequency / math.pi  # against a stop there a swing lasts half a period
        return [f"{words}, about {rate:.3g} times a second"], {"stop": "often", "stop_hits_a_second": rate}
    if gap < 0.0:
        force = Value(-gap * s.length * s.mass * s.frequency**2).format("N")
        words = f"stop: pressed on the mass with {force}: it is hit whenever the shaking lifts the mass"
        return [words], {"stop": "pressed"}
    moments, peak = variances(eqs), amplitude(eqs)
    distance = Value(gap * s.length).format("m")
    if moments is not None and peak is None:
        x2, v2 = moments
        rate = math.sqrt(v2 / x2) / (2.0 * math.pi) * math.exp(max(-0.5 * gap * gap / x2, -700.0))
        often, seldom = OFTEN / (2.0 * math.pi), SELDOM / (2.0 * math.pi)
        how = "often" if rate > often else "at times" if rate > seldom else "seldom or never"
        rms = Value(math.sqrt(x2) * s.length).format("m")
        words = f"stop: hit {how}: without it the displacement is {rms} (RMS, linear), and it is {distance} away"
        if eqs.mu is None:
            words += ", in open circuit"
        if rate > seldom:
            words += f"; it would be reached {rate * s.frequency:.2g} times a second"
        return [words], {"stop": how, "stop_hits_a_second": rate * s.frequency}
    if peak is not None and math.isfinite(peak):
        how = "hit in every swing" if peak > gap else "not reached"
        swing = f"the amplitude is {Value(peak * s.length).format('m')} (linear{', noise apart' if eqs.n1 else ''})"
        words = f"stop: {how}: without it {swing}, and it is {distance} away"
        return [words], {"stop": "often" if peak > gap else "seldom or never"}
    return [f"stop: {distance} away; how often it is hit, harvester motion shows"], {"stop": None}
