"""The answer of `identify`: parameters with intervals, undetermined parameters, and the quality of the fit."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, unknown
from harvester.identification.fit import Channel, DeviceFit
from harvester.identification.measurement import Impedance
from harvester.presentation import drawing
from harvester.presentation.columns import columns
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.quantities.units import SYMBOLS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NUMBERS = ("value", "low", "high")
PREFIXED = ("kg", "N/m", "Hz", "F", "m", "N/V")  # units that are printed with a prefix


@dataclass(frozen=True)
class Parameter:
    """One number of the device with its 95 % interval, in the unit."""

    key: str
    value: float
    low: float
    high: float
    unit: str
    what: str


class IdentificationResult(TableResult):
    """The parameters of a device from measurements.

    Attributes
    ----------
    parameters : tuple of Parameter
        each with its ``key``, ``value`` and 95 % interval ``low`` to ``high``, in its ``unit``.
    missing : tuple
        keys that the data do not determine, with a measurement that would.
    residual_rms : float
        that of the logarithms of sizes, of angles in rad, and of ring-downs over their size.
    names, correlations : tuple of str or ndarray
        the fitted parameters, and their correlations, shape (m, m).
    points, left_out : int
        the number of measured points, and of those left out as outliers.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).
    fit : DeviceFit
        the model that was fitted.

    Examples
    --------
    >>> import harvester as hv
    >>> found = hv.identify("examples/bench_impedance.csv")
    >>> 40e-9 < found["piezo.capacitance"].value < 42e-9
    True
    """

    DERIVED = ("table",)
    INTERNAL = frozenset({"names", "missing", "correlations", "fit"})
    NOT_SHOWN = frozenset({"parameters"})
    SHORT = ("parameters", "points", "residual_rms")

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
    def table(self) -> Table:
        """A row for each parameter, with the ends of its 95 % interval."""
        units = [p.unit for p in self.parameters]
        columns = [Column("key", [p.key for p in self.parameters])]
        columns += [
            Column(name, [getattr(p, name) for p in self.parameters], units=units)
            for name in _NUMBERS
        ]
        columns.append(Column("unit", units))
        return Table(tuple(columns), index=("key",))

    @property
    def _remarks(self) -> list[str]:
        """Its notes and warnings, each with the word for it."""
        return [f"{diagnostic.severity}: {diagnostic}" for diagnostic in self.diagnostics]

    def __getitem__(self, key: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.key == key:
                return parameter
        raise unknown("parameter", key, [parameter.key for parameter in self.parameters])

    def curves(self) -> "list[FittedCurve]":
        """Each measured curve with its fit, for a figure."""
        return fitted_curves(self.fit)

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The measurements and the fit as a matplotlib figure; InputError without a curve."""
        if not self.curves():
            raise InputError(
                "a figure needs the curve of a file, but there are single numbers alone"
            )
        return drawing.draw(self, title, ax)

    def as_json(self) -> dict[str, object]:
        """The answer as ``--json`` prints it."""
        return {
            "parameters": {
                p.key: {"value": p.value, "low": p.low, "high": p.high} for p in self.parameters
            },
            "residual_rms": self.residual_rms,
            "not_determined": dict(self.missing),
            "points": self.points,
            "outliers": self.left_out,
            "correlations": {
                "names": list(self.names),
                "matrix": np.round(self.correlations, 4).tolist(),
            },
            "notes": self._remarks,
        }

    def __str__(self) -> str:
        rows = [(p.key, *number_words(p), p.what) for p in self.parameters]
        lines = columns([("parameter", "value", "95 % interval", ""), *rows], "  ")
        for reason in dict.fromkeys(why for _, why in self.missing):
            keys = ", ".join(key for key, why in self.missing if why == reason)
            lines.append(f"not determined: {keys}: {reason}")
        lines.append(
            f"residual: {100.0 * self.residual_rms:.2g} % rms, {self.points} points{self._outliers()}"
        )
        lines += [self._strongest()] if len(self.names) > 1 else []
        return "\n".join([*lines, *self._remarks])

    def _outliers(self) -> str:
        return (
            f", {self.left_out} of them left out as outliers"
            if self.left_out
            else ", none of them an outlier"
        )

    def _strongest(self) -> str:
        """The strongest correlation in words."""
        off = np.abs(self.correlations - np.diag(np.diag(self.correlations)))
        i, j = np.unravel_index(int(off.argmax()), off.shape)
        return f"strongest correlation: {self.correlations[i, j]:+.2f} of {self.names[i]} and {self.names[j]}"


def number_words(parameter: Parameter) -> tuple[str, str]:
    """A parameter's value and its interval in words, with as many digits as the interval is worth."""
    # a known number has none
    width = max(parameter.high - parameter.low, 1e-12 * abs(parameter.value), 1e-300)
    digits = min(
        max(3, 2 + math.ceil(math.log10(2.0 * max(abs(parameter.value), 1e-300) / width))), 9
    )
    scale = 1.0
    unit = parameter.unit
    if parameter.unit in PREFIXED and parameter.value:
        gram = 1e-3 if parameter.unit == "kg" else 1.0
        power = min(max(3 * math.floor(math.log10(abs(parameter.value) / gram) / 3.0), -15), 6)
        scale = gram * 10.0**power
        unit = SYMBOLS[power] + ("g" if parameter.unit == "kg" else parameter.unit)
    shown = f"{parameter.value / scale:.{digits}g} {unit}".rstrip()
    return shown, f"{parameter.low / scale:.{digits}g} to {parameter.high / scale:.{digits}g}"


_LABELS = {"voltage": "voltage (V)", "displacement": "displacement (m)", "speed": "speed (m/s)"}


@dataclass(frozen=True, eq=False)
class FittedCurve:
    """One curve; arrays of shape (n,)."""

    name: str
    label: str
    x_label: str
    x: Floats
    measured: Floats
    fitted: Floats
    residual: Floats
    kept: Floats
    logarithmic: bool


def fitted_curves(fit: DeviceFit) -> list[FittedCurve]:
    """The curves of all channels of a fit; a single number is not a curve."""
    values = fit.values()
    return [
        _curve(channel, channel.residuals(values, kept), kept, noise)
        for channel, kept, noise in zip(fit.channels, fit.kept, fit.noise, strict=True)
        if channel.given_noise is None
    ]


def _curve(channel: Channel, off: Floats, kept: Floats, noise: float) -> FittedCurve:
    of = getattr(channel.source, "of", "")
    name = f"{channel.source.name}, {channel.source.state}"
    fitted = channel.values - off
    measured = channel.values
    x_label = "frequency (Hz)"
    size = channel.name == "size"
    if channel.name == "ring-down":
        label = _LABELS[of]
        x_label = "time (s)"
    elif channel.name == "phase":
        label = "phase (degrees)"
        measured = np.degrees(measured)
        fitted = np.degrees(fitted)
    else:
        label = (
            "|Z| (ohm)"
            if isinstance(channel.source, Impedance)
            else _LABELS[of].replace(")", " per m/s²)")
        )
        measured, fitted = np.exp(measured), np.exp(fitted)
    return FittedCurve(
        name=name,
        label=label,
        x_label=x_label,
        x=channel.x,
        measured=measured,
        fitted=fitted,
        residual=off / noise,
        kept=kept,
        logarithmic=size,
    )
