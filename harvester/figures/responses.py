"""The figure of frequency responses: power, voltage, displacement and phases against the frequency."""

import math
from collections.abc import Sequence
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
Curve = tuple[FrequencyResponse, str, dict[str, Any]]  # a response, its direction, and the look


def response(
    answer: FrequencyResponse | FrequencyResponses, title: str | None, per_g: bool = False
) -> Plot:
    """Draw power, RMS voltage, RMS displacement and phases, with a bar for each half-power bandwidth of one response.

    Up and down are one curve if they cannot can be distinguished.  Several responses differ in
    colour; for many values of one key the power is drawn as a map (`response_maps`).  ``per_g``:
    power over the square of the base's amplitude in g, voltage and displacement over it.
    """
    answers = answer.curves if isinstance(answer, FrequencyResponses) else [answer]
    draw = response_map if is_map(answers) else _response_curves
    return draw(answers, title, per_g)


def _response_curves(answers: Sequence[FrequencyResponse], title: str | None, per_g: bool) -> Plot:
    """Draw a curve over the frequency for each response and direction."""
    curves = [curve for answer in answers for curve in _curves(answer, answers)]
    units = answers[0].unit_names
    points = [p for a, d, _ in curves for p in a.sweep(d)]
    frequency = "excitation frequency" if units.frequency else "excitation frequency Ω"
    hertz = scale(frequency, units.frequency, [p.frequency for p in points])
    sizes = _quantities(points, units, per_g)
    turned = any(p.voltage_phase is not None for p in points)
    panels = len(sizes) + turned
    with styled():
        rows, columns = (2, 2) if panels > 2 else (2, 1)
        figure, axes = new(rows, columns, (WIDTH, 5.4), sharex=True, squeeze=False)
        all_panels = list(axes.flat)
        for panel, (name, words, unit, power) in zip(all_panels, sizes, strict=False):
            _sizes(
                panel, curves, name=name, words=words, unit=unit, hertz=hertz.factor, per_g=power
            )
        alone = curves if len(answers) == 1 and not per_g else []
        _bandwidths(all_panels[0], alone, hertz.factor)
        if turned:
            _phases(all_panels[len(sizes)], curves, hertz.factor, bool(units.frequency))
        _close(all_panels, panels, columns, broken(hertz.label, 30))
        entitle(figure, title, "Mean power against the excitation frequency")
        legend(figure, _note(curves, len(answers)))
        write_labels(all_panels[0], [_peak(a, d, look, hertz.factor) for a, d, look in alone])
    return figure


def _quantities(
    points: Sequence[ResponsePoint], units: AnswerUnits, per_g: bool
) -> list[tuple[str, str, str, int]]:
    """A quantity with a panel of its own: its name, words and unit, and the power of the level in its divisor."""
    sizes = [
        ("mean_power", "mean power", units.power, 2 * per_g),
        ("voltage_rms", "RMS voltage", units.voltage, +per_g),
    ]
    if any(p.displacement_rms is not None for p in points):
        sizes.append(("displacement_rms", "RMS displacement", units.length, +per_g))
    return sizes


def _close(all_panels: Sequence[Any], panels: int, columns: int, label: str) -> None:
    """Take away the panels that are empty, and label the lowest of each column."""
    for panel in all_panels[panels:]:
        panel.remove()
    for panel in all_panels[max(0, panels - columns) : panels]:
        panel.set_xlabel(label)
        panel.tick_params(labelbottom=True)


def _curves(answer: FrequencyResponse, answers: Sequence[FrequencyResponse]) -> list[Curve]:
    """The curves of one of several responses: one if its directions are alike, with their looks."""
    values = list(dict.fromkeys(_values(a) for a in answers))
    if (number := values.index(_values(answer))) >= MOST_CURVES:
        return []
    directions = list(answer.directions)
    alike = len(directions) > 1 and all(
        _alike(answer, name) for name in ("mean_power", "voltage_rms")
    )
    engines = list(dict.fromkeys(a.engine for a in answers))
    curves = []
    for direction in directions[:1] if alike else directions:
        look = dict(_LOOKS[direction]) | {"label": _WORDS[direction]}
        if alike:
            look |= {"label": "up and down the frequencies, alike", "marker": "o"}
        if len(answers) > 1:
            way = "" if alike or len(directions) == 1 else direction
            look |= _among_others(answer.engine, values, number, len(engines) > 1, way)
        points = len(answer.sweep(direction))
        look["markersize"] = 0 if points >= _FEW else 3 if points < _MANY else 2
        curves.append((answer, direction, look))
    return curves


