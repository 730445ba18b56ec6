"""The answer of `identify`: the parameters with their intervals, what is not determined, and how well the fit fits."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.errors import names_arguments, unknown
from harvester.identification.fit import DeviceFit
from harvester.presentation.columns import columns
from harvester.presentation.diagnostic import Diagnostic
from harvester.quantities.units import SYMBOLS

PREFIXED = ("kg", "N/m", "Hz", "F", "m", "N/V")  # units that are printed with a prefix

if TYPE_CHECKING:
    from harvester.identification.curves import FittedCurve


@dataclass(frozen=True)
class Parameter:
    """One number of the device with its 95 % interval, in the unit."""

    key: str
    value: float
    low: float
    high: float
    unit: str
    what: str


@names_arguments
@dataclass(frozen=True, eq=False)
class IdentificationResult:
    """What measurements say of a device.

    ``parameters`` have intervals; ``missing`` are keys that the data do not determine, with what would.
    ``residual_rms`` is that of the logarithms of sizes, of angles in rad, and of ring-downs over their size.
    ``correlations`` are those of the fitted parameters ``names``, shape (m, m).

    >>> import harvester as hv
    >>> found = hv.identify("examples/bench_impedance.csv")
    >>> 40e-9 < found["piezo.capacitance"].value < 42e-9
    True
    """

    parameters: tuple[Parameter, ...]
    missing: tuple[tuple[str, str], ...]
    residual_rms: float
    names: tuple[str, ...]
    correlations: Floats
    points: int
    left_out: int
    diagnostics: tuple[Diagnostic, ...]
    fit: DeviceFit

    @property
    def notes(self) -> tuple[str, ...]:
        """Its notes and warnings, each with the word for it."""
        return tuple(f"{one.severity}: {one}" for one in self.diagnostics)

    def __getitem__(self, key: str) -> Parameter:
        for one in self.parameters:
            if one.key == key:
                return one
        raise unknown("parameter", key, [one.key for one in self.parameters])

    def curves(self) -> list["FittedCurve"]:
        """Each measured curve with its fit, for a figure."""
        from harvester.identification.curves import fitted_curves

        return fitted_curves(self.fit)

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The measurements and the fit as a matplotlib figure."""
        return figures.identification(self, title)

    def as_json(self) -> dict[str, object]:
        """The answer as ``--json`` prints it."""
        return {
            "parameters": {one.key: {"value": one.value, "low": one.low, "high": one.high} for one in self.parameters},
            "residual_rms": self.residual_rms,
            "not_determined": dict(self.missing),
            "points": self.points,
            "outliers": self.left_out,
            "correlations": {"names": list(self.names), "matrix": np.round(self.correlations, 4).tolist()},
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        rows = [(one.key, *number_words(one), one.what) for one in self.parameters]
        lines = columns([("parameter", "value", "95 % interval", ""), *rows], "  ")
        for reason in dict.fromkeys(why for _, why in self.missing):
            keys = ", ".join(key for key, why in self.missing if why == reason)
            lines.append(f"not determined: {keys}: {reason}")
        lines.append(f"residual: {100.0 * self.residual_rms:.2g} % rms, {self.points} points{self._outliers()}")
        lines += [self._strongest()] if len(self.names) > 1 else []
        return "\n".join([*lines, *self.notes])

    def _outliers(self) -> str:
        return f", {self.left_out} of them left out as outliers" if self.left_out else ", none of them an outlier"

    def _strongest(self) -> str:
        """The strongest correlation in words."""
        off = np.abs(self.correlations - np.diag(np.diag(self.correlations)))
        i, j = np.unravel_index(int(off.argmax()), off.shape)
        return f"strongest correlation: {self.correlations[i, j]:+.2f} of {self.names[i]} and {self.names[j]}"


def number_words(one: Parameter) -> tuple[str, str]:
    """A parameter's value and its interval in words, with as many digits as the interval is worth."""
    half = max(one.high - one.low, 1e-12 * abs(one.value), 1e-300) / 2.0  # a known number has no width
    digits = min(max(3, 2 + math.ceil(math.log10(max(abs(one.value), 1e-300) / half))), 9)
    scale, unit = 1.0, one.unit
    if one.unit in PREFIXED and one.value:
        gram = 1e-3 if one.unit == "kg" else 1.0
        power = min(max(3 * math.floor(math.log10(abs(one.value) / gram) / 3.0), -15), 6)
        scale, unit = gram * 10.0**power, SYMBOLS[power] + ("g" if one.unit == "kg" else one.unit)
    shown = f"{one.value / scale:.{digits}g} {unit}".rstrip()
    return shown, f"{one.low / scale:.{digits}g} to {one.high / scale:.{digits}g}"
