"""Several frequency responses side by side: of several values of scene keys, such as loads, and by several engines."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from harvester import figures
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.scene.keys import unit_of
from harvester.studies.frequency_response.curve import FrequencyResponse
from harvester.studies.frequency_response.point import heads
from harvester.studies.output_folder import csv_text, named
from harvester.uncertainty.value import Value, amount, percent

MOST_ROWS = 60


@names_arguments
@dataclass(frozen=True)
class FrequencyResponses:
    """Responses over the same frequencies, one for each engine and combination of the varied keys' values.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> found = hv.responses(scene, [0.9, 1.0, 1.1], {"nondimensional.mu": [0.5, 2.0]})
    >>> [(curve.varied, curve.peak("up").frequency) for curve in found.curves]
    [({'nondimensional.mu': 0.5}, 1.0), ({'nondimensional.mu': 2.0}, 1.0)]
    """

    curves: tuple[FrequencyResponse, ...]

    @property
    def keys(self) -> list[str]:
        """The varied scene keys."""
        return list(self.curves[0].varied)

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return self.curves[0].unit_names

    def plot(self, title: str | None = "", per_g: bool = False) -> "figures.Plot":
        """Draw the curves; of many values of one key a map of the power over frequency and value."""
        return figures.response(self.curves, title, per_g)

    def text(self) -> str:
        """The CSV file: the varied keys and the engine, then the columns of one response."""
        units = {key: unit_of(key) for key in self.keys}
        own = [named(key, "" if unit == "1" else unit) for key, unit in units.items()]
        rows = [[*c.varied.values(), c.engine, *row] for c in self.curves for row in c.rows()]
        return csv_text([*own, "engine", *heads(self.unit_names)], rows)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: that of the one response, or ``responses``, one of each."""
        if len(self.curves) == 1:
            return self.curves[0].as_json()
        return {"responses": [curve.as_json() for curve in self.curves]}

    def __str__(self) -> str:
        if len(self.curves) == 1:
            return str(self.curves[0])
        of, rows = self.unit_names, list[Sequence[str]]()
        for curve in self.curves:
            values = [amount(value, unit_of(key)) for key, value in curve.varied.items()]
            directions = curve.directions
            same = not curve.hysteresis and curve.peak(directions[0]).frequency == curve.peak(directions[-1]).frequency
            for direction in directions[:1] if same else directions:
                peak, words = curve.peak(direction), " and ".join(directions) if same else direction
                at = f"{peak.frequency:.5g} {of.frequency}".rstrip()
                power = [amount(peak.mean_power.value, of.power), _error(peak.mean_power)]
                rows.append([*values, curve.engine, words, *power, at, curve.bandwidth_text(direction)])
        left, rows = len(rows) - MOST_ROWS, rows[:MOST_ROWS]
        head = [*self.keys, "engine", "direction", "peak power", "error, 95 %", "at", "half-power bandwidth"]
        lines = columns([head, *rows])
        if left > 0:
            lines.append(f"({left} rows more: see response.csv)")
        if several := sum(bool(curve.hysteresis) for curve in self.curves):
            lines.append(f"note: up and down differ in {several} of {len(self.curves)} responses: hysteresis")
        if several := sum(len(curve.differing) for curve in self.curves):
            lines.append(f"warning: at {several} points trajectories differ: several responses, or a chaotic one")
        return "\n".join([*lines, *dict.fromkeys(note for curve in self.curves for note in curve.notes())])


def _error(power: Value) -> str:
    """The whole error at 95 % in percent, or what of it is known."""
    if power.value == 0.0 or (power.stderr is None and power.bias is None):
        return "not known"
    share = percent(power.known_error95, power.value)
    return f"at least {share}" if power.unknown else share
