"""The curves of a sweep's figure: which rows make a curve, and the styles of engines and values of other keys.

One curve an engine: colour, line and marker are the engine's
(`harvester.presentation.engine_look`).  Several curves an engine, one for each value of the other
keys: the colour, dark to light, and the marker are the value's, and the line is the engine's.  Both
survive a grey print.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from harvester.arrays import Floats
from harvester.figures.quantities import values_in_words
from harvester.figures.style import INK, paler
from harvester.presentation.engine_look import look as look_of
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable

Rows = list[SweepRow]
VISIBLE = 1e-6  # relative error that a band shows
MOST_SHOWN = 2000  # points of a curve
FEW_POINTS = 30  # of a line, which show as markers
MOST_CURVES = 6  # values of the other keys
_MARKS = "osv^Dx"  # one for each value of the other keys
# every eye tells them apart
_COLOURS = ("#440154", "#3B528B", "#21908C", "#5DC863", "#E377C2", "#E67E22")


@dataclass(frozen=True)
class Levels:
    """Mean powers of rows and their errors, each of shape (n,), in W over the unit drawn.

    ``sampling`` are half the 95 % sampling interval and ``step`` the other errors of engines that
    sample; ``model`` is the error that an engine without samples states of itself.  All are 0 if
    absent; together they are the error of `Value.error95`, or the known part of it.
    """

    power: Floats
    sampling: Floats
    step: Floats
    model: Floats

    @staticmethod
    def of(rows: Rows, unit: float) -> "Levels":
        """The mean powers of some rows in units of ``unit``."""
        values = [row.mean_power for row in rows]
        power, sampling, whole = (
            np.array([np.nan if mean is None else getattr(mean, name) for mean in values]) / unit
            for name in ("value", "sampling95", "known_error95")
        )
        is_sampled = np.array(
            [mean is not None and mean.stderr is not None for mean in values], dtype=bool
        )
        rest = np.nan_to_num(whole - sampling)
        sampling = np.nan_to_num(sampling)
        return Levels(
            power, sampling, np.where(is_sampled, rest, 0.0), np.where(is_sampled, 0.0, rest)
        )

    @property
    def has_band(self) -> bool:
        """Whether an error is stated that is more than rounding."""
        return bool((self.model > VISIBLE * np.abs(self.power)).any())

    def over(self, base: "Levels") -> "Levels":
        """These powers over others at the same points, with the errors of both.

        The ``model`` is that of these.
        """
        ratio = _quotient(self.power, base.power)
        over_this, over_base = (_quotient(levels.sampling, levels.power) for levels in (self, base))
        size = np.abs(ratio)
        sampling = size * np.hypot(np.nan_to_num(over_this), np.nan_to_num(over_base))
        step = size * sum(
            np.nan_to_num(np.abs(_quotient(levels.step, levels.power))) for levels in (self, base)
        )
        model = size * np.nan_to_num(np.abs(_quotient(self.model, self.power)))
        return Levels(ratio, np.nan_to_num(sampling), np.nan_to_num(step), np.nan_to_num(model))


def groups(table: SweepTable) -> dict[str, dict[str, Rows]]:
    """Sort rows along the drawn axis into curves: for each value of the other keys, and each engine."""
    curve_axis = table.curve_axis
    others = (
        () if table.listed else tuple(axis for axis in table.axes if axis.key != curve_axis.key)
    )
    grouped: dict[tuple[float, ...], dict[str, Rows]] = {}
    for row in table.rows:
        grouped.setdefault(tuple(row.varied[a.key] for a in others), {}).setdefault(
            row.engine, []
        ).append(row)
    curves = {}
    for group, of_engine in grouped.items():
        words = values_in_words(
            (axis.key, value) for axis, value in zip(others, group, strict=True)
        )
        for rows in of_engine.values():
            rows.sort(key=lambda row: row.varied[curve_axis.key])
        curves[words] = {
            name: rows[:: -(-len(rows) // MOST_SHOWN)] for name, rows in of_engine.items()
        }
    return curves


def style(engine: str, table: SweepTable, number: int, groups: int, points: int) -> dict[str, Any]:
    """The style of an engine's curve at the ``number``-th of the ``groups`` of values of the other keys.

    Points of a list, which are not line, and a point alone are markers.
    """
    look = look_of(engine).style()
    alone = points == 1 or (table.listed and len(table.axes) > 1)
    if groups > 1:
        look["color"] = paler(colour(number, groups), look_of(engine).paler)
    if alone:
        look |= {"linestyle": "none", "marker": look_of(engine).marker, "markersize": 5}
    elif (
        groups == 1
        and points <= FEW_POINTS
        and look["linestyle"] != "none"
        and "linewidth" not in look
    ):
        # straight lines between points are no results
        look |= {"marker": look_of(engine).marker, "markersize": 4.5}
    elif groups > 1:
        marks = look.get("linestyle") == "none"  # hollow, over the filled ones of the lines
        look |= {
            "marker": _MARKS[number],
            "markersize": 6 if marks else 3.5,
            "markevery": max(1, points // 15),
        }
        look |= {"markerfacecolor": "none" if marks else look["color"]}
    return look


def legend_lines(curves: dict[str, Any], engines: list[str], points: int) -> list[Line2D]:
    """The legend entries if there are several values of the other keys: the engines in ink, then each value."""
    if len(curves) < 2:
        return []
    entries = []
    for engine in engines:
        look: dict[str, Any] = {"color": paler(INK, look_of(engine).paler), "label": engine}
        look |= {
            k: v
            for k, v in look_of(engine).style().items()
            if k in ("linestyle", "linewidth", "marker", "label")
        }
        if points == 1:
            look |= {"linestyle": "none", "marker": look_of(engine).marker}
        entries.append(Line2D([], [], markerfacecolor="none", **look))
    marks: dict[str, Any] = {"linestyle": "none", "markersize": 4.5}
    return entries + [
        Line2D([], [], color=colour(n, len(curves)), marker=_MARKS[n], label=label, **marks)
        for n, label in enumerate(curves)
    ]


def colour(number: int, groups: int) -> str:
    """The colour of the ``number``-th of ``groups`` values: from dark to light, as far apart as there are colours."""
    return _COLOURS[round(number * (len(_COLOURS) - 1) / max(1, groups - 1))]


def _quotient(values: Floats, by: Floats) -> Floats:
    """Values divided by others; nan if these are 0."""
    quotients: Floats = np.divide(values, by, out=np.full(len(values), np.nan), where=by != 0.0)
    return quotients
