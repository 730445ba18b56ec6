"""The paper's Fourier form of the frequency and of the noise's drift (Eqs. 16, 17, and the end of 23).

The program computes with `harvester.averaging.published.ito.noise_drift`, which needs no series; these are
the paper's own steps, misprints corrected, and agree with it to the error of the series.
"""

from collections.abc import Callable

import numpy as np

from harvester.arrays import Coefficient, Floats
from harvester.averaging.grids import given
from harvester.averaging.published.ito import stiffness
from harvester.equations.scaling import Equations


def coefficients(A: Floats, k: Floats, alpha: Coefficient) -> Floats:
    """b0, b2, b4, b6 of nu, shape (4, ...) (Eq. 17), k = 1 + K, to third order in eta.

    b0 = w (1 - eta^2/16),  b2 = w (eta/2 + 3 eta^3/64),  b4 = -w eta^2/16,  b6 = w eta^3/64,
    w^2 = 1 + K + 3/4 alpha A^2,  eta = alpha A^2/(4 w^2) <= 1/3
    """
    w2 = k + 0.75 * alpha * A**2
    eta = 0.25 * alpha * A**2 / w2
    b: Floats = np.sqrt(w2) * np.array([1 - eta**2 / 16, eta / 2 + 3 * eta**3 / 64, -(eta**2) / 16, eta**3 / 64])
    return b


def nu(b: Floats, Phi: Floats) -> Floats:
    """The sum nu = b0 + b2 cos 2 Phi + b4 cos 4 Phi + b6 cos 6 Phi (Eq. 16).

    In error by at most 0.078 % (the paper says 0.03 %), at eta = 1/3, where the cubic force is all.
    """
    n: Floats = b[0] + b[1] * np.cos(2 * Phi) + b[2] * np.cos(4 * Phi) + b[3] * np.cos(6 * Phi)
    return n


def external_drift(A: Floats, eqs: Equations) -> Floats:
    """The external noise's part of b(A) (Eq. 23, its lines with eps1).

    Corrected against print: the brackets of b0' and b2', and 2 b2^2 in the last bracket.
    """
    k, Q = stiffness(A, eqs)
    b0, b2, b4, b6 = b = coefficients(A, k, given(eqs.alpha))
    brackets = np.array([4 * b0 - 2 * b2, 2 * b2 - 2 * b0 - b4, 2 * b4 - b2 - b6, 2 * b6 - b4])
    slopes = _slope(lambda a: coefficients(a, stiffness(a, eqs)[0], given(eqs.alpha)) / stiffness(a, eqs)[1], A)
    spread = (brackets * slopes).sum(axis=0) / (8 * Q)
    per_n1: Floats = spread + (2 * b0**2 + 2 * (b**2).sum(axis=0)) / (8 * A * Q**2)
    return given(eqs.n1) * per_n1


def parametric_drift(A: Floats, eqs: Equations) -> Floats:
    """The parametric noise's part of b(A) (Eq. 23, its lines with eps2, right as printed)."""
    k, Q = stiffness(A, eqs)
    b0, b2, b4, b6 = b = coefficients(A, k, given(eqs.alpha))

    def sines(b: Floats) -> Floats:
        """4 nu sin Phi cos Phi = (2 b0 - b4) sin 2 Phi + (b2 - b6) sin 4 Phi + b4 sin 6 Phi + b6 sin 8 Phi."""
        return np.array([2 * b[0] - b[2], b[1] - b[3], b[2], b[3]])

    def in_sigma(a: Floats) -> Floats:
        k, Q = stiffness(a, eqs)
        return a * sines(coefficients(a, k, given(eqs.alpha))) / Q

    spread = (sines(b) * _slope(in_sigma, A)).sum(axis=0) / (32 * Q)
    squares = 2 * b0**2 + 2 * b0 * b2 + b2**2 + b2 * b4 + b4**2 + b4 * b6 + b6**2
    per_n2: Floats = A * (spread + squares / (8 * Q**2))
    return given(eqs.n2) * per_n2


def _slope(f: Callable[[Floats], Floats], A: Floats) -> Floats:
    """df/dA by central differences, to about 1e-10."""
    h = 1e-5 * A
    return (f(A + h) - f(A - h)) / (2 * h)
