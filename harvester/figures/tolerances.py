"""The figure of a study of tolerances: how the power scatters, and the effect of each key."""

import textwrap

import numpy as np
from matplotlib.axes import Axes

from harvester.figures.quantities import Scale, mark, quantity, scale, written
from harvester.figures.style import INK, WIDTH, entitle, legend, new
from harvester.presentation.engine_look import look as look_of
from harvester.presentation.plot import Plot, styled
from harvester.studies.tolerance.tolerance_result import ToleranceResult, TornadoBar
from harvester.uncertainty.value import Value

_BAR = "#56B4E9"
_LIMIT = "#D55E00"
_PALE = "#DCEBF7"
_MOST_BINS, _LETTERS = 60, 26


def tolerance(answer: ToleranceResult, title: str | None) -> Plot:
    """Draw a histogram of the powers with quantiles and limits over the tornado.

    For one key the power along it.
    """
    power = scale("mean power", answer.unit_names.power, answer.power)
    keys = len(answer.tornado)
    with styled():
        if len(answer.spreads) == 1:
            figure, axes = new(1, 2, (WIDTH, 3.8), sharey=True, width_ratios=[1.0, 1.5])
            _histogram(axes[0], answer, power, "horizontal")
            _over_key(axes[1], answer, power)
        else:
            heights = [2.2, 0.9 + 0.52 * keys] if keys else [1.0]
            size = (WIDTH, 1.2 + sum(heights))
            figure, axes = new(
                len(heights), 1, size, sharex=True, squeeze=False, height_ratios=heights
            )
            _histogram(axes[0, 0], answer, power, "vertical")
            if keys:
                _tornado(axes[1, 0], answer, power)
            axes[-1, 0].set_xlabel(power.label)
        entitle(figure, title, "How does the mean power scatter from device to device?")
        shares = (
            "Percent: fraction of the variance, alone."
            if answer.sensitivity and len(answer.spreads) > 1
            else ""
        )
        legend(figure, f"{len(answer.power)} devices by {answer.engine}.", beside=shares)
    return figure


def _histogram(here: Axes, answer: ToleranceResult, unit: Scale, way: str) -> None:
    """Draw how many devices have which power, with upright bars or (way "horizontal") lying ones."""
    colour = look_of(answer.engine).colour
    lying = way == "horizontal"
    bins = int(np.clip(np.sqrt(len(answer.power)), 8, _MOST_BINS))
    here.hist(answer.power / unit.factor, bins=bins, color=colour, alpha=0.5, orientation=way)  # type: ignore[arg-type]
    line = here.axhline if lying else here.axvline
    marks = {
        0.05: (":", "5 % and 95 % of devices are below"),
        0.5: ("--", "median"),
        0.95: (":", "_"),
    }
    for share, (dash, label) in marks.items():
        if share in answer.quantiles:
            line(
                answer.quantiles[share].value / unit.factor, color=INK, linestyle=dash, label=label
            )
    for limit in answer.limits:
        if limit.quantity == "mean_power":
            line(limit.bound / unit.factor, color=_LIMIT, linewidth=1.8, label="limit of the power")
    if lying:
        here.set_ylabel(unit.label)
        here.set_xlabel("devices")
    else:
        here.set_ylabel("devices")


def _over_key(here: Axes, answer: ToleranceResult, unit: Scale) -> None:
    """Draw the power over the one key, with its error, and the range of 5 to 95 % of the devices."""
    key = answer.spreads[0].key
    order = np.argsort(answer.samples[:, 0])
    values = answer.samples[order, 0]
    power = answer.power[order] / unit.factor
    by = mark(here.xaxis, key, values, False)
    for bar in answer.tornado:
        here.axvspan(
            bar.ends[0] / by,
            bar.ends[1] / by,
            color=_PALE,
            zorder=0,
            label="5 to 95 % of the devices",
        )
    colour = look_of(answer.engine).colour
    here.plot(values / by, power, color=colour, label="mean power")
    if answer.off:
        error = answer.off * np.abs(power)
        label = "its error, 95 %"
        here.fill_between(
            values / by,
            power - error,
            power + error,
            color=colour,
            alpha=0.25,
            linewidth=0,
            label=label,
        )


def _tornado(here: Axes, answer: ToleranceResult, unit: Scale) -> None:
    """Draw the range of 5 to 95 % of the powers with one key alone, and the powers at the key's 5 and 95 % points."""
    bars = list(reversed(answer.tornado))
    for k, bar in enumerate(bars):
        low, high = (quantile / unit.factor for quantile in bar.quantiles)
        first = k == len(bars) - 1
        here.barh(
            k,
            high - low,
            left=low,
            color=_BAR,
            height=0.55,
            label="this key alone: 5 to 95 %" if first else "_",
        )
        for side, form in ((0, "<"), (1, ">")):
            label = ("at the key's 5 % point", "at its 95 % point")[side] if first else "_"
            look = {
                "color": "white",
                "markeredgecolor": INK,
                "markersize": 6.0,
                "linestyle": "none",
            }
            here.plot([bar.powers[side] / unit.factor], [k], marker=form, label=label, **look)  # type: ignore[arg-type]
        share = answer.sensitivity.get(bar.key)
        if share is not None:
            text = f"{100.0 * share.first:.0f} %" + " of\nthe variance" * first
            here.annotate(
                text,
                (1.0, k),
                (4, 0),
                ("axes fraction", "data"),
                "offset points",
                va="center",
                fontsize=9,
            )
    nominal = float(np.median(answer.power)) if answer.nominal is None else answer.nominal
    here.axvline(nominal / unit.factor, color=INK, linewidth=0.8, zorder=0)
    here.set_yticks(range(len(bars)), [_named(bar) for bar in bars])
    here.set_ylim(-0.6, len(bars) - 0.4)
    here.grid(visible=False, axis="y")


def _named(bar: TornadoBar) -> str:
    """The name of a key, and below it the 5 % and 95 % points of its spread."""
    name, unit = quantity(bar.key)
    low, high = (written(Value(end).format("" if unit == "SI" else unit)) for end in bar.ends)
    return f"{textwrap.shorten(name, _LETTERS, placeholder=' ...')}\n{low} to {high}"
