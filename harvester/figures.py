"""All drawing.  One colour and one marker an engine throughout; readable in grey; error bars at 95 %."""

import io
import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harvester.arrays import Floats

if TYPE_CHECKING:
    from harvester.cost_table import Row
    from harvester.optimum.answer import Optimum
    from harvester.optimum.ranges import Range
    from harvester.paper import Point
    from harvester.region import Edge
    from harvester.studies.compare import Comparison
    from harvester.sweeps.table import Table

# Okabe and Ito's palette, told apart without colour by line and marker.
STYLES: dict[str, dict[str, Any]] = {
    "published": {"color": "#D55E00", "linestyle": "--", "marker": "", "label": "published averaging"},
    "averaged": {"color": "#009E73", "linestyle": "-.", "marker": "", "zorder": 3, "label": "impact-aware averaging"},
    "ensemble": {"color": "#999999", "linestyle": "-", "marker": "", "linewidth": 3, "label": "ensemble (exact RC)"},
    "ideal": {
        "color": "#CC79A7",
        "linestyle": ":",
        "marker": "",
        "linewidth": 2.5,
        "label": "ensemble (ideal circuit)",
    },
    "spice": {
        "color": "#0072B2",
        "linestyle": "none",
        "marker": "o",
        "markersize": 5,
        "zorder": 4,
        "label": "SPICE (ngspice)",
    },
    "spice alone": {
        "color": "#56B4E9",
        "linestyle": "none",
        "marker": "^",
        "markersize": 5,
        "label": "SPICE, not paired",
    },
}
Rows = list[dict[str, str]]
MARKERS = {"published": "X", "averaged": "P", "ensemble": "s", "ideal": "D", "spice": "o", "spice alone": "^"}
MOST_SHOWN = 2000  # points of a curve
UNITS = {
    "load.resistance": "load resistance (ohm)",
    "excitation.acceleration_psd": "base acceleration density ((m/s$^2$)$^2$/Hz)",
    "stop.restitution": "restitution coefficient",
    "piezo.coupling": "electromechanical coupling (N/V)",
    "piezo.capacitance": "clamped capacitance (F)",
    "nondimensional.mu": "time-constant ratio mu",
    "nondimensional.beta": "coupling beta",
    "nondimensional.restitution": "restitution coefficient r",
}


def sweep(table: "Table", title: str, physical: bool) -> bytes:
    """The file of `sweep_figure`."""
    return png(sweep_figure(table, title, physical))


def sweep_figure(table: "Table", title: str, physical: bool) -> Figure:
    """Mean power against the first varied key, one curve an engine (and a value of the other keys).

    A list of points of several keys is markers without a line.  Of a long curve `MOST_SHOWN` points are drawn.
    """
    first = table.axes[0]
    engines = list(dict.fromkeys(row["engine"] for row in table.rows))
    several = len(engines) > 1
    if several:
        figure, (top, low) = new(2, 1, (7, 6.4), sharex=True, height_ratios=[2.2, 1])
    else:
        figure, top = new(1, 1, (7, 4.6))
        low = top
    reference = next((e for e in ("ensemble", "spice") if e in engines), engines[-1])
    for number, (label, curves) in enumerate(itertools.islice(_curves(table).items(), 6)):
        _powers(top, table, curves, label, 1.0 - 0.12 * number)
        if several:
            _ratios(low, table, curves, reference)
    top.set_ylabel("mean power (W)" if physical else "mean power (nondimensional)")
    low.set_xlabel(UNITS.get(first.key, first.key))
    if several:
        low.set_ylabel(f"power over\n{reference}")
        low.axhline(1.0, color="0.6", linewidth=1, zorder=0)
        low.set_ylim(0.0, None)
    if first.logarithmic:
        low.set_xscale("log")
    positive = [float(row["mean_power"]) for row in table.rows if row["mean_power"]]
    if min(positive) > 0.0 and max(positive) > 5.0 * min(positive):
        top.set_yscale("log")
    top.set_title(title or "Mean power", wrap=True, parse_math=False)
    top.legend(frameon=False, fontsize=9)
    for axes in {top, low}:
        axes.grid(color="0.92")
    return figure


