"""The response of the linear equations to a frequency and to white noise, in closed form.

    x'' + c x' + x + beta V = a,   V' + mu V = x',   c = -c1

Without a load V = x, which is mu = 0.

The first harmonic of a steady motion, and its phase to the base that drives it, are defined by

    y(t) = mean + Re[Y exp(i W t)] + higher harmonics,   Y = 2/T times the integral of y exp(-i W t) over whole periods

The mass of a physical scene feels the opposite of the base's acceleration, -A cos(W t), so that a
displacement far below the resonance is at 180 degrees to that acceleration, at the resonance at 90,
and far above it at 0.
"""

import cmath
import math
from collections.abc import Sequence
from functools import singledispatch
from typing import NamedTuple

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.equations.modes import Modes, SingleMode

AT_ONCE = 1 << 16  # frequencies, of several modes


class WhiteResponse(NamedTuple):
    """E[x^2], E[x'^2], E[V^2] and E[q'^2] under white noise of intensity 1, and how much sharper rounding is in them.

    ``charge_speed2`` is that of the charge q = s.y, which is x of one mode (`equations.modes`);
    ``sharpness`` is the frequency over the loss, w/(c + C), about Q; infinite if nothing dissipates
    energy.
    """

    x2: float
    speed2: float
    v2: float
    charge_speed2: float
    sharpness: float


def white(eqs: Equations) -> WhiteResponse:
    """The moments under white noise of intensity N1 = 1, from the Lyapunov equation.

        S = N1/(c (1 + beta + mu^2 + c mu) + beta mu)
        E[V^2] = E[xV] = S    E[x^2] = S (1 + mu^2 + c mu)    E[x'^2] = E[x^2] + S beta

    Infinite if nothing dissipates energy, or more is fed than dissipated.  For several modes it is
    solved unchanged.
    """
    return _white(eqs.modal, eqs)


@singledispatch
def _white(modes: SingleMode | Modes, eqs: Equations) -> WhiteResponse:
    """`white` of these coordinates."""
    c = -(eqs.c1 or 0.0)
    beta = eqs.beta or 0.0
    mu = eqs.mu or 0.0
    loss = c * (1.0 + beta + mu * mu + c * mu) + beta * mu
    if not loss > 0.0:
        return WhiteResponse(math.inf, math.inf, math.inf, math.inf, math.inf)
    x2 = 1.0 + mu * mu + c * mu
    sharpness = math.sqrt(1.0 + beta) * (x2 + 2.0 * abs(c) * mu + beta) / loss
    speed2 = (x2 + beta) / loss
    return WhiteResponse(x2 / loss, speed2, 1.0 / loss, speed2, sharpness)


def amplitudes(
    eqs: Equations, w: Floats | float, direction: Sequence[float] | None = None
) -> Complexes:
    """Complex amplitudes of x and V under a = exp(i w t), one of each a frequency, shape (2, ...).

    For several modes x may be that in another ``direction`` than the oscillator's, shape (modes,).

    For a bistable spring they are those of small motions in the first well, whose stiffness is used
    in place of the 1. Infinite at a resonance if nothing dissipates energy.
    """
    stiffness = 1.0
    if eqs.linear is not None:
        linear, alpha2, alpha = eqs.spring
        rest = next(iter(eqs.resting_places), 0.0)  # none where the spring pushes the mass away
        stiffness = linear + rest * (2.0 * alpha2 + 3.0 * alpha * rest)
    return _amplitudes(eqs.modal, eqs, np.asarray(w), stiffness, direction)


@singledispatch
def _amplitudes(
    modes: SingleMode | Modes,
    eqs: Equations,
    w: Floats,
    stiffness: float,
    direction: Sequence[float] | None,
) -> Complexes:
    """`amplitudes` of these coordinates, with the oscillator's stiffness."""
    s = 1j * w
    mu = eqs.mu or 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        voltage = s / (s + mu) if mu else np.ones_like(s)
        x = 1.0 / (stiffness + s * (s - (eqs.c1 or 0.0)) + (eqs.beta or 0.0) * voltage)
        return np.array([x, voltage * x])


