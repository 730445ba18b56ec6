"""Draws docs/validation/*.png: published curves and points beside ours, for docs/validation.md and docs/formulas.md.

    .venv/bin/python docs/draw_validation.py           # all, two minutes
    .venv/bin/python docs/draw_validation.py bistable  # one

The published curves are those of benchmarks/published.py; ours come from the engines, with 95 %
errors as bars.
"""

import sys
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.ticker import EngFormatter

import harvester as hv
from harvester.arrays import Floats
from harvester.engines.selection import ENGINES
from harvester.figures.style import legend, new
from harvester.presentation.engine_look import look
from harvester.presentation.plot import Plot, image
from harvester.studies import paper

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "benchmarks"))
import predictions  # noqa: E402
import published  # noqa: E402

THEIRS = {"color": ENGINES["published"].LOOK.colour, "linestyle": (0, (5, 2))}
OURS = {"color": ENGINES["spice"].LOOK.colour}
SETTLING = 0.3  # s, of load and smoothing capacitor: 14 periods
POINTS = {"fmt": "o", "color": ENGINES["spice"].LOOK.colour, "capsize": 2}
IDEAL = POINTS
REAL = POINTS | {"fmt": "^", "color": look("spice alone").colour}


def finished(figure: Plot) -> Plot:
    """Plain numbers on axes with ratios, and a legend."""
    for axes in figure.axes:
        for scale, axis in ((axes.get_xscale(), axes.xaxis), (axes.get_yscale(), axes.yaxis)):
            if scale == "log":
                axis.set_major_formatter(EngFormatter(sep=""))
                axis.set_minor_formatter(lambda *_: "")
    legend(figure)
    return figure


def erturk_inman() -> Plot:
    """Voltage over the frequency at three loads, and peak power over the load, with what was measured."""
    scene = hv.load(published.SCENES / "erturk_inman_2009.toml")
    figure, (left, right) = new(1, 2, (7.0, 3.0))
    frequencies = np.linspace(40.0, 55.0, 301)
    for load, dashes in (("1 kohm", "-"), ("33 kohm", "--"), ("470 kohm", ":")):
        points = hv.response(scene.with_load(resistance=load), tuple(frequencies)).sweep("up")
        left.semilogy(
            frequencies, [2**0.5 * p.voltage_rms.value for p in points], linestyle=dashes, **OURS
        )
        left.annotate(
            load, (40.5, 1.2 * 2**0.5 * points[0].voltage_rms.value), va="bottom", fontsize=8
        )
    left.set(xlabel="frequency (Hz)", ylabel="voltage amplitude (V/g)")
    loads = np.geomspace(1e3, 1e7, 121)
    for frequency, dashes in ((45.6, "-"), (48.4, "--")):
        power = [
            hv.run(published.shaken(scene, frequency, resistance=R), "exact").mean_power.value
            for R in loads
        ]
        right.semilogx(
            loads, 2e3 * np.array(power), linestyle=dashes, label=f"ours, {frequency} Hz", **OURS
        )
    right.plot(35e3, 23.9, "X", color=THEIRS["color"], label="measured, 45.6 Hz")
    right.axvline(186e3, label="measured best load, 48.4 Hz", linewidth=1.0, **THEIRS)
    right.set(xlabel="load (ohm)", ylabel="peak power (mW/g²)", ylim=(0.0, None))
    return finished(figure)


