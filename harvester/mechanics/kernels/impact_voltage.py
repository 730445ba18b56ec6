"""The voltage that an impact leaves at the end of its step, without a division: right in the mean over a step.

A mass of speed v that meets the stop a time a before the end of a step changes the voltage there by a multiple of

    v P(a),   P(a) = (1 - exp(-mu a))/mu        (`harvester.mechanics.kernels.equation_of_motion.drift`)

where a = x1/v takes a division, as slow as ten other operations, and P a series.  Where white noise moves the mass, all
places of an impact in a step are equally likely, and the straight line that is nearest to P over them by least squares,

    v P(a) ~ first v + slope x1

has an error, up to mu h^2/12 of v, of mean zero and uncorrelated with a: it enters no mean of V or x V, and that of
V^2 by its own square only.
"""

from harvester.equations.coefficients import Equations

SLOW = 0.5  # mu h, at most: the square is then below .0004 of E[V^2]
HEAT = 0.01  # (beta h^2)^2/(1 - r^2), at most: the voltage's error then gives below 1e-4 of what an impact takes
_TERMS = 12  # of a series in mu h, for `SLOW` to the last digit

Line = tuple[float, float]


def fitted(mu: float, h: float) -> Line:
    """The straight line first + slope a that is nearest to (1 - exp(-mu a))/mu, a from 0 to h: (first, slope).

    The means I0 of P and I1 of P a/h give first = 4 I0 - 6 I1 and slope h = 12 I1 - 6 I0.

    >>> first, slope = fitted(0.05, 0.1)
    >>> round(1e6 * first, 3), round(slope, 6)
    (41.583, 0.997504)
    """
    first, slope, term = 0.0, 0.0, 1.0
    for n in range(1, _TERMS + 1):
        term /= n  # (-mu h)^(n - 1)/n!
        zero, one = term / (n + 1), term / (n + 2)
        first, slope = first + (4.0 * zero - 6.0 * one), slope + (12.0 * one - 6.0 * zero)
        term *= -mu * h
    return first * h, slope


def lines(eqs: Equations, h: float) -> tuple[Line, Line] | tuple[None, None]:
    """The lines of a step and of half a step; None twice where the voltage at an impact is exact.

    It is where no white noise moves the mass, between two stops, and where the load or the back-coupling is too fast
    for the step (`SLOW`, `HEAT`).
    """
    if eqs.mu is None or eqs.restitution is None or eqs.n1 is None or eqs.opposite_restitution is not None:
        return None, None
    if eqs.mu * h > SLOW or ((eqs.beta or 0.0) * h * h) ** 2 > HEAT * (1.0 - eqs.restitution**2):
        return None, None
    return fitted(eqs.mu, h), fitted(eqs.mu, 0.5 * h)
