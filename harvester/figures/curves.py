"""Curves with error bars or bands, as all figures draw them."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.arrays import Floats

MOST_BARS = 60  # points with an error bar each; more are a band


def curve(axes: Axes, x: Floats, y: Floats, error: Floats, style: dict[str, Any], dot: str = "o") -> None:
    """Draw a line or markers, with intervals y +- error where there are any.

    nan breaks the line; a point without neighbours, which no line shows, is a marker ``dot``.
    """
    many = len(x) > MOST_BARS
    if many and style.get("marker") and style.get("linestyle") == "none":
        style = style | {"markersize": 2.0}
    axes.plot(x, y, **style)
    if np.any(error > 0.0):
        if many:
            axes.fill_between(x, y - error, y + error, color=style["color"], alpha=0.3, linewidth=0, zorder=1.9)
        else:
            bars = {"fmt": "none", "elinewidth": 1.0, "zorder": style.get("zorder", 2.0)}
            axes.errorbar(x, y, error, ecolor=style["color"], **bars)
    if style.get("linestyle", "-") != "none" and not style.get("marker"):
        known = np.concatenate(([False], np.isfinite(y), [False]))
        alone = known[1:-1] & ~known[:-2] & ~known[2:]
        dots: dict[str, Any] = {"marker": dot, "markersize": 5, "linestyle": "none"}
        if alone.any():
            axes.plot(x[alone], y[alone], color=style["color"], zorder=style.get("zorder", 2.0), **dots)


def relative(values: Floats, by: Floats) -> Floats:
    """Values divided by others; nan where these are 0."""
    quotients: Floats = np.divide(values, by, out=np.full(len(values), np.nan), where=by != 0.0)
    return quotients
