"""Limits that a device must meet, such as ``mean_power > 5 uW``: read from a text, and which devices meet them."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, reading, unknown
from harvester.quantities.kinds import Kind, with_prefix
from harvester.studies.extremes.extremes import read_lifetime
from harvester.studies.extremes.levels import (
    RATE,
    SPEED,
    STRAIN,
    check_served,
    is_sinusoidal,
    strain_factor,
)

POWER = Kind("a mean power (W)", "W", "'5 uW'")
SQUARE = Kind("a mean square voltage (V^2)", "V^2", "'4 V^2'")
VOLTAGE = Kind("a voltage (V)", "V", "'2 V'")
LENGTH = Kind("a displacement (m)", "m", "'1.5 mm'")
NUMBER = Kind("a number", "", "0.05")
PURE = Kind("a strain", "", "500e-6")
FAST = Kind("a speed (m/s)", "m/s", "'0.1 m/s'")
OFTEN = Kind("a rate (Hz)", "Hz", "'7 Hz'")
# What may be limited, with its kind in SI units.
QUANTITIES = {"mean_power": POWER, "mean_square_voltage": SQUARE, "voltage_rms": VOLTAGE}
# Over a lifetime: 95 % of devices of these values stay below; the impact rate is a mean.
PEAKS = ("peak_displacement", "peak_voltage", STRAIN, SPEED, RATE)
QUANTITIES |= {
    "peak_displacement": LENGTH,
    "peak_voltage": VOLTAGE,
    STRAIN: PURE,
    SPEED: FAST,
    RATE: OFTEN,
}
_FORM = re.compile(r"\s*([\w.]+)\s*(>=|<=|>|<)\s*(.+?)\s*")


@dataclass(frozen=True)
class Limit:
    """A ``quantity`` that must be above (``sign`` 1) or below (-1) a ``bound``, in SI units or nondimensional."""

    quantity: str
    sign: int
    bound: float
    written: str

    def as_json(self) -> str:
        """The limit as it was written."""
        return self.written

    def margin(self, value: float) -> float:
        """How far a value is within the limit, relatively.

        Below 0 beyond it, infinite for an infinite bound.
        """
        return (
            self.sign
            * (value - self.bound)
            / ((math.isfinite(self.bound) and abs(self.bound)) or 1.0)
        )

    def met(self, values: Floats) -> NDArray[np.bool_]:
        """Which of the values, of any shape, meet it; a bound itself is met, and nan never is."""
        return np.asarray(self.sign * (values - self.bound) >= 0.0)


def parse(text: str, physical: bool = True, quantities: Mapping[str, Kind] = QUANTITIES) -> Limit:
    """The limit that a text such as ``mean_power > 5 uW`` describes.

    For a nondimensional scene without unit.

    Raises InputError for a text of another form, a quantity that is not among ``quantities``, with
    the nearest match, and a bound that is not one of its values.
    """
    match = _FORM.fullmatch(text)
    if match is None:
        raise invalid(
            "`limit`", "be QUANTITY > VALUE or QUANTITY < VALUE, such as 'mean_power > 5 uW'", text
        )
    name = match[1]
    sign = match[2]
    bound = match[3]
    if name not in quantities:
        raise unknown("quantity of a limit", name, quantities)
    kind = quantities[name] if physical else NUMBER
    value = reading(f"the limit of {name}", partial(with_prefix, kind=kind), bound)
    return Limit(name, 1 if sign[0] == ">" else -1, value, " ".join(text.split()))


def limits(texts: Sequence[str] | str, physical: bool) -> tuple[Limit, ...]:
    """The limits that one text or several describe; raises InputError as `parse`."""
    return tuple(parse(text, physical) for text in ([texts] if isinstance(texts, str) else texts))


def lifetime_of(
    limits: Sequence[Limit], lifetime: float | str | None, problem: Problem
) -> float | None:
    """The lifetime, in seconds or 1/w0, of the limits that are of peaks; None if none is.

    A sinusoid alone moves a linear scene alike for ever: there it may be left out, and is infinite.

    Raises InputError if it is missing, none of the limits is of a peak, or a strain or an impact is
    limited that the scene does not have; CannotServeError for a scene that has no peaks over a
    lifetime.
    """
    peaks = [limit.quantity for limit in limits if limit.quantity in PEAKS]
    if lifetime is None and not peaks:
        return None
    if lifetime is None and is_sinusoidal(problem):
        span = math.inf
    elif lifetime is None:
        raise InputError(f"`lifetime` must be given for a limit of {peaks[0]}, but is left out")
    else:
        span = read_lifetime(lifetime, problem)
        if not peaks:
            raise InputError(
                f"`lifetime` must be used with a limit of {' or '.join(PEAKS)}, but there is none"
            )
        check_served(problem)
    for name in (SPEED, RATE):
        if name in peaks and not problem.equations.has_stop:
            raise InputError(f"a limit of {name} must be used with a stop, but the scene has none")
    if STRAIN in peaks and strain_factor(problem) is None:
        raise InputError(
            f"piezo.strain_per_displacement must be given for a limit of {STRAIN}, but is left out "
            "('harvester new --bimorph' writes it)"
        )
    return span
