"""Steps of the paper that lead to its formulas and that the package itself does not need (its Eqs. 4-19, 27, 31, 38).

Misprints are corrected; docs/audit.md has them all.  Symbols are the paper's.
"""

import math
from collections.abc import Callable

import numpy as np

from harvester.arrays import Coefficient, Floats
from harvester.averaging.grids import or_zero
from harvester.averaging.published.ito import stiffness
from harvester.averaging.published.orbit import C, G, closed, dK_dA, nu, nu2, omega2
from harvester.averaging.published.stationary import Stationary
from harvester.averaging.stability.averaged_exponent import published
from harvester.averaging.stability.linearised import Override, load, log, with_overrides
from harvester.equations.coefficients import Equations


def earlier_velocity(x: Floats, v: Floats, w: Floats, s: Floats) -> Floats:
    """x'(t - s) = x' cos(w s) + w x sin(w s) of a harmonic x of frequency w (Eq. 4)."""
    return v * np.cos(w * s) + w * x * np.sin(w * s)


def on_harmonic(A: Floats, Phi: Floats, w: Floats, mu: Coefficient) -> Floats:
    """V = A w (w cos Phi - mu sin Phi)/(mu^2 + w^2) (Eq. 5, with mu where beta is printed)."""
    return A * w * (w * np.cos(Phi) - mu * np.sin(Phi)) / (mu**2 + w**2)


def omega(A: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient) -> Floats:
    """Averaged frequency omega(A) (Eq. 10, corrected)."""
    return np.sqrt(omega2(A, alpha, beta, mu))


