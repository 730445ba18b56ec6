"""Whether a harmonic drive meets the resonance, from the linear equations without a stop.

The power at the frequency w is beta mu |V(w)|^2 of `harvester.linear.transfer.amplitudes`, times the drive's square.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from harvester.equations.problem import Problem
from harvester.linear.transfer import gains
from harvester.presentation.diagnostic import Diagnostic, warning

MISSES = 0.1  # of the largest power: below, the drive misses the resonance
LOW, HIGH, POINTS = 0.5, 2.0, 4001  # frequencies looked at, over the resonance in short and in open circuit


def off_resonance(problem: Problem) -> tuple[list[Diagnostic], dict[str, Any]]:
    """A warning where the drive's frequency gives little of the power that another one would give, and its facts.

    Without a load resistor it is the power of the best one under white noise, mu = sqrt(1 + beta).  Empty without a
    drive or damping, and where the spring has another linear part than 1 (two wells).
    """
    eqs = problem.equations
    w, beta = eqs.drive_frequency, eqs.beta or 0.0
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
    told = warning("drive_off_resonance", "drive", **numbers)
    return [told], {"drive_share": share, "best_drive_frequency": best * hertz}
