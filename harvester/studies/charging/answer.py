"""The answer of a charging study: the time to a voltage and its spread, the curve, and the power on the way."""

from dataclasses import dataclass
from typing import Any

from harvester import figures
from harvester.arrays import Floats
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.studies.output_folder import csv_text, named
from harvester.uncertainty.value import Value, number

FEW = 20  # runs, of which 5 % are less than one


@dataclass(frozen=True)
class Level:
    """One voltage on the way: the store's energy there, and the times and the power that it takes to get there.

    ``time`` is None where a run never gets there; ``low`` and ``high`` are the times by which 5 and 95 % of the runs
    have; ``power`` is the mean from the level before, None where a run never gets there or the probe is not the store.
    """

    voltage: float
    energy: float | None
    reached: float
    time: Value | None
    low: float | None
    high: float | None
    power: Value | None


@names_arguments
@dataclass(frozen=True)
class ChargingResult:
    """How a circuit charges from empty, in the scene's units.

    ``time`` is the mean time to the ``target``, None where a run never reaches it within the ``duration``: then
    ``at_least`` is a lower bound, the mean with such a run counted as the duration.  ``reached`` is the share of
    ``runs`` that do, ``reached_between`` its 95 % interval; by the times ``low`` and ``high`` 5 and 95 % of them have.
    The curve has ``voltage``, the mean, its standard error (None for one run), and the 5 and 95 % ``quantiles`` over
    the runs at the times ``t``, and ``arrived``, the share that has reached the target by then; ``levels`` are voltages
    up to the target.  ``afterwards`` is the share of the time that the probe is at or above the target once it has been
    there, and ``rises`` how often a run rises to it; both are None where no ``duration`` was asked for, and by ideal.

    >>> import harvester as hv
    >>> scene = hv.load("examples/plate_bridge.toml")
    >>> found = hv.charge(scene, to="2 V", engine="ideal", trajectories=256)
    >>> found.reached, found.time.value > 0.0
    (1.0, True)
    """

    engine: str
    probe: str
    unit: str
    target: float
    duration: float
    runs: int
    reached: float
    reached_between: tuple[float, float]
    time: Value | None
    at_least: Value
    low: float | None
    high: float | None
    t: Floats
    voltage: Floats
    stderr: Floats | None
    quantiles: tuple[Floats, Floats]
    arrived: Floats
    levels: tuple[Level, ...]
    physical: bool
    seconds: float
    steps: int
    afterwards: Value | None = None
    rises: float | None = None
    reason: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    @property
    def strongest(self) -> Level | None:
        """The level on whose way the store takes the most power; None where that is not known."""
        known = [one for one in self.levels if one.power is not None]
        return max(known, key=lambda one: one.power.value if one.power else 0.0) if known else None

    def plot(self, title: str | None = "") -> "figures.Plot":
        """Draw the curve with its band, the share of runs that have arrived, and the power, as a matplotlib figure."""
        return figures.charging(self, title)

    def text(self) -> str:
        """The CSV file of the curve."""
        of = self.unit_names
        heads = [named("time", of.time), *(named(f"{self.probe}_{one}", self.unit) for one in ("mean", "low", "high"))]
        heads.append("share_arrived")
        rows = [self.t, self.voltage, *self.quantiles, self.arrived]
        if self.stderr is not None:
            heads, rows = [*heads, named(f"{self.probe}_mean_stderr", self.unit)], [*rows, self.stderr]
        return csv_text(heads, zip(*rows, strict=True))

    def levels_text(self) -> str:
        """The CSV file of the levels: times and power on the way to each, with their errors."""
        of = self.unit_names
        heads = [named(self.probe, self.unit), named("energy", "J" if self.physical else ""), "reached"]
        heads += [named(f"time_{one}", of.time) for one in ("mean", "stderr", "step_bias", "low", "high")]
        heads += [named(f"power_{one}", of.power) for one in ("mean", "stderr", "step_bias")]
        rows = []
        for one in self.levels:
            time, power = (
                (None, None, None) if value is None else (value.value, value.stderr, value.bias)
                for value in (one.time, one.power)
            )
            rows.append([one.voltage, one.energy, one.reached, *time, one.low, one.high, *power])
        return csv_text(heads, rows)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        time = {"value": None, "stderr": None} if self.time is None else number(self.time)
        return {
            "engine": self.engine,
            "probe": self.probe,
            "target": self.target,
            "time": time | {"low": self.low, "high": self.high},
            "at_least": number(self.at_least),
            "reached": self.reached,
            "reached_between": list(self.reached_between),
            "afterwards": None if self.afterwards is None else number(self.afterwards),
            "rises": self.rises,
            "runs": self.runs,
            "duration": self.duration,
            "levels": [
                {
                    "voltage": one.voltage,
                    "energy": one.energy,
                    "reached": one.reached,
                    "time": None if one.time is None else number(one.time),
                    "power": None if one.power is None else number(one.power),
                }
                for one in self.levels
            ],
            "seconds": self.seconds,
            "steps": self.steps,
            "reason": self.reason,
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        of, at = self.unit_names, f"{self.target:.6g} {self.unit}".rstrip()
        lines = [f"{self.engine}: {self.runs} run{'s' * (self.runs > 1)} from empty, {self.seconds:.2g} s"]
        if self.time is not None:
            rows = [[f"mean time to {at}", self.time.format(of.time)]]
        else:
            rows = [[f"mean time to {at}", "not known: runs that never get there have no time"]]
            rows.append(["at least", self.at_least.format(of.time)])
        if self.runs > 1:
            bounds = [
                "after the end" if one is None else f"{one:.4g} {of.time}".rstrip() for one in (self.low, self.high)
            ]
            low, high = (f"{100 * one:.3g}" for one in self.reached_between)
            rows.append(["5 and 95 % of runs", " and ".join(bounds)])
            rows.append(["reached", f"{self.reached:.1%} of the runs (95 %: {low} to {high} %)"])
        if self.afterwards is not None and self.rises is not None:
            times = f"{self.rises:.4g} time{'s' * (self.rises != 1.0)}"
            share = self.afterwards.scaled(100.0).format("")
            rows.append(["then at or above it", f"{share} % of the time; it rises to it {times}"])
        rows += self._energy()
        lines += columns(rows, "  ")
        lines += [f"  note: {self.reason}"] if self.reason else []
        return "\n".join([*lines, *(f"  warning: {word}" for word in self.warnings)])

    def _energy(self) -> list[list[str]]:
        """Rows of the energy in the store, and the power on the way."""
        last, best, of = self.levels[-1], self.strongest, self.unit_names
        if last.energy is None:
            return []
        rows = [["energy there", Value(last.energy).format("J" if self.physical else "")]]
        if self.time is not None:
            from harvester.studies.charging.passages import over

            rows.append(["mean power to there", over(last.energy, self.time).format(of.power)])
        if best is not None and best.power is not None:
            below = self.levels[self.levels.index(best) - 1].voltage if best is not self.levels[0] else 0.0
            way = f"{below:.3g} to {best.voltage:.3g} {self.unit}".rstrip()
            steps = f"the largest of {len(self.levels)} steps"
            rows.append(["power", f"{best.power.format(of.power)}, from {way}: {steps}"])
        return rows
