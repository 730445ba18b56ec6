"""The figure of a charging study: the voltage with its band, who has arrived, and the power on the way."""

from typing import Any

from harvester.figures.quantities import scale
from harvester.figures.shapes import ChargingShape
from harvester.figures.style import WIDTH, Plot, entitle, legend, new, styled

_INK, _PALE, _TARGET, _POWER = "#0072B2", "#9ecae9", "#D55E00", "#009E73"


def charging(answer: ChargingShape, title: str | None) -> Plot:
    """Draw the voltage over time, beside it the share of runs that have reached the target, and the store's power."""
    of, several = answer.unit_names, answer.stderr is not None
    known = [one for one in answer.levels if one.power is not None]
    time = scale("time from empty", of.time, answer.t)
    volt = scale(answer.probe, answer.unit, [*answer.quantiles[1], answer.target])
    with styled():
        figure, axes = new(1, 3 if known else 2, (WIDTH, 3.2), width_ratios=[1.6, 1, 1] if known else [1.6, 1])
        curve, share = axes[:2]
        t = answer.t / time.factor
        if several:
            low, high = (one / volt.factor for one in answer.quantiles)
            curve.fill_between(t, low, high, color=_PALE, linewidth=0, label="5 to 95 % of the runs")
        curve.plot(t, answer.voltage / volt.factor, color=_INK, label="mean" if several else "the run")
        look: dict[str, Any] = {"color": _TARGET, "linewidth": 1.0, "linestyle": (0, (5, 2))}
        curve.axhline(answer.target / volt.factor, **look, label="target")
        if answer.time is not None:
            error, at = answer.time.known_error95 / time.factor, answer.time.value / time.factor
            y = answer.target / volt.factor
            curve.errorbar([at], [y], xerr=[error], fmt="o", color=_TARGET, zorder=4, label="mean time to the target")
        curve.set_xlim(0.0, t[-1])
        curve.set_ylim(min(0.0, float(answer.quantiles[0].min()) / volt.factor), None)
        curve.set_xlabel(time.label)
        curve.set_ylabel(volt.label)
        share.step(t, 100.0 * answer.arrived, color=_INK, where="post", linewidth=1.0)
        share.set_xlim(0.0, t[-1])
        share.set_ylim(-3.0, 103.0)
        share.set_xlabel(time.label)
        share.set_ylabel("runs that have reached it (%)")
        if known:
            _draw_power(axes[2], answer, volt.factor, volt.label)
        entitle(figure, title, "Charging from empty")
        legend(figure, "Bars: 95 % sampling and step, as far as they are known.")
    return figure


def _draw_power(axes: Any, answer: ChargingShape, factor: float, label: str) -> None:
    """Draw the mean power between the levels against the voltage midway."""
    middles, values = [], []
    below = 0.0
    for one in answer.levels:
        if one.power is not None:
            middles.append(0.5 * (below + one.voltage) / factor)
            values.append(one.power)
        below = one.voltage
    watt = scale("power into the store", answer.unit_names.power, [one.value for one in values])
    heights, errors = ([getattr(one, name) / watt.factor for one in values] for name in ("value", "known_error95"))
    axes.errorbar(middles, heights, errors, fmt=".-", color=_POWER, linewidth=1.0)
    axes.set_xlabel(label)
    axes.set_ylabel(watt.label)
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)
