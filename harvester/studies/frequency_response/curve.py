"""The points of a frequency response, and what they say: peak, half-power bandwidth, hysteresis."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harvester import figures
from harvester.engines.agreement import UNLIKE
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.studies.frequency_response.point import ResponsePoint, cells, failed_cells, heads
from harvester.studies.output_folder import csv_text
from harvester.uncertainty.value import number


@names_arguments
@dataclass(frozen=True)
class FrequencyResponse:
    """A frequency response: the points of the sweep up, then of the sweep down, each in the order in which it was made.

    Engine `spice` goes over those of a linear mass once: the one direction is "from rest".  ``resolved`` says that the
    peak and its half-power points are among them; else the peak is the best of the points.  ``level`` is the amplitude
    of the base's acceleration in g, None where there is none; ``varied`` are scene keys that this response has of its
    own, with their values in SI units; ``failures`` are frequencies without a point, and why.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> found = hv.response(scene, [0.9, 1.0, 1.1])
    >>> len(found.points), found.hysteresis
    (6, [])
    """

    points: tuple[ResponsePoint, ...]
    physical: bool
    warnings: tuple[str, ...] = ()
    resolved: bool = False
    engine: str = ""
    level: float | None = None
    varied: Mapping[str, float] = field(default_factory=dict)
    failures: tuple[tuple[float, str], ...] = ()

    @property
    def directions(self) -> list[str]:
        """The directions that it has points of, in their order."""
        return list(dict.fromkeys(p.direction for p in self.points))

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    def sweep(self, direction: str) -> list[ResponsePoint]:
        """The points of one direction ("up", "down" or "from rest"), frequencies ascending."""
        return sorted((p for p in self.points if p.direction == direction), key=lambda p: p.frequency)

    def peak(self, direction: str) -> ResponsePoint:
        """The frequency of the sweep with the largest power."""
        return max(self.sweep(direction), key=lambda p: p.mean_power.value)

    def bandwidth(self, direction: str) -> float | None:
        """The half-power bandwidth, between the `edges`; None where one of them is beyond the sweep."""
        edges = self.edges(direction)
        return None if edges is None else edges[1] - edges[0]

    def edges(self, direction: str) -> tuple[float, float] | None:
        """The frequencies to either side of the peak where the power is half of it; None if one is beyond the sweep.

        Linear between the frequencies of the sweep, whose spacing is the resolution.
        """
        points = self.sweep(direction)
        f = [p.frequency for p in points]
        power = np.array([p.mean_power.value for p in points])
        top = int(power.argmax())
        half = 0.5 * power[top]
        edges = []
        for way in (range(top, 0, -1), range(top, len(points) - 1)):
            step = -1 if way.step < 0 else 1
            crossing = next((k for k in way if power[k + step] <= half < power[k]), None)
            if crossing is None:
                return None
            share = (power[crossing] - half) / (power[crossing] - power[crossing + step])
            edges.append(float(f[crossing] + share * (f[crossing + step] - f[crossing])))
        return edges[0], edges[1]

    @property
    def hysteresis(self) -> list[float]:
        """The frequencies where up and down differ in E[v^2] by more than 1 % and their errors; none without both."""
        found = list[float]()
        if not {"up", "down"} <= set(self.directions):
            return found
        downwards = {down.frequency: down.mean_square_voltage for down in self.sweep("down")}
        for up in self.sweep("up"):
            a, b = up.mean_square_voltage, downwards.get(up.frequency)
            if b is not None and abs(a.value - b.value) > 0.01 * max(a.value, b.value) + 2.0 * (
                a.known_error95 + b.known_error95
            ):
                found.append(up.frequency)
        return found

    def plot(self, title: str | None = "", per_g: bool = False) -> "figures.Plot":
        """Draw power, voltage, displacement and phases against the frequency; ``per_g``: over the base's amplitude."""
        return figures.response([self], title, per_g)

    def text(self) -> str:
        """The CSV file."""
        return csv_text(heads(self.unit_names), self.rows())

    def rows(self) -> list[Sequence[object]]:
        """The rows of the CSV file: those of the points, then those of the frequencies that failed."""
        failed = [failed_cells(*failure, self.unit_names) for failure in self.failures]
        return [*(cells(p, self.level) for p in self.points), *failed]

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        sweeps = {}
        for direction in self.directions:
            peak = self.peak(direction)
            sweeps[direction] = {
                "peak_frequency": peak.frequency,
                "peak_power": number(peak.mean_power),
                "half_power_bandwidth": self.bandwidth(direction),
                "points": [p.as_json(self.level) for p in self.sweep(direction)],
            }
        failed = [{"frequency": f, "error": why} for f, why in self.failures]
        told = {"sweeps": sweeps, "hysteresis": self.hysteresis, "warnings": list(self.warnings)}
        return {"engine": self.engine, "varied": dict(self.varied), **told, "failures": failed}

    def _where(self, direction: str) -> str:
        """Where the true peak may be: between the neighbours of the best point, or beyond the sweep."""
        f, best = [p.frequency for p in self.sweep(direction)], self.peak(direction).frequency
        if best in (f[0], f[-1]):
            return ", an end of the sweep (a higher one may lie beyond)"
        if self.resolved:
            return ""
        place = f.index(best)
        between = f"{f[place - 1]:.5g} and {f[place + 1]:.5g} {self.unit_names.frequency}".rstrip()
        return f", the best of the sweep (the true one lies between {between})"

    def bandwidth_text(self, direction: str) -> str:
        """The half-power bandwidth in words."""
        width = self.bandwidth(direction)
        return "not within the sweep" if width is None else f"{width:.4g} {self.unit_names.frequency}".rstrip()

    @property
    def differing(self) -> list[ResponsePoint]:
        """The points at which trajectories differ: several responses, or a chaotic one."""
        return [p for p in self.points if (p.spread or 0.0) > UNLIKE]

    def notes(self) -> list[str]:
        """Lines that qualify the peaks, beside hysteresis: how far points are apart, what failed, warnings."""
        hertz, lines = self.unit_names.frequency, list[str]()
        f = [p.frequency for p in self.sweep(self.directions[0])]
        if not self.resolved and len(f) > 1:
            widest = max(b - a for a, b in itertools.pairwise(f))
            lines.append(f"note: frequencies are up to {widest:.3g} {hertz}".rstrip() + " apart")
        if self.failures:
            first, why = self.failures[0]
            at = f"{first:.5g} {hertz}".rstrip()
            lines.append(f"failed at {len(self.failures)} of {len(f) + len(self.failures)} frequencies, as {at}: {why}")
        return [*lines, *(f"warning: {word}" for word in self.warnings)]

    def __str__(self) -> str:
        lines = []
        for direction in self.directions:
            peak = self.peak(direction)
            at = f"{peak.frequency:.5g} {self.unit_names.frequency}".rstrip()
            power, band = peak.mean_power.format(self.unit_names.power), self.bandwidth_text(direction)
            lines.append(f"{direction:<5} peak {power} at {at}{self._where(direction)}; half-power bandwidth {band}")
        if self.hysteresis:
            ends = [f"{f:.5g}" for f in (min(self.hysteresis), max(self.hysteresis))]
            where = f"at {ends[0]}" if ends[0] == ends[1] else f"between {ends[0]} and {ends[1]}"
            lines.append(f"note: up and down differ {where} {self.unit_names.frequency}".rstrip() + ": hysteresis")
        if several := self.differing:
            lines.append(f"warning: at {len(several)} points trajectories differ: several responses, or a chaotic one")
        return "\n".join([*lines, *self.notes()])