def rectifier(file: str, loads: Floats, frequencies: Floats, theirs: dict[str, object]) -> Plot:
    """Power over the load and over the frequency: the published formula, and ngspice with ideal and real diodes."""
    scene = hv.load(published.SCENES / file)
    given = dict(scene.load.parameters)
    real = {name: value for name, value in given.items() if name not in published.IDEAL}
    over_load = [(47.0, R) for R in loads]
    over_frequency = [(f, 1e5) for f in frequencies]
    figure, axes = new(1, 2, (7.0, 3.0), sharey=True)
    for axis, places, varied in zip(axes, (over_load, over_frequency), (1, 0), strict=True):
        fine = np.geomspace(places[0][varied], places[-1][varied], 201)
        for name, (formula, style) in theirs.items():
            curve = [1e3 * formula(scene, *((47.0, one) if varied else (one, 1e5))) for one in fine]
            axis.plot(fine, curve, label=name, **style)
        for name, parameters, mark in (
            ("nearly ideal diodes", given, IDEAL),
            ("1N4148 diodes", real, REAL),
        ):
            powers = []
            for frequency, R in places:
                smooth = {"R": float(R), "C": min(SETTLING / float(R), given["C"])}
                load = {"netlist": scene.load.netlist, "parameters": parameters | smooth}
                try:
                    found = (
                        hv.Spice(budget="12s")
                        .run(published.shaken(scene, float(frequency), **load))
                        .mean_power
                    )
                except hv.SimulationError as error:  # a point that is missing is told, not hidden
                    print(
                        f"{scene.load.netlist}, {name}, {frequency:g} Hz, {R:g} ohm: {error}",
                        flush=True,
                    )
                    found = hv.Value(0.0)
                powers.append(found)
            mean, error = (
                1e3 * np.array([getattr(p, what) for p in powers]) for what in ("value", "error95")
            )
            x = np.array([place[varied] for place in places])
            there = mean > 0.0
            axis.errorbar(
                x[there], mean[there], error[there], **(mark | {"label": f"ours, {name}"})
            )
    axes[0].set(
        xscale="log", xlabel="load at 47 Hz (ohm)", ylabel="mean power (mW)", ylim=(0.0, None)
    )
    axes[1].set(xlabel="frequency at 100 kohm (Hz)")
    return finished(figure)


def bridge() -> Plot:
    """The formula of 2006 and the whole first harmonic."""
    whole = {"color": ENGINES["averaged"].LOOK.colour}
    formulas = {"Shu and Lien 2006": (published.shu_lien, THEIRS)}
    return rectifier(
        "shu_lien_2006.toml",
        np.geomspace(1e4, 1e6, 9),
        np.linspace(43.0, 52.0, 10),
        formulas | {"whole first harmonic": (published.first_harmonic, whole)},
    )


def parallel_sshi() -> Plot:
    """The formula of 2007."""
    scene = hv.load(published.SCENES / "shu_lien_wu_2007.toml")
    share = published.voltage_left(scene.load.parameters)

    def formula(one: hv.Scene, frequency: float, resistance: float) -> float:
        return published.shu_lien(one, frequency, resistance, share)

    return rectifier(
        "shu_lien_wu_2007.toml",
        np.array([7e4, 1e5, 2e5, 5e5]),
        np.array([45.6, 47.0, 48.4, 50.0]),
        {"Shu, Lien and Wu 2007": (formula, THEIRS)},
    )


def bistable() -> Plot:
    """Mean lambda v^2 over the amplitude: mean over all starts, and the source's equations from two of them."""
    scene = hv.load(published.SCENES / "erturk_hoffmann_inman_2009.toml")
    figure, axis = new(1, 1, (7.0, 3.0))
    amplitudes = np.linspace(0.02, 0.2, 46)
    answers = [
        hv.Ensemble().run(scene.vary("excitation.acceleration_amplitude", float(f)))
        for f in amplitudes
    ]
    mean, error = (
        np.array([0.05 * getattr(a.mean_square_voltage, what) for a in answers])
        for what in ("value", "error95")
    )
    alone = np.array(["all starts that were tried" in a.reason for a in answers])
    for which, name, mark in (
        (alone, "ours, one response", "o"),
        (~alone, "ours, mean over starts: chaos, or several", "^"),
    ):
        axis.errorbar(
            amplitudes[which], mean[which], error[which], **(POINTS | {"fmt": mark, "label": name})
        )
    for start, name, style in (
        ((1.0, 0.0, 0.0), "source's equations from (1, 0, 0)", "X"),
        ((1.0, 1.3, 0.0), "from (1, 1.3, 0)", "+"),
    ):
        at = (0.041, 0.06, 0.147, 0.2) if style == "X" else (0.041, 0.06, 0.083, 0.115)
        axis.plot(
            at,
            [published.integrated(f, start) for f in at],
            style,
            color=THEIRS["color"],
            label=name,
            zorder=5,
        )
    axis.set(yscale="log", xlabel="amplitude f of the base", ylabel="mean of λ v²")
    return finished(figure)


