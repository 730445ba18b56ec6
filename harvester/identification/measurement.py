"""A measurement at the bench, in SI units, one kind and one electrical state each."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.uncertainty.value import Value

# loads in ohm
SHORT = 0.0
OPEN = math.inf


@dataclass(frozen=True, eq=False)
class Impedance:
    """Impedance Z in ohm at frequencies f in Hz, both of shape (n,).

    ``clamped``: with the mass held.

    If the phase is not known, z is the magnitude.  ``left_out`` are rows of the file, from 1.
    """

    name: str
    f: Floats
    z: Complexes
    clamped: bool = False
    phase_known: bool = True
    left_out: tuple[int, ...] = ()

    @property
    def state(self) -> str:
        """The state of the device in words."""
        return "clamped" if self.clamped else "free"


@dataclass(frozen=True, eq=False, kw_only=True)
class _OverLoad:
    """A measurement over a ``load`` in ohm: ``of`` voltage, displacement, speed or acceleration.

    ``left_out`` are rows of the file, from 1.
    """

    load: float
    of: str
    left_out: tuple[int, ...] = ()

    @property
    def state(self) -> str:
        """The load in words."""
        if self.load in (SHORT, OPEN):
            return "short circuit" if self.load == SHORT else "open circuit"
        return Value(float(f"{self.load:.3g}")).format("ohm")


@dataclass(frozen=True, eq=False)
class BaseResponse(_OverLoad):
    """Voltage (V), displacement (m) or speed (m/s) per base acceleration of 1 m/s^2 at frequencies f, shape (n,).

    ``phase`` (rad) is None if it was not measured; the sign of the sensor is not known.
    """

    name: str
    f: Floats
    size: Floats
    phase: Floats | None


@dataclass(frozen=True, eq=False)
class Decay(_OverLoad):
    """A ring-down: voltage (V), displacement (m), speed (m/s) or acceleration over even or uneven times, shape (n,)."""

    name: str
    t: Floats
    y: Floats


Measurement = Impedance | BaseResponse | Decay


@dataclass(frozen=True)
class StatedNumber:
    """A number of a datasheet or a prior, with the standard deviation of its logarithm."""

    name: str
    value: float
    sigma: float

    @property
    def state(self) -> str:
        """Its origin in words."""
        return "datasheet"


def thinned(data: Measurement, most: int) -> Measurement:
    """A measurement of every n-th point: enough to distinguish good starting values from bad ones.

    For a curve over the frequency there are about ``most``, of a ring-down eight times as many.
    """
    arrays: dict[str, Any] = {
        name: values for name, values in vars(data).items() if isinstance(values, np.ndarray)
    }
    points = max(map(len, arrays.values()))
    pick = slice(None, None, max(1, points // (8 * most if isinstance(data, Decay) else most)))
    return dataclasses.replace(data, **{name: values[pick] for name, values in arrays.items()})


def rows_left_out(used: Any, rows: Any = True) -> tuple[int, ...]:
    """The numbers, from 1, of the ``rows`` of a file that are not used; both of shape (n,)."""
    return tuple(int(row) + 1 for row in np.flatnonzero(~used & rows))


def finite(*columns: Floats) -> Any:
    """The rows in which all columns have a number, shape (n,)."""
    return np.asarray(np.all(np.isfinite(np.array(columns)), axis=0))
