"""The figure of one path: over time, in the phase plane, and how it spends its time."""

from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from harvester.arrays import Floats
from harvester.figures.quantities import broken, scale
from harvester.figures.shapes import MotionShape
from harvester.figures.style import WIDTH, Plot, entitle, legend, new, styled

_INK, _PALE = "#0072B2", "0.72"
_STOP: dict[str, Any] = {"color": "#D55E00", "linewidth": 1.0, "linestyle": (0, (5, 2))}
_MOST = 4000  # points of a line
_PROBES = 4  # that are drawn
_DOTS = 20_000  # of the phase plane
_BINS = 80  # of a density
_STILL = 1e-9  # relative differences of a quantity that stands still
_ROUNDING = 1e-12  # of the terminals' voltage
_GOLDEN = 0.6180339887498949  # multiples of it, less whole numbers, lie evenly without a period
_ROUND = [1, 2, 2.5, 5, 10]  # times a power of ten: steps between ticks


def motion(path: MotionShape, title: str | None) -> Plot:
    """Draw displacement, voltage and probes of the part shown, phase plane and densities; stops are dashed lines."""
    end = float(path.t[-1])
    last, settled = path.t >= end - path.shown, path.t >= 0.25 * end
    few = path.t >= end - 0.15 * path.shown
    thin = slice(None, None, max(1, int(last.sum()) // _MOST))
    u = path.unit_names
    units = {"x": u.length, "voltage": u.voltage, "acceleration": u.acceleration, "v": u.speed, "t": u.time}
    names = {"x": "displacement", "voltage": "voltage", "acceleration": "base acceleration", "v": "velocity"}
    names["t"] = "time"
    names["acceleration"] += " but its white noise" if path.hides_noise else ""
    from_rest = path.shown > 0.999 * end  # a beginning, which has no density
    probes = list(path.probes)[:_PROBES]
    values = {name: array for name in names if (array := getattr(path, name)) is not None}
    values |= {name: _but_rounding(path.probes[name], path, path.probe_units[name] == u.voltage) for name in probes}
    names, units = names | {name: name for name in probes}, units | {name: path.probe_units[name] for name in probes}
    scales = {
        name: scale(names[name], units[name], [end] if name == "t" else array[last]) for name, array in values.items()
    }
    shown = {name: array / scales[name].factor for name, array in values.items()}
    in_time = [*(name for name in ("x", "voltage", "acceleration") if name in values), *probes]
    stops = [stop / scales["x"].factor for stop in path.stops]
    with styled():
        figure, axes = new(len(in_time), 2, (WIDTH, 1.9 * len(in_time) + 0.5), width_ratios=[2.0, 1])
        for here, name in zip(axes[:, 0], in_time, strict=True):
            here.plot(shown["t"][last][thin], shown[name][last][thin], color=_INK, linewidth=0.8)
            here.set_ylabel(broken(scales[name].label, 20).replace(" (", "\n("))
            here.set_xlim((end - path.shown) / scales["t"].factor, end / scales["t"].factor)
        for here in axes[:-1, 0]:
            here.tick_params(labelbottom=False)
        axes[-1, 0].set_xlabel(scales["t"].label)
        hits = path.impacts[path.impacts[:, 0] >= end - path.shown]
        if 0 < len(hits) <= _MOST:
            at = np.where(hits[:, 1] > 0.0, stops[0], stops[-1])
            look = {"color": _STOP["color"], "linestyle": "none", "markersize": 2.5, "label": "impacts"}
            axes[0, 0].plot(hits[:, 0] / scales["t"].factor, at, "o", **look)
        for number, stop in enumerate(stops):
            axes[0, 0].axhline(stop, **_STOP, label="_" if number else "stop" if len(stops) == 1 else "stops")
        plane, density = axes[0, 1], axes[1, 1]
        dots: dict[str, Any] = {"markersize": 0.8, "markeredgewidth": 0, "color": _PALE, "rasterized": True}
        plane.plot(*_between(path, 0.25 * end, shown["x"], shown["v"]), ".", zorder=1, **dots)
        plane.plot(shown["x"][few], shown["v"][few], color=_INK, linewidth=0.7)
        plane.set_xlabel(scales["x"].label)
        plane.set_ylabel(scales["v"].label)
        for here in (plane,) if from_rest else (plane, density):
            for stop in stops:
                here.axvline(stop, **_STOP)
        for here in axes.flat:
            here.yaxis.set_major_locator(MaxNLocator(4, steps=_ROUND))
        for here in axes[:, 0]:
            here.xaxis.set_major_locator(MaxNLocator(6, steps=_ROUND))
        for here in axes[:, 1]:
            here.xaxis.set_major_locator(MaxNLocator(3))
        others = ["x", *probes] if path.acceleration is None else ["x", "voltage", *probes]
        for here, name in zip(axes[1:, 1], others, strict=True):
            if from_rest:
                here.remove()
                continue
            _density(here, shown[name][settled], scales[name].label)
        entitle(figure, title, "One path")
        note = (
            "Phase plane: the end of the path, and in grey the last three quarters of it, which the densities are of."
        )
        legend(figure, note.partition(", which")[0] + "." if from_rest else note)
    return figure


def _but_rounding(probe: Floats, path: MotionShape, of_voltage: bool) -> Floats:
    """A probe, or zeros where all of it is what rounding leaves of a difference of two nodes' voltages.

    Such as the output of a chip that does not run yet: femtovolts on an axis of its own would look like a signal.
    """
    quiet = of_voltage and np.max(np.abs(probe)) <= _ROUNDING * np.max(np.abs(path.voltage))
    return np.zeros_like(probe) if quiet else probe


def _between(path: MotionShape, start: float, x: Floats, v: Floats) -> tuple[Floats, Floats]:
    """At most `_DOTS` places after the time ``start``, at times without a common period, so that they make no spokes.

    They lie on the lines between readings; none is taken where an impact turned the velocity between two readings.
    """
    count = min(int(np.sum(path.t >= start)), _DOTS)
    at = start + (path.t[-1] - start) * ((np.arange(count) * _GOLDEN) % 1.0)
    before = np.searchsorted(path.t, at)
    hits = np.sort(path.impacts[:, 0])
    clear = np.searchsorted(hits, path.t[before]) == np.searchsorted(hits, path.t[np.maximum(before - 1, 0)])
    return np.interp(at[clear], path.t, x), np.interp(at[clear], path.t, v)


def time_spent(values: Floats, edges: Floats) -> Floats:
    """The share of time, shape (n - 1,), that a path spends between edges of shape (n,), as a density.

    The path goes straight from reading to reading, so that readings at the same few phases of a period leave no gaps.
    """
    low, high = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
    width = np.maximum(high - low, 1e-12 * (edges[-1] - edges[0]))
    below = np.array([np.mean(np.clip((edge - low) / width, 0.0, 1.0)) for edge in edges])
    below[-1] = 1.0  # the last edge is the largest value itself
    shares: Floats = np.diff(below) / np.diff(edges)
    return shares


def bins(values: Floats) -> Floats:
    """The edges of the density's bins, shape (n + 1,): from the least to the largest value.

    Of what stands still but for rounding they lie about it, half as far as it is from zero.
    """
    low, high = float(values.min()), float(values.max())
    size = max(abs(low), abs(high))
    if high - low <= _STILL * size:
        low, high = low - 0.5 * (size or 1.0), high + 0.5 * (size or 1.0)
    return np.linspace(low, high, _BINS + 1)


def _density(here: Any, values: Floats, label: str) -> None:
    """Draw how often each value is taken, as a density whose integral is 1."""
    edges = bins(values)
    here.stairs(time_spent(values, edges), edges, fill=True, color=_PALE)
    here.set_xlabel(label)
    unit = label[label.rindex("(") + 1 : -1]
    here.set_ylabel("density (nondimensional)" if "nondimensional" in unit else f"density (1/{unit})")
