"""The pictures of the page (Bokeh): power over the slider, the orbit, and the voltage against time."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from bokeh.core.properties import value
from bokeh.models import (
    ColumnDataSource,
    CustomJSTickFormatter,
    HoverTool,
    Legend,
    LegendItem,
    Span,
)
from bokeh.plotting import figure

from harvester.arrays import Floats
from harvester.explore.live import FORMULAS, Live, PowerCurve, engineering
from harvester.explore.runs import POINTS
from harvester.explore.slider_scale import Slide
from harvester.explore.texts import unit_on_page
from harvester.presentation.engine_look import look as look_of
from harvester.quantities.units import SYMBOLS

# matplotlib's letter of an engine's marker -> the name of Bokeh; an engine with another letter gets
# circles
_MARKERS = {
    "o": "circle",
    "s": "square",
    "D": "diamond",
    "*": "star",
    "X": "x",
    "P": "plus",
    "^": "triangle",
}
_MARKERS |= {"h": "hex", "v": "inverted_triangle", "p": "hex_dot"}
_DASH = 1.5  # a dash, in those of matplotlib
_INK = "#3a434d"
_GRID = "#e6e9ec"
_GHOST = "#9aa4af"
_NEAREST, _REFERENCE = (
    {"line_width": 2.4, "line_alpha": 1.0},
    {"line_width": 1.2, "line_alpha": 0.5},
)
_EARLIER = 0.3  # opacity of a curve that is of the sliders' place before, until it is computed anew
# of the axis of power, times a power of ten
_ENDS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
JOINED = 3  # points of one design that are joined
_TICK_FORMAT = """
const size = Math.abs(tick);
if (size == 0) return "0";
const names = {"-15": "f", "-12": "p", "-9": "n", "-6": "µ", "-3": "m", "0": "", "3": "k", "6": "M", "9": "G"};
let power = 3 * Math.floor(Math.log10(size) / 3 + 1e-9);
power = Math.max(-15, Math.min(9, power));
return parseFloat((tick / 10 ** power).toPrecision(4)) + names[power];
"""


def _plain(**options: Any) -> Any:
    """A figure in the look of the page."""
    plot = figure(
        toolbar_location=None,
        tools="",
        min_border_right=14,
        **{"sizing_mode": "stretch_width", **options},
    )
    plot.outline_line_color = None
    plot.background_fill_alpha = plot.border_fill_alpha = 0.0
    for axis in plot.axis:
        axis.axis_line_color = axis.major_tick_line_color = "#b6bec6"
        axis.minor_tick_line_color = None
        axis.major_label_text_color = axis.axis_label_text_color = _INK
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size, axis.major_label_text_font_size = "13px", "12px"
    for grid in plot.grid:
        grid.grid_line_color = _GRID
    return plot


def _dashes(line: Any) -> Any:
    """The line style of an engine in the words of Bokeh."""
    return "solid" if line == "-" else [round(_DASH * part) for part in line[1]]


class PowerPlot:
    """Mean power over a key: the formulas' curves, their stated errors, runs with error bars, and a pinned design."""

    def __init__(self, key: str, slide: Slide) -> None:
        by_ratio = slide.by_ratio and slide.sign > 0.0
        ends = {"x_range": slide.ends, "y_range": (0.0, 1.0)}
        self.plot = _plain(
            x_axis_type="log" if by_ratio else "linear",
            name="power",
            sizing_mode="stretch_both",
            **ends,
        )
        self.key, self.slide = key, slide
        name = key.rpartition(".")[2].replace("_", " ")
        unit = unit_on_page(key).replace("ohm", "Ω")
        self.plot.xaxis.axis_label = f"{name} ({unit})" if unit else name
        if by_ratio:
            self.plot.xaxis.formatter = CustomJSTickFormatter(code=_TICK_FORMAT)
            if (
                1.0 < math.log10(slide.high / slide.low) < 2.0
            ):  # where Bokeh has even ones, too near at the end
                low = math.floor(math.log10(slide.low))
                self.plot.xaxis.ticker = [
                    size * 10.0 ** (low + k) for k in range(4) for size in (1.0, 2.0, 5.0)
                ]
        self.power = 0
        self.ghost = self.plot.line(
            "x",
            "y",
            source=_nothing("ghost", "xy"),
            color=_GHOST,
            line_width=3,
            line_dash=[1, 4],
            line_cap="round",
        )
        self.curves: dict[str, Any] = {}
        self.joined: dict[str, Any] = {}
        items = []
        for engine in reversed(FORMULAS):
            source = _nothing(f"curve-{engine}", ("x", "y", "low", "high"))
            colour = look_of(engine).colour
            self.plot.varea("x", "low", "high", source=source, color=colour, alpha=0.15)
            look = {"color": colour, "line_width": 2.4, "line_dash": _dashes(look_of(engine).line)}
            self.curves[engine] = self.plot.line("x", "y", source=source, name=engine, **look)
            items.append(LegendItem(label=engine, renderers=[self.curves[engine]]))
        for engine in POINTS:
            marker = _MARKERS.get(look_of(engine).marker, "circle")
            source = _nothing(f"runs-{engine}", ("x", "y", "low", "high", "alpha"))
            look = {"color": look_of(engine).colour, "alpha": "alpha"}
            self.plot.segment("x", "low", "x", "high", source=source, line_width=2, **look)
            joined = _nothing(f"joined-{engine}", "xy")
            self.joined[engine] = self.plot.line(
                "x", "y", source=joined, color=look_of(engine).colour, line_width=2.4
            )
            dots = self.plot.scatter(
                "x", "y", source=source, size=9, marker=marker, name=engine, **look
            )
            self.curves[engine] = dots
            items.append(LegendItem(label=engine, renderers=[dots]))
        items.append(LegendItem(label="pinned", renderers=[self.ghost]))
        for item in items:
            item.visible = False
        self.items = {item.label.value: item for item in items}  # by what they are called at first
        dashed = {"line_color": _INK, "line_dash": [3, 3], "line_width": 1}
        self.here = Span(location=1.0, dimension="height", name="here", **dashed)
        self.plot.add_layout(self.here)
        self._add_legend(items)
        for name, renderer in self.curves.items():
            tip = [(name, "@y{0.0000}"), ("at", "@x{0.000a}")]
            self.plot.add_tools(HoverTool(renderers=[renderer], tooltips=tip, mode="mouse"))

    def _add_legend(self, items: list[LegendItem]) -> None:
        legend = Legend(
            items=items, orientation="horizontal", border_line_color=None, background_fill_alpha=0.0
        )
        legend.label_text_color = _INK
        legend.label_text_font_size = "12px"
        legend.spacing = 10
        legend.padding = 2
        legend.margin = 2
        legend.glyph_width = 24
        self.plot.add_layout(legend, "above")

    def show(
        self, live: Live, runs: list[dict[str, Any]], pinned: tuple[Floats, Floats] | None
    ) -> None:
        """Draw the curves, the runs (x, y, error, engine, own) and the pinned design's (x, y), all in one unit."""
        tops = [float(curve.power.max()) for curve in live.curves.values()] + [
            run["y"] + run["error"] for run in runs
        ]
        tops += [float(pinned[1].max())] if pinned else []
        self.power = engineering(tops)
        unit = f"{SYMBOLS[self.power].replace('u', 'µ')}W" if live.problem.physical else ""
        scaled = 10.0**self.power
        digits = "" if live.problem.physical or self.power == 0 else f"10^{self.power}, "
        self.plot.yaxis.axis_label = f"mean power ({unit or digits + 'nondimensional'})"
        self._show_curves(live, pinned, scaled)
        self._show_runs(runs, scaled)
        self.here.location = live.at
        top = max(filter(math.isfinite, tops), default=0.0)
        self.plot.y_range.end = axis_end(top / scaled, self.plot.y_range.end)

    def _show_curves(self, live: Live, pinned: tuple[Floats, Floats] | None, scaled: float) -> None:
        """Draw the formulas' curves, and that of the pinned design, over ``scaled``."""
        best = next((name for name in FORMULAS if name in live.curves), "")
        for engine in FORMULAS:
            curve = None if live.instead and engine != best else live.curves.get(engine)
            _put(self.curves[engine].data_source, _columns(curve, scaled))
            look = _REFERENCE if live.instead else _NEAREST
            faint = {"line_alpha": _EARLIER} if engine in live.earlier else {}
            self.curves[engine].glyph.update(**look | faint)
            self.items[engine].visible = curve is not None
            self.items[engine].label = value(
                f"a resistor instead ({engine})" if live.instead else engine
            )
        drawn = (
            {"x": [], "y": []}
            if pinned is None
            else {"x": pinned[0].tolist(), "y": (pinned[1] / scaled).tolist()}
        )
        _put(self.ghost.data_source, drawn)
        self.items["pinned"].visible = pinned is not None

    def _show_runs(self, runs: list[dict[str, Any]], scaled: float) -> None:
        """Draw the runs of each engine with their errors; paler those of another scene."""
        for engine in POINTS:
            mine = [run for run in runs if run["engine"] == engine]
            y, error = (
                np.array([run[name] for run in mine], dtype=float) / scaled
                for name in ("y", "error")
            )
            data = {
                "x": np.array([run["x"] for run in mine]),
                "y": y,
                "low": y - error,
                "high": y + error,
            }
            lists = {name: column.tolist() for name, column in data.items()}
            _put(
                self.curves[engine].data_source,
                lists | {"alpha": [1.0 if run["own"] else 0.3 for run in mine]},
            )
            points = sorted((run["x"], run["y"] / scaled) for run in mine if run["own"])
            drawn = points if len(points) >= JOINED else []
            _put(
                self.joined[engine].data_source,
                {"x": [x for x, _ in drawn], "y": [y for _, y in drawn]},
            )
            self.items[engine].visible = bool(mine)


