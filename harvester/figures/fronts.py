"""The figure of a front: the largest power for each value of another quantity."""

from collections.abc import Sequence

from harvester.figures.quantities import scale
from harvester.figures.style import WIDTH, entitle, legend, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.optimum.pareto_front import FrontPoint, ParetoFront

_INK = "#0072B2"
LEAST = 1e-6  # of the power: an error that can be seen


def front(answer: ParetoFront, title: str | None) -> Plot:
    """Draw the power of each design against its other quantity, joined in their order."""
    x = scale(
        answer.quantity.replace("_", " "), answer.unit, [point.quantity for point in answer.points]
    )
    y = scale(
        "largest mean power",
        answer.unit_names.power,
        [point.mean_power.value for point in answer.points],
    )
    at, heights, bars, wide = _numbers(answer.points, x.factor, y.factor)
    seen = max(bars) > LEAST * max(map(abs, heights))
    with styled():
        figure, axes = new(1, 1, (WIDTH, 3.6))
        axes.errorbar(
            at, heights, bars if seen else None, fmt="o-", color=_INK, markersize=4, linewidth=1.0
        )
        if any(wide):
            axes.errorbar(at, heights, xerr=wide, fmt="none", ecolor=_INK, elinewidth=0.8)
        if answer.alike:
            style = {"color": "0.6", "markersize": 3, "linewidth": 0.8, "zorder": 1}
            alike = _numbers(answer.alike, x.factor, y.factor)
            axes.errorbar(*alike, fmt="o", label="indistinguishable from the front", **style)
        axes.set_xlabel(x.label)
        axes.set_ylabel(y.label)
        axes.margins(0.05, 0.08)
        entitle(figure, title, f"How much power for which {answer.quantity.replace('_', ' ')}?")
        legend(figure, "Bars: 95 % of the errors, as far as stated." if seen else "")
    return figure


def _numbers(designs: Sequence[FrontPoint], x: float, y: float) -> tuple[list[float], ...]:
    """The quantities, powers, and errors of powers and of quantities of designs, in units of ``x`` and ``y``."""
    powers = [(point.mean_power.value / y, point.mean_power.known_error95 / y) for point in designs]
    rows = [
        (p.quantity / x, *power, (p.quantity_error95 or 0.0) / x)
        for p, power in zip(designs, powers, strict=True)
    ]
    return tuple(map(list, zip(*rows, strict=True)))
