"""The voltage on an orbit, as published: x harmonic about zero (paper, Eqs. 3-8, 10, 14).

Symbols are the paper's: A amplitude, alpha cubic stiffness, beta electromechanical coupling,
mu time-constant ratio.  All arrays over A broadcast.

From V' + mu V = x', without the start's decaying term:

    V(t) = int_0^inf e^(-mu s) x'(t - s) ds,   Phi = omega(A) t + Gamma     (Eqs. 4, 5)
"""

import numpy as np

from harvester.arrays import Coefficient, Floats
from harvester.averaging.published.orbit import amplitude, closed


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


def amplitude_through(x: Floats, v: Floats, alpha: Coefficient, beta: Coefficient, mu: Coefficient) -> Floats:
    """Amplitude A of the orbit through (x, v) with the load's stiffness at A: v^2/2 + G(x; K(A)) = G(A; K(A)).

    A fixed point; each round at least halves the error, as K'(A) A < 1 + K + alpha A^2.
    """
    A = amplitude(x, v, alpha, np.asarray(0.0))
    for _ in range(60):
        before, A = A, amplitude(x, v, alpha, K(A, alpha, beta, mu))
        if np.allclose(A, before, rtol=1e-14, atol=0.0):
            break
    return A