def _nothing(name: str, columns: Iterable[str]) -> ColumnDataSource:
    """A source of data that has none yet."""
    return ColumnDataSource({column: [] for column in columns}, name=name)


def _put(source: ColumnDataSource, data: dict[str, Any]) -> None:
    """Show other data, of lists; nothing is sent if they are the same."""
    if source.data != data:
        source.data = data


def axis_end(top: float, now: float) -> float:
    """The end of an axis from 0 that shows ``top``: the one that it has ``now`` while that fits, else a round number.

    A curve then moves before a fixed scale, and the browser need not set the axis anew at
    every step.
    """
    if not top > 0.0:
        return 1.0
    if 0.5 * now <= top <= 0.97 * now:
        return now
    size = 10.0 ** math.floor(math.log10(top))
    return next(end * size for end in (*_ENDS, 12.0) if 1.04 * top <= end * size)


def _columns(curve: PowerCurve | None, scaled: float) -> dict[str, Any]:
    """A curve as lists: each array would be two messages of its own on the websocket."""
    if curve is None:
        return {"x": [], "y": [], "low": [], "high": []}
    columns = {
        "x": curve.x,
        "y": curve.power / scaled,
        "low": curve.low / scaled,
        "high": curve.high / scaled,
    }
    return {name: column.tolist() for name, column in columns.items()}