def entropy() -> Plot:
    """Densities of x and x' of Figure 1, which the paper's theory has right, and E[V^2], which it has not."""
    points = list(paper.figure("1"))
    figure, axes = new(1, 3, (7.0, 3.0))
    for axis, panel in zip(axes, ("p(displacement x)", "p(velocity x')"), strict=False):
        for curve in dict.fromkeys(p.curve for p in points):
            those = [p for p in points if (p.panel, p.curve) == (panel, curve)]
            x, theirs, ours, error = (
                np.array([getattr(p, n) for p in those])
                for n in ("x", "published", "ensemble", "ensemble_stderr")
            )
            axis.plot(x, theirs, label="paper's theory", **THEIRS)
            small = {"markersize": 2, "label": "Monte Carlo of its equations"}
            axis.errorbar(x, ours, 1.96 * error, **(POINTS | small))
        axis.set(title=f"{panel}\nr = 0.92, 0.96, 0.99")
    values = np.linspace(0.9, 0.99, 7)
    scene = hv.load(published.SCENES / "entropy_2026.toml")
    several = [scene.vary("nondimensional.restitution", float(r)) for r in values]
    axes[2].plot(
        values, [hv.run(s, "published").mean_square_voltage.value for s in several], **THEIRS
    )
    ours = [hv.Ensemble(within=3e-3).run(s).mean_square_voltage for s in several]
    axes[2].errorbar(values, [v.value for v in ours], [v.known_error95 for v in ours], **POINTS)
    axes[2].set(title="E[V²]", xlabel="r", ylim=(0.0, None))
    return finished(figure)


def prediction(device: str) -> Plot:
    """The intervals of a device's predictions and what was measured, both over the predicted value."""
    found = predictions.measured()
    rows = [
        one for one in predictions.kept() if one.device == device and (device, one.what) in found
    ][::-1]
    figure, axes = new(1, 1, (7.0, 0.9 + 0.32 * len(rows)))
    for place, one in enumerate(rows):
        axes.plot(
            [one.low / one.value, one.high / one.value],
            [place, place],
            linewidth=5.0,
            alpha=0.4,
            **OURS,
        )
        axes.plot(
            1.0, place, "|", markersize=12.0, label="predicted" if place == 0 else "_", **OURS
        )
        measured = found[device, one.what].value / one.value
        axes.plot(
            measured, place, "X", color=THEIRS["color"], label="measured" if place == 0 else "_"
        )
    axes.set_yticks(range(len(rows)), [f"{one.what}: {one.value:.3g} {one.unit}" for one in rows])
    axes.set(
        xlabel="over the prediction; bar: interval with 95 %",
        xscale="log",
        ylim=(-0.7, len(rows) - 0.3),
    )
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.tick_params(axis="x", which="minor", labelsize=7)
    legend(figure)
    return figure


FIGURES = {one.__name__: one for one in (erturk_inman, bridge, parallel_sshi, bistable, entropy)}
FIGURES |= {device: partial(prediction, device) for device in predictions.DEVICES}


def main() -> None:
    (HERE / "validation").mkdir(exist_ok=True)
    for name in sys.argv[1:] or FIGURES:
        (HERE / "validation" / f"{name}.png").write_bytes(image(FIGURES[name](), "png"))
        print(name, flush=True)


if __name__ == "__main__":
    main()
