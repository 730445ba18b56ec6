"""The figure of one trajectory: over time, in the phase plane, and how it spends its time."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from harvester.arrays import Floats
from harvester.figures.quantities import Scale, broken, scale
from harvester.figures.style import WIDTH, entitle, legend, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.motion import Motion

_INK, _PALE = "#0072B2", "0.72"
_STOP: dict[str, Any] = {"color": "#D55E00", "linewidth": 1.0, "linestyle": (0, (5, 2))}
_MOST = 4000  # points of a line
_PROBES = 4  # that are drawn
_DOTS = 20_000  # of the phase plane
_BINS = 80  # of a density
_STILL = 1e-9  # relative differences of a quantity that stands still
_ROUNDING = 1e-12  # of the terminals' voltage
_GOLDEN = 0.6180339887498949  # multiples of it, less whole numbers, lie evenly without a period
# attributes of a trajectory that are drawn
_ATTRIBUTES = ("displacement", "voltage", "acceleration", "velocity", "time")
_ROUND = [1, 2, 2.5, 5, 10]  # times a power of ten: steps between ticks


@dataclass(frozen=True)
class _Drawn:
    """A path as it is drawn: values over their scales, and the places of its readings."""

    path: Motion
    scales: dict[str, Scale]
    values: dict[str, Floats]
    probes: list[str]
    stops: list[float]

    @staticmethod
    def of(path: Motion) -> "_Drawn":
        """The trajectory, with the scales of the part that is shown."""
        u = path.unit_names
        probes = list(path.probes)[:_PROBES]
        units = {"displacement": u.length, "voltage": u.voltage, "acceleration": u.acceleration}
        units |= {"velocity": u.speed, "time": u.time}
        names = {name: name for name in (*_ATTRIBUTES, *probes)} | {
            "acceleration": "base acceleration"
        }
        names["acceleration"] += " but its white noise" if path.hides_noise else ""
        units |= {name: path.probe_units[name] for name in probes}
        values = {name: array for name in _ATTRIBUTES if (array := getattr(path, name)) is not None}
        values |= {
            name: _but_rounding(path.probes[name], path, units[name] == u.voltage)
            for name in probes
        }
        last = path.time >= path.time[-1] - path.shown
        parts = {name: array[last] for name, array in values.items()} | {"time": path.time[-1:]}
        scales = {name: scale(names[name], units[name], part) for name, part in parts.items()}
        shown = {name: array / scales[name].factor for name, array in values.items()}
        return _Drawn(
            path,
            scales,
            shown,
            probes,
            [stop / scales["displacement"].factor for stop in path.stops],
        )

    @property
    def end(self) -> float:
        """When the trajectory ends."""
        return float(self.path.time[-1])

    @property
    def from_rest(self) -> bool:
        """Whether all of it is shown: a beginning, which has no density."""
        return self.path.shown > 0.999 * self.end

    @property
    def over_time(self) -> list[str]:
        """The quantities drawn over time."""
        return [
            *(name for name in ("displacement", "voltage", "acceleration") if name in self.values),
            *self.probes,
        ]


def motion(path: Motion, title: str | None) -> Plot:
    """Draw displacement, voltage and probes, phase plane and densities; stops are dashed lines."""
    drawn = _Drawn.of(path)
    rows = len(drawn.over_time)
    with styled():
        figure, axes = new(rows, 2, (WIDTH, 1.9 * rows + 0.5), width_ratios=[2.0, 1])
        _over_time(axes[:, 0], drawn)
        _impacts_and_stops(axes[0, 0], drawn)
        _phase_plane(axes[0, 1], drawn)
        _densities(axes[1:, 1], drawn)
        for column, most in ((axes[:, 0], 5), (axes[:, 1], 2)):
            for here in column:
                here.yaxis.set_major_locator(MaxNLocator(4, steps=_ROUND))
                here.xaxis.set_major_locator(
                    MaxNLocator(most, steps=_ROUND) if most > 2 else MaxNLocator(most)
                )
        entitle(figure, title, "One trajectory over time")
        rest = "." if drawn.from_rest else ", used for the densities."
        legend(
            figure,
            beside=f"Phase plane: the end of the trajectory, in grey its last three quarters{rest}",
        )
    return figure


def _over_time(column: Any, drawn: _Drawn) -> None:
    """Draw each quantity over the part of the time that is shown."""
    path = drawn.path
    end = drawn.end
    t = drawn.scales["time"]
    last = path.time >= end - path.shown
    thin = slice(None, None, max(1, int(last.sum()) // _MOST))
    for here, name in zip(column, drawn.over_time, strict=True):
        here.plot(
            drawn.values["time"][last][thin],
            drawn.values[name][last][thin],
            color=_INK,
            linewidth=0.8,
        )
        here.set_ylabel(broken(drawn.scales[name].label, 20).replace(" (", "\n("))
        here.set_xlim((end - path.shown) / t.factor, end / t.factor)
        here.tick_params(labelbottom=False)
    column[-1].tick_params(labelbottom=True)
    column[-1].set_xlabel(t.label)


def _impacts_and_stops(here: Any, drawn: _Drawn) -> None:
    """Mark the impacts and the stops next to the displacement."""
    hits = drawn.path.impacts[drawn.path.impacts[:, 0] >= drawn.end - drawn.path.shown]
    if drawn.stops and 0 < len(hits) <= _MOST:
        at = np.where(hits[:, 1] > 0.0, drawn.stops[0], drawn.stops[-1])
        look = {"color": _STOP["color"], "linestyle": "none", "markersize": 2.5, "label": "impacts"}
        here.plot(hits[:, 0] / drawn.scales["time"].factor, at, "o", **look)
    name = "stop" if len(drawn.stops) == 1 else "stops"
    for number, stop in enumerate(drawn.stops):
        here.axhline(stop, **_STOP, label="_" if number else name)


def _phase_plane(plane: Any, drawn: _Drawn) -> None:
    """Draw velocity over displacement: in grey the earlier path, and its end as a line."""
    x = drawn.values["displacement"]
    v = drawn.values["velocity"]
    path = drawn.path
    dots: dict[str, Any] = {
        "markersize": 0.8,
        "markeredgewidth": 0,
        "color": _PALE,
        "rasterized": True,
    }
    plane.plot(*_between(path, 0.25 * drawn.end, x, v), ".", zorder=1, **dots)
    few = path.time >= drawn.end - 0.15 * path.shown
    plane.plot(x[few], v[few], color=_INK, linewidth=0.7)
    plane.set_xlabel(drawn.scales["displacement"].label)
    plane.set_ylabel(drawn.scales["velocity"].label)
    for stop in drawn.stops:
        plane.axvline(stop, **_STOP)


def _densities(column: Any, drawn: _Drawn) -> None:
    """Draw how often displacement, voltage and probes have each value, unless it is from rest."""
    if drawn.from_rest:
        for here in column:
            here.remove()
        return
    others = ["displacement", *["voltage"] * (drawn.path.acceleration is not None), *drawn.probes]
    settled = drawn.path.time >= 0.25 * drawn.end
    for here, name in zip(column, others, strict=True):
        _density(here, drawn.values[name][settled], drawn.scales[name].label)
    for stop in drawn.stops:
        column[0].axvline(stop, **_STOP)


def _but_rounding(probe: Floats, path: Motion, of_voltage: bool) -> Floats:
    """A probe, or zeros if all of it is the rounding error of a difference of two nodes' voltages.

    Such as the output of a chip that does not run yet: femtovolts on an axis of its own would look
    like a signal.
    """
    quiet = of_voltage and np.max(np.abs(probe)) <= _ROUNDING * np.max(np.abs(path.voltage))
    return np.zeros_like(probe) if quiet else probe


def _between(path: Motion, start: float, x: Floats, v: Floats) -> tuple[Floats, Floats]:
    """At most `_DOTS` places after the time ``start``, at times without a common period, so that they make no spokes.

    They lie on the lines between readings; none is used if an impact turned the velocity
    between two readings.
    """
    count = min(int(np.sum(path.time >= start)), _DOTS)
    at = start + (path.time[-1] - start) * ((np.arange(count) * _GOLDEN) % 1.0)
    before = np.searchsorted(path.time, at)
    hits = np.sort(path.impacts[:, 0])
    clear = np.searchsorted(hits, path.time[before]) == np.searchsorted(
        hits, path.time[np.maximum(before - 1, 0)]
    )
    return np.interp(at[clear], path.time, x), np.interp(at[clear], path.time, v)


def time_spent(values: Floats, edges: Floats) -> Floats:
    """The fraction of time, shape (n - 1,), that a path spends between edges of shape (n,), as a density.

    The trajectory is straight from reading to reading, so that readings at the same few phases of a
    period leave no gaps.
    """
    low, high = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
    width = np.maximum(high - low, 1e-12 * (edges[-1] - edges[0]))
    below = np.array([np.mean(np.clip((edge - low) / width, 0.0, 1.0)) for edge in edges])
    below[-1] = 1.0  # the last edge is the largest value itself
    shares: Floats = np.diff(below) / np.diff(edges)
    return shares


def bins(values: Floats) -> Floats:
    """The edges of the density's bins, shape (n + 1,): from the least to the largest value.

    For a value constant up to rounding they lie about it, half as far as it is from zero.
    """
    low, high = float(values.min()), float(values.max())
    size = max(abs(low), abs(high))
    if high - low <= _STILL * size:
        low = low - 0.5 * (size or 1.0)
        high = high + 0.5 * (size or 1.0)
    return np.linspace(low, high, _BINS + 1)


def _density(here: Any, values: Floats, label: str) -> None:
    """Draw the frequency of each value, as a density whose integral is 1."""
    edges = bins(values)
    here.stairs(time_spent(values, edges), edges, fill=True, color=_PALE)
    here.set_xlabel(label)
    unit = label[label.rindex("(") + 1 : -1]
    here.set_ylabel(
        "density (nondimensional)" if "nondimensional" in unit else f"density (1/{unit})"
    )
