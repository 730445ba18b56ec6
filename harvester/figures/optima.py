"""The figure of an optimum: the evaluations that found it, the best place and its interval."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.arrays import Floats
from harvester.figures.engines import in_words
from harvester.figures.quantities import amount, broken, mark, quantity, scale
from harvester.figures.smoothing import local_fit, smooth
from harvester.figures.style import INK, WIDTH, entitle, legend, new
from harvester.presentation.engine_look import look as look_of
from harvester.presentation.plot import Plot, styled
from harvester.studies.optimum.evaluations import Evaluation
from harvester.studies.optimum.optimum_result import OptimalKey, Optimum

_BARS = "Bars: 95 % sampling + step + model, as far as stated."
_MAP = "Map: a smooth surface through the evaluations; white without any nearby."
_MOST_BARS = 150  # evaluations with an error bar each
_STAR: dict[str, Any] = {"marker": "*", "markersize": 13, "linestyle": "none", "zorder": 6}
_STAR["clip_on"] = False
_GRID = 121  # points a side of a map
_FINE = 2001  # places of a range


@dataclass(frozen=True)
class _Evaluations:
    """Evaluations as arrays: places and keys' values (n, keys), powers and errors (n,) in units of the axis."""

    positions: Floats
    x: Floats
    power: Floats
    error: Floats
    sampling: Floats

    @classmethod
    def of(
        cls, some: Sequence[Evaluation], keys: Sequence[OptimalKey], unit: float
    ) -> "_Evaluations":
        """Those of an answer; powers are divided by ``unit``."""
        powers = [evaluation.power for evaluation in some if evaluation.power is not None]
        values = [
            [key.range.value(float(u)) for key, u in zip(keys, evaluation.u, strict=True)]
            for evaluation in some
        ]
        parts = ("value", "known_error95", "normal_stderr")
        power, error, sampling = (
            np.array([getattr(v, name) for v in powers]) / unit for name in parts
        )
        positions = np.array([evaluation.u for evaluation in some]).reshape(-1, len(keys))
        return cls(positions, np.array(values).reshape(-1, len(keys)), power, error, sampling)

    @property
    def fills_a_plane(self) -> bool:
        """Whether a map can be drawn through them."""
        if self.positions.shape[1] != 2 or len(self.positions) <= 3:
            return False
        return bool(np.linalg.matrix_rank(self.positions - self.positions[0], 1e-6) == 2)

    @property
    def bars(self) -> Floats | None:
        """Their errors, if there are any and not too many to be seen."""
        return self.error if self.error.any() and len(self.x) <= _MOST_BARS else None


def optimum(answer: Optimum, title: str | None) -> Plot:
    """Draw the engine's evaluations, the optimum and its interval: a map over two keys, else a panel for each.

    Evaluations that are not sound are left out, and counted below, unless there are no others.
    """
    powers = [p.power.value for p in answer.own_points if p.power is not None]
    y = scale("mean power", answer.estimate.unit_names.power, powers)
    sound, left = _sound(answer)
    evaluations = _Evaluations.of(sound, answer.keys, y.factor)
    plane = evaluations.fills_a_plane
    with styled():
        figure, axes = new(
            1, 1 if plane else len(answer.keys), (WIDTH, 4.4), squeeze=False, sharey=True
        )
        if plane:
            _plane(axes[0, 0], answer, evaluations, y.label)
        else:
            for number, here in enumerate(axes[0]):
                _panel(here, answer, number, evaluations, y.factor)
            if len(answer.keys) == 1:
                _local_fit(axes[0, 0], answer.keys[0], evaluations, look_of(answer.engine).colour)
            axes[0, 0].set_ylabel(y.label)
        names = [quantity(best.range.key)[0].split(" = ")[0] for best in answer.keys]
        question = (
            f"Which {' and '.join(names)} {'gives' if len(names) == 1 else 'give'} the most power?"
        )
        entitle(figure, title, question if len(names) < 3 else "Power over the two keys")
        notes = [_MAP if plane else _BARS if evaluations.bars is not None else ""]
        notes += (
            [f"Not drawn: {left} evaluations not settled, cut off or without an error."]
            if left
            else []
        )
        legend(figure, " ".join(notes).strip())
    return figure


def _sound(answer: Optimum) -> tuple[list[Evaluation], int]:
    """The engine's evaluations that have an answer: those that are sound, or all if none is.

    How many are left.
    """
    known = [p for p in answer.own_points if p.power is not None]
    sound = [p for p in known if p.is_sound] or known
    return sound, len(known) - len(sound)


def _star(answer: Optimum) -> str:
    """The meaning of the star, with its numbers: no optimum if most of the range was not searched."""
    what = "optimum" if answer.scanned else "highest so far: the scan was cut short"
    power = in_words(answer.estimate.mean_power, answer.estimate.unit_names.power)
    values = (
        amount(best.value, quantity(best.range.key)[1].replace("SI", "")) for best in answer.keys
    )
    return f"{what}\n{power} at {', '.join(values)}"