def _curves(table: "Table") -> dict[str, dict[str, Rows]]:
    """Rows with an answer along the first key: of each value of the other keys, by engine."""
    others = () if table.listed else table.axes[1:]
    found: dict[tuple[str, ...], dict[str, Rows]] = {}
    for row in table.rows:
        if not row["error"]:
            found.setdefault(tuple(row[a.key] for a in others), {}).setdefault(row["engine"], []).append(row)
    curves = {}
    for group, of_engine in found.items():
        label = ", ".join(f"{a.key} = {float(v):.4g}" for a, v in zip(others, group, strict=True))
        curves[label] = {engine: rows[:: -(-len(rows) // MOST_SHOWN)] for engine, rows in of_engine.items()}
        for rows in curves[label].values() if table.listed else ():
            rows.sort(key=lambda row: float(row[table.axes[0].key]))
    return curves


def _powers(top: Axes, table: "Table", curves: dict[str, Rows], label: str, alpha: float) -> None:
    """Each engine's mean power, and what `averaged` says of its own error."""
    for engine, rows in curves.items():
        x, p = _numbers(rows, table.axes[0].key), _numbers(rows, "mean_power")
        style = _style(engine, table) | {"alpha": alpha}
        style["label"] += f" {label}" if label else ""
        _curve(top, x, p, 1.96 * _numbers(rows, "mean_power_stderr"), style)
        if engine == "averaged" and style["linestyle"] != "none":
            bias = _numbers(rows, "mean_power_bias")
            top.fill_between(x, p - bias, p + bias, color=style["color"], alpha=0.2, linewidth=0)


def _ratios(low: Axes, table: "Table", curves: dict[str, Rows], reference: str) -> None:
    """Each engine's mean power over that of the reference at the same point."""

    def at(row: dict[str, str]) -> tuple[str, ...]:
        return tuple(row[a.key] for a in table.axes)

    base = {at(row): float(row["mean_power"]) for row in curves.get(reference, [])}
    for engine, rows in curves.items():
        here = [row for row in rows if base.get(at(row))]
        if engine != reference and here:
            over = np.array([base[at(row)] for row in here])
            error = 1.96 * _numbers(here, "mean_power_stderr") / over
            x, ratio = _numbers(here, table.axes[0].key), _numbers(here, "mean_power") / over
            _curve(low, x, ratio, error, _style(engine, table) | {"label": None})


def _style(engine: str, table: "Table") -> dict[str, Any]:
    """An engine's; a list of points of several keys lies on no line."""
    style = STYLES.get(engine, {"label": engine})
    if table.listed and len(table.axes) > 1:
        style = style | {"linestyle": "none", "marker": MARKERS.get(engine, "o"), "markersize": 4}
    return dict(style)


def _numbers(rows: Rows, name: str) -> Floats:
    return np.array([float(row[name] or 0.0) for row in rows])


def _curve(axes: Axes, x: Floats, y: Floats, error: Floats, style: dict[str, Any]) -> None:
    """A line or markers, with 95 % intervals where the engine samples."""
    if error.any():
        axes.errorbar(x, y, error, capsize=2, **style)
    else:
        axes.plot(x, y, **style)


def comparison(result: "Comparison", title: str) -> bytes:
    """Power of each engine, and V of one path from three sources, with and without the stop."""
    rows = 1 + len(result.paths)
    figure, axes = new(rows, 1, (8, 2.6 * rows), squeeze=False)
    bars = axes[0, 0]
    names = [e.engine for e in result.estimates]
    values = [e.mean_power.value for e in result.estimates]
    errors = [1.96 * (e.mean_power.stderr or 0.0) for e in result.estimates]
    colours = [STYLES[name]["color"] for name in names]
    bars.barh(names, values, xerr=errors, color=colours, height=0.6, capsize=3)
    bars.invert_yaxis()
    bars.set_xlabel("mean power (W), 95 % interval" if result.estimates[0].physical else "mean power (nondimensional)")
    bars.set_title(title or "Engines side by side", wrap=True, parse_math=False)
    for panel, path in zip(axes[1:, 0], result.paths, strict=True):
        shown = path.t > path.t[-1] - 40.0
        t = path.t[shown]
        panel.plot(t, path.decoupled[shown], color=STYLES["published"]["color"], linestyle="--", label="decoupled")
        panel.plot(t, path.exact[shown], color="0.6", linewidth=3, label="exact update")
        panel.plot(t, path.spice[shown], color=STYLES["spice"]["color"], linewidth=1, label="ngspice")
        panel.set_title(
            f"{path.title}: relative RMS error of the decoupled V {path.decoupled_error:.0%}, "
            f"ngspice against exact {path.spice_error:.0e}",
            fontsize=10,
        )
        panel.set_ylabel("V (nondimensional)")
        panel.legend(frameon=False, fontsize=8, ncols=3, loc="upper left")
    axes[-1, 0].set_xlabel("time (1/w0)")
    return png(figure)


def cost(rows: "Sequence[Row]", title: str) -> bytes:
    """Total error against seconds, a marker each row, and the front: what no other row equals or betters in both."""
    figure, here = new(1, 1, (7.5, 5.2))
    shown = [row for row in rows if row.seconds and row.total_error]
    for engine in dict.fromkeys(row.engine for row in shown):
        points = [(row.seconds, row.total_error) for row in shown if row.engine == engine]
        style = {k: v for k, v in STYLES[engine].items() if k in ("color", "label")}
        marks = {"marker": MARKERS[engine], "linestyle": "none", "markersize": 6, "markeredgecolor": "0.2"}
        here.plot(*zip(*points, strict=True), markeredgewidth=0.5, zorder=3, **marks, **style)
    best = sorted((row.seconds, row.total_error, row.engine) for row in shown if row.best)
    here.step([b[0] for b in best], [b[1] for b in best], where="post", color="0.2", linewidth=1, zorder=2)
    for (_, _, before), (seconds, error, engine) in zip([(0.0, 0.0, ""), *best], best, strict=False):
        if engine != before:
            here.annotate(engine, (seconds, error), (-4, -12), textcoords="offset points", ha="right", fontsize=9)
    here.set(xscale="log", yscale="log", xlabel="seconds (computation)")
    here.set_ylabel("total error of the mean power, relative")
    here.set_title(title or "What accuracy costs", wrap=True, parse_math=False, fontsize=10)
    here.grid(color="0.92", which="both")
    here.legend(frameon=False, fontsize=9)
    return png(figure)


def new(rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Figure, Any]:
    """A figure and its axes, without pyplot, which costs .2 s to load and remembers every figure."""
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def png(figure: Figure) -> bytes:
    """The figure as a file."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=130)
    return out.getvalue()


def paper(points: "list[Point]", title: str) -> bytes:
    """One of the paper's figures: a panel each, published, ours and Monte Carlo with 95 % intervals."""
    panels = list(dict.fromkeys(p.panel for p in points))
    figure, axes = new(1, len(panels), (max(5.2 * len(panels), 8.0), 4.4), squeeze=False)
    for panel, here in zip(panels, axes[0], strict=True):
        curves = list(dict.fromkeys(p.curve for p in points if p.panel == panel))
        for number, curve in enumerate(curves):
            rows = [p for p in points if p.panel == panel and p.curve == curve]
            x = np.array([p.x for p in rows])
            first = number == 0
            for name in ("published", "averaged"):
                style = dict(STYLES[name], alpha=1.0 - 0.25 * number)
                here.plot(x, [getattr(p, name) for p in rows], **(style if first else style | {"label": None}))
            error = [1.96 * p.ensemble_stderr for p in rows]
            marks = {"color": "0.2", "linestyle": "none", "marker": "osv"[number % 3], "markersize": 3.5, "capsize": 2}
            label = f"Monte Carlo{', ' + curve if curve else ''}"
            here.errorbar(x, [p.ensemble for p in rows], error, label=label, **marks)
        what, _, against = panel.partition(" against ")
        here.set_ylabel(what)
        here.set_xlabel(against or what[2:-1])
        here.grid(color="0.92")
        here.legend(frameon=False, fontsize=8)
        if "mu" in panel.split():
            here.set_xscale("log")
    figure.suptitle(title, fontsize=10)
    return png(figure)


def region(edges: "list[Edge]", title: str) -> bytes:
    """Stable and unstable in the plane (mu, D22): the boundary published, ours, and by Monte Carlo with 95 %."""
    figure, here = new(1, 1, (8.0, 5.0))
    mu = np.array([e.mu for e in edges])
    known = [e for e in edges if np.isfinite(e.ensemble_stderr)]
    finite = [v for e in edges for v in (e.published, e.averaged, e.ensemble) if np.isfinite(v)]
    top = 1.3 * max(finite, default=1.0) or 1.0
    for name in ("published", "averaged"):
        here.plot(mu, np.minimum([getattr(e, name) for e in edges], top), **STYLES[name])
    measured = np.minimum([e.ensemble for e in edges], top)
    here.fill_between(mu, 0.0, measured, color="0.9", label="stable (Monte Carlo)", zorder=0)
    error = [1.96 * e.ensemble_stderr for e in known]
    marks: dict[str, Any] = {"color": "0.2", "linestyle": "none", "marker": "o", "markersize": 4, "capsize": 2}
    here.errorbar([e.mu for e in known], [e.ensemble for e in known], error, label="Monte Carlo, 95 %", **marks)
    here.set(xscale="log", ylim=(0.0, top), xlabel="time-constant ratio mu = 1/(R Cp w0)")
    here.set_ylabel("parametric noise D22 at which rest becomes unstable")
    here.set_title(f"{title}: stable below, unstable above" if title else "stable below, unstable above", fontsize=10)
    here.grid(color="0.92")
    here.legend(frameon=False, fontsize=9)
    return png(figure)


def optimum(answer: "Optimum", title: str) -> bytes:
    """All evaluations of the engine with the optimum and its interval: contours over two keys, else a panel a key."""
    keys = answer.keys
    own = [p for p in answer.points if p.engine == answer.engine and p.power is not None]
    x = np.array([[key.range.value(float(u)) for key, u in zip(keys, p.u, strict=True)] for p in own])
    powers = [p.power for p in own if p.power is not None]
    power, error = np.array([v.value for v in powers]), np.array([v.error95 for v in powers])
    unit = " (W)" if answer.estimate.physical else ""
    colour = STYLES.get(answer.engine, {}).get("color", "0.3")
    plane = len(keys) == 2 and len(own) > 3
    figure, axes = new(1, 1 if plane else len(keys), (7 if len(keys) < 3 else 3.2 * len(keys), 4.6), squeeze=False)
    mark = {"color": "0.1", "marker": "*", "markersize": 12, "linestyle": "none", "zorder": 6, "label": "optimum"}
    if plane:
        here = axes[0, 0]
        filled = here.tricontourf(x[:, 0], x[:, 1], power, levels=12, cmap="viridis")
        figure.colorbar(filled, ax=here, label=f"mean power{unit}")
        here.plot(x[:, 0], x[:, 1], ".", color="0.9", markersize=2, label="evaluations")
        spans = [
            None if k.low95 is None or k.high95 is None else [[k.value - k.low95], [k.high95 - k.value]] for k in keys
        ]
        if spans[0] and spans[1]:
            here.errorbar(
                keys[0].value, keys[1].value, spans[1], spans[0], color="0.1", capsize=3, linestyle="none", zorder=5
            )
        here.plot(keys[0].value, keys[1].value, **mark)
        _axis(here.set_ylabel, here.set_yscale, keys[1].range)
    for number, here in enumerate(axes[0]):
        key = keys[number]
        _axis(here.set_xlabel, here.set_xscale, key.range)
        if not plane:
            order = np.argsort(x[:, number])
            style = {"color": colour, "marker": ".", "linestyle": "none", "elinewidth": 0.7, "label": answer.engine}
            here.errorbar(x[order, number], power[order], error[order], **style)
            if key.low95 is not None and key.high95 is not None:
                here.axvspan(key.low95, key.high95, color="0.85", zorder=0, label="interval of the best value")
            here.errorbar(key.value, answer.mean_power.value, answer.mean_power.error95, **mark, capsize=3)
            here.set_ylabel(f"mean power{unit}" if number == 0 else "")
            here.grid(color="0.92")
    axes[0, 0].legend(frameon=plane, fontsize=9)
    figure.suptitle(title or "Largest mean power", wrap=True, parse_math=False, fontsize=10)
    return png(figure)


def _axis(label: Any, scale: Any, one: "Range") -> None:
    label(UNITS.get(one.key, one.key))
    if one.logarithmic:
        scale("log")
