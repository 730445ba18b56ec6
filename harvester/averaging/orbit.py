"""Orbits of the equivalent oscillator: potential, instantaneous frequency, Fourier form (paper, Eqs. 8, 15-17)."""

import numpy as np

from harvester.arrays import Floats


def G(y: Floats, alpha: float, K: Floats) -> Floats:
    """Potential energy G(y) = (1 + K) y^2/2 + alpha y^4/4 (paper, below Eq. 14)."""
    return 0.5 * (1.0 + K) * y**2 + 0.25 * alpha * y**4


def nu2(A: Floats, Phi: Floats, alpha: float, K: Floats) -> Floats:
    """Square of the instantaneous frequency, nu^2 = 1 + K + 3/4 alpha A^2 + 1/4 alpha A^2 cos 2 Phi (Eq. 15)."""
    return 1.0 + K + 0.75 * alpha * A**2 + 0.25 * alpha * A**2 * np.cos(2.0 * Phi)


def amplitude(x: Floats, v: Floats, alpha: float, K: Floats) -> Floats:
    """Amplitude of the orbit through (x, v): G(A) = v^2/2 + G(x)."""
    H = 0.5 * v**2 + G(x, alpha, K)
    q = 1.0 + K
    return np.sqrt(4.0 * H / (q + np.sqrt(q**2 + 4.0 * alpha * H)))
