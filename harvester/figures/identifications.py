"""The figure of an identification: each measurement with its fit, and the residuals below."""

from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from harvester.figures.quantities import scale
from harvester.figures.style import WIDTH, entitle, legend, new
from harvester.identification.identification_result import IdentificationResult
from harvester.presentation.plot import Plot, styled

_POINTS: dict[str, Any] = {
    "linestyle": "none",
    "marker": ".",
    "markersize": 2.5,
    "color": "#0072B2",
}
_OUT: dict[str, Any] = {"linestyle": "none", "marker": "x", "markersize": 5, "color": "#D55E00"}
_LINE: dict[str, Any] = {"linewidth": 1.0, "color": "0.1"}
MOST = 6  # measurements that are drawn


def identification(result: IdentificationResult, title: str | None) -> Plot:
    """Draw sizes, phases and ring-downs with their fits, and each one's residual over its noise."""
    curves = result.curves()[: 2 * MOST]
    across = 2 if len(curves) > 1 else 1
    down = -(-len(curves) // across)
    with styled():
        figure, grid = new(
            2 * down,
            across,
            (WIDTH, 1.0 + 2.4 * down),
            squeeze=False,
            height_ratios=[2.4, 1.0] * down,
        )
        for n, curve in enumerate(curves):
            top = grid[2 * (n // across)][n % across]
            low = grid[2 * (n // across) + 1][n % across]
            kept = curve.kept > 0.0
            of = scale(
                curve.label.partition(" (")[0], curve.label.partition(" (")[2][:-1], curve.measured
            )
            measured, fitted = curve.measured / of.factor, curve.fitted / of.factor
            top.plot(curve.x[kept], measured[kept], **_POINTS, label="measured")
            if not kept.all():
                top.plot(curve.x[~kept], measured[~kept], **_OUT, label="left out as an outlier")
            order = np.argsort(curve.x)
            top.plot(curve.x[order], fitted[order], **_LINE, label="fit")
            if curve.logarithmic:
                top.set_yscale("log")
                top.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=8))
                top.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
                top.yaxis.set_minor_formatter(NullFormatter())
            top.set_ylabel(of.label)
            top.set_title(curve.name, fontsize=9, loc="left")
            top.tick_params(labelbottom=False)
            low.plot(curve.x[kept], curve.residual[kept], **_POINTS)
            low.axhline(0.0, color="0.1", linewidth=0.6)
            low.set_ylim(-5.0, 5.0)
            low.set_ylabel("residual\nover noise", fontsize=8)
            low.set_xlabel(curve.x_label)
        for spare in range(len(curves), across * down):
            for row in (0, 1):
                grid[2 * (spare // across) + row][spare % across].set_axis_off()
        entitle(figure, title, "Do the fitted parameters explain the measurements?")
        legend(figure, beside="If the residuals show only noise, the model fits.")
    return figure
