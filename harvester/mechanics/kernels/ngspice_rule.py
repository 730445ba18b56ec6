"""The load resistor by ngspice's integration rule, in place of the exact update: the very steps of the lock-step.

    V1 - V0 + mu t (w V0 + (1 - w) V1) = x' t

for a step of length t at constant velocity.  The weight w makes that exact for a whole drift, not
for the parts before and after an impact, nor for the halves of a drift in which ngspice lands on a
sample.  The difference is one part in a million, but it moves a grazing impact now and then to the
other side of a kick, and the trajectories part.  By the same rule they agree to rounding, and
ngspice's mean needs few runs paired with a long ensemble (`harvester.uncertainty.control_variate`).
"""

import math

from harvester.mechanics.kernels.coefficients import State
from harvester.mechanics.kernels.compiled import inlined


def rule_weight(z: float) -> float:
    """The weight w of a step's beginning, ngspice's xmu: 1/z - 1/(exp(z) - 1) for a drift of z = mu h.

    It is 1/2, the trapezoidal rule, for a short step and goes to 0, backward Euler, for a long one,
    in cases in which the trapezoidal rule would ring.
    """
    if z < 1e-3:
        return 0.5 - z / 12.0
    return 1.0 / z - (1.0 / math.expm1(z) if z < 700.0 else 0.0)


@inlined
def stepped_voltage(V, v, t, mu, w):
    """The voltage V after a step of length t at constant velocity v."""
    return ((1.0 - w * mu * t) * V + v * t) / (1.0 + (1.0 - w) * mu * t)


@inlined
def drift_by_ngspice_rule(s, t, mu, r, w):
    """Drift by t: the state and the speed of the impact or 0, without a branch, so that loops vectorise.

    ngspice lands on the impact: one step to it and one beyond, of length 0 if there is none.
    """
    x1 = s.x + t * s.v
    if r is None:
        return State(x1, s.v, stepped_voltage(s.V, s.v, t, mu, w)), 0.0
    hit = x1 < 0.0
    after = x1 / s.v if hit else 0.0
    V1 = stepped_voltage(stepped_voltage(s.V, s.v, t - after, mu, w), -r * s.v, after, mu, w)
    return State(-r * x1 if hit else x1, -r * s.v if hit else s.v, V1), (-s.v if hit else 0.0)
