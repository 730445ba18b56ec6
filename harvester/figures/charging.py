"""The figure of a charging study: voltage with its band, runs that arrived, charging power."""

from typing import Any

from harvester.figures.quantities import Scale, amount, scale
from harvester.figures.style import WIDTH, entitle, legend, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.charging.answer import ChargingResult

_INK = "#0072B2"
_PALE = "#9ecae9"
_TARGET = "#D55E00"
_POWER = "#009E73"
_SEEN = 0.01  # of a value: a shorter bar is hidden by its mark


def charging(answer: ChargingResult, title: str | None) -> Plot:
    """Draw the voltage over time; for several runs the fraction at the target, and the power."""
    of = answer.unit_names
    several = answer.stderr is not None
    known = [level for level in answer.levels if level.power is not None]
    time = scale("time from empty", of.time, answer.t)
    volt = scale(_called(answer), answer.unit, [*answer.quantiles[1], answer.target])
    panels = 1 + several + bool(known)
    with styled():
        figure, axes = new(
            max(1, panels - 1), min(panels, 2), (WIDTH, 3.4 if panels < 3 else 5.6), squeeze=False
        )
        first, *others = axes.ravel()
        if panels == 3:  # the voltage takes the whole of the first row
            others = [axes[1, 0], axes[1, 1]]
            axes[0, 1].remove()
            if first.figure is figure:
                first.set_subplotspec(first.get_gridspec()[0, :])
        _draw_voltage(first, answer, time, volt)
        if several:
            share = others.pop(0)
            t = answer.t / time.factor
            share.step(t, 100.0 * answer.arrived, color=_INK, where="post", linewidth=1.0)
            share.set_xlim(0.0, t[-1])
            share.set_ylim(-3.0, 103.0)
            share.set_xlabel(time.label)
            share.set_ylabel("runs at the target (%)")
        if known:
            _draw_power(others[0], answer, volt.factor, volt.label)
        entitle(figure, title, f"How long until {amount(answer.target, answer.unit)}?")
        powers = [level.power for level in known if level.power is not None]
        errors = [*powers, *([answer.time] if answer.time is not None else [])]
        seen = any(number.known_error95 > _SEEN * abs(number.value) for number in errors)
        legend(figure, "Bars: 95 % sampling and step, as far as they are known." if seen else "")
    return figure


def _called(answer: ChargingResult) -> str:
    """The probe as an axis names it: a node by its measured quantity, an expression unchanged."""
    kind = {"V": "voltage of ", "A": "current of ", "W": "power of "}.get(answer.unit, "")
    return answer.probe if "(" in answer.probe else f"{kind}{answer.probe}"


def _draw_voltage(curve: Any, answer: ChargingResult, time: Scale, volt: Scale) -> None:
    """Draw the probe over time with its band, the target, and when it is reached."""
    t = answer.t / time.factor
    several = answer.stderr is not None
    if several:
        low, high = (quantile / volt.factor for quantile in answer.quantiles)
        curve.fill_between(t, low, high, color=_PALE, linewidth=0, label="5 to 95 % of the runs")
    curve.plot(t, answer.voltage / volt.factor, color=_INK, label="mean" if several else "the run")
    look: dict[str, Any] = {"color": _TARGET, "linewidth": 1.0, "linestyle": (0, (5, 2))}
    curve.axhline(answer.target / volt.factor, **look, label="target")
    if answer.time is not None:
        error, at = answer.time.known_error95 / time.factor, answer.time.value / time.factor
        y = answer.target / volt.factor
        reached = amount(answer.time.value, answer.unit_names.time)
        label = f"{'mean time to the target' if several else 'reached after'}: {reached}"
        curve.errorbar([at], [y], xerr=[error], fmt="o", color=_TARGET, zorder=4, label=label)
    curve.set_xlim(0.0, t[-1])
    curve.set_ylim(min(0.0, float(answer.quantiles[0].min()) / volt.factor), None)
    curve.set_xlabel(time.label)
    curve.set_ylabel(volt.label)


def _draw_power(axes: Any, answer: ChargingResult, factor: float, label: str) -> None:
    """Draw the mean power between the levels against the voltage midway."""
    middles, powers = [], []
    below = 0.0
    for level in answer.levels:
        if level.power is not None:
            middles.append(0.5 * (below + level.voltage) / factor)
            powers.append(level.power)
        below = level.voltage
    watt = scale("charging power", answer.unit_names.power, [power.value for power in powers])
    heights, errors = (
        [getattr(power, name) / watt.factor for power in powers]
        for name in ("value", "known_error95")
    )
    axes.errorbar(middles, heights, errors, fmt=".-", color=_POWER, linewidth=1.0)
    axes.set_xlabel(label)
    axes.set_ylabel(watt.label)
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)