def g(y: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Restoring force g(y) = dG/dy = (1 + K) y + alpha y^3 (paper, below Eq. 8)."""
    return (1.0 + K) * y + alpha * y**3


def nu2_coupled(
    A: Floats, Phi: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient
) -> Floats:
    """Square of the instantaneous frequency with the load's stiffness at nu itself (Eq. 9).

        nu^2 = [G1 + sqrt(G1^2 + 4 G0)]/2,   G1 = s + beta - mu^2,   G0 = mu^2 s,
        s = 1 + 3/4 alpha A^2 + 1/4 alpha A^2 cos 2 Phi

    the positive root of nu^2 = s + beta nu^2/(mu^2 + nu^2).  Printed G0 lacks mu^2 in its last term.
    """
    return closed(nu2(A, Phi, alpha, np.asarray(0.0)), beta, mu)


def on_orbit(A: Floats, Phi: Floats, alpha: Coefficient, K: Floats) -> tuple[Floats, Floats]:
    """The point y = A cos Phi, y' = -A nu sin Phi (Eq. 3)."""
    return A * np.cos(Phi), -A * nu(A, Phi, alpha, K) * np.sin(Phi)


def folded(y: Floats, v: Floats) -> tuple[Floats, Floats]:
    """The mirror x = |y|, x' = y' sgn y (Eq. 11): x' -> -r x' at the stop is y' -> r y' through it (Eq. 12)."""
    return np.abs(y), v * np.sign(y)


def damping(A: Floats, y: Floats, eqs: Equations) -> Floats:
    """f(y) + C(A), f = c3 y^4 - c2 y^2 - c1 (Eq. 14)."""
    c1 = or_zero(eqs.c1)
    c2 = or_zero(eqs.c2)
    c3 = or_zero(eqs.c3)
    return c3 * y**4 - c2 * y**2 - c1 + C(A, or_zero(eqs.alpha), or_zero(eqs.beta), or_zero(eqs.mu))


def m1(A: Floats, Phi: Floats, eqs: Equations) -> Floats:
    """dA/dt by damping, -A nu^2 sin^2 Phi (f + C)/Q (Eq. 19); the impact is in `impact`."""
    k, Q = stiffness(A, eqs)
    n2 = nu2(A, Phi, or_zero(eqs.alpha), k - 1.0)
    rate: Floats = -A * n2 * np.sin(Phi) ** 2 * damping(A, A * np.cos(Phi), eqs) / Q
    return rate


def m2(A: Floats, Phi: Floats, eqs: Equations) -> Floats:
    """dGamma/dt by damping, -nu^2 sin Phi cos Phi (f + C)/Q (Eq. 19, with nu^2 where nu is printed).

    The impact's part has the factor cos Phi delta(A cos Phi) = 0.
    """
    k, Q = stiffness(A, eqs)
    n2 = nu2(A, Phi, or_zero(eqs.alpha), k - 1.0)
    return -n2 * np.sin(Phi) * np.cos(Phi) * damping(A, A * np.cos(Phi), eqs) / Q


def impact(A: Floats, Phi: Floats, eqs: Equations) -> Floats:
    """What is before delta(A cos Phi) in dA/dt, -(1 - r) A^2 nu^3 |sin^3 Phi|/Q (Eqs. 13, 19, with an abs)."""
    if eqs.restitution is None:
        return np.zeros(np.broadcast(A, Phi).shape)
    k, Q = stiffness(A, eqs)
    speed = A * nu(A, Phi, or_zero(eqs.alpha), k - 1.0) * np.abs(np.sin(Phi))
    return -(1.0 - eqs.restitution) * speed**3 / (A * Q)


def sigma(A: Floats, Phi: Floats, eqs: Equations) -> tuple[Floats, Floats, Floats, Floats]:
    """sigma11, sigma12, sigma21, sigma22 per eps1 and eps2 (Eq. 19, with eps1 in sigma11 and sigma21).

    sigma11 = -sgn(cos Phi) nu sin Phi/Q        sigma12 = -A nu sin Phi cos Phi/Q
    sigma21 = -sgn(cos Phi) nu cos Phi/(A Q)    sigma22 = -nu cos^2 Phi/Q

    Without a stop sgn is 1.
    """
    k, Q = stiffness(A, eqs)
    n = nu(A, Phi, or_zero(eqs.alpha), k - 1.0)
    sin = np.sin(Phi)
    cos = np.cos(Phi)
    sign = np.ones_like(cos) if eqs.restitution is None else np.sign(cos)
    return -sign * n * sin / Q, -A * n * sin * cos / Q, -sign * n * cos / (A * Q), -n * cos**2 / Q


def nu_coefficients(A: Floats, k: Floats, alpha: Coefficient) -> Floats:
    """b0, b2, b4, b6 of nu, shape (4, ...) (Eq. 17), k = 1 + K, to third order in eta.

    b0 = w (1 - eta^2/16),  b2 = w (eta/2 + 3 eta^3/64),  b4 = -w eta^2/16,  b6 = w eta^3/64,
    w^2 = 1 + K + 3/4 alpha A^2,  eta = alpha A^2/(4 w^2) <= 1/3
    """
    w2 = k + 0.75 * alpha * A**2
    eta = 0.25 * alpha * A**2 / w2
    b: Floats = np.sqrt(w2) * np.array(
        [1 - eta**2 / 16, eta / 2 + 3 * eta**3 / 64, -(eta**2) / 16, eta**3 / 64]
    )
    return b


def nu_series(b: Floats, Phi: Floats) -> Floats:
    """The sum nu = b0 + b2 cos 2 Phi + b4 cos 4 Phi + b6 cos 6 Phi (Eq. 16).

    In error by at most 0.078 %, at eta = 1/3, where the cubic force is all; at the paper's alpha,
    up to A = 3.4, by less than the 0.03 % that it states.
    """
    n: Floats = b[0] + b[1] * np.cos(2 * Phi) + b[2] * np.cos(4 * Phi) + b[3] * np.cos(6 * Phi)
    return n


def external_drift(A: Floats, eqs: Equations) -> Floats:
    """The external noise's part of b(A) (Eq. 23, its lines with eps1).

    Corrected against print: the brackets of b0' and b2', and 2 b2^2 in the last bracket.
    """
    k, Q = stiffness(A, eqs)
    b0, b2, b4, b6 = b = nu_coefficients(A, k, or_zero(eqs.alpha))
    brackets = np.array([4 * b0 - 2 * b2, 2 * b2 - 2 * b0 - b4, 2 * b4 - b2 - b6, 2 * b6 - b4])
    slopes = _slope(
        lambda a: (
            nu_coefficients(a, stiffness(a, eqs)[0], or_zero(eqs.alpha)) / stiffness(a, eqs)[1]
        ),
        A,
    )
    spread = (brackets * slopes).sum(axis=0) / (8 * Q)
    per_n1: Floats = spread + (2 * b0**2 + 2 * (b**2).sum(axis=0)) / (8 * A * Q**2)
    return or_zero(eqs.n1) * per_n1


def parametric_drift(A: Floats, eqs: Equations) -> Floats:
    """The parametric noise's part of b(A) (Eq. 23, its lines with eps2, right as printed)."""
    k, Q = stiffness(A, eqs)
    b0, b2, b4, b6 = b = nu_coefficients(A, k, or_zero(eqs.alpha))

    def sines(b: Floats) -> Floats:
        """4 nu sin Phi cos Phi = (2 b0 - b4) sin 2 Phi + (b2 - b6) sin 4 Phi + b4 sin 6 Phi + b6 sin 8 Phi."""
        return np.array([2 * b[0] - b[2], b[1] - b[3], b[2], b[3]])

    def in_sigma(a: Floats) -> Floats:
        k, Q = stiffness(a, eqs)
        return a * sines(nu_coefficients(a, k, or_zero(eqs.alpha))) / Q

    spread = (sines(b) * _slope(in_sigma, A)).sum(axis=0) / (32 * Q)
    squares = 2 * b0**2 + 2 * b0 * b2 + b2**2 + b2 * b4 + b4**2 + b4 * b6 + b6**2
    per_n2: Floats = A * (spread + squares / (8 * Q**2))
    return or_zero(eqs.n2) * per_n2


def _slope(f: Callable[[Floats], Floats], A: Floats) -> Floats:
    """df/dA by central differences, to about 1e-10."""
    h = 1e-5 * A
    return (f(A + h) - f(A - h)) / (2 * h)


def energy_density(law: Stationary, eqs: Equations) -> tuple[Floats, Floats]:
    """H and p(H) = p(A) dA/dH at the amplitudes of ``law``, each of shape (n,) (Eq. 27)."""
    (k, Q) = stiffness(law.A, eqs)
    A = law.A
    slope = dK_dA(A, or_zero(eqs.alpha), or_zero(eqs.beta), or_zero(eqs.mu))
    return G(A, or_zero(eqs.alpha), k - 1.0), law.p / (A * Q + 0.5 * A**2 * slope)


def exponent_as_printed(eqs: Equations) -> float:
    """Lambda of Eq. 38 as printed: the noise's factor upside down, with beta for 2 beta."""
    m = eqs.mu or 0.0
    beta = eqs.beta or 0.0
    n2 = eqs.n2 or 0.0
    return float(published(eqs, n2=0.0)) + n2 * (1 + m**2 + beta + beta**2) / (
        4 * (m**2 + 1 + beta)
    )


def simple_exponent(
    eqs: Equations, mu: Override = None, n2: Override = None, restitution: Override = None
) -> Floats:
    """Lambda = (c1 - C)/2 + (w/pi) ln r + N2/(4 w^2): the load as one damping C and one stiffness w^2 - 1."""
    m, n, r = with_overrides(eqs, mu, n2, restitution)
    w2, damping = load(eqs, m, r)
    value = 0.5 * damping + n / (4.0 * w2)
    return value if r is None else value + np.sqrt(w2) / math.pi * log(r)
