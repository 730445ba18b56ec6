"""The figure of frequency responses: power, voltage, displacement and phases."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from harvester.arrays import Floats
from harvester.figures.labels import Label, write_labels
from harvester.figures.quantities import amount, broken, scale, values_in_words
from harvester.figures.response_maps import is_map, response_map
from harvester.figures.style import MOST_BARS, WIDTH, curve, entitle, legend, new
from harvester.figures.sweep_curves import MOST_CURVES, colour
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.engine_look import look as look_of
from harvester.presentation.plot import Plot, styled
from harvester.studies.frequency_response.curve import FrequencyResponse
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.frequency_response.responses import FrequencyResponses
from harvester.uncertainty.value import Value

_UP = "#0072B2"
_LOOKS: dict[str, dict[str, Any]] = {
    "up": {"color": _UP, "marker": ">", "linestyle": "-", "linewidth": 1.0},
    "down": {
        "color": "#D55E00",
        "marker": "<",
        "linestyle": (0, (4, 2)),
        "linewidth": 1.0,
        "markerfacecolor": "white",
    },
    "from rest": {"color": _UP, "marker": "o", "linestyle": "-", "linewidth": 1.0},
}
_WORDS = {
    "up": "up the frequencies",
    "down": "down the frequencies",
    "from rest": "each frequency from rest",
}
_LETTERS = 25  # of a label beside a panel
_SEEN = 0.01  # of the largest value: a shorter error bar is hidden by a marker
_ALIKE = 0.003  # of the largest value: closer curves are one line
_FEW, _MANY = 200, 40  # points of a curve whose points are marked, and of one whose marks are small


@dataclass(frozen=True)
class DirectedResponse:
    """A response in one direction, and its look."""

    answer: FrequencyResponse
    direction: str
    look: dict[str, Any]

    @property
    def points(self) -> Sequence[ResponsePoint]:
        """The points of that direction."""
        return self.answer.sweep(self.direction)


@dataclass(frozen=True)
class SizePanel:
    """A quantity with a panel of its own, divided by the ``power`` of the base's amplitude in g."""

    name: str
    words: str
    unit: str
    power: int

    @property
    def divided(self) -> tuple[str, str]:
        """Its words and its unit as the panel has them."""
        if self.power == 0:
            return self.words, self.unit
        if self.power == 1:
            return f"{self.words} per g", f"{self.unit}/g"
        return f"{self.words} per g²", f"{self.unit}/g^2"


def response(
    answer: FrequencyResponse | FrequencyResponses, title: str | None, per_g: bool = False
) -> Plot:
    """Draw power, voltage, displacement and phases; one response has its half-power bandwidths.

    Up and down are one curve if they cannot be distinguished.  Several responses differ in
    colour; for many values of one key the power is drawn as a map (`response_maps`).  ``per_g``:
    power over the square of the base's amplitude in g, voltage and displacement over it.
    """
    answers = answer.curves if isinstance(answer, FrequencyResponses) else [answer]
    draw = response_map if is_map(answers) else _response_curves
    return draw(answers, title, per_g)


def _response_curves(answers: Sequence[FrequencyResponse], title: str | None, per_g: bool) -> Plot:
    """Draw a curve over the frequency for each response and direction."""
    curves = [one_curve for answer in answers for one_curve in _curves(answer, answers)]
    units = answers[0].unit_names
    points = [p for one_curve in curves for p in one_curve.points]
    frequency = "excitation frequency" if units.frequency else "excitation frequency Ω"
    hertz = scale(frequency, units.frequency, [p.frequency for p in points])
    sizes = _size_panels(points, units, per_g)
    turned = any(p.voltage_phase is not None for p in points)
    panels = len(sizes) + turned
    with styled():
        rows, columns = (2, 2) if panels > 2 else (2, 1)
        figure, axes = new(rows, columns, (WIDTH, 5.4), sharex=True, squeeze=False)
        all_panels = list(axes.flat)
        for panel, size in zip(all_panels, sizes, strict=False):
            _draw_size(panel, curves, size, hertz.factor)
        alone = curves if len(answers) == 1 and not per_g else []
        _bandwidths(all_panels[0], alone, hertz.factor)
        if turned:
            _phases(all_panels[len(sizes)], curves, hertz.factor, bool(units.frequency))
        _close(all_panels, panels, columns, broken(hertz.label, 30))
        entitle(figure, title, "Mean power against the excitation frequency")
        legend(figure, _note(curves, len(answers)))
        write_labels(all_panels[0], [_peak(one_curve, hertz.factor) for one_curve in alone])
    return figure


