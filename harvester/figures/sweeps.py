"""The figure of a sweep: mean power against the first varied key, and each engine's power over one of them."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from harvester.arrays import Floats
from harvester.figures.quantities import broken, logarithm, mark, plain, quantity, scale, written
from harvester.figures.shapes import SweepShape
from harvester.figures.style import MARKERS, MOST_BARS, STYLES, WIDTH, Plot, curve, entitle, legend, new, paler, styled
from harvester.uncertainty.value import NORMAL_QUANTILE

Rows = list[dict[str, str]]
MOST_SHOWN = 2000  # points of a curve
MOST_CURVES = 6  # values of the other keys
_GROUPS = "osv^Dx"  # a marker a value of the other keys
_SPREAD = 0.12  # how much paler each next one is


def sweep(table: SweepShape, title: str | None) -> Plot:
    """Draw the mean power, a curve for each engine (and value of the other keys), with errors; crosses are failures.

    Below, with several engines, the power over that of an engine that samples, at the same point.  A list of points of
    several keys is markers without a line.  Of a long curve every n-th point is drawn, at most `MOST_SHOWN`.
    """
    first = table.axes[0]
    engines = list(dict.fromkeys(row["engine"] for row in table.rows))
    found = _groups(table)
    groups = dict(list(found.items())[:MOST_CURVES])
    several = len(engines) > 1
    reference = next((e for e in ("exact", "ensemble", "spice", "ideal", "averaged") if e in engines), engines[-1])
    powers = np.array([_number(row, "mean_power") for row in table.rows])
    known = powers[np.isfinite(powers)]
    with styled():
        ratio: dict[str, Any] = {"sharex": True, "height_ratios": [2.2, 1]}
        figure, axes = new(
            1 + several, 1, (WIDTH, 5.6 if several else 4.2), squeeze=False, **(ratio if several else {})
        )
        top, low = axes[0, 0], axes[-1, 0]
        x_scale = mark(low.xaxis, first.key, first.values, first.logarithmic)
        y_scale = scale("mean power", table.unit_names.power, known)
        for number, curves in enumerate(groups.values()):
            for engine, rows in curves.items():
                style = _style(engine, table, number, len(groups), len(rows))
                x = np.array([float(row[first.key]) for row in rows]) / x_scale
                power, error = _powers(rows, y_scale.factor)
                _stated_error(top, engine, x, power, rows, y_scale.factor, style)
                look = style if number == 0 else style | {"label": "_"}
                curve(top, x, power, error, look, MARKERS.get(engine, "o"))
                _failed(top, x, power, style["color"])
            if several:
                _ratios(low, table, curves, reference, x_scale, (number, len(groups)))
        top.set_ylabel(broken(y_scale.label, 44))
        if len(known) and 0.0 < 5.0 * known.min() < known.max() < 1e9 * known.min():
            logarithm(top.yaxis)
        if several:
            low.set_ylabel(f"power over\nthat of {reference}")
            low.axhline(1.0, color="0.6", linewidth=0.8, zorder=0)
            _widen(low)
        entitle(figure, title, "Mean power")
        legend(figure, _note(table, len(found)), _markers(groups))
    return figure


def _groups(table: SweepShape) -> dict[str, dict[str, Rows]]:
    """Sort rows along the first key into curves: for each value of the other keys, and each engine."""
    first, others = table.axes[0], () if table.listed else table.axes[1:]
    found: dict[tuple[str, ...], dict[str, Rows]] = {}
    for row in table.rows:
        found.setdefault(tuple(row[a.key] for a in others), {}).setdefault(row["engine"], []).append(row)
    curves = {}
    for group, of_engine in found.items():
        told = []
        for a, value in zip(others, group, strict=True):
            name, unit = quantity(a.key)
            told.append(f"{name.split(' = ')[0]} {plain(float(value))} {written(unit)}".rstrip())
        for rows in of_engine.values():
            rows.sort(key=lambda row: float(row[first.key]))
        curves[", ".join(told)] = {name: rows[:: -(-len(rows) // MOST_SHOWN)] for name, rows in of_engine.items()}
    return curves


def _style(engine: str, table: SweepShape, number: int, groups: int, points: int) -> dict[str, Any]:
    """The style of an engine's curve, paler for each next value of the other keys; scattered points have no line."""
    style = dict(STYLES.get(engine, {"label": engine, "color": "0.3"}))
    style["color"] = paler(style["color"], _SPREAD * number)
    if points == 1 or (table.listed and len(table.axes) > 1):
        style |= {"linestyle": "none", "marker": MARKERS.get(engine, "o"), "markersize": 5}
    elif groups > 1:
        style |= {"marker": _GROUPS[number], "markersize": 3.5, "markevery": max(1, points // 15)}
        if style.get("linestyle") == "none":
            style["markersize"] = 5
    return style


def _number(row: dict[str, str], name: str) -> float:
    return float(row[name]) if row[name] else np.nan


def _powers(rows: Rows, unit: float) -> tuple[Floats, Floats]:
    """Mean powers, and 1.96 standard errors of each: 95 % where samples are many (0: the engine samples nothing)."""
    power = np.array([_number(row, "mean_power") for row in rows]) / unit
    error = NORMAL_QUANTILE * np.nan_to_num([_number(row, "mean_power_stderr") for row in rows]) / unit
    return power, error


def _stated_error(
    axes: Axes, engine: str, x: Floats, power: Floats, rows: Rows, unit: float, style: dict[str, Any]
) -> None:
    """Draw the error that `averaged` states of its model, as a band."""
    if engine != "averaged" or (len(x) > 1 and style["linestyle"] == "none"):
        return
    bias = np.nan_to_num([_number(row, "mean_power_bias") for row in rows]) / unit
    if len(x) == 1:
        axes.errorbar(x, power, bias, fmt="none", ecolor=style["color"], elinewidth=1.0)
    axes.fill_between(x, power - bias, power + bias, color=style["color"], alpha=0.2, linewidth=0, zorder=1.8)


def _failed(axes: Axes, x: Floats, power: Floats, colour: Any) -> None:
    at = x[~np.isfinite(power)]
    if len(at):  # an empty line that is not clipped upsets the layout
        look: dict[str, Any] = {"color": colour, "transform": axes.get_xaxis_transform(), "clip_on": False, "zorder": 5}
        axes.plot(at, np.zeros(len(at)), "x", **look)


def _ratios(
    low: Axes, table: SweepShape, curves: dict[str, Rows], reference: str, x_scale: float, place: tuple[int, int]
) -> None:
    """Draw each engine's mean power over the reference's at the same point, with the errors of both."""

    def at(row: dict[str, str]) -> tuple[str, ...]:
        return tuple(row[a.key] for a in table.axes)

    base = {at(row): row for row in curves.get(reference, []) if row["mean_power"]}
    for engine, rows in curves.items():
        here = [row for row in rows if at(row) in base]
        if engine == reference or not here:
            continue
        style = _style(engine, table, *place, len(here))
        x = np.array([float(row[table.axes[0].key]) for row in here]) / x_scale
        (power, error), (over, its) = _powers(here, 1.0), _powers([base[at(row)] for row in here], 1.0)
        ratio = _relative(power, over)
        spread = np.abs(ratio) * np.hypot(np.nan_to_num(_relative(error, power)), np.nan_to_num(_relative(its, over)))
        curve(low, x, ratio, np.nan_to_num(spread), style | {"label": "_"}, MARKERS.get(engine, "o"))


def _relative(values: Floats, by: Floats) -> Floats:
    """Values divided by others; nan where these are 0."""
    quotients: Floats = np.divide(values, by, out=np.full(len(values), np.nan), where=by != 0.0)
    return quotients


def _widen(low: Axes) -> None:
    """Choose the axis of ratios: a close look where all are near 1, else one from 0."""
    near, far = low.dataLim.y0, low.dataLim.y1
    if not (np.isfinite([near, far]).all() and near > 0.5 and far < 1.5):
        low.set_ylim(0.0, None)
    elif far - near < 0.02:
        low.set_ylim(min(near, 0.99), max(far, 1.01))


def _markers(groups: dict[str, Any]) -> list[Line2D]:
    """One legend entry for each value of the other keys."""
    if len(groups) < 2:
        return []
    look: dict[str, Any] = {"linestyle": "none", "markersize": 4}
    return [
        Line2D([], [], color=paler("0.2", _SPREAD * n), marker=_GROUPS[n], label=label, **look)
        for n, label in enumerate(groups)
    ]


def _note(table: SweepShape, groups: int) -> str:
    """The note under the legend: what the error bars are, what is not shown, what failed."""
    notes = []
    if any(row["mean_power_stderr"] for row in table.rows):
        alone = max(len([row for row in table.rows if row["engine"] == e]) for e in {r["engine"] for r in table.rows})
        what = "Bars" if alone <= MOST_BARS * groups else "Bands"
        notes.append(f"{what}: 1.96 standard errors (near 95 %); of a ratio, those of both.")
    scattered = table.listed and len(table.axes) > 1
    if scattered:
        notes.append("The other keys differ from point to point.")
    if not scattered and any(row["engine"] == "averaged" and row["mean_power_bias"] for row in table.rows):
        notes.append("Pale green: the error that averaged states.")
    if any(row["engine"] == "published" for row in table.rows):
        notes.append("published states no error.")
    failed = sum(bool(row["error"]) for row in table.rows)
    if failed:
        notes.append(f"Crosses on the axis: {failed} of {len(table.rows)} rows failed.")
    if groups > MOST_CURVES:
        notes.append(f"The first {MOST_CURVES} of {groups} values of the other keys.")
    return " ".join(notes)