def stationary(eqs: Equations, modes: Modes) -> Floats:
    """The covariance S of (y, y', V) under white noise of intensity 1: A S + S A^T + 2 b b^T = 0, b = g at y'.

    Without a load that of (y, y').
    """
    from scipy.linalg import solve_continuous_lyapunov

    matrix = flow(eqs)
    n = modes.count
    forced = np.zeros(len(matrix))
    forced[n : 2 * n] = modes.base
    return np.asarray(solve_continuous_lyapunov(matrix, -2.0 * np.outer(forced, forced)))


@_white.register(Modes)
def _white_of_modes(modes: Modes, eqs: Equations) -> WhiteResponse:
    """`white` of several modes; x is the oscillator's displacement."""
    values = np.linalg.eigvals(flow(eqs))
    n = modes.count
    s = np.array(modes.coupling)
    losses = -values.real
    if not losses.min() > 1e-14 * np.abs(values).max():
        return WhiteResponse(math.inf, math.inf, math.inf, math.inf, math.inf)
    covariance = stationary(eqs, modes)
    e = modes.direction
    v2 = covariance[-1, -1] if eqs.mu is not None else s @ covariance[:n, :n] @ s
    moved = e @ covariance[:n, :n] @ e
    speeds = covariance[n : 2 * n, n : 2 * n]
    sharpness = (0.5 * np.abs(values) / losses).max()
    return WhiteResponse(*map(float, (moved, e @ speeds @ e, v2, s @ speeds @ s, sharpness)))


@_amplitudes.register(Modes)
def _amplitudes_of_modes(
    modes: Modes, eqs: Equations, w: Floats, spring: float, direction: Sequence[float] | None
) -> Complexes:
    """`amplitudes` of several modes: (K + s D + s^2 + beta V/(s.y) s s^T) y = g a at each frequency."""
    stiffness, damping = modes.matrices(spring, -(eqs.c1 or 0.0))
    coupling = np.array(modes.coupling)
    base = np.array(modes.base, complex)
    every = w.reshape(-1)
    result = np.empty((2, every.size), complex)
    for first in range(0, every.size, AT_ONCE):
        s = 1j * every[first : first + AT_ONCE, None, None]
        voltage = s / (s + eqs.mu) if eqs.mu else np.ones_like(s)
        dynamic = stiffness + s * damping + s * s * np.eye(modes.count)
        dynamic = dynamic + (eqs.beta or 0.0) * voltage * np.outer(coupling, coupling)
        y = np.linalg.solve(dynamic, np.broadcast_to(base[:, None], (len(s), modes.count, 1)))[
            :, :, 0
        ]
        result[0, first : first + AT_ONCE] = y @ (
            modes.direction if direction is None else direction
        )
        result[1, first : first + AT_ONCE] = voltage[:, 0, 0] * (y @ coupling)
    return result.reshape(2, *w.shape)


def gains(eqs: Equations, w: Floats | float) -> Floats:
    """The squared sizes of the `amplitudes`."""
    complex_amplitudes = amplitudes(eqs, w)
    return np.asarray(complex_amplitudes.real**2 + complex_amplitudes.imag**2)


def first_harmonic(values: Floats, angles: Floats) -> complex:
    """The complex amplitude Y of ``values``, shape (n,), at evenly spaced ``angles`` W t over whole periods."""
    return complex(2.0 * np.mean(values * np.exp(-1j * angles)))


def phase_to_base(amplitude: complex, eqs: Equations, physical: bool) -> float:
    """The phase of a first harmonic to the base's acceleration in degrees, above -180 and up to 180.

    For a nondimensional scene that to the excitation, drive cos(W t), which is the force on the
    mass.
    """
    sign = (1.0 if (eqs.drive or 0.0) >= 0.0 else -1.0) * (-1.0 if physical else 1.0)
    angle = math.degrees(cmath.phase(sign * amplitude))
    return 180.0 if math.isclose(angle, -180.0) else angle
