"""The figures of engines: errors of one answer, answers side by side, the cost of accuracy."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.figures.labels import Label, write_labels
from harvester.figures.quantities import Scale, logarithm, scale
from harvester.figures.style import INK, WIDTH, entitle, legend, new
from harvester.presentation.engine_look import look as look_of
from harvester.presentation.plot import Plot, styled
from harvester.studies.compare import Comparison, PathComparison
from harvester.studies.work_precision.cost_table import SHOWN, Cost
from harvester.uncertainty.value import Value, percent

_SHOWN = 0.4  # of the trajectory, its end
_LEDGER = "ledger_"
MOST_ENGINES = 6  # of the figure of costs
FARTHEST = 100.0  # times the longest measured time: predictions beyond it are in the table alone
_SEEN = 1e-5  # of the power: a smaller error is not written beside it
_HATCHES = {"sampling, 95 %": "", "step": "////", "model, estimated": "...."}


def estimate(answer: Estimate, title: str | None) -> Plot:
    """Draw bars of the mean power's errors in percent, and of the energy balance."""
    flows = {k.removeprefix(_LEDGER): v for k, v in answer.details.items() if k.startswith(_LEDGER)}
    flows.pop("residual", None)
    with styled():
        figure, axes = new(2 if flows else 1, 1, (WIDTH, 4.8 if flows else 2.6), squeeze=False)
        _errors(axes[0, 0], answer)
        if flows:
            here = axes[1, 0]
            x = scale("mean power", answer.unit_names.power, [*flows.values()])
            here.barh(
                [*flows],
                [v / x.factor for v in flows.values()],
                color="0.6",
                edgecolor=INK,
                linewidth=0.6,
            )
            here.axvline(0.0, color=INK, linewidth=0.6)
            here.invert_yaxis()
            here.set_xlabel(x.label)
            here.set_title("Power dissipated by element")
            here.grid(visible=False, axis="y")
        entitle(figure, title, f"How well does {answer.engine} know the mean power?")
    return figure


def _errors(here: Axes, answer: Estimate) -> None:
    """Draw the sampling errors, step and model as a bar each."""
    power = answer.mean_power
    parts = {
        "sampling, 95 %": power.stderr and power.sampling95,
        "step": power.bias,
        "model, estimated": power.model,
    }
    by = abs(power.value) / 100.0
    colour = look_of(answer.engine).colour
    for row, (name, error) in enumerate(parts.items()):
        if error is None or by == 0.0:
            absent = "none, or not known" if power.error95 is None else "none"
            text = absent if error is None else "the power is 0"
            here.annotate(
                text,
                (0.0, row),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=9,
                color="0.35",
            )
        else:
            here.barh(
                row,
                error / by,
                0.6,
                color=colour,
                edgecolor=INK,
                linewidth=0.6,
                hatch=_HATCHES[name],
            )
    here.set_yticks(range(len(parts)), [*parts])
    here.set_ylim(len(parts) - 0.5, -0.5)
    here.set_xlim(0.0, None if here.containers else 1.0)
    here.set_xlabel("mean-power error (%)")
    here.set_title(f"{in_words(power, answer.unit_names.power)}: the parts of its error")
    here.grid(visible=False, axis="y")


def comparison(answer: Comparison, title: str | None) -> Plot:
    """Draw each engine's power with its total error, and V of one trajectory from three sources.

    The axis of the powers need not begin at zero: differences and errors are compared.
    """
    estimates = answer.estimates
    paths = len(answer.paths)
    height = 0.7 + 0.34 * len(estimates)
    with styled():
        size = (WIDTH, 1.2 + height + 1.9 * paths)
        figure, axes = new(
            1 + paths, 1, size, squeeze=False, height_ratios=[height, *paths * [1.9]]
        )
        _powers(axes[0, 0], estimates)
        for panel, path in zip(axes[1:, 0], answer.paths, strict=True):
            _path(panel, path)
            panel.set_xlabel(panel.get_xlabel() if panel is axes[-1, 0] else "")
        entitle(figure, title, "Do the engines agree on the mean power?")
        legend(figure, "Bars of the power: 95 % sampling + step + model, as far as stated.")
    return figure


