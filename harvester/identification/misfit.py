"""Whether the residuals of a fit are noise: single points far off are outliers, but neighbours that agree are a misfit.

For n residuals of white noise the correlation of neighbours is 0 within 1/sqrt(n).  A second mode,
a wrong minimum or a stop that is not rigid leaves a pattern: neighbours agree, however small the
residual is.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats

OUTLIER = 5.0  # times a channel's noise
RUN = 4  # so many neighbours beyond it are no outliers
CERTAIN = 5.0  # standard errors of a correlation that chance does not make
LEAST = 1e-6  # of the size: a smaller residual is rounding


def without_outliers(off: Floats, noise: float, x: Floats) -> Floats:
    """1 if a residual at x is kept, 0 if it is an outlier, all of shape (n,)."""
    order = np.argsort(x, kind="stable")
    far = np.abs(off[order]) > OUTLIER * noise
    edges = np.flatnonzero(np.diff(np.concatenate(([0], far.astype(int), [0]))))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        far[begin:end] &= end - begin < RUN
    kept = np.ones(len(off))
    kept[order] = np.where(far, 0.0, 1.0)
    return kept


@dataclass(frozen=True)
class Pattern:
    """A residual that is not noise: the ``correlation`` of neighbours, and if it is strongest, ``at`` (Hz)."""

    correlation: float
    at: float


def pattern(off: Floats, x: Floats, relative: float, of_time: bool) -> Pattern | None:
    """The pattern of residuals at x (Hz, or s if ``of_time``), shape (n,).

    None if they may be noise.

    ``relative`` is their size over that of the measurement.
    """
    order = np.argsort(x, kind="stable")
    x = x[order]
    off = off[order] - off.mean()
    power = float(off @ off)
    if len(off) < 3 * RUN or power <= 0.0 or relative < LEAST:
        return None
    correlation = float(off[1:] @ off[:-1]) / power
    if abs(correlation) * math.sqrt(len(off)) < CERTAIN:
        return None
    if of_time:
        lines = np.abs(
            np.fft.rfft(np.interp(np.linspace(x[0], x[-1], len(x)), x, off) * np.hanning(len(x)))
        )
        return Pattern(correlation, float(np.argmax(lines) / (x[-1] - x[0])))
    smooth = np.convolve(off, np.ones(RUN) / RUN, "same")
    return Pattern(correlation, float(x[np.argmax(np.abs(smooth))]))
