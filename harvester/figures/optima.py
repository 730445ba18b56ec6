"""The figure of an optimum: the evaluations that found it, the best place and its interval."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.arrays import Floats
from harvester.figures.quantities import broken, mark, scale
from harvester.figures.shapes import BestKeyShape, OptimumShape
from harvester.figures.smoothing import FEWEST, smooth
from harvester.figures.style import INK, WIDTH, Plot, entitle, legend, new, styled
from harvester.presentation.engine_look import look as look_of
from harvester.uncertainty.value import NORMAL_QUANTILE

_NOTE = "Bars: 95 % sampling + step + model, as far as stated."
_MAP = "Map: a smooth surface through the evaluations; white where there is none near."
_MOST_BARS = 150  # evaluations with an error bar each
_STAR: dict[str, Any] = {"marker": "*", "markersize": 13, "linestyle": "none", "zorder": 6}
_STAR["clip_on"] = False
_GRID = 121  # points a side of a map


def optimum(answer: OptimumShape, title: str | None) -> Plot:
    """Draw the engine's evaluations, the optimum and its interval: a map over two keys, else a panel for each."""
    keys = answer.keys
    own = [p for p in answer.points if p.engine == answer.engine and p.power is not None]
    places = np.array([p.u for p in own])
    x = np.array([[key.range.value(float(u)) for key, u in zip(keys, p.u, strict=True)] for p in own])
    powers = [p.power for p in own if p.power is not None]
    y = scale("mean power", answer.estimate.unit_names.power, [v.value for v in powers])
    power, error = (np.array([getattr(v, name) for v in powers]) / y.factor for name in ("value", "known_error95"))
    plane = len(keys) == 2 and len(own) > 3 and bool(np.linalg.matrix_rank(places - places[0], 1e-6) == 2)
    with styled():
        columns = 1 if plane else len(keys)
        figure, axes = new(1, columns, (WIDTH, 4.4), squeeze=False, sharey=True)
        sampling = np.array([v.sampling95 / NORMAL_QUANTILE for v in powers]) / y.factor
        if plane:
            _plane(axes[0, 0], answer, places, x, power, sampling, y.label)
        for number, here in enumerate(() if plane else axes[0]):
            _panel(here, answer, keys[number], x[:, number], power, error, y.factor)
        if len(keys) == 1 and len(own) >= FEWEST and np.ptp(places) > 0.0:
            _guide(axes[0, 0], keys[0], places, power, sampling)
        if not plane:
            axes[0, 0].set_ylabel(y.label)
        entitle(figure, title, "Largest mean power")
        legend(figure, _MAP if plane else _NOTE if error.any() and len(own) <= _MOST_BARS else "")
    return figure


def _star(answer: OptimumShape) -> str:
    """The name of the star: no optimum where most of the range was never looked at."""
    return "optimum" if answer.scanned else "highest so far: the scan was cut short"


def _panel(
    here: Axes, answer: OptimumShape, key: BestKeyShape, x: Floats, power: Floats, error: Floats, unit: float
) -> None:
    """Draw the evaluations against one key, whatever the values of the others."""
    by = mark(here.xaxis, key.range.key, [key.range.low, key.range.high], key.range.logarithmic)
    if np.ptp([*x, key.value]) < 1e-6 * abs(key.value):  # all at one place: no width that an axis could have
        here.set_xlim(key.range.low / by, key.range.high / by)
    colour = look_of(answer.engine).colour
    if key.low95 is not None and key.high95 is not None:
        here.axvspan(key.low95 / by, key.high95 / by, color="0.88", zorder=0, label="interval of the best value")
    if len(answer.keys) > 1:
        here.set_xlabel(broken(here.get_xlabel(), 22))
    style: dict[str, Any] = {"color": colour, "marker": "o", "markersize": 3, "linestyle": "none"}
    style |= {"markeredgecolor": INK, "markeredgewidth": 0.4, "ecolor": colour, "elinewidth": 0.8}
    bars = error if error.any() and len(x) <= _MOST_BARS else None
    here.errorbar(x / by, power, bars, **style, label=f"evaluations by {answer.engine}")
    best = answer.estimate.mean_power
    here.errorbar(
        key.value / by, best.value / unit, best.known_error95 / unit or None, color=INK, label=_star(answer), **_STAR
    )


def _guide(here: Axes, key: BestKeyShape, places: Floats, power: Floats, sampling: Floats) -> None:
    """Draw a smooth line through the evaluations of one key, which leads the eye."""
    u = np.linspace(places.min(), places.max(), 300)[:, None]
    by = mark(here.xaxis, key.range.key, [key.range.low, key.range.high], key.range.logarithmic)
    x = np.array([key.range.value(float(one)) for one in u[:, 0]]) / by
    here.plot(x, smooth(places, power, sampling, u), color="0.5", linewidth=1.0, zorder=1.5, label="guide to the eye")


def _plane(
    here: Axes, answer: OptimumShape, places: Floats, x: Floats, power: Floats, sampling: Floats, label: str
) -> None:
    """Draw a smooth map over two keys, made as they were searched: by ratio where the axis is logarithmic."""
    one, two = answer.keys
    ranges = zip((here.xaxis, here.yaxis), (one.range, two.range), strict=True)
    by = [mark(axis, r.key, [r.low, r.high], r.logarithmic) for axis, r in ranges]
    x = x / by
    side = np.linspace(0.0, 1.0, _GRID)
    u = np.stack(np.meshgrid(side, side), axis=-1)
    surface = smooth(places, power, sampling, u.reshape(-1, 2)).reshape(_GRID, _GRID)
    surface = np.clip(surface, power.min(), power.max())  # a spline may overshoot
    across, up = (np.array([k.range.value(float(v)) for v in side]) / b for k, b in zip(answer.keys, by, strict=True))
    filled = here.pcolormesh(across, up, surface, cmap="viridis", shading="gouraud", rasterized=True)
    assert here.figure is not None
    here.figure.colorbar(filled, ax=here, label=label)
    if power.max() > power.min():
        lines = here.contour(across, up, surface, 8, colors="white", linewidths=0.6, alpha=0.8)
        here.clabel(lines, fontsize=7, fmt="%.4g")
    dots: dict[str, Any] = {"marker": "o", "markersize": 3 if len(x) < 100 else 1.5, "linestyle": "none"}
    dots |= {"markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 0.4}
    here.plot(x[:, 0], x[:, 1], **dots, label=f"evaluations by {answer.engine}")
    spans = [
        None if k.low95 is None or k.high95 is None else [[(k.value - k.low95) / b], [(k.high95 - k.value) / b]]
        for k, b in zip(answer.keys, by, strict=True)
    ]
    look = _STAR | {"label": _star(answer), "color": "#D55E00", "markeredgecolor": "white", "capsize": 3}
    here.errorbar(one.value / by[0], two.value / by[1], spans[1], spans[0], **look)
    here.grid(visible=False)
    here.set_xlim(across[0], across[-1])
    here.set_ylim(up[0], up[-1])
