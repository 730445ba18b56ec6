"""Averaged drift and diffusion of the amplitude (paper, Eqs. 19-24, misprints corrected).

dA = b(A) dt + sigma(A) dB,   averages uniform in Phi over (0, 2 pi), Q = 1 + K + alpha A^2
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.averaging.voltage import C, K
from harvester.scaling import Equations


def drift(A: Floats, eqs: Equations) -> Floats:
    """b(A) of Eq. 23.

    Corrected against print: the bracket of c2 is A^3 (1+K)/8 + 3/32 alpha A^5, and the noise
    terms stand in a compact form equal to the corrected Fourier sums.  The impact term,
    -(1 - r) A nu^3(pi/2)/(pi Q), is the paper's, of first order in 1 - r.
    """
    alpha, beta, mu = eqs.alpha or 0.0, eqs.beta or 0.0, eqs.mu or 0.0
    c1, c2, c3 = eqs.c1 or 0.0, eqs.c2 or 0.0, eqs.c3 or 0.0
    k = 1.0 + K(A, alpha, beta, mu)
    Q = k + alpha * A**2
    b = -c3 * (16 * A**5 * k + 13 * alpha * A**7) / 256
    b += c2 * (A**3 * k / 8 + 3 * alpha * A**5 / 32)
    b += (c1 - C(A, alpha, beta, mu)) * (8 * A * k + 5 * alpha * A**3) / 16
    if eqs.restitution is not None:
        b -= (1.0 - eqs.restitution) / math.pi * A * (k + 0.5 * alpha * A**2) ** 1.5
    return b / Q + noise_drift(A, eqs)


def diffusion(A: Floats, eqs: Equations) -> tuple[Floats, Floats]:
    """The two parts of sigma^2(A) (Eq. 24), by external and by parametric noise.

        s1^2 = N1 (1+K+5/8 alpha A^2)/Q^2,   s2^2 = N2 A^2 (1+K+3/4 alpha A^2)/(4 Q^2)

    Corrected against print: Eq. 21's sigma^2 has no products of different rows.
    """
    alpha, beta, mu = eqs.alpha or 0.0, eqs.beta or 0.0, eqs.mu or 0.0
    k = 1.0 + K(A, alpha, beta, mu)
    Q = k + alpha * A**2
    s1 = (eqs.n1 or 0.0) * (k + 0.625 * alpha * A**2) / Q**2
    s2 = (eqs.n2 or 0.0) * A**2 * (k + 0.75 * alpha * A**2) / (4 * Q**2)
    return s1, s2


def noise_drift(A: Floats, eqs: Equations) -> Floats:
    """The noise's part of b(A): the last four lines of Eq. 23, corrected, in compact form.

    1/4 d(s1^2 + s2^2)/dA + N1 (1+K+3/4 alpha A^2)/(2 A Q^2) + N2 A [(1+K)/4 + 7/32 alpha A^2]/Q^2
    """
    alpha, beta, mu = eqs.alpha or 0.0, eqs.beta or 0.0, eqs.mu or 0.0
    k = 1.0 + K(A, alpha, beta, mu)
    Q = k + alpha * A**2
    step = 1e-5 * A
    slope = (sum(diffusion(A + step, eqs)) - sum(diffusion(A - step, eqs))) / (2.0 * step)
    b = 0.25 * np.asarray(slope)
    b += (eqs.n1 or 0.0) * (k + 0.75 * alpha * A**2) / (2 * A * Q**2)
    b += (eqs.n2 or 0.0) * A * (k / 4 + 7 * alpha * A**2 / 32) / Q**2
    return b
