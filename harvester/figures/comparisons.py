"""The figure of a comparison: each engine's power with its error, and V of one path from three sources."""

from typing import Any

from harvester.figures.quantities import scale
from harvester.figures.shapes import ComparisonShape, EstimateShape
from harvester.figures.style import INK, MARKERS, STYLES, WIDTH, Plot, entitle, legend, new, styled

_SHOWN = 40.0  # 1/w0 of the path


def comparison(result: ComparisonShape, title: str | None) -> Plot:
    """Draw each engine's power with its whole error, and V of one path from three sources, with and without the stop.

    The axis of the powers need not begin at zero: what is compared is differences and errors.
    """
    paths, height = len(result.paths), 0.7 + 0.32 * len(result.estimates)
    with styled():
        size = (WIDTH, 1.0 + height + 1.9 * paths)
        figure, axes = new(1 + paths, 1, size, squeeze=False, height_ratios=[height, *paths * [1.9]])
        powers = axes[0, 0]
        x = scale("mean power", result.estimates[0].unit_names.power, [e.mean_power.value for e in result.estimates])
        values = [e.mean_power.value for e in result.estimates]
        for place, estimate in enumerate(result.estimates):
            look = {"color": STYLES[estimate.engine]["color"], "marker": MARKERS[estimate.engine], "markersize": 6}
            bars = {"markeredgecolor": INK, "ecolor": INK, "capsize": 3, "linestyle": "none", "zorder": 3}
            error = estimate.mean_power.error95 / x.factor
            powers.errorbar(estimate.mean_power.value / x.factor, place, xerr=error or None, **look, **bars)
            text = f"{estimate.mean_power.value / x.factor:.4g}" + (f" ± {error:.2g}" if error else "")
            left = _relative_place(estimate.mean_power.value, values) > 0.6
            where: dict[str, Any] = {"xytext": (-9 if left else 9, 9), "ha": "right" if left else "left"}
            at = (estimate.mean_power.value / x.factor, place)
            powers.annotate(text, at, textcoords="offset points", va="center", fontsize=8, **where)
        powers.set_yticks(range(len(result.estimates)), [_label(e) for e in result.estimates])
        powers.set_ylim(len(result.estimates) - 0.5, -0.5)
        powers.margins(x=0.1)
        powers.set_xlabel(f"{x.label}; bars: 95 % sampling + step + model, as far as stated")
        powers.grid(visible=False, axis="y")
        for panel, path in zip(axes[1:, 0], result.paths, strict=True):
            shown = path.t > path.t[-1] - _SHOWN
            t = path.t[shown]
            published, spice = STYLES["published"], STYLES["spice"]["color"]
            look = {"color": published["color"], "linestyle": published["linestyle"], "linewidth": 1.1}
            panel.plot(t, path.decoupled[shown], **look, label="published: V decoupled from x and x'")
            panel.plot(t, path.exact[shown], color=STYLES["ensemble"]["color"], linewidth=4, label="exact RC update")
            panel.plot(t, path.spice[shown], color=spice, linewidth=1, label="ngspice")
            text = f"decoupled off by {path.decoupled_error:.0%} RMS, ngspice by {path.spice_error:.1g} of the exact"
            panel.set_title(f"One path {path.title}: {text}")
            panel.set_ylabel("voltage V\n(nondimensional)")
            panel.set_xlim(t[0], t[-1])
        if paths:
            axes[-1, 0].set_xlabel("time ω0 t (nondimensional)")
        entitle(figure, title, "Engines side by side")
        legend(figure)
    return figure


def _relative_place(value: float, values: list[float]) -> float:
    """Where a value lies between the smallest of all (0) and the largest (1)."""
    room = max(values) - min(values)
    return (value - min(values)) / room if room > 0.0 else 0.0


def _label(estimate: EstimateShape) -> str:
    """The label of an engine, which says so where there is no error to draw."""
    return estimate.engine if estimate.mean_power.error95 else f"{estimate.engine}\n(error not known)"