def _size_panels(
    points: Sequence[ResponsePoint], units: AnswerUnits, per_g: bool
) -> list[SizePanel]:
    """The quantities that have a panel: the displacement if any point knows it."""
    sizes = [
        SizePanel("mean_power", "mean power", units.power, 2 if per_g else 0),
        SizePanel("voltage_rms", "RMS voltage", units.voltage, 1 if per_g else 0),
    ]
    if any(p.displacement_rms is not None for p in points):
        sizes.append(
            SizePanel("displacement_rms", "RMS displacement", units.length, 1 if per_g else 0)
        )
    return sizes


def _close(all_panels: Sequence[Any], panels: int, columns: int, label: str) -> None:
    """Take away the panels that are empty, and label the lowest of each column."""
    for panel in all_panels[panels:]:
        panel.remove()
    for panel in all_panels[max(0, panels - columns) : panels]:
        panel.set_xlabel(label)
        panel.tick_params(labelbottom=True)


def _curves(
    answer: FrequencyResponse, answers: Sequence[FrequencyResponse]
) -> list[DirectedResponse]:
    """The curves of one of several responses: one if its directions are alike, with their looks."""
    values = list(dict.fromkeys(_values(a) for a in answers))
    if (number := values.index(_values(answer))) >= MOST_CURVES:
        return []
    directions = list(answer.directions)
    alike = len(directions) > 1 and all(
        _alike(answer, name) for name in ("mean_power", "voltage_rms")
    )
    engines = list(dict.fromkeys(a.engine for a in answers))
    curves = list[DirectedResponse]()
    for direction in directions[:1] if alike else directions:
        look = dict(_LOOKS[direction]) | {"label": _WORDS[direction]}
        if alike:
            look |= {"label": "up and down the frequencies, alike", "marker": "o"}
        if len(answers) > 1:
            way = "" if alike or len(directions) == 1 else direction
            look |= _among_others(answer.engine, values, number, len(engines) > 1, way)
        points = len(answer.sweep(direction))
        look["markersize"] = 0 if points >= _FEW else 3 if points < _MANY else 2
        curves.append(DirectedResponse(answer, direction, look))
    return curves


def _among_others(
    engine: str, values: Sequence[str], number: int, engines: bool, direction: str
) -> dict[str, Any]:
    """The look of one of several responses: colour by value or engine, marker by engine."""
    words = [values[number]] if len(values) > 1 else []
    words += ([engine] if engines else []) + ([direction] if direction else [])
    engine_look = look_of(engine)
    look = {"label": ", ".join(words), "color": engine_look.colour}
    if len(values) > 1:
        look["color"] = colour(number, min(len(values), MOST_CURVES))
    if engines:
        fill = "white" if engine_look.line == "none" else look["color"]
        look |= {"marker": engine_look.marker, "markerfacecolor": fill}
    return look


def _values(answer: FrequencyResponse) -> str:
    """The values of the varied keys in words."""
    return values_in_words(answer.varied.items())


def _draw_size(
    axes: Axes, curves: Sequence[DirectedResponse], size: SizePanel, hertz: float
) -> None:
    """Draw one quantity of all curves, each over its level to the panel's power."""
    drawn = []
    for one_curve in curves:
        known = [p for p in one_curve.points if getattr(p, size.name) is not None]
        values: list[Value] = [getattr(p, size.name) for p in known]
        over = (one_curve.answer.level or 1.0) ** size.power
        f = np.array([p.frequency for p in known])
        y = np.array([v.value for v in values]) / over
        error = np.array([v.known_error95 for v in values]) / over
        drawn.append((f, y, error, one_curve.look))
    words, unit = size.divided
    y_scale = scale(words, unit, np.concatenate([y for _, y, _, _ in drawn]))
    for f, y, error, look in drawn:
        curve(axes, f / hertz, y / y_scale.factor, error / y_scale.factor, look)
    axes.set_ylabel(broken(y_scale.label, _LETTERS))
    axes.set_ylim(0.0, None)


