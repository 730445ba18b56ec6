"""How far a fit is off, and whether the device that was measured is the one that was fitted."""

import math
from collections.abc import Sequence

import numpy as np

from harvester.identification.fit import Channel, DeviceFit
from harvester.identification.measurement import Measurement
from harvester.identification.misfit import pattern
from harvester.presentation.diagnostic import Diagnostic, note, warning

STRANGE = 0.05  # residual of a sweep from which on the model is doubted
DOUBTFUL = 0.05  # share of a ring-down's samples left out from which on they are no outliers


def left_out(measurements: Sequence[Measurement]) -> list[Diagnostic]:
    """A note for each measurement that does not use all rows of its file."""
    return [
        note("rows_left_out", file=data.name, rows=len(data.left_out), first=data.left_out[0])
        for data in measurements
        if data.left_out
    ]


def residual_rms(best: DeviceFit) -> float:
    """The residual of the whole fit, over all points that are kept."""
    counts = np.array([kept.sum() for kept in best.kept])
    parts = np.array(
        [
            _relative(channel, noise)
            for channel, noise in zip(best.channels, best.noise, strict=True)
        ]
    )
    values = best.values()
    for at, (channel, kept) in enumerate(zip(best.channels, best.kept, strict=True)):
        if channel.given_noise is not None:
            parts[at] = abs(float(channel.residuals(values, kept)[0]))
    return math.sqrt(float(counts @ parts**2) / max(float(counts.sum()), 1.0))


def _relative(channel: Channel, noise: float) -> float:
    """The rms residual of a channel: for a ring-down over its size, else as it is."""
    return (
        noise / max(float(np.std(channel.values)), 1e-300) if channel.name == "ring-down" else noise
    )


def misfits(best: DeviceFit) -> list[Diagnostic]:
    """Warnings if the device that was measured is not the one that was fitted."""
    warnings = list[Diagnostic]()
    values = best.values()
    swept = (  # the residual of a ring-down may be noise
        _relative(channel, noise)
        for channel, noise in zip(best.channels, best.noise, strict=True)
        if channel.name != "ring-down" and channel.given_noise is None
    )
    rms = max(swept, default=0.0)
    if rms > STRANGE:
        warnings.append(warning("fit_is_off", percent=100.0 * rms))
    for channel, kept, noise in zip(best.channels, best.kept, best.noise, strict=True):
        if channel.given_noise is not None:
            continue
        off = channel.residuals(values, kept)[kept > 0.0]
        where = {"file": channel.source.name, "curve": channel.name}
        trend = pattern(
            off, channel.x[kept > 0.0], _relative(channel, noise), channel.name == "ring-down"
        )
        if trend is not None:
            warnings.append(
                warning(
                    "residual_has_a_pattern", at=trend.at, correlation=trend.correlation, **where
                )
            )
        if len(off) < (1.0 - DOUBTFUL) * len(kept):
            warnings.append(
                warning("many_outliers", left_out=len(kept) - len(off), points=len(kept), **where)
            )
    return warnings