def _among_others(
    engine: str, values: Sequence[str], number: int, engines: bool, direction: str
) -> dict[str, Any]:
    """The look of one of several responses: its colour by the value or the engine, its marker by the engine."""
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


def _sizes(
    axes: Axes, curves: Sequence[Curve], name: str, words: str, unit: str, hertz: float, per_g: int
) -> None:
    """Draw one quantity of all curves, over the level to the power of ``per_g``."""
    if per_g:
        words, unit = (
            f"{words} per g{'²' if per_g == 2 else ''}",
            f"{unit}/g{'^2' if per_g == 2 else ''}",
        )
    drawn = []
    for answer, direction, look in curves:
        values = [(p.frequency, getattr(p, name)) for p in answer.sweep(direction)]
        known = [(f, v) for f, v in values if v is not None]
        over = (answer.level or 1.0) ** per_g
        f, y, error = (np.array([part(f, v) for f, v in known]) for part in _PARTS)
        drawn.append((f, y / over, error / over, look))
    y_scale = scale(words, unit, np.concatenate([y for _, y, _, _ in drawn]))
    for f, y, error, look in drawn:
        curve(axes, f / hertz, y / y_scale.factor, error / y_scale.factor, look)
    axes.set_ylabel(broken(y_scale.label, _LETTERS))
    axes.set_ylim(0.0, None)


_PARTS: Any = (lambda f, v: f, lambda f, v: v.value, lambda f, v: v.known_error95)


def _phases(axes: Axes, curves: Sequence[Curve], hertz: float, physical: bool) -> None:
    """Draw the voltage's phase."""
    known = [0.0]
    for answer, direction, look in curves:
        points = answer.sweep(direction)
        f = np.array([p.frequency for p in points]) / hertz
        phases = _unwrapped([p.voltage_phase for p in points])
        axes.plot(f, phases, **look | {"label": "_"})
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


def _bandwidths(top: Axes, curves: Sequence[Curve], hertz: float) -> None:
    """Draw each half-power bandwidth that is within its sweep as a wide pale bar at half the largest power."""
    label = "half-power bandwidth"
    for answer, direction, look in curves:
        if (edges := answer.edges(direction)) is None:
            continue
        half = 0.5 * answer.peak(direction).mean_power.value / _power_scale(answer)
        bar: dict[str, Any] = {
            "linewidth": 3.5,
            "alpha": 0.5,
            "color": look["color"],
            "solid_capstyle": "butt",
        }
        top.plot([edge / hertz for edge in edges], [half, half], **bar, label=label)
        label = "_"


def _power_scale(answer: FrequencyResponse) -> float:
    """The divisor of the powers of a response alone."""
    powers = [p.mean_power.value for d in answer.directions for p in answer.sweep(d)]
    return scale("", answer.unit_names.power, powers).factor


def _peak(answer: FrequencyResponse, direction: str, look: dict[str, Any], hertz: float) -> Label:
    """The label of the largest power: how much, and at which frequency."""
    peak = answer.peak(direction)
    of = answer.unit_names
    text = f"{amount(float(f'{peak.mean_power.value:.3g}'), of.power)}\nat {amount(peak.frequency, of.frequency)}"
    at = np.array([[peak.frequency / hertz, peak.mean_power.value / _power_scale(answer)]])
    return Label(text, look["color"], at)


def _alike(answer: FrequencyResponse, name: str) -> bool:
    """Whether the curves of both directions are closer everywhere than a line is wide."""
    a, b = (np.array([getattr(p, name).value for p in answer.sweep(d)]) for d in answer.directions)
    return len(a) == len(b) and bool(
        np.max(np.abs(a - b)) <= _ALIKE * max(np.abs(a).max(), np.abs(b).max())
    )


def _note(curves: Sequence[Curve], several: int) -> str:
    """The meaning of the error bars; their size if they are too small to be seen; which curves are not drawn."""
    everything: list[Value] = [p.mean_power for a, d, _ in curves for p in a.sweep(d)]
    error = max(v.known_error95 for v in everything)
    largest = max(abs(v.value) for v in everything)
    shown = len({id(a) for a, _, _ in curves})
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
    points = max(len(a.sweep(d)) for a, d, _ in curves)
    return f"{'Bars' if points <= MOST_BARS else 'Bands'}: 95 % sampling and step.{left}"
