"""The figure of a sweep: mean power along one key, and ratios of the engines' powers."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.arrays import Floats
from harvester.figures.quantities import broken, logarithm, mark, quantity, scale
from harvester.figures.style import MOST_BARS, WIDTH, curve, entitle, legend, new
from harvester.figures.sweep_curves import (
    MOST_CURVES,
    VISIBLE,
    Levels,
    Rows,
    groups,
    legend_lines,
    style,
)
from harvester.presentation.engine_look import look as look_of
from harvester.presentation.plot import Plot, styled
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.uncertainty.value import Value


def sweep(table: SweepTable, title: str | None) -> Plot:
    """Draw the mean power, a curve for each engine (and value of the other keys), with errors.

    Crosses are failures.

    Below, with several engines, the power over that of an engine that samples, at the same point.
    A list of points of several keys is markers without a line.  For a long curve every n-th point
    is drawn, at most `MOST_SHOWN`.
    """
    curve_axis = table.curve_axis
    engines = list(table.engines)
    curves_of = groups(table)
    shown = dict(list(curves_of.items())[:MOST_CURVES])
    several = len(engines) > 1
    reference = max(engines, key=lambda engine: look_of(engine).trust)
    known = np.array([row.mean_power.value for row in table.rows if row.mean_power is not None])
    with styled():
        ratio: dict[str, Any] = {"sharex": True, "height_ratios": [2.2, 1]}
        figure, axes = new(
            1 + several,
            1,
            (WIDTH, 4.2 + 1.4 * several),
            squeeze=False,
            **(ratio if several else {}),
        )
        top = axes[0, 0]
        low = axes[-1, 0]
        x_scale = mark(low.xaxis, curve_axis.key, curve_axis.values, curve_axis.logarithmic)
        y_scale = scale("mean power", table.unit_names.power, known)
        for number, curves in enumerate(shown.values()):
            for engine, rows in curves.items():
                look = style(engine, table, number, len(shown), len(rows))
                x = np.array([row.varied[curve_axis.key] for row in rows]) / x_scale
                levels = Levels.of(rows, y_scale.factor)
                _draw(top, engine, x, levels, look | ({"label": "_"} if len(shown) > 1 else {}))
                _failed(top, x, levels.power, look["color"])
            if several:
                _ratios(low, table, curves, reference, x_scale, number=number, groups=len(shown))
        top.set_ylabel(broken(y_scale.label, 44))
        if len(known) and 0.0 < 5.0 * known.min() < known.max() < 1e9 * known.min():
            logarithm(top.yaxis)
        if several:
            low.set_ylabel(f"power over\nthat of {reference}")
            low.axhline(1.0, color="0.6", linewidth=0.8, zorder=0)
            _widen(low)
        entitle(figure, title, f"Mean power against {quantity(curve_axis.key)[0].split(' = ')[0]}")
        legend(
            figure,
            _note(table, len(curves_of)),
            legend_lines(shown, engines, len(curve_axis.values)),
            beside="A ratio has the errors of both engines." if several else "",
        )
    return figure


def _draw(axes: Axes, engine: str, x: Floats, levels: Levels, look: dict[str, Any]) -> None:
    """Draw a curve with bars of sampling and step, and a band of the error that a formula states of its model."""
    if levels.has_band:
        _band(axes, x, levels.power, levels.model, look)
    curve(axes, x, levels.power, levels.sampling + levels.step, look, look_of(engine).marker)


def _band(axes: Axes, x: Floats, middle: Floats, error: Floats, look: dict[str, Any]) -> None:
    """Draw an error that is stated rather than sampled as a pale band.

    For a single point as a bar.
    """
    if len(x) > 1 and look["linestyle"] == "none":
        return
    if len(x) == 1:
        axes.errorbar(x, middle, error, fmt="none", ecolor=look["color"], elinewidth=1.0)
    axes.fill_between(
        x, middle - error, middle + error, color=look["color"], alpha=0.2, linewidth=0, zorder=1.8
    )


def _failed(axes: Axes, x: Floats, power: Floats, colour: Any) -> None:
    at = x[~np.isfinite(power)]
    if len(at):  # an empty line that is not clipped upsets the layout
        look: dict[str, Any] = {
            "color": colour,
            "transform": axes.get_xaxis_transform(),
            "clip_on": False,
            "zorder": 5,
        }
        axes.plot(at, np.zeros(len(at)), "x", **look)


def _ratios(
    low: Axes,
    table: SweepTable,
    curves: dict[str, Rows],
    reference: str,
    x_scale: float,
    number: int,
    groups: int,
) -> None:
    """Draw each engine's mean power over the reference's at the same point, with the errors of both.

    If the reference states an error without sampling, that is a band around 1.
    """

    def at(row: SweepRow) -> tuple[float, ...]:
        return tuple(row.varied[a.key] for a in table.axes)

    base = {at(row): row for row in curves.get(reference, []) if row.mean_power is not None}
    for engine, rows in curves.items():
        here = [row for row in rows if at(row) in base]
        if not here:
            continue
        look = style(engine, table, number, groups, len(here)) | {"label": "_"}
        x = np.array([row.varied[table.curve_axis.key] for row in here]) / x_scale
        ratio = Levels.of(here, 1.0).over(Levels.of([base[at(row)] for row in here], 1.0))
        if engine != reference:
            _draw(low, engine, x, ratio, look)
        elif ratio.has_band:
            _band(low, x, ratio.power, ratio.model, look)


def _widen(low: Axes) -> None:
    """Choose the axis of ratios: a close look if all are near 1, else one from 0."""
    near, far = low.dataLim.y0, low.dataLim.y1
    if not (np.isfinite([near, far]).all() and near > 0.5 and far < 1.5):
        low.set_ylim(0.0, None)
    elif far - near < 0.02:
        low.set_ylim(min(near, 0.99), max(far, 1.01))


def _note(table: SweepTable, groups: int) -> str:
    """The note under the legend: the meaning of the error bars, omitted curves, failed points."""
    notes = list(_error_notes(table, groups))
    if table.listed and len(table.axes) > 1:
        notes.append("The other keys differ from point to point.")
    failed = sum(row.mean_power is None for row in table.rows)
    if failed:
        notes.append(f"Crosses on the axis: {failed} of {len(table.rows)} rows failed.")
    if groups > MOST_CURVES:
        notes.append(f"The first {MOST_CURVES} of {groups} values of the other keys.")
    return " ".join(notes)


def _error_notes(table: SweepTable, groups: int) -> Iterator[str]:
    """The meaning of bars and bands, and the engines without a known total error."""
    powers = [(row.engine, row.mean_power) for row in table.rows if row.mean_power is not None]
    if any(power.stderr is not None for _, power in powers):
        points = Counter(engine for engine, _ in powers)
        what = "Bars" if max(points.values()) <= MOST_BARS * groups else "Bands"
        yield f"{what}: 95 % interval of sampling and time step."
    stated = _engines(
        powers, lambda p: p.stderr is None and p.known_error95 > VISIBLE * abs(p.value)
    )
    if stated and not (table.listed and len(table.axes) > 1):
        yield f"Pale band: the error stated by {stated}."
    if unknown := _engines(powers, lambda power: power.error95 is None):
        yield f"The error of {unknown} is known in part."


def _engines(powers: Sequence[tuple[str, Value]], which: Callable[[Value], bool]) -> str:
    """The engines with a power of a kind, in words, each once."""
    return " and ".join(dict.fromkeys(engine for engine, power in powers if which(power)))
