"""What a figure draws of a fit: each measured curve, its fit, and the residual over the noise."""

from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.identification.fit import Channel, DeviceFit
from harvester.identification.measurement import Impedance

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
    """The curves of all channels of a fit."""
    values = fit.values()
    return [
        _curve(channel, channel.residuals(values, kept), kept, noise)
        for channel, kept, noise in zip(fit.channels, fit.kept, fit.noise, strict=True)
    ]


def _curve(channel: Channel, off: Floats, kept: Floats, noise: float) -> FittedCurve:
    of = getattr(channel.source, "of", "")
    name = f"{channel.source.name}, {channel.source.state}"
    fitted, measured = channel.values - off, channel.values
    if channel.name == "ring-down":
        return FittedCurve(name, _LABELS[of], "time (s)", channel.x, measured, fitted, off / noise, kept, False)
    if channel.name == "phase":
        turn = np.degrees
        label = "phase (degrees)"
        shown = turn(measured), turn(fitted)
        return FittedCurve(name, label, "frequency (Hz)", channel.x, *shown, off / noise, kept, False)
    label = "|Z| (ohm)" if isinstance(channel.source, Impedance) else _LABELS[of].replace(")", " per m/s²)")
    shown = np.exp(measured), np.exp(fitted)
    return FittedCurve(name, label, "frequency (Hz)", channel.x, *shown, off / noise, kept, True)
