"""The figure of a study of tolerances: the distribution of the power, the tornado, and the shares of the variance."""

import textwrap

import numpy as np
from matplotlib.axes import Axes

from harvester.figures.quantities import quantity, scale, written
from harvester.figures.shapes import ToleranceShape, TornadoShape
from harvester.figures.style import INK, WIDTH, Plot, entitle, legend, new, styled
from harvester.presentation.engine_look import look as look_of
from harvester.uncertainty.value import Value

_LOW, _HIGH, _LIMIT = "#56B4E9", "#E69F00", "#D55E00"
_MOST_BINS, _LETTERS = 60, 16


def tolerance(answer: ToleranceShape, title: str | None) -> Plot:
    """Draw a histogram of the powers with quantiles and limits, and for each key its bar and its shares."""
    shares = len(answer.sensitivity) > 0
    with styled():
        height = 3.8 + 0.5 * max(len(answer.spreads) - 3, 0)
        figure, axes = new(1, 3 if shares else 2, (WIDTH, height), squeeze=False)
        _histogram(axes[0, 0], answer)
        _tornado(axes[0, 1], answer)
        if shares:
            _shares(axes[0, 2], answer)
        entitle(figure, title, "Tolerances")
        legend(figure, "Bars of the shares: 95 % of their estimate and what the response surface does not explain.")
    return figure


def _histogram(here: Axes, answer: ToleranceShape) -> None:
    """Draw how many devices have which power."""
    unit = scale("mean power", answer.unit_names.power, answer.power)
    colour = look_of(answer.engine).colour
    bins = int(np.clip(np.sqrt(len(answer.power)), 8, _MOST_BINS))
    here.hist(answer.power / unit.factor, bins=bins, color=colour, alpha=0.7, label=f"samples by {answer.engine}")
    marks = {0.05: (":", "5 %, 95 % of devices below"), 0.5: ("--", "median"), 0.95: (":", "")}
    for share, (dash, label) in marks.items():
        if share in answer.quantiles:
            here.axvline(answer.quantiles[share].value / unit.factor, color=INK, linestyle=dash, label=label or None)
    for limit in answer.limits:
        if limit.quantity == "mean_power":
            here.axvline(limit.bound / unit.factor, color=_LIMIT, linewidth=1.8, label="limit of the power")
    here.set_xlabel(unit.label)
    here.set_ylabel("samples")


def _tornado(here: Axes, answer: ToleranceShape) -> None:
    """Draw the power with one key after the other at the ends of its spread."""
    unit = scale("power, one key alone", answer.unit_names.power, [*answer.power])
    bars = list(reversed(answer.tornado))
    nominal = float(np.median(answer.power)) if answer.nominal is None else answer.nominal
    for k, bar in enumerate(bars):
        for side, colour in ((0, _LOW), (1, _HIGH)):
            label = ("at its 5 % point", "at its 95 % point")[side] if k == 0 else None
            wide = (bar.powers[side] - nominal) / unit.factor
            here.barh(k, wide, left=nominal / unit.factor, color=colour, label=label, height=0.6)
    here.axvline(nominal / unit.factor, color=INK, linewidth=0.8)
    here.set_yticks(range(len(bars)), [_named(bar) for bar in bars])
    here.set_ylim(-0.6, len(bars) - 0.4)
    here.grid(visible=False, axis="y")
    here.set_xlabel(unit.label)


def _shares(here: Axes, answer: ToleranceShape) -> None:
    """Draw the shares of the variance in the order of the tornado."""
    keys = [bar.key for bar in reversed(answer.tornado) if bar.key in answer.sensitivity]
    at = np.arange(len(keys))
    for shift, name, colour in ((0.18, "first", "#0072B2"), (-0.18, "total", "#999999")):
        values = [getattr(answer.sensitivity[key], name) for key in keys]
        errors = [getattr(answer.sensitivity[key], f"{name}_error95") for key in keys]
        label = "share of the variance, alone" if name == "first" else "with all others"
        here.barh(at + shift, values, 0.34, xerr=errors, color=colour, ecolor=INK, capsize=2, label=label)
    here.set_yticks(at, [""] * len(keys))
    here.set_ylim(-0.6, len(keys) - 0.4)
    here.set_xlim(0.0, None)
    here.grid(visible=False, axis="y")
    here.set_xlabel("share of the variance")


def _named(bar: TornadoShape) -> str:
    """The name of a key over several lines, short enough for an axis, and the 5 % and 95 % points of its spread."""
    name, unit = quantity(bar.key)
    unit = "" if unit == "SI" else unit
    ends = [written(Value(end).format(unit)) for end in bar.ends]
    return "\n".join(
        [textwrap.fill(name, _LETTERS, max_lines=2, placeholder=" ..."), "5 to 95 %:", f"{ends[0]} to", ends[1]]
    )
