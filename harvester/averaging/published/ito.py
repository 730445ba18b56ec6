"""The averaged Ito equation of the amplitude (paper, Eqs. 13, 18-24, misprints corrected).

On an orbit (y, y') of `harvester.averaging.published.orbit`, with Q = 1 + K + alpha A^2 = g(A)/A,

    dA/dt     = m1 + sigma11 xi1 + sigma12 xi2          (Eq. 18)
    dGamma/dt = m2 + sigma21 xi1 + sigma22 xi2

with, by friction, load, impacts and noise (Eq. 19, corrected; f = c3 y^4 - c2 y^2 - c1, C of the
load),

    m1 = -A nu^2 sin^2 Phi (f + C)/Q - (1 - r) A^2 nu^3 |sin^3 Phi|/Q delta(A cos Phi)
    sigma11 = -sgn(cos Phi) nu sin Phi/Q        sigma12 = -A nu sin Phi cos Phi/Q

and on average over Phi, uniform in (0, 2 pi) as in the paper (Eq. 22; over time the weight would be
1/nu),

    dA = b(A) dt + sigma(A) dB                          (Eq. 20)

K is held constant in time (not in A), as in the paper.  Both noises act through one acceleration,
of intensity

    N(y) = N1 + 2 N12 |y| + N2 y^2

at the mirrored y: external noise there carries sgn y, parametric noise does not, so their product
has |y|.  Without a stop nothing is mirrored, the product is odd in y, and correlation has no effect
on average.
"""

import math

from harvester.arrays import Floats
from harvester.averaging.grids import or_zero
from harvester.averaging.published.orbit import C, K, dK_dA
from harvester.equations.coefficients import Equations


def stiffness(A: Floats, eqs: Equations) -> tuple[Floats, Floats]:
    """The stiffnesses k = 1 + K(A) and Q = 1 + K(A) + alpha A^2."""
    alpha = or_zero(eqs.alpha)
    k = 1.0 + K(A, alpha, or_zero(eqs.beta), or_zero(eqs.mu))
    return k, k + alpha * A**2


def drift(A: Floats, eqs: Equations) -> Floats:
    """The drift b(A) of the amplitude: the mean of m1, and the noise's part (Eqs. 21, 23).

    Corrected against print: the bracket of c2 is A^3 (1+K)/8 + 3/32 alpha A^5, and the noise
    terms are in a compact form equal to the corrected Fourier sums.  The impact term,
    -(1 - r) A nu^3(pi/2)/(pi Q), is the paper's, of first order in 1 - r.
    """
    alpha = or_zero(eqs.alpha)
    beta = or_zero(eqs.beta)
    mu = or_zero(eqs.mu)
    c1 = or_zero(eqs.c1)
    c2 = or_zero(eqs.c2)
    c3 = or_zero(eqs.c3)
    k, Q = stiffness(A, eqs)
    b = -c3 * (16 * A**5 * k + 13 * alpha * A**7) / 256
    b += c2 * (A**3 * k / 8 + 3 * alpha * A**5 / 32)
    b += (c1 - C(A, alpha, beta, mu)) * (8 * A * k + 5 * alpha * A**3) / 16
    if eqs.restitution is not None:
        b -= (1.0 - eqs.restitution) / math.pi * A * (k + 0.5 * alpha * A**2) ** 1.5
    return b / Q + noise_drift(A, eqs)


def intensities(eqs: Equations) -> tuple[Floats, Floats, Floats]:
    """The noise intensities N1, N2 and N12 that the averaged amplitude feels.

    N12 is absent without a stop.
    """
    return or_zero(eqs.n1), or_zero(eqs.n2), or_zero(None if eqs.restitution is None else eqs.n12)


def diffusion(A: Floats, eqs: Equations) -> tuple[Floats, Floats, Floats]:
    """The three parts of sigma^2(A) = 2 <nu^2 sin^2 Phi N(y)>/Q^2: external, parametric, correlated (Eq. 24).

        s1^2 = N1 (1+K+5/8 alpha A^2)/Q^2,   s2^2 = N2 A^2 (1+K+3/4 alpha A^2)/(4 Q^2),
        s12^2 = 8 N12 A (1+K+7/10 alpha A^2)/(3 pi Q^2)

    Corrected against print: Eq. 21's sigma^2 has no products of different rows.  The paper
    leaves D12 out; s12^2 may be negative, the sum may not.
    """
    N1, N2, N12 = intensities(eqs)
    (k, Q) = stiffness(A, eqs)
    a = or_zero(eqs.alpha) * A**2
    s1 = N1 * (k + 0.625 * a) / Q**2
    s2 = N2 * A**2 * (k + 0.75 * a) / (4 * Q**2)
    s12 = 8 * N12 * A * (k + 0.7 * a) / (3 * math.pi * Q**2)
    return s1, s2, s12


def noise_drift(A: Floats, eqs: Equations) -> Floats:
    """The noise's part of b(A): the last four lines of Eq. 23, corrected, in compact form.

        1/4 d(sigma^2)/dA + <nu^2 N(y)>/(2 A Q^2)

    <nu^2 N> = N1 (1+K+3/4 alpha A^2) + N2 A^2 [(1+K)/2 + 7/16 alpha A^2] + 4/pi N12 A (1+K+5/6
    alpha A^2).
    """
    N1, N2, N12 = intensities(eqs)
    (k, Q) = stiffness(A, eqs)
    a = or_zero(eqs.alpha) * A**2
    mean = (
        N1 * (k + 0.75 * a)
        + N2 * A**2 * (k / 2 + 7 * a / 16)
        + 4 / math.pi * N12 * A * (k + 5 * a / 6)
    )
    return 0.25 * diffusion_slope(A, eqs) + mean / (2 * A * Q**2)


def diffusion_slope(A: Floats, eqs: Equations) -> Floats:
    """Slope d(sigma^2)/dA of the diffusion (Eq. 24), with K'(A)."""
    N1, N2, N12 = intensities(eqs)
    alpha = or_zero(eqs.alpha)
    (k, Q) = stiffness(A, eqs)
    a = alpha * A**2
    dk = dK_dA(A, alpha, or_zero(eqs.beta), or_zero(eqs.mu))
    top = (
        N1 * (k + 0.625 * a)
        + N2 * A**2 * (k + 0.75 * a) / 4
        + 8 * N12 * A * (k + 0.7 * a) / (3 * math.pi)
    )
    dtop = N1 * (dk + 1.25 * alpha * A) + N2 * (A**2 * dk / 4 + A * (k + 1.5 * a) / 2)
    dtop += 8 * N12 * (A * dk + k + 2.1 * a) / (3 * math.pi)
    return dtop / Q**2 - 2 * top * (dk + 2 * alpha * A) / Q**3
