"""The response of the linear equations to a frequency and to white noise, in closed form.

    x'' + c x' + x + beta V = a,   V' + mu V = x',   c = -c1

Without a load V = x, which is mu = 0.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.equations.coefficients import Equations


class WhiteResponse(NamedTuple):
    """E[x^2], E[x'^2] and E[V^2] under white noise of intensity 1, and how much sharper rounding is in the response.

    ``sharpness`` is the frequency over the loss, w/(c + C), about Q; infinite where nothing takes energy.
    """

    x2: float
    speed2: float
    v2: float
    sharpness: float


def white(eqs: Equations) -> WhiteResponse:
    """The moments under white noise of intensity N1 = 1, from the Lyapunov equation.

        S = N1/(c (1 + beta + mu^2 + c mu) + beta mu)
        E[V^2] = E[xV] = S    E[x^2] = S (1 + mu^2 + c mu)    E[x'^2] = E[x^2] + S beta

    Infinite where nothing takes energy, or more is fed than taken.
    """
    c, beta, mu = -(eqs.c1 or 0.0), eqs.beta or 0.0, eqs.mu or 0.0
    loss = c * (1.0 + beta + mu * mu + c * mu) + beta * mu
    if not loss > 0.0:
        return WhiteResponse(math.inf, math.inf, math.inf, math.inf)
    x2 = 1.0 + mu * mu + c * mu
    sharpness = math.sqrt(1.0 + beta) * (x2 + 2.0 * abs(c) * mu + beta) / loss
    return WhiteResponse(x2 / loss, (x2 + beta) / loss, 1.0 / loss, sharpness)


def amplitudes(eqs: Equations, w: Floats | float) -> Complexes:
    """Complex amplitudes of x and V under a = exp(i w t), one of each a frequency, shape (2, ...).

    With a spring of two wells they are those of small motions in the first, whose stiffness takes the place of the 1.
    Infinite at a resonance where nothing takes energy.
    """
    s, mu, stiffness = 1j * np.asarray(w), eqs.mu or 0.0, 1.0
    if eqs.linear is not None:
        linear, alpha2, alpha = eqs.spring
        rest = eqs.resting_places[0]
        stiffness = linear + rest * (2.0 * alpha2 + 3.0 * alpha * rest)
    with np.errstate(divide="ignore", invalid="ignore"):
        voltage = s / (s + mu) if mu else np.ones_like(s)
        x = 1.0 / (stiffness + s * (s - (eqs.c1 or 0.0)) + (eqs.beta or 0.0) * voltage)
        return np.array([x, voltage * x])


def gains(eqs: Equations, w: Floats | float) -> Floats:
    """The squared sizes of the `amplitudes`."""
    found = amplitudes(eqs, w)
    return np.asarray(found.real**2 + found.imag**2)
