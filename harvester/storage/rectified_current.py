"""The mean current that a rectifier gives into a store at a voltage that is held, and how it follows that voltage.

I(V)    mean current, with the errors of sampling and of the step
S(V)    Var(charge)/time over a long time, the spectral density at frequency zero: the diffusion of V is S/(2 C^2)
q0      the charge that is not given while the mass rings up from rest: integral of I(0) - i(t)
tau(V)  how far the current lags behind V: q = integral of i(t) - I(V) after a step of V, over the step of I
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from harvester.arrays import Floats


@dataclass(frozen=True)
class RectifiedCurrent:
    """The table, in SI units, at ascending ``voltages`` from 0 on, shape (n,) each.

    ``stderr`` is None where nothing is random; ``square`` the mean square of the piezo's voltage; ``lag`` is in s.
    """

    voltages: Floats
    current: Floats
    stderr: Floats | None
    density: Floats
    square: Floats
    lag: Floats
    ring_up: float

    @cached_property
    def curve(self) -> PchipInterpolator:
        """I(V), monotone between the points."""
        return PchipInterpolator(self.voltages, self.current)

    def at(self, volts: Floats) -> Floats:
        """The mean current; beyond the last voltage that of the last."""
        return np.asarray(self.curve(np.clip(volts, 0.0, self.voltages[-1])))

    def slope(self, volts: Floats) -> Floats:
        """The slope dI/dV, 0 beyond the last voltage."""
        slopes = np.asarray(self.curve(np.minimum(volts, self.voltages[-1]), 1))
        return np.where(volts <= self.voltages[-1], slopes, 0.0)

    def sampled(self, name: str, volts: Floats) -> Floats:
        """Another column between its points, on straight lines."""
        return np.asarray(np.interp(volts, self.voltages, getattr(self, name)))

    @property
    def delay(self) -> float:
        """How long (s) after rest the current begins to follow, so that the ring-up's charge is not given."""
        return max(self.ring_up / float(self.current[0]) - float(self.lag[0]), 0.0) if self.current[0] > 0.0 else 0.0

    def halved(self) -> "RectifiedCurrent":
        """The table without every other voltage but the ends: what it then says differently is the interpolation."""
        keep = np.unique(np.append(np.arange(0, len(self.voltages), 2), len(self.voltages) - 1))
        names = ("voltages", "current", "density", "square", "lag")
        stderr = None if self.stderr is None else self.stderr[keep]
        return replace(self, stderr=stderr, **{name: getattr(self, name)[keep] for name in names})

    def extrapolated(self, coarse: "RectifiedCurrent") -> "RectifiedCurrent":
        """The table as of a step of 0, from this one and another at twice the step, whose error is of second order."""
        return replace(self, current=self.current + (self.current - coarse.current) / 3.0)

    def shifted(self) -> "RectifiedCurrent":
        """The table with all currents one standard error lower, as independent ones of the points would seldom be."""
        return self if self.stderr is None else replace(self, current=self.current - self.stderr)
