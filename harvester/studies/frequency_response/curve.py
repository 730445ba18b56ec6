"""The points of a frequency response, and their summary: peak, half-power bandwidth, hysteresis."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from harvester.engines.sampling import UNLIKE
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.result import Result, TableResult
from harvester.presentation.sheet import table_of
from harvester.presentation.table import Cell, Column, Table
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Columns over the base's amplitude of so many g: their values and units.
PER_G: dict[str, tuple[Callable[[ResponsePoint, float], float], str]] = {
    "voltage_rms_per_g": (lambda point, level: point.voltage_rms.value / level, "V/g"),
    "mean_power_per_g2": (lambda point, level: point.mean_power.value / level**2, "W/g^2"),
}


class Failure(NamedTuple):
    """A frequency without a point, and why."""

    frequency: float
    error: str


class DirectionPeak(Result):
    """Largest power of one direction, its frequency, and the half-power bandwidth there (None: beyond the sweep)."""

    NOT_IN_JSON = frozenset({"direction"})
    NOT_SHOWN = frozenset({"points"})
    SHORT = ("direction", "peak_frequency", "peak_power")

    direction: str
    peak_power: Value
    peak_frequency: float
    half_power_bandwidth: float | None
    points: tuple[dict[str, Any], ...]


class FrequencyResponse(TableResult):
    """A frequency response: the points of the sweep up, then of the sweep down, each in the order in which it was made.

    Engine `Spice` runs through those of a linear mass once: the one direction is "from rest".

    Attributes
    ----------
    points : tuple of ResponsePoint
        a point for each frequency and direction, with ``frequency``, ``mean_power``,
        ``voltage_rms`` and ``displacement_rms``.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    remarks : tuple of Diagnostic
        warnings and notes next to those of the curve itself.
    resolved : bool
        whether the peak and its half-power points are among the points; else the peak is the best
        of them.
    engine : str
        the name of the engine that computed it.
    level : float or None
        the amplitude of the base's acceleration in g; None if absent.
    varied : mapping
        scene keys that this response has of its own, with their values in SI units.
    failures : tuple of Failure
        frequencies without a point, and why.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> curve = hv.response(scene, [0.9, 1.0, 1.1])
    >>> len(curve.points), curve.hysteresis
    (6, [])
    """

    DERIVED = ("sweeps", "hysteresis", "peaks")
    INTERNAL = frozenset({"points", "remarks", "resolved", "level"})
    NOT_SHOWN = frozenset({"varied", "failures", "sweeps", "hysteresis"})
    NOT_IN_JSON = frozenset({"peaks"})
    SHORT = ("engine", "points", "peaks")

    points: tuple[ResponsePoint, ...]
    physical: bool
    remarks: tuple[Diagnostic, ...] = ()
    resolved: bool = False
    engine: str = ""
    level: float | None = None
    varied: Mapping[str, float] = field(default_factory=dict)
    failures: tuple[Failure, ...] = ()

    @property
    def directions(self) -> list[str]:
        """The directions that it has points of, in their order."""
        return list(dict.fromkeys(p.direction for p in self.points))

    def sweep(self, direction: str) -> list[ResponsePoint]:
        """The points of one direction ("up", "down" or "from rest"), frequencies ascending."""
        return sorted(
            (p for p in self.points if p.direction == direction), key=lambda p: p.frequency
        )

    def peak(self, direction: str) -> ResponsePoint:
        """The frequency of the sweep with the largest power."""
        return max(self.sweep(direction), key=lambda p: p.mean_power.value)

    def bandwidth(self, direction: str) -> float | None:
        """The half-power bandwidth, between the `edges`.

        None if one of them is beyond the sweep.
        """
        edges = self.edges(direction)
        return None if edges is None else edges[1] - edges[0]

    def edges(self, direction: str) -> tuple[float, float] | None:
        """The frequencies to either side of the peak at which the power is half of it.

        None if one is beyond the sweep.

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
        """Frequencies at which up and down differ in E[v^2] by more than 1 % and their errors.

        Empty without both.
        """
        frequencies = list[float]()
        if not {"up", "down"} <= set(self.directions):
            return frequencies
        downwards = {down.frequency: down.mean_square_voltage for down in self.sweep("down")}
        for up in self.sweep("up"):
            a = up.mean_square_voltage
            b = downwards.get(up.frequency)
            if b is not None and abs(a.value - b.value) > 0.01 * max(a.value, b.value) + 2.0 * (
                a.known_error95 + b.known_error95
            ):
                frequencies.append(up.frequency)
        return frequencies

    def plot(
        self, title: str | None = "", per_g: bool = False, ax: "Axes | None" = None
    ) -> "Figure":
        """Draw power, voltage, displacement and phases against the frequency.

        ``per_g``: over the base's amplitude.
        """
        return drawing.draw(self, title, ax, per_g=per_g)

    @property
    def sweeps(self) -> dict[str, DirectionPeak]:
        """The peak of each direction, and its points as data."""
        return {direction: self._sweep(direction) for direction in self.directions}

    @property
    def peaks(self) -> Table:
        """The peaks: one row if up and down have the same."""
        rows = list(self.sweeps.values())
        if not self.hysteresis and len({row.peak_frequency for row in rows}) == 1:
            rows = [replace(rows[0], direction=" and ".join(self.directions))]
        return table_of(rows, "", self.unit_names)

    def _sweep(self, direction: str) -> DirectionPeak:
        best = self.peak(direction)
        points = list[dict[str, Any]]()
        for point in self.sweep(direction):
            per_g = (
                {}
                if self.level is None
                else {name: value(point, self.level) for name, (value, _) in PER_G.items()}
            )
            points.append(point.as_json() | per_g)
        return DirectionPeak(
            direction, best.mean_power, best.frequency, self.bandwidth(direction), tuple(points)
        )

    @property
    def table(self) -> Table:
        """Its points, then the frequencies that failed, with the reason in the last column."""
        names = self.unit_names
        points = self.points
        blank = [None] * len(self.failures)

        def column(name: str, unit: str, cells: list[Cell]) -> Column:
            return Column(name, [*cells, *blank], unit)

        frequencies = [
            *(p.frequency for p in points),
            *(failure.frequency for failure in self.failures),
        ]
        columns = [column("direction", "", [p.direction for p in points])]
        columns.append(Column("frequency", frequencies, names.frequency))
        units = {
            "voltage_rms": names.voltage,
            "mean_power": names.power,
            "displacement_rms": names.length,
        }
        units |= dict.fromkeys(("displacement_phase", "voltage_phase"), "degree")
        columns += [
            column(name, unit, [getattr(p, name) for p in points]) for name, unit in units.items()
        ]
        if self.level is not None:
            over = self.level
            columns += [
                column(name, unit, [of_g(p, over) for p in points])
                for name, (of_g, unit) in PER_G.items()
            ]
        columns.append(column("spread_of_trajectories", "", [p.spread for p in points]))
        columns.append(
            Column("error", [None] * len(points) + [failure.error for failure in self.failures])
        )
        return Table(tuple(columns), index=() if self.failures else ("direction", "frequency"))

    @property
    def differing(self) -> list[ResponsePoint]:
        """The points at which trajectories differ: several responses, or a chaotic one."""
        return [p for p in self.points if (p.spread or 0.0) > UNLIKE]

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Its remarks, and those of its points: places of the true peaks, hysteresis, failures and differences."""
        hertz = f" {self.unit_names.frequency}".rstrip()
        remarks = list(self.remarks)
        remarks += [remark for direction in self.directions for remark in self._where(direction)]
        f = [p.frequency for p in self.sweep(self.directions[0])]
        if not self.resolved and len(f) > 1:
            widest = max(b - a for a, b in itertools.pairwise(f))
            remarks.append(note("frequencies_apart", widest=widest, unit=hertz))
        if self.hysteresis:
            remarks.append(
                note("hysteresis", low=min(self.hysteresis), high=max(self.hysteresis), unit=hertz)
            )
        if differing := self.differing:
            most = max(p.spread or 0.0 for p in differing)
            remarks.append(
                warning("trajectories_differ", first=differing[0].frequency, unit=hertz, most=most)
            )
        if self.failures:
            first = self.failures[0]
            several = len(self.failures)
            numbers: Any = {"failed": several, "of": len(f) + several, "first": first.frequency}
            remarks.append(warning("frequencies_failed", unit=hertz, why=first.error, **numbers))
        return tuple(remarks)

    def _where(self, direction: str) -> list[Diagnostic]:
        """The place of the true peak: between the neighbours of the best point, or beyond the sweep."""
        f = [p.frequency for p in self.sweep(direction)]
        best = self.peak(direction).frequency
        hertz = f" {self.unit_names.frequency}".rstrip()
        if best in (f[0], f[-1]):
            return [note("peak_at_an_end", direction, at=best, unit=hertz)]
        if self.resolved:
            return []
        index = f.index(best)
        low = f[index - 1]
        high = f[index + 1]
        return [note("peak_between", direction, low=low, high=high, unit=hertz)]
