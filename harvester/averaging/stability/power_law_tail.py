"""The power tail that parametric noise gives the amplitude, and so which means exist at all.

If nothing but linear damping, the load and the stop at rest dissipate energy, a large amplitude A
multiplies by factors that do not depend on it, so that its moments grow or fade as E[A^p] ~
exp(Lambda(p) t), and its stationary density is

    p(A) ~ A^-(1 + q)   with   Lambda(q) = 0   (Kesten, Acta Math. 131, 207, 1973)

E[A^p] exists for p < q alone: the mean square voltage and the power need q > 2, a finite variance
of them q > 4. A spring or a friction that grows with the amplitude, or a second stop, leaves no
such tail.

Without a stop the even moments obey closed linear equations, whose largest eigenvalue is Lambda(2)
and Lambda(4). With one, ln A drifts at the top Lyapunov exponent lambda and spreads by n = N2/(4
w^2), w^2 = 1 + K, to first order

    Lambda(p) = lambda p + n p^2/2,   q = -2 lambda/n
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.stability import averaged_exponent as exponent
from harvester.averaging.stability.linearised import coupled, load, matrix, with_overrides
from harvester.equations.bounds import friction_bounds
from harvester.equations.coefficients import Equations

# powers of the amplitude whose mean the mean of V^2 needs, and its variance
MEAN, VARIANCE = 2.0, 4.0
LIGHT = 12.0  # above it no moment of interest is touched, and nothing more is asked
# Couplings g above, and rates mu of the load over |lambda| + n below, at which its slow voltage may
# hold the mass
STRONG, QUICK = 0.2, 4.0


@dataclass(frozen=True)
class PowerTail:
    """The exponent q of the density p(A) ~ A^-(1 + q), and the ends between which it lies.

    ``highest`` is infinite if what dissipates energy is not all known: then ``exponent`` is that
    without it.  An exponent of zero or less belongs to no law at all: the response grows without
    bound.
    """

    exponent: float
    lowest: float
    highest: float

    def moment_diverges(self, power: float) -> bool:
        """Whether E[A^power] surely does not exist."""
        return self.highest <= power

    def moment_may_diverge(self, power: float) -> bool:
        """Whether E[A^power] may not exist, as far as the exponent is known."""
        return self.lowest <= power


def power_tail(eqs: Equations, driven: bool = False) -> PowerTail | None:
    """The tail of the amplitude's stationary law; None if all moments exist.

    ``driven``: by a circuit that is not in the equations, of which no more is known than that it
    dissipates energy; and of a compliant stop no more than that it does not feed any.

    With a stop and a load, d = 1 - r and g = 4 beta/(pi^2 w^2), the ends are q (1 - 0.03 - 0.6 d -
    0.3 g), or the exponent without both if that is more, and q (1 + 0.05 + 0.2 d + 2.5 g), or none
    if the slow voltage may take more than averaging knows: chosen on 40 random scenes, and tried
    on 40 others, by Monte Carlo of Lambda, that of the linearised motion.
    """
    nonlinear = (eqs.linear, eqs.alpha2, eqs.alpha)
    if not eqs.n2 or friction_bounds(eqs) or any(term is not None for term in nonlinear):
        return None
    bare = _without_stop(Equations(c1=eqs.c1, n2=eqs.n2))
    if driven or eqs.stop_stiffness is not None:
        return None if bare > LIGHT else PowerTail(bare, bare, math.inf)
    if eqs.restitution is None or (eqs.restitution == 1.0 and not coupled(eqs, None)):
        q = _without_stop(eqs)
        return None if q > LIGHT else PowerTail(q, q, q)
    return _with_stop(eqs, bare)


def _with_stop(eqs: Equations, bare: float) -> PowerTail | None:
    """The tail with a stop; ``bare`` is the exponent without stop and load."""
    m, n2, r = with_overrides(eqs, None, None, None)
    w2, _ = load(eqs, m, r)
    n = float(n2 / (4.0 * w2))
    growth = float(exponent.averaged(eqs))
    q = -2.0 * growth / n
    lost = 1.0 - float(1.0 if r is None else r)
    if q > LIGHT:
        return None
    g = 4.0 * (eqs.beta or 0.0) / (math.pi**2 * float(w2)) if coupled(eqs, None) else 0.0
    lowest = max(q - abs(q) * (0.03 + 0.6 * lost + 0.3 * g), bare)
    slow = g > 0.0 and (g > STRONG or float(m) < QUICK * (abs(growth) + n))
    return PowerTail(
        max(q, lowest), lowest, math.inf if slow else q + abs(q) * (0.05 + 0.2 * lost + 2.5 * g)
    )


def _without_stop(eqs: Equations) -> float:
    """The exponent q without a stop: exact if it is 2 or 4, between and beyond by straight lines of Lambda(p)/p."""
    powers = np.array([0.0, MEAN, VARIANCE])
    rates = [float(exponent.averaged(eqs)), *(moment_growth(eqs, int(p)) / p for p in powers[1:])]
    after = 1 if rates[1] > 0.0 else 2
    (p0, p1), (y0, y1) = powers[after - 1 : after + 1], rates[after - 1 : after + 1]
    return float(p0 - y0 * (p1 - p0) / (y1 - y0)) if y1 > y0 else math.inf


def moment_growth(eqs: Equations, degree: int) -> float:
    """The rate Lambda(degree) at which the moments of that even degree grow, of linear equations without a stop.

    For z' = M z with the noise x sqrt(2 N2) dW/dt on x', z = (x, x', V), or (x, x') if V has no
    load, the generator

        L = sum_ij M_ij z_j d/dz_i + N2 x^2 d^2/dx'^2

    takes polynomials of one degree to such; the rate is the largest real part of its eigenvalues.
    """
    m, n2, _ = with_overrides(eqs, None, None, None)
    flow = matrix(eqs, m)
    if not coupled(eqs, None):
        flow = np.array([[0.0, 1.0], [-1.0 - (eqs.beta or 0.0), eqs.c1 or 0.0]])
    return float(np.linalg.eigvals(_on_monomials(flow, float(n2), degree)).real.max())


def _on_monomials(flow: Floats, n2: float, degree: int) -> Floats:
    """The matrix of L on the monomials of one degree in the components of z, each given by its powers."""
    size = len(flow)
    of_degree = [p for p in itertools.product(range(degree + 1), repeat=size) if sum(p) == degree]
    index = {powers: k for k, powers in enumerate(of_degree)}
    whole = np.zeros((len(of_degree), len(of_degree)))
    for powers, k in index.items():
        for i, j in itertools.product(range(size), repeat=2):
            if powers[i]:
                whole[index[_moved(powers, i, j, 1)], k] += flow[i, j] * powers[i]
        if powers[1] > 1:
            whole[index[_moved(powers, 1, 0, 2)], k] += n2 * powers[1] * (powers[1] - 1)
    return whole


def _moved(powers: tuple[int, ...], i: int, j: int, count: int) -> tuple[int, ...]:
    """The powers with ``count`` factors z_i replaced by z_j."""
    moved = list(powers)
    moved[i] -= count
    moved[j] += count
    return tuple(moved)