def _powers(powers: Axes, estimates: Sequence[Estimate]) -> None:
    """Draw each engine's mean power with its error, and write both next to it."""
    values = [e.mean_power.value for e in estimates]
    x = scale("mean power", estimates[0].unit_names.power, values)
    for row, answer in enumerate(estimates):
        look: Any = {
            "color": look_of(answer.engine).colour,
            "marker": look_of(answer.engine).marker,
        }
        bars: dict[str, Any] = {
            "markersize": 6,
            "markeredgecolor": INK,
            "ecolor": INK,
            "capsize": 3,
            "zorder": 3,
        }
        power = answer.mean_power.scaled(1.0 / x.factor)
        left = _relative_place(answer.mean_power.value, values) > 0.6
        powers.errorbar(
            power.value, row, xerr=power.known_error95 or None, linestyle="none", **look, **bars
        )
        where: dict[str, Any] = {
            "xytext": (-9 if left else 9, 9),
            "ha": "right" if left else "left",
            "fontsize": 9,
        }
        powers.annotate(
            _with_error(power), (power.value, row), textcoords="offset points", va="center", **where
        )
    powers.set_yticks(range(len(estimates)), [_label(e) for e in estimates])
    powers.set_ylim(len(estimates) - 0.5, -0.7)
    powers.margins(x=0.1)
    powers.set_xlabel(x.label)
    powers.grid(visible=False, axis="y")


def _with_error(power: Value) -> str:
    """A power with its total error to two digits.

    Without one if it is not known, or is too small next to it.
    """
    error = power.error95
    if error is None or error <= _SEEN * abs(power.value):
        return f"{power.value:.4g}"
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{power.value:.{digits}f} ± {error:.{digits}f}"


def in_words(power: Value, unit: str) -> str:
    """A power with its total error and its unit, such as "8.27 ± 0.23 µW"."""
    of = scale("", unit, [power.value]) if unit else Scale(1.0, "( )")
    return f"{_with_error(power.scaled(1.0 / of.factor))} {of.label[2:-1]}".rstrip()


def _path(panel: Axes, path: PathComparison) -> None:
    """Draw the end of one trajectory: V from ngspice, the exact update and the published theory."""
    shown = path.t > (1.0 - _SHOWN) * path.t[-1]
    clock = scale("time", path.unit_names.time, path.t[shown])
    volt = scale("voltage", path.unit_names.voltage, [*path.spice[shown], *path.decoupled[shown]])
    t = path.t[shown] / clock.factor
    published, spice, ensemble = map(look_of, ("published", "spice", "ensemble"))
    curves: dict[str, tuple[Floats, dict[str, Any]]] = {
        "published: V from x and x' alone": (
            path.decoupled,
            {"color": published.colour, "linestyle": published.line, "linewidth": 1.1},
        ),
        "exact RC update": (path.exact, {"color": ensemble.colour, "linewidth": 4}),
        "ngspice": (path.spice, {"color": spice.colour, "linewidth": 1}),
    }
    for label, (values, look) in curves.items():
        panel.plot(t, values[shown] / volt.factor, label=label, **look)
    errors = [percent(error, 1.0) for error in (path.decoupled_rms_error, path.spice_rms_error)]
    panel.set_title(
        f"One trajectory {path.title}: RMS error {errors[0]} published, {errors[1]} ngspice"
    )
    panel.set_ylabel(volt.label.replace(" (", "\n("))
    panel.set_xlim(t[0], t[-1])
    panel.set_xlabel(clock.label)


def _relative_place(value: float, values: list[float]) -> float:
    """The place of a value between the smallest of all (0) and the largest (1)."""
    room = max(values) - min(values)
    return (value - min(values)) / room if room > 0.0 else 0.0


