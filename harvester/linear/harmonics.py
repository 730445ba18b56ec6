"""The first harmonic of a steady motion, and its phase to the base that drives it.

    y(t) = mean + Re[Y exp(i W t)] + higher harmonics,   Y = 2/T times the integral of y exp(-i W t) over whole periods

The mass of a physical scene feels the opposite of the base's acceleration, -A cos(W t), so that a displacement far
below the resonance is at 180 degrees to that acceleration, at the resonance at 90, and far above it at 0.
"""

import cmath
import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations


def first_harmonic(values: Floats, angles: Floats) -> complex:
    """The complex amplitude Y of ``values``, shape (n,), at evenly spaced ``angles`` W t over whole periods."""
    return complex(2.0 * np.mean(values * np.exp(-1j * angles)))


def phase_to_base(amplitude: complex, eqs: Equations, physical: bool) -> float:
    """The phase of a first harmonic to the base's acceleration in degrees, above -180 and up to 180.

    Of a nondimensional scene that to the drive, drive cos(W t), which is the force on the mass.
    """
    sign = (1.0 if (eqs.drive or 0.0) >= 0.0 else -1.0) * (-1.0 if physical else 1.0)
    angle = math.degrees(cmath.phase(sign * amplitude))
    return 180.0 if math.isclose(angle, -180.0) else angle
