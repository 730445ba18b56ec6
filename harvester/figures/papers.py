"""The figures of the Entropy 2026 paper, and the region of stability: theories and Monte Carlo."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from harvester.figures.quantities import broken, logarithm, scale
from harvester.figures.style import INK, WIDTH, entitle, legend, new, paler
from harvester.presentation.engine_look import look as look_of
from harvester.presentation.plot import Plot, styled
from harvester.studies.paper import FigurePoint, PaperFigure
from harvester.studies.stability.exponent import Stability

# of the first, second and third curve
_MARKERS = "so^"
_PALER = 0.3
_NAMES = {
    "E[V^2]": "mean square voltage E[V²]",
    "E[P]": "mean power E[P]",
    "lambda": "top Lyapunov exponent λ",
    "D22": "parametric noise D22",
    "mu": "time-constant ratio μ",
    "beta": "coupling β",
    "r": "restitution coefficient r",
    "D11": "external noise D11",
}


def paper(answer: PaperFigure, title: str | None) -> Plot:
    """Draw the panels of a figure: published, ours, and Monte Carlo with 95 % intervals."""
    points = answer.points
    panels = list(dict.fromkeys(p.panel for p in points))
    curves = list(dict.fromkeys(p.curve for p in points))
    with styled():
        figure, axes = new(1, len(panels), (WIDTH, 3.8 if len(panels) < 3 else 3.4), squeeze=False)
        for panel, here in zip(panels, axes[0], strict=True):
            of_panel = [p for p in points if p.panel == panel]
            unit = _label(here, panel, of_panel, 22 if len(panels) > 2 else 34)
            for number, name in enumerate(curves):
                _curve(here, [p for p in of_panel if p.curve == name], unit, number)
        entitle(figure, title, "")
        look: dict[str, Any] = {"linestyle": "none", "markersize": 4}
        marks = [
            Line2D([], [], color=paler(INK, _PALER * n), marker=_MARKERS[n % 3], label=name, **look)
            for n, name in enumerate(curves)
            if name
        ]
        legend(figure, "Bars: 95 % sampling intervals of the Monte Carlo.", marks)
    return figure


def _curve(here: Axes, rows: Sequence[FigurePoint], unit: float, number: int) -> None:
    """Draw one curve of the three sources, in paler colours for each next ``number``."""
    x, y = np.array([p.x for p in rows]), np.array([p.ensemble for p in rows])
    for name in ("published", "averaged"):
        style = look_of(name).style() | {
            "color": paler(look_of(name).colour, _PALER * number),
            "linewidth": 1.2,
        }
        here.plot(
            x,
            np.array([getattr(p, name) for p in rows]) / unit,
            **style | ({"label": "_"} if number else {}),
        )
    solved = [(p.x, p.density / unit) for p in rows if p.density is not None]
    if solved:
        style = look_of("density").style() | {"linewidth": 1.2}
        here.plot(*np.transpose(solved), **style | ({"label": "_"} if number else {}))
    error = np.array([p.ensemble_error95 for p in rows])
    marks: dict[str, Any] = {
        "color": look_of("ensemble").colour,
        "linestyle": "none",
        "zorder": 2.5,
    }
    marks |= {
        "marker": _MARKERS[number % 3],
        "markersize": 4 if len(rows) < 20 else 3,
        "markeredgewidth": 0.6,
    }
    marks |= {
        "markeredgecolor": paler(INK, _PALER * number),
        "ecolor": paler(INK, _PALER * number),
        "elinewidth": 0.8,
    }
    here.errorbar(
        x, y / unit, error / unit, **marks, label="_" if number else "ensemble (Monte Carlo)"
    )


def _label(here: Axes, panel: str, rows: Sequence[FigurePoint], most: int) -> float:
    """Label a panel's axes, all nondimensional, and return the divisor of the values."""
    what, _, against = panel.partition(" against ")
    if not against:
        against = what[2:-1]
        what = "probability density"
    y = scale(_NAMES.get(what, what), "", [p.averaged for p in rows])
    here.set_ylabel(broken(y.label, most))
    here.set_xlabel(broken(f"{_NAMES.get(against, against)} (nondimensional)", most))
    if against == "mu":
        logarithm(here.xaxis)
    else:
        here.xaxis.set_major_locator(MaxNLocator(5 if most > 22 else 3))  # more numbers would touch
    return y.factor


def region(answer: Stability, title: str | None) -> Plot:
    """Draw the boundary of stability in the plane (mu, D22): published, ours, and Monte Carlo with 95 % intervals."""
    edges = answer.region
    mu = [edge.mu for edge in edges]
    finite = [v for e in edges for v in (e.published, e.averaged, e.ensemble) if np.isfinite(v)]
    top = 1.3 * max(finite, default=1.0) or 1.0
    y = scale("noise D22 at the stability limit of rest", "", [top])
    with styled():
        figure, here = new(1, 1, (WIDTH, 4.4))
        edge = np.minimum([e.ensemble for e in edges], top) / y.factor
        here.fill_between(
            mu, 0.0, edge, color="0.92", linewidth=0, label="stable (Monte Carlo)", zorder=0
        )
        for name in ("published", "averaged"):
            here.plot(
                mu,
                np.minimum([getattr(e, name) for e in edges], top) / y.factor,
                **look_of(name).style(),
            )
        marks: dict[str, Any] = {
            "color": look_of("ensemble").colour,
            "markeredgecolor": INK,
            "ecolor": INK,
        }
        marks |= {
            "linestyle": "none",
            "marker": "s",
            "zorder": 3.5,
            "label": "ensemble (Monte Carlo)",
        }
        known = [(m, e.ensemble, e.ensemble_error95) for m, e in zip(mu, edges, strict=True)]
        positions, noises, errors = (
            np.array([row for row in known if np.isfinite(row[2])]).reshape(-1, 3).T
        )
        here.errorbar(positions, noises / y.factor, errors / y.factor, **marks)
        logarithm(here.xaxis)
        here.set_ylim(0.0, top / y.factor)
        here.set_xlabel("time-constant ratio μ = 1/(R Cp ω0) (nondimensional)")
        here.set_ylabel(broken(y.label, 44))
        entitle(figure, title, "Rest is stable below the line")
        legend(figure, "Bars: 95 % sampling intervals.")
    return figure
