"""The figure of a front: the largest power for each value of another quantity."""

from harvester.figures.quantities import scale
from harvester.figures.shapes import FrontShape
from harvester.figures.style import WIDTH, Plot, entitle, legend, new, styled

_INK = "#0072B2"
LEAST = 1e-6  # of the power: an error that can be seen


def front(answer: FrontShape, title: str | None) -> Plot:
    """Draw the power of each design against its other quantity, joined in their order."""
    values = [one.quantity for one in answer.points]
    powers = [one.mean_power for one in answer.points]
    x = scale(answer.quantity.replace("_", " "), answer.unit, values)
    y = scale("largest mean power", answer.unit_names.power, [one.value for one in powers])
    bars = [one.known_error95 / y.factor for one in powers]
    seen = max(bars) > LEAST * max(abs(one.value) for one in powers) / y.factor
    with styled():
        figure, axes = new(1, 1, (WIDTH, 3.6))
        at = [value / x.factor for value in values]
        heights = [one.value / y.factor for one in powers]
        axes.errorbar(at, heights, bars if seen else None, fmt="o-", color=_INK, markersize=4, linewidth=1.0)
        wide = [(one.quantity_error95 or 0.0) / x.factor for one in answer.points]
        if any(wide):
            axes.errorbar(at, heights, xerr=wide, fmt="none", ecolor=_INK, elinewidth=0.8)
        if answer.alike:
            of = [
                (
                    one.quantity / x.factor,
                    one.mean_power.value / y.factor,
                    one.mean_power.known_error95 / y.factor,
                    (one.quantity_error95 or 0.0) / x.factor,
                )
                for one in answer.alike
            ]
            style = {"color": "0.6", "markersize": 3, "linewidth": 0.8, "zorder": 1}
            axes.errorbar(*zip(*of, strict=True), fmt="o", label="cannot be told from the front", **style)
        axes.set_xlabel(x.label)
        axes.set_ylabel(y.label)
        axes.margins(0.05, 0.08)
        entitle(figure, title, "Power against " + answer.quantity.replace("_", " "))
        legend(figure, "Bars: 95 % of the errors, as far as stated." if seen else "")
    return figure
