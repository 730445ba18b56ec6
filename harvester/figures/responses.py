"""The figure of a frequency response."""

from typing import Any

import numpy as np

from harvester.figures.quantities import scale
from harvester.figures.shapes import ResponseShape
from harvester.figures.style import WIDTH, Plot, curve, entitle, legend, new, styled

_LOOKS: dict[str, dict[str, Any]] = {
    "up": {"color": "#0072B2", "marker": ">", "linestyle": "-", "linewidth": 1.0},
    "down": {"color": "#D55E00", "marker": "<", "linestyle": (0, (4, 2)), "linewidth": 1.0, "markerfacecolor": "white"},
}


def response(answer: ResponseShape, title: str | None) -> Plot:
    """Draw power and RMS voltage against the frequency, up and down, with a bar for each half-power bandwidth."""
    f = np.array([p.frequency for p in answer.sweep("up")])
    units = answer.unit_names
    hertz = scale("drive frequency" if units.frequency else "drive frequency Ω", units.frequency, f)
    powers = {d: [p.mean_power for p in answer.sweep(d)] for d in _LOOKS}
    volts = {d: [p.voltage_rms for p in answer.sweep(d)] for d in _LOOKS}
    with styled():
        figure, (top, low) = new(2, 1, (WIDTH, 5.6), sharex=True)
        named = (("mean power", powers, units.power), ("RMS voltage", volts, units.voltage))
        for axes, (name, values, unit) in zip((top, low), named, strict=True):
            y = scale(name, unit, [v.value for of in values.values() for v in of])
            for direction, look in _LOOKS.items():
                error = np.array([v.error95 for v in values[direction]]) / y.factor
                style = look | {"label": f"{direction} the frequencies", "markersize": 3 if len(f) < 200 else 0}
                curve(axes, f / hertz.factor, np.array([v.value for v in values[direction]]) / y.factor, error, style)
                edges = answer.edges(direction)
                if axes is top and edges is not None:
                    half = 0.5 * answer.peak(direction).mean_power.value / y.factor
                    bar: dict[str, Any] = {"linewidth": 3.5, "alpha": 0.5, "color": look["color"]}
                    at = [e / hertz.factor for e in edges]
                    top.plot(at, [half, half], **bar, label=f"half-power bandwidth, {direction}")
            axes.set_ylabel(y.label)
            axes.set_ylim(0.0, None)
        low.set_xlabel(hertz.label)
        entitle(figure, title, "Frequency response")
        legend(figure, "Bars: 95 % sampling and step." if any(v.error95 for of in powers.values() for v in of) else "")
    return figure