def _phases(axes: Axes, curves: Sequence[DirectedResponse], hertz: float, physical: bool) -> None:
    """Draw the voltage's phase."""
    known = [0.0]
    for one_curve in curves:
        f = np.array([p.frequency for p in one_curve.points]) / hertz
        phases = _unwrapped([p.voltage_phase for p in one_curve.points])
        axes.plot(f, phases, **one_curve.look | {"label": "_"})
        known += phases[np.isfinite(phases)].tolist()
    low, high = 90.0 * math.floor(min(known) / 90.0), 90.0 * math.ceil(max(known) / 90.0)
    axes.set_ylim(low - 5.0, high + 5.0)
    axes.set_yticks(np.arange(low, high + 1.0, 90.0 * math.ceil((high - low) / 540.0)))
    axes.set_ylabel(f"phase of the voltage\nto the {'base' if physical else 'drive'} (°)")


def _unwrapped(phases: Sequence[float | None]) -> Floats:
    """Phases in degrees without jumps, their first from -90 to 270; nan if they are not known."""
    y = np.array([np.nan if p is None else p for p in phases])
    known = np.isfinite(y)
    y[known] = np.unwrap(np.mod(y[known] + 90.0, 360.0) - 90.0, period=360.0)
    return y


def _bandwidths(top: Axes, curves: Sequence[DirectedResponse], hertz: float) -> None:
    """Draw each half-power bandwidth within its sweep as a pale bar at half the largest power."""
    label = "half-power bandwidth"
    for one_curve in curves:
        answer = one_curve.answer
        edges = answer.edges(one_curve.direction)
        if edges is None:
            continue
        largest = answer.peak(one_curve.direction).mean_power.value
        half = 0.5 * largest / _power_scale(answer)
        bar: dict[str, Any] = {
            "linewidth": 3.5,
            "alpha": 0.5,
            "color": one_curve.look["color"],
            "solid_capstyle": "butt",
        }
        top.plot([edge / hertz for edge in edges], [half, half], **bar, label=label)
        label = "_"


def _power_scale(answer: FrequencyResponse) -> float:
    """The divisor of the powers of a response alone."""
    powers = [p.mean_power.value for d in answer.directions for p in answer.sweep(d)]
    return scale("", answer.unit_names.power, powers).factor


def _peak(one_curve: DirectedResponse, hertz: float) -> Label:
    """The label of the largest power: how much, and at which frequency."""
    answer = one_curve.answer
    units = answer.unit_names
    peak = answer.peak(one_curve.direction)
    power = peak.mean_power.value
    rounded = float(f"{power:.3g}")
    text = f"{amount(rounded, units.power)}\nat {amount(peak.frequency, units.frequency)}"
    at = np.array([[peak.frequency / hertz, power / _power_scale(answer)]])
    return Label(text, one_curve.look["color"], at)


def _alike(answer: FrequencyResponse, name: str) -> bool:
    """Whether the curves of both directions are closer everywhere than a line is wide."""
    a, b = (np.array([getattr(p, name).value for p in answer.sweep(d)]) for d in answer.directions)
    return len(a) == len(b) and bool(
        np.max(np.abs(a - b)) <= _ALIKE * max(np.abs(a).max(), np.abs(b).max())
    )


def _note(curves: Sequence[DirectedResponse], several: int) -> str:
    """The meaning of the error bars, or their size if it is small; which curves are not drawn."""
    powers: list[Value] = [p.mean_power for one_curve in curves for p in one_curve.points]
    error = max(v.known_error95 for v in powers)
    largest = max(abs(v.value) for v in powers)
    shown = len({id(one_curve.answer) for one_curve in curves})
    left = f" The first {shown} of {several} responses." if shown < several else ""
    if error == 0.0:
        return left.strip()
    if error < _SEEN * largest:
        share = 100.0 * error / largest
        size = (
            f"at most {share:.1g} % of the largest power"
            if share >= 0.001
            else "below 0.001 % of the largest power"
        )
        return f"Errors (95 % sampling and step) are {size}: too small to be seen.{left}"
    points = max(len(one_curve.points) for one_curve in curves)
    return f"{'Bars' if points <= MOST_BARS else 'Bands'}: 95 % sampling and step.{left}"
