"""The figures of engines: the errors of one answer, several answers side by side, and what accuracy costs."""

from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.axes import Axes

from harvester.figures.quantities import logarithm, scale
from harvester.figures.shapes import EstimateShape, PathShape
from harvester.figures.style import INK, WIDTH, Plot, entitle, legend, new, styled
from harvester.presentation.engine_look import look as look_of

_SHOWN = 0.4  # of the path, its end
_LEDGER = "ledger_"
_FILLED: Any = {"": "full", "no controls": "none", "no pairing": "left", "from rest": "bottom"}  # marks, by what lacks
_HATCHES = {"sampling, 95 %": "", "step": "////", "model, estimated": "...."}


def estimate(answer: EstimateShape, title: str | None) -> Plot:
    """Draw bars of the mean power's errors in percent of it, and of the ledger's powers; an unknown error says so."""
    flows = {k.removeprefix(_LEDGER): v for k, v in answer.details.items() if k.startswith(_LEDGER)}
    flows.pop("residual", None)
    with styled():
        figure, axes = new(1, 2 if flows else 1, (WIDTH, 2.4), squeeze=False)
        _errors(axes[0, 0], answer)
        if flows:
            here = axes[0, 1]
            x = scale("mean power", answer.unit_names.power, [*flows.values()])
            here.barh([*flows], [v / x.factor for v in flows.values()], color="0.6", edgecolor=INK, linewidth=0.6)
            here.axvline(0.0, color=INK, linewidth=0.6)
            here.invert_yaxis()
            here.set_xlabel(x.label)
            here.set_title("Where the power went")
            here.grid(visible=False, axis="y")
        entitle(figure, title, f"Answer of {answer.engine}")
    return figure


def _errors(here: Axes, answer: EstimateShape) -> None:
    """Draw the errors of sampling, step and model as a bar each."""
    power = answer.mean_power
    parts = {
        "sampling, 95 %": None if power.stderr is None else power.sampling95,
        "step": power.bias,
        "model, estimated": power.model,
    }
    by = abs(power.value) / 100.0
    colour = look_of(answer.engine).colour
    for place, (name, error) in enumerate(parts.items()):
        if error is None or by == 0.0:
            text = "none, or not known" if error is None else "the power is 0"
            here.annotate(text, (0.0, place), (4, 0), textcoords="offset points", va="center", fontsize=8, color="0.35")
        else:
            here.barh(place, error / by, 0.6, color=colour, edgecolor=INK, linewidth=0.6, hatch=_HATCHES[name])
    here.set_yticks(range(len(parts)), [*parts])
    here.set_ylim(len(parts) - 0.5, -0.5)
    here.set_xlim(0.0, None if here.containers else 1.0)
    here.set_xlabel("error of the mean power (%)")
    here.set_title(f"What the error of {answer.engine} is made of")
    here.grid(visible=False, axis="y")


