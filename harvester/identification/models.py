"""The equations of one mode with its piezo, in the frequency and in the time domain, as measurements show them.

    x'' + (w0/Q) x' + w0^2 x + (theta/M) V = -a        C (1 - j d) V' + V/R = theta x'        beta = theta^2/(K C)

With s = j w, D = s^2 + s w0/Q + w0^2, and the piezo's charge of the voltage e = s C (1 - j d):

    Y = e + sum s C beta w0^2/D      X/a = -1/(D + beta w0^2 h),  h = s C/(e + 1/R)          V/a = psi h X/a

Y has a second mode if an impedance holds two resonances. psi = theta/C.  d is the dielectric loss
(tan delta), taken as constant.  Poles of a ring-down over R:

    (s^2 + s w0/Q + w0^2)(s + 1/(R C)) + beta w0^2 s = 0
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.identification.measurement import OPEN, SHORT


@dataclass(frozen=True)
class Device:
    """One mode and its piezo: f0 in short circuit (Hz), quality Q, beta, clamped capacitance (F), loss, psi (V/m).

    The last three are those of a second mode; beta2 None: there is none.
    """

    frequency: float = 1.0
    quality: float = 100.0
    beta: float = 0.0
    capacitance: float = 1.0
    loss: float = 0.0
    psi: float = 1.0
    frequency2: float = 1.0
    quality2: float = 100.0
    beta2: float | None = None

    @property
    def w0(self) -> float:
        """The angular frequency in short circuit, rad/s."""
        return 2.0 * math.pi * self.frequency


def impedance(device: Device, f: Floats, clamped: bool) -> Complexes:
    """Z in ohm at frequencies f (Hz), of the shape of f."""
    s = 2j * math.pi * f
    c = device.capacitance
    admittance = s * c * (1.0 - 1j * device.loss)
    if not clamped:
        admittance = admittance + s * c * device.beta * device.w0**2 / _mechanical(device, s)
        if (beta := device.beta2) is not None:
            second = Device(device.frequency2, device.quality2)
            admittance = admittance + s * c * beta * second.w0**2 / _mechanical(second, s)
    return np.asarray(1.0 / admittance)


def base_response(device: Device, f: Floats, load: float, of: str) -> Complexes:
    """Voltage, displacement or speed per base acceleration at frequencies f (Hz), of the shape of f."""
    s = 2j * math.pi * f
    c = device.capacitance
    if load == SHORT:
        h = np.zeros_like(s)
    else:
        h = s * c / (s * c * (1.0 - 1j * device.loss) + (0.0 if load == OPEN else 1.0 / load))
    x = -1.0 / (_mechanical(device, s) + device.beta * device.w0**2 * h)
    seen: dict[str, Any] = {"voltage": device.psi * h, "displacement": 1.0, "speed": s}
    return np.asarray(x * seen[of])


def _mechanical(device: Device, s: Any) -> Complexes:
    return np.asarray(s * s + s * device.w0 / device.quality + device.w0**2)


def poles(device: Device, load: float) -> Complexes:
    """The poles of a ring-down in 1/s: the pair, and with a load the voltage's own."""
    w0 = device.w0
    damping = device.w0 / device.quality
    if load == SHORT:
        return np.roots([1.0, damping, w0 * w0]).astype(complex)
    stiff = w0 * w0 * (1.0 + device.beta)
    if load == OPEN:
        return np.roots([1.0, damping, stiff]).astype(complex)
    rate = 1.0 / (load * device.capacitance)
    return np.roots([1.0, damping + rate, stiff + damping * rate, w0 * w0 * rate]).astype(complex)


def decay(device: Device, t: Floats, y: Floats, load: float, weights: Floats) -> Floats:
    """The sum of the modes, and a constant, that is nearest to y at the times t: linear least squares, shape (n,).

    ``weights`` are 0 if a point is left out.
    """
    s = poles(device, load)
    pair = s[np.argmax(np.abs(s.imag))]
    t = t - t[0]
    swing = np.exp(pair.real * t)
    columns = [swing * np.cos(pair.imag * t), swing * np.sin(pair.imag * t), np.ones_like(t)]
    slow = s[np.abs(s.imag) < 1e-9 * np.abs(s)]
    if (
        len(s) == 3 and len(slow) and -slow[-1].real * (t[-1] - t[0]) > 0.1
    ):  # slower ones are the constant
        columns.append(np.exp(np.maximum(slow[-1].real * t, -700.0)))
    basis = np.array(columns).T
    return np.asarray(
        basis @ np.linalg.lstsq(basis * weights[:, None], y * weights, rcond=1e-12)[0]
    )
