"""The order of the step's bias near a rigid stop under white noise: below 2, for impacts come ever closer.

A mass that leaves a stop with the speed u, so slowly that only white noise acts on it, is back with
the speed z u, where z has the density (3/2 pi) z^(3/2)/(1 + z^3) (McKean, J. Math. Kyoto Univ. 2,
227, 1963), so that

    E[z^s] = 1/(2 cos(pi (1 + s)/3))

and leaves with r z u: the logarithm of its speed walks at random.  Speeds u << 1 have a stationary
density of impacts in ln u of u^a, with E[(r z)^-a] = 1, which is

    r^a 2 cos(pi (1 - a)/3) = 1,   a != 0

with a = 2 for r = 1, and a < 0 below r = exp(-pi/sqrt 3) = 0.163, at which infinitely many impacts
end in a finite time (Cornell, Swift and Bray, Phys. Rev. Lett. 81, 1142, 1998).  A step of h
resolves no speed below sqrt(h): the energy that those impacts dissipate, u^2 each, is wrong by a part
of order one, and the mean by

    h^p,   p = 1 + a/2.
"""

import math

from harvester.equations.coefficients import Equations
from harvester.presentation.diagnostic import Diagnostic, note

# restitution coefficient below which impacts accumulate
COLLAPSE = math.exp(-math.pi / math.sqrt(3.0))
# the order at a restitution coefficient of 0.5: below it steps are shorter, and three tell the bias
STRONG = 1.5
REGULAR = 2.0  # the order of the scheme where nothing lowers it


def impact_order(r: float) -> float:
    """The order p of the step's bias near a stop of restitution coefficient r.

    >>> [round(impact_order(r), 3) for r in (0.0, COLLAPSE, 0.37, 1.0)]
    [0.75, 1.0, 1.306, 2.0]
    """
    if r <= 0.0:
        return 0.75
    if abs(slope := math.log(r) + math.pi / math.sqrt(3.0)) < 1e-6:
        return 1.0

    # Halved until no number is between: only to load SciPy's own search would take each run with a
    # stop 0.3 s.
    low, high = (1e-9, 2.5 - 1e-12) if slope > 0.0 else (-0.5 + 1e-15, -1e-9)
    while low < (a := 0.5 * (low + high)) < high:
        beyond = a * math.log(r) + math.log(2.0 * math.cos(math.pi * (1.0 - a) / 3.0)) < 0.0
        low, high = (low, a) if beyond == (slope > 0.0) else (a, high)
    return 1.0 + 0.5 * a


def accumulation(eqs: Equations) -> Diagnostic | None:
    """The note that white noise makes impacts accumulate, so that none counts them.

    None if it does not.
    """
    stops = [r for r in (eqs.restitution, eqs.opposite_restitution) if r is not None]
    if eqs.n1 is None or min(stops, default=1.0) >= COLLAPSE:
        return None
    return note("impacts_accumulate", restitution=COLLAPSE)


def step_order(eqs: Equations) -> float:
    """The order of the step's bias of a mean: that of the most dissipative rigid stop under white noise; else 2."""
    stops = [r for r in (eqs.restitution, eqs.opposite_restitution) if r is not None]
    return REGULAR if eqs.n1 is None or not stops else min(impact_order(r) for r in stops)