def comparison(estimates: Sequence[EstimateShape], curves: Sequence[PathShape], title: str | None) -> Plot:
    """Draw each engine's power with its whole error, and V of one path from three sources, with and without the stop.

    The axis of the powers need not begin at zero: what is compared is differences and errors.
    """
    paths, height = len(curves), 0.7 + 0.32 * len(estimates)
    with styled():
        size = (WIDTH, 1.0 + height + 1.9 * paths)
        figure, axes = new(1 + paths, 1, size, squeeze=False, height_ratios=[height, *paths * [1.9]])
        powers = axes[0, 0]
        values = [e.mean_power.value for e in estimates]
        x = scale("mean power", estimates[0].unit_names.power, values)
        for place, answer in enumerate(estimates):
            look = {"color": look_of(answer.engine).colour, "marker": look_of(answer.engine).marker, "markersize": 6}
            bars = {"markeredgecolor": INK, "ecolor": INK, "capsize": 3, "linestyle": "none", "zorder": 3}
            error = answer.mean_power.known_error95 / x.factor
            powers.errorbar(answer.mean_power.value / x.factor, place, xerr=error or None, **look, **bars)
            text = f"{answer.mean_power.value / x.factor:.4g}" + (
                f" ± {error:.2g}" if answer.mean_power.error95 else ""
            )
            left = _relative_place(answer.mean_power.value, values) > 0.6
            where: dict[str, Any] = {"xytext": (-9 if left else 9, 9), "ha": "right" if left else "left"}
            at = (answer.mean_power.value / x.factor, place)
            powers.annotate(text, at, textcoords="offset points", va="center", fontsize=8, **where)
        powers.set_yticks(range(len(estimates)), [_label(e) for e in estimates])
        powers.set_ylim(len(estimates) - 0.5, -0.5)
        powers.margins(x=0.1)
        powers.set_xlabel(f"{x.label}; bars: 95 % sampling + step + model, as far as stated")
        powers.grid(visible=False, axis="y")
        for panel, path in zip(axes[1:, 0], curves, strict=True):
            shown = path.t > (1.0 - _SHOWN) * path.t[-1]
            clock = scale("time", path.unit_names.time, path.t[shown])
            volt = scale("voltage", path.unit_names.voltage, [*path.spice[shown], *path.decoupled[shown]])
            t = path.t[shown] / clock.factor
            published, spice = look_of("published"), look_of("spice").colour
            look = {"color": published.colour, "linestyle": published.line, "linewidth": 1.1}
            panel.plot(t, path.decoupled[shown] / volt.factor, **look, label="published: V decoupled from x and x'")
            panel.plot(
                t,
                path.exact[shown] / volt.factor,
                color=look_of("ensemble").colour,
                linewidth=4,
                label="exact RC update",
            )
            panel.plot(t, path.spice[shown] / volt.factor, color=spice, linewidth=1, label="ngspice")
            text = f"RMS error of published {path.decoupled_rms_error:.0%}, of ngspice {path.spice_rms_error:.1g}"
            panel.set_title(f"One path {path.title}: {text}")
            panel.set_ylabel(volt.label.replace(" (", "\n("))
            panel.set_xlim(t[0], t[-1])
            panel.set_xlabel(clock.label if panel is axes[-1, 0] else "")
        entitle(figure, title, "Engines side by side")
        legend(figure)
    return figure


def _relative_place(value: float, values: list[float]) -> float:
    """Where a value lies between the smallest of all (0) and the largest (1)."""
    room = max(values) - min(values)
    return (value - min(values)) / room if room > 0.0 else 0.0


def _label(answer: EstimateShape) -> str:
    """The label of an engine, which says so where there is no error to draw."""
    return answer.engine if answer.mean_power.error95 else f"{answer.engine}\n(error not known)"


def cost(points: Iterable[tuple[str, float, float, bool]], title: str | None) -> Plot:
    """Draw total error against seconds: points of (engine, seconds, relative error, whether on the Pareto front).

    The second panel has seconds times error squared against the error.  More samples of the same kind divide the error
    by the root of the time, so that a sampling engine stays on a level there; it rises where a bias is what is left.
    """
    shown = [(engine, seconds, 100.0 * error, best) for engine, seconds, error, best in points]
    best = sorted((seconds, error) for _, seconds, error, on_front in shown if on_front)
    with styled():
        figure, (here, worth) = new(1, 2, (WIDTH, 4.2))
        for engine in dict.fromkeys(point[0] for point in shown):
            of_engine = [(seconds, error) for name, seconds, error, _ in shown if name == engine]
            whole, _, lacks = engine.partition(", ")
            look = {"color": look_of(whole).colour, "marker": look_of(whole).marker, "fillstyle": _FILLED[lacks]}
            look |= {"linestyle": "none", "markersize": 6, "markeredgecolor": INK, "zorder": 3}
            label = look_of(whole).label + (f", {lacks}" if lacks else "")
            here.plot(*zip(*of_engine, strict=True), label=label, **look)
            worth.plot(*zip(*((error, seconds * error**2) for seconds, error in of_engine), strict=True), **look)
        if best:
            front = {"color": INK, "linewidth": 1, "zorder": 2, "label": "front: none is as fast and as accurate"}
            here.step(*zip(*best, strict=True), where="post", **front)
            for axes in (here, worth):
                logarithm(axes.xaxis)
                logarithm(axes.yaxis)
                axes.margins(0.08)
        here.set_xlabel("time of the computation (s)")
        here.set_ylabel("total error of the mean power (%)")
        worth.set_xlabel("total error of the mean power (%)")
        worth.set_ylabel("time times error squared (s %²)")
        entitle(figure, title, "What accuracy costs")
        note = "Total error: sampling at 95 % plus step and model, each counted as large as it may be unseen."
        legend(figure, note + " Right: a level is the best that sampling can do.")
    return figure
