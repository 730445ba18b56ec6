"""The voltage on an orbit, as published: x harmonic about zero (paper, Eqs. 3-8, 10, 14).

Symbols are the paper's: A amplitude, alpha cubic stiffness, beta electromechanical coupling,
mu time-constant ratio.  All arrays over A broadcast.
"""

import numpy as np

from harvester.arrays import Floats


def omega2(A: Floats, alpha: float, beta: float, mu: float) -> Floats:
    """Square of the averaged frequency, omega^2(A) = 1 + K + 3/4 alpha A^2.

    Printed Eq. 10 has 1 + beta + alpha A^2; K = beta omega^2/(mu^2 + omega^2) makes it a
    quadratic in omega^2, with s = 1 + 3/4 alpha A^2:

        omega^2 = [(s + beta - mu^2) + sqrt((s + beta - mu^2)^2 + 4 mu^2 s)]/2
    """
    s = 1.0 + 0.75 * alpha * A**2
    g = s + beta - mu**2
    root = np.hypot(g, 2.0 * mu * np.sqrt(s))
    # For large mu, g < 0: the second form does not cancel.
    return np.where(g > 0.0, 0.5 * (g + root), 2.0 * mu**2 * s / (root - np.minimum(g, 0.0)))


def C(A: Floats, alpha: float, beta: float, mu: float) -> Floats:
    """Damping by the load, C(A) = beta mu/(mu^2 + omega^2) (paper, below Eq. 14)."""
    return beta * mu / (mu**2 + omega2(A, alpha, beta, mu))


def K(A: Floats, alpha: float, beta: float, mu: float) -> Floats:
    """Stiffness by the load, K(A) = beta omega^2/(mu^2 + omega^2) (paper, below Eq. 14)."""
    w2 = omega2(A, alpha, beta, mu)
    return beta * w2 / (mu**2 + w2)


def decoupled(x: Floats, v: Floats, w2: Floats, mu: float) -> Floats:
    """V = (omega^2 x + mu x')/(mu^2 + omega^2) (paper, Eq. 6, with mu for the misprinted beta of Eq. 5)."""
    return (w2 * x + mu * v) / (mu**2 + w2)