def _label(answer: Estimate) -> str:
    """The label of an engine, which reports it if there is no error to draw."""
    return answer.engine if answer.mean_power.error95 else f"{answer.engine}\n(error not known)"


def cost(answer: Cost, title: str | None) -> Plot:
    """Draw total error against seconds: points of (engine, seconds, relative error, whether on the Pareto front).

    Each engine, `MOST_ENGINES` at most, has a line through those of its points that none of its own
    beats, with its name in addition to it, and a dotted one through the times that its poorer
    points predict for the errors `SHOWN`.  A point measured without control variates or pairing
    is a hollow mark of the same colour.
    """
    shown = [
        (*row.engine.partition(", ")[::2], row.seconds, 100.0 * row.total_error, row.best)
        for row in answer.rows
        if row.seconds and row.total_error
    ]
    whole = dict.fromkeys(p[0] for p in shown if not p[1])
    first = sorted(whole, key=lambda name: not any(p[4] for p in shown if p[0] == name))
    with styled():
        figure, here = new(1, 1, (WIDTH, 4.4))
        labels = [
            _cost_of(here, engine, [p[1:4] for p in shown if p[0] == engine])
            for engine in first[:MOST_ENGINES]
        ]
        predicted = [_predictions_of(here, answer, engine) for engine in first[:MOST_ENGINES]]
        logarithm(here.xaxis)
        logarithm(here.yaxis)
        here.margins(0.18, 0.1)
        here.set_xlabel("time of the computation (s)")
        here.set_ylabel("total mean-power error (%)")
        entitle(figure, title, "The cost of accuracy in time")
        notes = ["Error: 95 % sampling + step + model, unknown parts at their upper bound."]
        notes += ["Hollow: without control variates, pairing or a settled start."] * any(
            p[1] for p in shown
        )
        notes += ["Dotted: predicted by points of larger error."] * any(predicted)
        notes += [f"Not drawn: {', '.join(first[MOST_ENGINES:])}."] * bool(first[MOST_ENGINES:])
        legend(figure, " ".join(notes))
        write_labels(here, labels)
    return figure


def _cost_of(here: Axes, engine: str, points: Sequence[tuple[str, float, float]]) -> Label:
    """Draw the points of an engine, (missing method, seconds, error in percent), and return the label of its line."""
    whole = sorted((s, e) for missing, s, e in points if not missing)
    poorer = [(s, e) for missing, s, e in points if missing]
    best = [
        point for k, point in enumerate(whole) if all(point[1] < other[1] for other in whole[:k])
    ]
    look: dict[str, Any] = {
        "color": look_of(engine).colour,
        "marker": look_of(engine).marker,
        "zorder": 3,
    }
    if poorer:
        here.plot(
            *zip(*poorer, strict=True), **look, linestyle="none", markersize=4, fillstyle="none"
        )
    here.plot(*zip(*whole, strict=True), **look, linestyle="none", markersize=4.5, alpha=0.45)
    here.plot(*zip(*best, strict=True), **look, linewidth=1.2, markersize=6, markeredgecolor=INK)
    return Label(engine, look_of(engine).colour, np.array([*best[::-1], *whole]))


def _predictions_of(here: Axes, answer: Cost, engine: str) -> bool:
    """Draw the seconds predicted for each of `SHOWN`, up to `FARTHEST`; whether there is one."""
    longest = max(row.seconds for row in answer.rows if row.seconds)
    seconds = [(answer.predicted(engine, within), within) for within in SHOWN]
    points = [
        (s, 100.0 * within) for s, within in seconds if s is not None and s <= FARTHEST * longest
    ]
    if points:
        here.plot(
            *zip(*points, strict=True),
            color=look_of(engine).colour,
            linestyle=":",
            linewidth=1.2,
            marker=".",
            markersize=5,
            zorder=2.5,
            gid=f"predicted {engine}",
        )
    return bool(points)
