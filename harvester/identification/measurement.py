"""What was measured at the bench, in SI units, one kind and one electrical state each."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Complexes, Floats

SHORT, OPEN = 0.0, math.inf  # loads in ohm


@dataclass(frozen=True, eq=False)
class Impedance:
    """Impedance Z in ohm at frequencies f in Hz, both of shape (n,); ``clamped``: with the mass held."""

    name: str
    f: Floats
    z: Complexes
    clamped: bool = False

    @property
    def state(self) -> str:
        """The state of the device in words."""
        return "clamped" if self.clamped else "free"


@dataclass(frozen=True, eq=False)
class BaseResponse:
    """Voltage (V), displacement (m) or speed (m/s) per base acceleration of 1 m/s^2 at frequencies f, shape (n,).

    ``phase`` (rad) is None where it was not measured; the sign of the sensor is not known.  ``load`` is in ohm.
    """

    name: str
    f: Floats
    size: Floats
    phase: Floats | None
    load: float
    of: str

    @property
    def state(self) -> str:
        """The load in words."""
        return load_words(self.load)


@dataclass(frozen=True, eq=False)
class Decay:
    """A ring-down: voltage (V), displacement (m), speed (m/s) or acceleration over even or uneven times, shape (n,)."""

    name: str
    t: Floats
    y: Floats
    load: float
    of: str

    @property
    def state(self) -> str:
        """The load in words."""
        return load_words(self.load)


Measurement = Impedance | BaseResponse | Decay


def load_words(load: float) -> str:
    """A load in words."""
    from harvester.uncertainty.value import Value

    if load in (SHORT, OPEN):
        return "short circuit" if load == SHORT else "open circuit"
    return Value(float(f"{load:.3g}")).format("ohm")


def thinned(one: Measurement, most: int) -> Measurement:
    """A measurement of every n-th point, of about ``most``: enough to tell good starting values from bad ones."""
    if isinstance(one, Impedance):
        pick = slice(None, None, max(1, len(one.f) // most))
        return dataclasses.replace(one, f=one.f[pick], z=one.z[pick])
    if isinstance(one, BaseResponse):
        pick = slice(None, None, max(1, len(one.f) // most))
        phase = None if one.phase is None else one.phase[pick]
        return dataclasses.replace(one, f=one.f[pick], size=one.size[pick], phase=phase)
    pick = slice(None, None, max(1, len(one.t) // (8 * most)))
    return dataclasses.replace(one, t=one.t[pick], y=one.y[pick])


def finite(*columns: Floats) -> Any:
    """Where all columns have a number, shape (n,)."""
    return np.asarray(np.all(np.isfinite(np.array(columns)), axis=0))
