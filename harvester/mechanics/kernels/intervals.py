"""The effect of a drift of a given length on the voltage: numbers made once a run, which every step of it uses.

The voltage at the end of a drift without an impact is e V + g v, with e = exp(-mu t) and g = (1 -
e)/mu.

An impact of a mass of speed v, a time a before the end of a step, changes the voltage there by a
multiple of

    v P(a),   P(a) = (1 - exp(-mu a))/mu        (`harvester.mechanics.kernels.equation_of_motion.drift`)

with a = x1/v, which needs a division, as slow as ten other operations, and P a series.  If white
noise moves the mass, all places of an impact in a step are equally likely, and the straight line that
is nearest to P over them by least squares,

    v P(a) ~ first v + slope x1

has an error, up to mu h^2/12 of v, of mean zero and uncorrelated with a: it enters no mean of V or
x V, and that of V^2 by its own square only.
"""

import math
from typing import NamedTuple

from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.ngspice_rule import rule_weight

SLOW = 0.5  # mu h, at most: the square is then below 0.0004 of E[V^2]
# (beta h^2)^2/(1 - r^2), at most: the voltage's error then gives below 1e-4 of what an impact takes
HEAT = 0.01
_TERMS = 12  # of a series in mu h, for `SLOW` to the last digit

Line = tuple[float, float]


class Update(NamedTuple):
    """How the voltage is carried along: the lines of impacts in a step and in half a step (`fitted`), None: exact.

    A ``weight`` states that it follows ngspice's rule instead
    (`harvester.mechanics.kernels.ngspice_rule`).
    """

    line: Line | None = None
    half_line: Line | None = None
    weight: float | None = None


EXACT = Update()


class Interval(NamedTuple):
    """The first ``t`` of the drift of a step h, with the numbers e and g above.

    The rest as of `Update`.
    """

    h: float
    t: float
    e: float
    g: float
    line: Line | None
    weight: float | None


@forced
def drifts(h, mu, update):
    """The drifts of a step and of half a step with a load of 1/mu, None for an open circuit."""
    return interval(h, h, mu, update.line, update.weight), interval(
        h, 0.5 * h, mu, update.half_line, update.weight
    )


@forced
def interval(h, t, mu, line=None, weight=None):
    """The first t of the drift of a step h."""
    if mu is None:
        return Interval(h, t, 1.0, t, line, weight)
    return Interval(h, t, math.exp(-mu * t), -math.expm1(-mu * t) / mu, line, weight)


def update_of(eqs: Equations, h: float, ngspice_rule: bool = False) -> Update:
    """How an ensemble carries the voltage along: by ngspice's rule, or exact, in the mean if that is enough.

    It is exact at each impact if no white noise moves the mass, between two stops, and where the
    load or the back-coupling is too fast for the step (`SLOW`, `HEAT`).
    """
    if ngspice_rule and eqs.mu is not None:
        return Update(weight=rule_weight(eqs.mu * h))
    if (
        eqs.mu is None
        or eqs.restitution is None
        or eqs.n1 is None
        or eqs.opposite_restitution is not None
    ):
        return EXACT
    if eqs.mu * h > SLOW or ((eqs.beta or 0.0) * h * h) ** 2 > HEAT * (1.0 - eqs.restitution**2):
        return EXACT
    return Update(fitted(eqs.mu, h), fitted(eqs.mu, 0.5 * h))


def fitted(mu: float, h: float) -> Line:
    """The straight line first + slope a that is nearest to (1 - exp(-mu a))/mu, a from 0 to h: (first, slope).

    The means I0 of P and I1 of P a/h give first = 4 I0 - 6 I1 and slope h = 12 I1 - 6 I0.

    >>> first, slope = fitted(0.05, 0.1)
    >>> round(1e6 * first, 3), round(slope, 6)
    (41.583, 0.997504)
    """
    first = 0.0
    slope = 0.0
    term = 1.0
    for n in range(1, _TERMS + 1):
        term /= n  # (-mu h)^(n - 1)/n!
        mean_0, mean_1 = term / (n + 1), term / (n + 2)
        first, slope = first + (4.0 * mean_0 - 6.0 * mean_1), slope + (12.0 * mean_1 - 6.0 * mean_0)
        term *= -mu * h
    return first * h, slope
