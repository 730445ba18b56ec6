"""The averaged Ito equation of the amplitude (paper, Eqs. 13, 18-24, misprints corrected).

On an orbit (y, y') of `harvester.averaging.published.orbit`, with Q = 1 + K + alpha A^2 = g(A)/A,

    dA/dt     = m1 + sigma11 xi1 + sigma12 xi2          (Eq. 18)
    dGamma/dt = m2 + sigma21 xi1 + sigma22 xi2

and on average over Phi, uniform in (0, 2 pi) as in the paper (Eq. 22; over time the weight would be 1/nu),

    dA = b(A) dt + sigma(A) dB                          (Eq. 20)

K is held constant in time (not in A), as in the paper.  Both noises act through one acceleration, of intensity

    N(y) = N1 + 2 N12 |y| + N2 y^2

at the mirrored y: external noise there carries sgn y, parametric noise does not, so their product has |y|.  Without a
stop nothing is mirrored, the product is odd in y, and correlation has no effect on average.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.grids import given
from harvester.averaging.published.orbit import nu, nu2
from harvester.averaging.published.voltage import C, K, dK_dA
from harvester.equations.scaling import Equations


def stiffness(A: Floats, eqs: Equations) -> tuple[Floats, Floats]:
    """The stiffnesses k = 1 + K(A) and Q = 1 + K(A) + alpha A^2."""
    alpha = given(eqs.alpha)
    k = 1.0 + K(A, alpha, given(eqs.beta), given(eqs.mu))
    return k, k + alpha * A**2


def damping(A: Floats, y: Floats, eqs: Equations) -> Floats:
    """f(y) + C(A), f = c3 y^4 - c2 y^2 - c1 (Eq. 14)."""
    c1, c2, c3 = given(eqs.c1), given(eqs.c2), given(eqs.c3)
    return c3 * y**4 - c2 * y**2 - c1 + C(A, given(eqs.alpha), given(eqs.beta), given(eqs.mu))


def m1(A: Floats, Phi: Floats, eqs: Equations) -> Floats:
    """dA/dt by damping, -A nu^2 sin^2 Phi (f + C)/Q (Eq. 19); the impact is in `impact`."""
    k, Q = stiffness(A, eqs)
    n2 = nu2(A, Phi, given(eqs.alpha), k - 1.0)
    rate: Floats = -A * n2 * np.sin(Phi) ** 2 * damping(A, A * np.cos(Phi), eqs) / Q
    return rate


def m2(A: Floats, Phi: Floats, eqs: Equations) -> Floats:
    """dGamma/dt by damping, -nu^2 sin Phi cos Phi (f + C)/Q (Eq. 19, with nu^2 where nu is printed).

    The impact's part has the factor cos Phi delta(A cos Phi) = 0.
    """
    k, Q = stiffness(A, eqs)
    n2 = nu2(A, Phi, given(eqs.alpha), k - 1.0)
    return -n2 * np.sin(Phi) * np.cos(Phi) * damping(A, A * np.cos(Phi), eqs) / Q


def impact(A: Floats, Phi: Floats, eqs: Equations) -> Floats:
    """What stands before delta(A cos Phi) in dA/dt, -(1 - r) A^2 nu^3 |sin^3 Phi|/Q (Eqs. 13, 19, with an abs)."""
    if eqs.restitution is None:
        return np.zeros(np.broadcast(A, Phi).shape)
    k, Q = stiffness(A, eqs)
    speed = A * nu(A, Phi, given(eqs.alpha), k - 1.0) * np.abs(np.sin(Phi))
    return -(1.0 - eqs.restitution) * speed**3 / (A * Q)


def sigma(A: Floats, Phi: Floats, eqs: Equations) -> tuple[Floats, Floats, Floats, Floats]:
    """sigma11, sigma12, sigma21, sigma22 per eps1 and eps2 (Eq. 19, with eps1 in sigma11 and sigma21).

    sigma11 = -sgn(cos Phi) nu sin Phi/Q        sigma12 = -A nu sin Phi cos Phi/Q
    sigma21 = -sgn(cos Phi) nu cos Phi/(A Q)    sigma22 = -nu cos^2 Phi/Q

    Without a stop sgn is 1.
    """
    k, Q = stiffness(A, eqs)
    n, sin, cos = nu(A, Phi, given(eqs.alpha), k - 1.0), np.sin(Phi), np.cos(Phi)
    sign = np.ones_like(cos) if eqs.restitution is None else np.sign(cos)
    return -sign * n * sin / Q, -A * n * sin * cos / Q, -sign * n * cos / (A * Q), -n * cos**2 / Q


def drift(A: Floats, eqs: Equations) -> Floats:
    """b(A) of Eqs. 21 and 23: the mean of m1, impacts and noise.

    Corrected against print: the bracket of c2 is A^3 (1+K)/8 + 3/32 alpha A^5, and the noise
    terms stand in a compact form equal to the corrected Fourier sums.  The impact term,
    -(1 - r) A nu^3(pi/2)/(pi Q), is the paper's, of first order in 1 - r.
    """
    alpha, beta, mu = given(eqs.alpha), given(eqs.beta), given(eqs.mu)
    c1, c2, c3 = given(eqs.c1), given(eqs.c2), given(eqs.c3)
    k, Q = stiffness(A, eqs)
    b = -c3 * (16 * A**5 * k + 13 * alpha * A**7) / 256
    b += c2 * (A**3 * k / 8 + 3 * alpha * A**5 / 32)
    b += (c1 - C(A, alpha, beta, mu)) * (8 * A * k + 5 * alpha * A**3) / 16
    if eqs.restitution is not None:
        b -= (1.0 - eqs.restitution) / math.pi * A * (k + 0.5 * alpha * A**2) ** 1.5
    return b / Q + noise_drift(A, eqs)


def intensities(eqs: Equations) -> tuple[Floats, Floats, Floats]:
    """N1, N2 and what the averaged amplitude feels of N12: nothing without a stop."""
    n12 = given(None if eqs.restitution is None else eqs.n12)
    return given(eqs.n1), given(eqs.n2), n12


def diffusion(A: Floats, eqs: Equations) -> tuple[Floats, Floats, Floats]:
    """The three parts of sigma^2(A) = 2 <nu^2 sin^2 Phi N(y)>/Q^2: external, parametric, correlated (Eq. 24).

        s1^2 = N1 (1+K+5/8 alpha A^2)/Q^2,   s2^2 = N2 A^2 (1+K+3/4 alpha A^2)/(4 Q^2),
        s12^2 = 8 N12 A (1+K+7/10 alpha A^2)/(3 pi Q^2)

    Corrected against print: Eq. 21's sigma^2 has no products of different rows.  The paper
    leaves D12 out; s12^2 may be negative, the sum may not.
    """
    N1, N2, N12 = intensities(eqs)
    (k, Q), a = stiffness(A, eqs), given(eqs.alpha) * A**2
    s1 = N1 * (k + 0.625 * a) / Q**2
    s2 = N2 * A**2 * (k + 0.75 * a) / (4 * Q**2)
    s12 = 8 * N12 * A * (k + 0.7 * a) / (3 * math.pi * Q**2)
    return s1, s2, s12


def noise_drift(A: Floats, eqs: Equations) -> Floats:
    """The noise's part of b(A): the last four lines of Eq. 23, corrected, in compact form.

        1/4 d(sigma^2)/dA + <nu^2 N(y)>/(2 A Q^2)

    <nu^2 N> = N1 (1+K+3/4 alpha A^2) + N2 A^2 [(1+K)/2 + 7/16 alpha A^2] + 4/pi N12 A (1+K+5/6 alpha A^2).
    """
    N1, N2, N12 = intensities(eqs)
    (k, Q), a = stiffness(A, eqs), given(eqs.alpha) * A**2
    mean = N1 * (k + 0.75 * a) + N2 * A**2 * (k / 2 + 7 * a / 16) + 4 / math.pi * N12 * A * (k + 5 * a / 6)
    return 0.25 * diffusion_slope(A, eqs) + mean / (2 * A * Q**2)


def diffusion_slope(A: Floats, eqs: Equations) -> Floats:
    """d(sigma^2)/dA, with K'(A)."""
    N1, N2, N12 = intensities(eqs)
    alpha = given(eqs.alpha)
    (k, Q), a = stiffness(A, eqs), alpha * A**2
    dk = dK_dA(A, alpha, given(eqs.beta), given(eqs.mu))
    top = N1 * (k + 0.625 * a) + N2 * A**2 * (k + 0.75 * a) / 4 + 8 * N12 * A * (k + 0.7 * a) / (3 * math.pi)
    dtop = N1 * (dk + 1.25 * alpha * A) + N2 * (A**2 * dk / 4 + A * (k + 1.5 * a) / 2)
    dtop += 8 * N12 * (A * dk + k + 2.1 * a) / (3 * math.pi)
    return dtop / Q**2 - 2 * top * (dk + 2 * alpha * A) / Q**3
