"""The figure of a frequency response."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.figures.quantities import scale
from harvester.figures.shapes import ResponseShape
from harvester.figures.style import MOST_BARS, WIDTH, Plot, curve, entitle, legend, new, styled
from harvester.uncertainty.value import Value

_LOOKS: dict[str, dict[str, Any]] = {
    "up": {"color": "#0072B2", "marker": ">", "linestyle": "-", "linewidth": 1.0},
    "down": {"color": "#D55E00", "marker": "<", "linestyle": (0, (4, 2)), "linewidth": 1.0, "markerfacecolor": "white"},
}
_SEEN = 0.01  # of the largest value: a shorter error bar is hidden by a marker
_ALIKE = 0.003  # of the largest value: closer curves are one line


def response(answer: ResponseShape, title: str | None) -> Plot:
    """Draw power and RMS voltage against the frequency, with a bar for each half-power bandwidth.

    Up and down are one curve where they cannot be told apart.
    """
    f = np.array([p.frequency for p in answer.sweep("up")])
    units = answer.unit_names
    hertz = scale("drive frequency" if units.frequency else "drive frequency Ω", units.frequency, f)
    powers = {d: [p.mean_power for p in answer.sweep(d)] for d in _LOOKS}
    volts = {d: [p.voltage_rms for p in answer.sweep(d)] for d in _LOOKS}
    alike = all(_alike(values["up"], values["down"]) for values in (powers, volts))
    with styled():
        figure, (top, low) = new(2, 1, (WIDTH, 5.6), sharex=True)
        named = (("mean power", powers, units.power), ("RMS voltage", volts, units.voltage))
        for axes, (name, values, unit) in zip((top, low), named, strict=True):
            y = scale(name, unit, [v.value for of in values.values() for v in of])
            for direction in ("up",) if alike else _LOOKS:
                look = dict(_LOOKS[direction]) | {"label": f"{direction} the frequencies"}
                if alike:
                    look |= {"label": "up and down the frequencies, alike", "marker": "o"}
                look["markersize"] = 3 if len(f) < 200 else 0
                error = np.array([v.error95 for v in values[direction]]) / y.factor
                curve(axes, f / hertz.factor, np.array([v.value for v in values[direction]]) / y.factor, error, look)
                if axes is top:
                    _bandwidth(top, answer, direction, y.factor, hertz.factor, alike)
            axes.set_ylabel(y.label)
            axes.set_ylim(0.0, None)
        low.set_xlabel(hertz.label)
        entitle(figure, title, "Frequency response")
        legend(figure, _note(powers, len(f)))
    return figure


def _bandwidth(top: Axes, answer: ResponseShape, direction: str, watts: float, hertz: float, alike: bool) -> None:
    """Draw the half-power bandwidth as a wide pale bar at half the largest power, if it is within the sweep."""
    edges = answer.edges(direction)
    if edges is None:
        return
    half = 0.5 * answer.peak(direction).mean_power.value / watts
    bar: dict[str, Any] = {
        "linewidth": 3.5,
        "alpha": 0.5,
        "color": _LOOKS[direction]["color"],
        "solid_capstyle": "butt",
    }
    label = "half-power bandwidth" + ("" if alike else f", {direction}")
    top.plot([edge / hertz for edge in edges], [half, half], **bar, label=label)


def _alike(one: list[Value], other: list[Value]) -> bool:
    """Whether two curves are closer everywhere than a line is wide."""
    a, b = (np.array([v.value for v in values]) for values in (one, other))
    return bool(np.max(np.abs(a - b)) <= _ALIKE * max(np.abs(a).max(), np.abs(b).max()))


def _note(powers: dict[str, list[Value]], points: int) -> str:
    """What the error bars are; their size where they are too small to be seen."""
    everything = [v for of in powers.values() for v in of]
    error, largest = max(v.error95 for v in everything), max(abs(v.value) for v in everything)
    if error == 0.0:
        return ""
    if error < _SEEN * largest:
        share = 100.0 * error / largest
        size = f"at most {share:.1g} % of the largest power" if share >= 0.001 else "below 0.001 % of the largest power"
        return f"Errors (95 % sampling and step) are {size}: too small to be seen."
    return f"{'Bars' if points <= MOST_BARS else 'Bands'}: 95 % sampling and step."
