"""Top Lyapunov exponent of the linearised oscillator, and the stability boundary (paper, section 6).

At rest without external noise Eq. 2 linearises to

    x'' - c1 x' + x + beta V = x sqrt(2 N2) dW/dt,   x'+ = -r x'- at x = 0,   V' + mu V = x'

whose size grows as e^(lambda t); alpha, c2 and c3 drop out.  V counts as part of the size where it
acts on the mass through a load.  Without a load V = x is a spring, W^2 = 1 + beta; without coupling
the exponent is that of (x, x').  The functions take arrays of mu, n2 and restitution that
broadcast, in place of those of the equations, so that a map of stability is one call.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.stability.exact_exponent import decoupled, noiseless
from harvester.averaging.stability.linearised import (
    Override,
    coupled,
    load,
    log,
    m_coth,
    modes,
    with_overrides,
)
from harvester.equations.coefficients import Equations
from harvester.presentation.diagnostic import Diagnostic, warning

DOUBTFUL = 0.02  # estimated error over the sum of the formula's terms that brings a warning
PULL = 0.1  # of the slow voltage, above which its first-order effect is not enough


def published(
    eqs: Equations, mu: Override = None, n2: Override = None, restitution: Override = None
) -> Floats:
    """The exponent lambda of the paper's Eq. 38, misprints corrected.

    lambda = c1/2 - C0/2 - (1 - r)/pi sqrt(1 + K0) + N2/(4 (1 + K0)),
    C0 = beta mu/(mu^2 + 1 + beta),   1 + K0 = (mu^2 + (1 + beta)^2)/(mu^2 + 1 + beta)
    """
    m, n2, r = with_overrides(eqs, mu, n2, restitution)
    k, rest = _published_parts(eqs, m, r)
    return rest + n2 / (4.0 * k)


def _published_parts(eqs: Equations, m: Floats, r: Floats | None) -> tuple[Floats, Floats]:
    """1 + K0 of Eq. 38, and its exponent without noise."""
    beta = eqs.beta or 0.0
    k = (m**2 + (1.0 + beta) ** 2) / (m**2 + 1.0 + beta)
    rest = 0.5 * ((eqs.c1 or 0.0) - beta * m / (m**2 + 1.0 + beta))
    return k, rest if r is None else rest - (1.0 - r) / math.pi * np.sqrt(k)


def averaged(
    eqs: Equations, mu: Override = None, n2: Override = None, restitution: Override = None
) -> Floats:
    """The exponent lambda by impact-aware averaging: exact at beta = 0, else to first order in beta and N2 beta.

    With a stop, with n = N2/(4 w^2), m = mu/w and g = 4 beta/(pi^2 w^2),

        lambda = decoupled(c1 - C, w^2) - n (beta eta - w^2 + 1) - (w/pi) ln r beta kappa^2
                 + g [(w/pi) ln r - (c1 - C)/2 - 5n/3] p + g [lambda - n (1 + f)/2 - mu p]

    p is the slow voltage over the cycle's mean displacement, whose law under noise has the mean p =
    l/(l + mu), l = lambda - n/2; if l + mu < n/2 few trajectories make that mean, and the typical p
    = lambda/(lambda + mu) takes its place.  Either way lambda is the larger root of a quadratic,
    near -mu if the voltage outlives the motion.  For g >= 1 (beta above about 4.6) `decoupled`
    stands alone.  f is the noise that the slow voltage follows: 1 for slow loads, 0 for fast ones;
    between, f = (1 - m^2)/(1 + m^2)/(1 + m^2/16) is not a theory but a fit to Monte Carlo (r = 1).

    Without a stop: the rightmost eigenvalue lambda_i of (x, x', V), plus what noise does to an
    oscillator of the frequency that has the mode's first-order response, -N2 (l_v x_i)^2, with
    right vectors (x_i, ...) and left ones (..., l_v, ...) of unit product.
    """
    m, n2, r = with_overrides(eqs, mu, n2, restitution)
    if not coupled(eqs, mu):
        w2, damping = load(eqs, m, r)
        return decoupled(damping, w2, n2, r)
    if r is not None:
        return _with_slow_voltage(eqs, m, n2, r)[0]
    values, slopes = modes(eqs, m)
    top = (values - n2[..., None] * slopes).argmax(axis=-1)[..., None]
    value, slope = (np.take_along_axis(part, top, -1)[..., 0] for part in (values, slopes))
    swinging = decoupled(0.0, -0.25 / np.minimum(slope, -1e-12), n2)
    return np.asarray(value + np.where(slope < 0.0, swinging, -n2 * slope))


def _with_slow_voltage(eqs: Equations, m: Floats, n2: Floats, r: Floats) -> tuple[Floats, Floats]:
    """The exponent with a stop and a load, and how far the slow voltage moves the centre of the orbits, g p."""
    w2, damping = load(eqs, m, r)
    beta = eqs.beta or 0.0
    ratio2 = m**2 / w2
    n = n2 / (4.0 * w2)
    log_r = np.sqrt(w2) / math.pi * log(r)
    g = 4.0 * beta / (math.pi**2 * w2)
    bare = decoupled(damping, w2, n2, r)
    # The kink of the voltage at an impact changes the speed there: kappa = q/((1 + m^2) w).
    kappa2 = (m_coth(np.sqrt(ratio2)) / (1.0 + ratio2)) ** 2 / w2
    s = bare - log_r * beta * kappa2 - n * (beta * pushed(ratio2) - (w2 - 1.0))
    loss = log_r - 0.5 * damping - 5.0 / 3.0 * n
    weak = np.where(g < 1.0, g, 0.5)

    def root(s: Floats) -> Floats:
        """The larger root of l = s + weak (loss + l) l/(l + mu), in the form that does not cancel."""
        b = m - s - weak * loss
        d = np.sqrt(np.maximum(b * b + 4.0 * (1.0 - weak) * s * m, 0.0))
        return np.where(
            b > 0.0, 2.0 * s * m / np.where(b > 0.0, b + d, 1.0), (d - b) / (2.0 * (1.0 - weak))
        )

    f = (1.0 - ratio2) / (1.0 + ratio2) / (1.0 + ratio2 / 16.0)
    mean = root(s - 0.5 * n * (1.0 + weak * f))
    typical = root(s - 0.5 * n * weak * (1.0 + f))
    few = mean + m < 0.5 * n
    slow = np.where(few, typical, mean)
    pull = weak * slow / np.maximum(slow + m, 1e-300)
    return np.where(g < 1.0, np.where(few, typical, mean + 0.5 * n), bare), np.where(
        g < 1.0, pull, np.inf
    )


def pushed(ratio2: Floats) -> Floats:
    """The number eta(m^2) by which the fast voltage's even part bends the orbit: noise then brings N2/4 (1 - beta eta).

    From <x^2>/E - <x^2 x'^2>/E^2 at equal energy E at the stop, to first order in beta.
    """
    offset = (
        2.0
        * m_coth(np.sqrt(ratio2))
        * (ratio2 - 15.0)
        / (math.pi * (ratio2 + 1.0) * (ratio2 + 9.0))
    )
    return np.asarray((1.0 + offset) / (1.0 + ratio2))


class Boundary(NamedTuple):
    """The stability boundary: N2 at which lambda = 0, at each mu (for eps2 = 1, N2 is D22).

    0 where rest is unstable without noise, infinite if no noise makes it unstable.
    """

    mu: Floats
    published: Floats
    averaged: Floats


def boundary(eqs: Equations, mu: Floats, restitution: Override = None) -> Boundary:
    """The stability boundary in the plane (mu, D22), with N2 and mu of ``eqs`` left aside (paper, Figure 9)."""
    m, needed, r = with_overrides(eqs, mu, 0.0, restitution)
    k, rest = _published_parts(eqs, m, r)
    w2, _ = load(eqs, m, r)
    for _ in range(400):  # lambda rises with N2, nowhere much faster than by 1/(4 w^2)
        before = needed
        needed = np.maximum(before - 3.5 * w2 * averaged(eqs, m, before, r), 0.0)
        if np.allclose(needed, before, rtol=1e-10, atol=1e-12):
            break
    else:
        needed = np.where(np.isclose(needed, before, rtol=1e-6, atol=1e-9), needed, np.inf)
    return Boundary(m, np.maximum(-4.0 * k * rest, 0.0), needed)


@dataclass(frozen=True)
class ExponentChecks:
    """What is known of the error of `averaged`: its estimated size (None: unknown), and what to beware of."""

    error: float | None
    diagnostics: tuple[Diagnostic, ...]


def checks(eqs: Equations) -> ExponentChecks:
    """Compare `averaged` with what is exact without noise, and estimate what noise and load do together."""
    m, n2, r = with_overrides(eqs, None, None, None)
    w2, _ = load(eqs, m, r)
    warnings = list[Diagnostic]()
    error = 0.0
    if coupled(eqs, None):
        if r is not None and r < 0.5:
            warnings.append(warning("unreliable_restitution", restitution=float(r)))
        quiet = noiseless(eqs)
        n = float(n2 / (4.0 * w2))
        ratio2 = float(m**2 / w2)
        g = 4.0 * (eqs.beta or 0.0) / (math.pi**2 * float(w2))
        error = (
            g * n * (9.0 * n if r is None else 6.0 * n + 0.5 * math.sqrt(ratio2) / (1.0 + ratio2))
        )
        if quiet is not None:
            error += abs(quiet - float(averaged(eqs, n2=0.0)))
        scale = n if r is None else n - float(np.sqrt(w2) / math.pi * log(r))
        if error > DOUBTFUL * (scale + abs(eqs.c1 or 0.0)):
            warnings.append(warning("exponent_doubtful", error=error))
        if r is not None and not abs(_with_slow_voltage(eqs, m, n2, r)[1]) < PULL:
            warnings.append(warning("slow_voltage"))
        if quiet is None:
            return ExponentChecks(None, (*warnings, warning("leaves_the_stop")))
    return ExponentChecks(error, tuple(warnings))