def pinned_curve(live: Live, runs: list[dict[str, Any]]) -> tuple[Floats, Floats] | None:
    """The power of a pinned design over the key: that of the engine nearest to the truth, or a circuit's own ``runs``.

    Never the curve of a resistor in a circuit's place; None if nothing is known yet.
    """
    if not live.instead:
        curve = next((live.curves[name] for name in FORMULAS if name in live.curves), None)
        return None if curve is None else (curve.x, curve.power)
    points = sorted((run["x"], run["y"]) for run in runs if run["own"])
    return (np.array([x for x, _ in points]), np.array([y for _, y in points])) if points else None


class PathPlots:
    """One trajectory: the orbit in the phase plane, and the voltage against time."""

    def __init__(self) -> None:
        self.orbit = _plain(name="orbit", height=300, x_range=(-1.0, 1.0), y_range=(-1.0, 1.0))
        self.voltage = _plain(name="voltage", height=300, x_range=(0.0, 1.0), y_range=(-1.0, 1.0))
        lines = (self.orbit, "x", "v", "spice", 1.1), (self.voltage, "t", "V", "averaged", 1.4)
        self.orbit_line, self.voltage_line = (
            plot.line(
                x,
                y,
                source=_nothing(plot.name, x + y),
                color=look_of(like).colour,
                line_width=width,
            )
            for plot, x, y, like, width in lines
        )
        self.stops = [
            Span(dimension="height", line_color=_INK, line_width=3, visible=False) for _ in range(2)
        ]
        for stop in self.stops:
            self.orbit.add_layout(stop)

    def show(self, path: dict[str, Any]) -> None:
        """Draw a path as `harvester.explore.in_worker.path` gives it."""
        physical = path["physical"]
        scales = {name: engineering(path[name]) if physical else 0 for name in ("x", "v", "V", "t")}
        units = dict(zip(scales, ("m", "m/s", "V", "s"), strict=True))
        drawn = {name: np.asarray(path[name]) / 10.0**power for name, power in scales.items()}

        def named(what: str, name: str) -> str:
            return (
                f"{what} ({SYMBOLS[scales[name]].replace('u', 'µ')}{units[name]})"
                if physical
                else what
            )

        self.orbit_line.data_source.data = {"x": drawn["x"], "v": drawn["v"]}
        self.voltage_line.data_source.data = {"t": drawn["t"], "V": drawn["V"]}
        for plot, x, y in (
            (self.orbit, drawn["x"], drawn["v"]),
            (self.voltage, drawn["t"], drawn["V"]),
        ):
            for ends, values in ((plot.x_range, x), (plot.y_range, y)):
                low, high = float(values.min()), float(values.max())
                room = 0.05 * (high - low) or 1.0
                ends.update(
                    start=low - room * (values is not drawn["t"]),
                    end=high + room * (values is not drawn["t"]),
                )
        self.orbit.xaxis.axis_label, self.orbit.yaxis.axis_label = (
            named("displacement", "x"),
            named("velocity", "v"),
        )
        self.voltage.xaxis.axis_label, self.voltage.yaxis.axis_label = (
            named("time", "t"),
            named("voltage", "V"),
        )
        for stop, position in zip(self.stops, [*path["stops"], math.nan, math.nan], strict=False):
            stop.visible = math.isfinite(position)
            stop.location = position / 10.0 ** scales["x"] if math.isfinite(position) else 0.0
