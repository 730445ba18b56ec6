"""Orbits of the equivalent oscillator: potential, amplitude, frequency, period and voltage (paper, Eqs. 3-15).

On an orbit of amplitude A the load's stiffness K = K(A) is a constant, so that

    y = A cos Phi,   y' = -A nu sin Phi,   dPhi/dt = nu(A, Phi),   H = y'^2/2 + G(y) = G(A)

Symbols are the paper's: A amplitude, alpha cubic stiffness, beta electromechanical coupling,
mu time-constant ratio.  All arrays broadcast.

The voltage is that of an x which is harmonic about zero: from V' + mu V = x', without the start's
decaying term,

    V(t) = int_0^inf e^(-mu s) x'(t - s) ds,   Phi = omega(A) t + Gamma     (Eqs. 4, 5)
"""

import numpy as np
from scipy.special import agm

from harvester.arrays import Coefficient, Floats


def G(y: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Potential energy G(y) = (1 + K) y^2/2 + alpha y^4/4 (paper, below Eq. 14)."""
    return 0.5 * (1.0 + K) * y**2 + 0.25 * alpha * y**4


def G_inverse(H: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Displacement y >= 0 at which G(y) = H >= 0; it does not cancel for small alpha H."""
    k = 1.0 + K
    return np.sqrt(4.0 * H / (k + np.sqrt(k**2 + 4.0 * alpha * H)))


def amplitude(x: Floats, v: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Amplitude of the orbit through (x, v): G(A) = v^2/2 + G(x)."""
    return G_inverse(0.5 * v**2 + G(x, alpha, K), alpha, K)


def closed(s: Floats, beta: Coefficient, mu: Coefficient) -> Floats:
    """Positive root w^2 of w^2 = s + beta w^2/(mu^2 + w^2), s > 0, without cancellation."""
    g1 = s + beta - mu**2
    root = np.hypot(g1, 2.0 * mu * np.sqrt(s))
    # For large mu, g1 < 0: the second form does not cancel.
    return np.where(g1 > 0.0, 0.5 * (g1 + root), 2.0 * mu**2 * s / (root - np.minimum(g1, 0.0)))


def nu2(A: Floats, Phi: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Square of the instantaneous frequency, nu^2 = 1 + K + 3/4 alpha A^2 + 1/4 alpha A^2 cos 2 Phi (Eq. 15)."""
    return 1.0 + K + 0.75 * alpha * A**2 + 0.25 * alpha * A**2 * np.cos(2.0 * Phi)


def nu(A: Floats, Phi: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Instantaneous frequency nu(A, Phi) = dPhi/dt (Eqs. 8, 15)."""
    return np.sqrt(nu2(A, Phi, alpha, K))


def frequency(A: Floats, alpha: Coefficient, K: Floats) -> Floats:
    """Frequency 2 pi/T(A) of an orbit, T = int_0^2pi dPhi/nu its period (Gauss).

        2 pi/T = agm[nu(A, 0), nu(A, pi/2)] = agm[sqrt(1 + K + alpha A^2), sqrt(1 + K + alpha
        A^2/2)]

    The omega(A) of Eq. 10 is above this by up to 2.3 %.
    """
    k = 1.0 + K
    return np.asarray(agm(np.sqrt(k + alpha * A**2), np.sqrt(k + 0.5 * alpha * A**2)))


def decoupled(x: Floats, v: Floats, w2: Floats, mu: Coefficient) -> Floats:
    """Decoupled voltage V = (omega^2 x + mu x')/(mu^2 + omega^2) (Eq. 6, with mu for the misprinted beta of Eq. 5)."""
    return (w2 * x + mu * v) / (mu**2 + w2)


def omega2(A: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient) -> Floats:
    """Square of the averaged frequency, omega^2(A) = 1 + K + 3/4 alpha A^2 (Eq. 10, corrected).

    Printed Eq. 10 has 1 + beta + alpha A^2; K = beta omega^2/(mu^2 + omega^2) makes it a
    quadratic in omega^2, with s = 1 + 3/4 alpha A^2:

        omega^2 = [(s + beta - mu^2) + sqrt((s + beta - mu^2)^2 + 4 mu^2 s)]/2
    """
    return closed(1.0 + 0.75 * alpha * A**2, beta, mu)


def C(A: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient) -> Floats:
    """Damping by the load, C(A) = beta mu/(mu^2 + omega^2) (paper, below Eq. 14)."""
    return beta * mu / (mu**2 + omega2(A, alpha, beta, mu))


def K(A: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient) -> Floats:
    """Stiffness by the load, K(A) = beta omega^2/(mu^2 + omega^2) (paper, below Eq. 14)."""
    w2 = omega2(A, alpha, beta, mu)
    return beta * w2 / (mu**2 + w2)


def dK_dA(A: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient) -> Floats:
    """Slope K'(A) = beta mu^2 (omega^2)'/(mu^2 + omega^2)^2, which the drift (Eq. 23) needs.

    (omega^2)' = 3/2 alpha A (mu^2 + omega^2)/(2 omega^2 + mu^2 - s - beta), from the quadratic of
    `omega2`; its denominator is the root there.
    """
    s = 1.0 + 0.75 * alpha * A**2
    root = np.hypot(s + beta - mu**2, 2.0 * mu * np.sqrt(s))
    return 1.5 * alpha * beta * mu**2 * A / ((mu**2 + omega2(A, alpha, beta, mu)) * root)


def amplitude_through(
    x: Floats, v: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient
) -> Floats:
    """Amplitude A of the orbit through (x, v) with the load's stiffness at A: v^2/2 + G(x; K(A)) = G(A; K(A)).

    A fixed point; each round at least halves the error, as K'(A) A < 1 + K + alpha A^2.
    """
    A = amplitude(x, v, alpha, np.asarray(0.0))
    for _ in range(60):
        before = A
        A = amplitude(x, v, alpha, K(A, alpha, beta, mu))
        if np.allclose(A, before, rtol=1e-14, atol=0.0):
            break
    return A
