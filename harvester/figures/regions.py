"""The figure of the region of stability."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harvester.figures.quantities import broken, logarithm, scale
from harvester.figures.shapes import EdgeShape
from harvester.figures.style import INK, STYLES, WIDTH, Plot, entitle, legend, new, styled
from harvester.uncertainty.value import NORMAL_QUANTILE


def region(edges: Sequence[EdgeShape], title: str | None) -> Plot:
    """Draw the boundary of stability in the plane (mu, D22): published, ours, and Monte Carlo with 95 % intervals."""
    mu = np.array([e.mu for e in edges])
    known = [e for e in edges if np.isfinite(e.ensemble_stderr)]
    finite = [v for e in edges for v in (e.published, e.averaged, e.ensemble) if np.isfinite(v)]
    top = 1.3 * max(finite, default=1.0) or 1.0
    y = scale("noise D22 where rest loses stability", "", [top])
    with styled():
        figure, here = new(1, 1, (WIDTH, 4.4))
        measured = np.minimum([e.ensemble for e in edges], top) / y.factor
        here.fill_between(mu, 0.0, measured, color="0.92", linewidth=0, label="stable (Monte Carlo)", zorder=0)
        for name in ("published", "averaged"):
            here.plot(mu, np.minimum([getattr(e, name) for e in edges], top) / y.factor, **STYLES[name])
        error = NORMAL_QUANTILE * np.array([e.ensemble_stderr for e in known]) / y.factor
        marks: dict[str, Any] = {
            "color": STYLES["ensemble"]["color"],
            "linestyle": "none",
            "marker": "s",
            "zorder": 3.5,
        }
        marks |= {"markeredgecolor": INK, "ecolor": INK, "label": "ensemble (Monte Carlo)"}
        here.errorbar([e.mu for e in known], np.array([e.ensemble for e in known]) / y.factor, error, **marks)
        logarithm(here.xaxis)
        here.set_ylim(0.0, top / y.factor)
        here.set_xlabel("time-constant ratio μ = 1/(R Cp ω0) (nondimensional)")
        here.set_ylabel(broken(y.label, 44))
        entitle(figure, f"{title}: rest is stable below the line" if title else title, "Rest is stable below the line")
        legend(figure, "Bars: 95 % sampling intervals.")
    return figure