def _panel(
    here: Axes, answer: Optimum, number: int, evaluations: _Evaluations, unit: float
) -> None:
    """Draw the evaluations against one key, whatever the values of the others."""
    key = answer.keys[number]
    x = evaluations.x[:, number]
    by = mark(here.xaxis, key.range.key, [key.range.low, key.range.high], key.range.logarithmic)
    if np.ptp([*x, key.value]) < 1e-6 * abs(
        key.value
    ):  # all at one place: no width that an axis could have
        here.set_xlim(key.range.low / by, key.range.high / by)
    colour = look_of(answer.engine).colour
    if key.low95 is not None and key.high95 is not None:
        here.axvspan(
            key.low95 / by,
            key.high95 / by,
            color="0.88",
            zorder=0,
            label="95 % interval of the best value",
        )
    if len(answer.keys) > 1:
        here.set_xlabel(broken(here.get_xlabel(), 22))
    style: dict[str, Any] = {"color": colour, "marker": "o", "markersize": 3, "linestyle": "none"}
    style |= {"markeredgecolor": INK, "markeredgewidth": 0.4, "ecolor": colour, "elinewidth": 0.8}
    here.errorbar(
        x / by,
        evaluations.power,
        evaluations.bars,
        **style,
        label=f"evaluations by {answer.engine}",
    )
    best = answer.estimate.mean_power
    here.errorbar(
        key.value / by,
        best.value / unit,
        best.known_error95 / unit or None,
        color=INK,
        label=_star(answer),
        **_STAR,
    )


def _local_fit(here: Axes, key: OptimalKey, evaluations: _Evaluations, colour: str) -> None:
    """Draw the parabola through the evaluations about the best value, and its band."""
    if not len(evaluations.positions):
        return
    side = np.linspace(0.0, 1.0, _FINE)
    near = float(np.interp(key.value, [key.range.value(float(u)) for u in side], side))
    fitted = local_fit(evaluations.positions[:, 0], evaluations.power, evaluations.sampling, near)
    if fitted is None:
        return
    u, line, half = fitted
    by = mark(here.xaxis, key.range.key, [key.range.low, key.range.high], key.range.logarithmic)
    x = np.array([key.range.value(float(position)) for position in u]) / by
    here.fill_between(
        x, line - half, line + half, color=colour, alpha=0.25, linewidth=0, zorder=1.4
    )
    here.plot(x, line, color=INK, linewidth=1.6, zorder=4, label="local fit, with its 95 % band")


def _plane(here: Axes, answer: Optimum, evaluations: _Evaluations, label: str) -> None:
    """Draw a smooth map over two keys: by ratio if the axis is logarithmic."""
    first, second = answer.keys
    ranges = zip((here.xaxis, here.yaxis), (first.range, second.range), strict=True)
    by = [mark(axis, r.key, [r.low, r.high], r.logarithmic) for axis, r in ranges]
    x = evaluations.x / by
    power = evaluations.power
    side = np.linspace(0.0, 1.0, _GRID)
    u = np.stack(np.meshgrid(side, side), axis=-1)
    surface = smooth(evaluations.positions, power, evaluations.sampling, u.reshape(-1, 2)).reshape(
        _GRID, _GRID
    )
    surface = np.clip(surface, power.min(), power.max())  # a spline may overshoot
    across, up = (
        np.array([k.range.value(float(v)) for v in side]) / b
        for k, b in zip(answer.keys, by, strict=True)
    )
    filled = here.pcolormesh(
        across, up, surface, cmap="viridis", shading="gouraud", rasterized=True
    )
    assert here.figure is not None
    here.figure.colorbar(filled, ax=here, label=label)
    if power.max() > power.min():
        lines = here.contour(across, up, surface, 8, colors="white", linewidths=0.6, alpha=0.8)
        here.clabel(lines, fontsize=8, fmt="%.4g")
    dots: dict[str, Any] = {
        "marker": "o",
        "markersize": 3 if len(x) < 100 else 1.5,
        "linestyle": "none",
    }
    dots |= {"markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 0.4}
    here.plot(x[:, 0], x[:, 1], **dots, label=f"evaluations by {answer.engine}")
    spans = [
        None
        if k.low95 is None or k.high95 is None
        else [[(k.value - k.low95) / b], [(k.high95 - k.value) / b]]
        for k, b in zip(answer.keys, by, strict=True)
    ]
    look = _STAR | {
        "label": _star(answer),
        "color": "#D55E00",
        "markeredgecolor": "white",
        "capsize": 3,
    }
    here.errorbar(first.value / by[0], second.value / by[1], spans[1], spans[0], **look)
    here.grid(visible=False)
    here.set_xlim(across[0], across[-1])
    here.set_ylim(up[0], up[-1])
