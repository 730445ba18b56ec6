"""How often a linear scene's displacement and voltage pass a level under white noise, and their largest value.

Both are Gaussian, so that |y| passes a level a upwards at Rice's rate,

    nu(a) = rate exp(-a^2/(2 s^2)),   rate = s'/(pi s),

with the standard deviations s of y and s' of its velocity.  If passages were independent, the
largest |y| in a time T would stay below a with the probability exp(-nu(a) T); as they come in
clumps this is a lower bound.  Vanmarcke counts the clumps,

    nu(a) (1 - exp(-sqrt(pi/2) q^1.2 a/s)) / (1 - exp(-a^2/(2 s^2))),   q^2 = 1 - l1^2/(l0 l2),

with the moments l of the density over the frequency.  Sources: Rice, Bell Syst. Tech. J. 24, 1945;
Vanmarcke, J. Appl. Mech. 42, 1975.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.linear.transfer import gains, white

_FREQUENCIES = 4_001  # at which the density is summed
_WIDEST = 1e3  # times the resonance


@dataclass(frozen=True)
class GaussianPeaks:
    """A Gaussian response of standard deviation ``deviation``, nondimensional.

    |y| passes zero upwards at ``rate`` a unit of time; ``bandwidth`` is Vanmarcke's q, 0 for a pure
    sine.
    """

    deviation: float
    rate: float
    bandwidth: float

    def rice(self, level: float) -> float:
        """The passages of |y| above a level, a unit of time."""
        return self.rate * math.exp(-0.5 * (level / self.deviation) ** 2)

    def clumps(self, level: float) -> float:
        """The clumps of such passages, a unit of time."""
        a = max(level / self.deviation, 1e-6)
        alone = -math.expm1(-math.sqrt(0.5 * math.pi) * self.bandwidth**1.2 * a)
        return self.rice(level) * alone / -math.expm1(-0.5 * a * a)

    def bound(self, share: float, time: float) -> float:
        """The level that |y| stays below in a time with a probability of at least ``share``: every passage counts."""
        ratio = self.rate * time / -math.log(share)
        return self.deviation * math.sqrt(2.0 * math.log(ratio)) if ratio > 1.0 else 0.0

    def largest(self, share: float, time: float) -> float:
        """The level that |y| stays below in a time with the probability ``share``: every clump counts once."""
        from scipy.optimize import brentq

        rate = -math.log(share) / time
        top = self.bound(share, time)
        if top == 0.0 or self.clumps(0.0) <= rate:
            return 0.0
        return float(brentq(lambda level: self.clumps(level) - rate, 0.0, 1.001 * top))


def peaks(eqs: Equations) -> tuple[GaussianPeaks, GaussianPeaks]:
    """The peaks of x and of V of linear equations under white noise N1 alone, nondimensional.

    From the moments of `harvester.linear.transfer.white` and V' = q' - mu V, hence E[V'^2] =
    E[q'^2] - mu^2 E[V^2]; the charge q is x of one mode.

    Raises SimulationError if no stationary response exists.
    """
    moments = white(eqs)
    n1 = eqs.n1 or 0.0
    mu = eqs.mu or 0.0
    if not (math.isfinite(moments.x2) and n1 > 0.0):
        raise SimulationError(
            "there is no stationary response: give a damping and white noise of the base"
        )
    voltage_speed2 = max(moments.charge_speed2 - mu * mu * moments.v2, 0.0)
    shapes = _bandwidths(eqs)
    pairs = ((moments.x2, moments.speed2), (moments.v2, voltage_speed2))
    return tuple(  # type: ignore[return-value]
        GaussianPeaks(math.sqrt(n1 * square), math.sqrt(speed / square) / math.pi, q)
        for (square, speed), q in zip(pairs, shapes, strict=True)
    )


def _bandwidths(eqs: Equations) -> list[float]:
    """Vanmarcke's q of x and V: sums over frequencies that are close around each resonance."""
    w = _frequencies(eqs)
    bandwidths = []
    for density in gains(eqs, w):
        l0, l1, l2 = (float(np.trapezoid(density * w**power, w)) for power in (0, 1, 2))
        bandwidths.append(math.sqrt(max(1.0 - l1 * l1 / (l0 * l2), 0.0)))
    return bandwidths


def _frequencies(eqs: Equations) -> Floats:
    """The frequencies of all resonances together, in order.

    About an eigenvalue of the frequency w0 and the width D they are w0 + D sinh(u): a step of u is
    short against the width, and long far away.
    """
    values = np.linalg.eigvals(flow(eqs))
    highest = _WIDEST * float(np.abs(values).max())
    grids = []
    for value in values[values.imag >= 0.0]:
        w0 = float(value.imag)
        width = max(-2.0 * float(value.real), 1e-9)
        u = np.linspace(-math.asinh(w0 / width), math.asinh(highest / width), _FREQUENCIES)
        grids.append(w0 + width * np.sinh(u))
    return np.unique(np.maximum(np.concatenate(grids), 0.0))
