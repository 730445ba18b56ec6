"""The points of a frequency response, and what they say: peak, half-power bandwidth, hysteresis."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from harvester import figures
from harvester.engines.ensemble import UNLIKE
from harvester.errors import names_arguments
from harvester.printing.answer_units import AnswerUnits
from harvester.studies.output_folder import csv_text, named
from harvester.uncertainty.value import Value


@dataclass(frozen=True)
class ResponsePoint:
    """The response at one frequency (Hz; nondimensional: rad): mean square voltage and mean power in the scene's units.

    ``spread`` is that of the trajectories' E[V^2], relative to the largest; None where there is noise.
    """

    direction: str
    frequency: float
    mean_square_voltage: Value
    mean_power: Value
    spread: float | None

    @property
    def voltage_rms(self) -> Value:
        """The square root of E[v^2], with errors to first order."""
        v2 = self.mean_square_voltage
        root = math.sqrt(v2.value)
        stderr, bias, model = (
            None if e is None else e / (2.0 * root) if root > 0.0 else 0.0 for e in (v2.stderr, v2.bias, v2.model)
        )
        return Value(root, stderr, bias, model, unknown=v2.unknown)


@names_arguments
@dataclass(frozen=True)
class Response:
    """A frequency response: the points of the sweep up, then of the sweep down, each in the order in which it was made.

    ``resolved`` says that the peak and its half-power points are among them; else the peak is the best of the points.

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

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    def sweep(self, direction: str) -> list[ResponsePoint]:
        """The points of one direction ("up" or "down"), frequencies ascending."""
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
        """The frequencies where up and down differ in E[v^2] by more than 1 % and their errors."""
        found = []
        for up, down in zip(self.sweep("up"), self.sweep("down"), strict=True):
            a, b = up.mean_square_voltage, down.mean_square_voltage
            if abs(a.value - b.value) > 0.01 * max(a.value, b.value) + 2.0 * (a.error95 + b.error95):
                found.append(up.frequency)
        return found

    def plot(self, title: str | None = "") -> "figures.Plot":
        """Draw power and RMS voltage against the frequency as a matplotlib figure."""
        return figures.response(self, title)

    def text(self) -> str:
        """The CSV file."""
        names, of = ("voltage_rms", "mean_power"), self.unit_names
        heads = [named("frequency", of.frequency), named(names[0], of.voltage), named(names[1], of.power)]
        errors = [f"{name}_{error}" for name in names for error in ("stderr", "step_bias")]
        rows = []
        for p in self.points:
            values = (p.voltage_rms, p.mean_power)
            spread = "" if p.spread is None else f"{p.spread:.3g}"
            known = [e for v in values for e in (v.stderr, v.bias)]
            rows.append([p.direction, p.frequency, *(v.value for v in values), *known, spread])
        return csv_text(["direction", *heads, *errors, "spread_of_trajectories"], rows)

    def as_json(self) -> dict[str, object]:
        """The object that ``--json`` prints."""

        def number(value: Value) -> dict[str, float | None]:
            return {"value": value.value, "stderr": value.stderr, "step_bias": value.bias}

        sweeps = {}
        for direction in ("up", "down"):
            peak = self.peak(direction)
            sweeps[direction] = {
                "peak_frequency": peak.frequency,
                "peak_power": number(peak.mean_power),
                "half_power_bandwidth": self.bandwidth(direction),
                "points": [
                    {
                        "frequency": p.frequency,
                        "voltage_rms": number(p.voltage_rms),
                        "mean_power": number(p.mean_power),
                        "spread_of_trajectories": p.spread,
                    }
                    for p in self.sweep(direction)
                ],
            }
        return {"sweeps": sweeps, "hysteresis": self.hysteresis, "warnings": list(self.warnings)}

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

    def __str__(self) -> str:
        hertz, watt = self.unit_names.frequency, self.unit_names.power
        f = [p.frequency for p in self.sweep("up")]
        lines = []
        for direction in ("up", "down"):
            peak, width = self.peak(direction), self.bandwidth(direction)
            band = "not within the sweep" if width is None else f"{width:.4g} {hertz}".rstrip()
            at = f"{peak.frequency:.5g} {hertz}".rstrip()
            where = self._where(direction)
            lines.append(
                f"{direction:<5} peak {peak.mean_power.text(watt)} at {at}{where}; half-power bandwidth {band}"
            )
        if not self.resolved:
            widest = max(b - a for a, b in itertools.pairwise(f))
            lines.append(f"note: frequencies are up to {widest:.3g} {hertz} apart".rstrip())
        if self.hysteresis:
            low, high = min(self.hysteresis), max(self.hysteresis)
            lines.append(f"note: up and down differ between {low:.5g} and {high:.5g} {hertz}: hysteresis".rstrip())
        several = [p for p in self.points if (p.spread or 0.0) > UNLIKE]
        if several:
            lines.append(f"warning: at {len(several)} points trajectories differ: several responses, or a chaotic one")
        return "\n".join([*lines, *(f"warning: {word}" for word in self.warnings)])
