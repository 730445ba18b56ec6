"""The answer of a search for the largest power: the keys with intervals, the power there, other peaks, what it took."""

from dataclasses import dataclass
from typing import Any

from harvester import figures
from harvester.answers.estimate import Estimate
from harvester.errors import HarvesterError, names_arguments
from harvester.scene.keys import unit_of
from harvester.studies.optimum.evaluations import Evaluation
from harvester.studies.optimum.ranges import Range
from harvester.studies.output_folder import csv_text
from harvester.uncertainty.value import Value, amount, number

_ENDS = {-1: "low", 1: "high"}


@dataclass(frozen=True)
class OptimalKey:
    """A key's best value and its interval (None: see `Optimum.why`); ``boundary`` is the end of the range there."""

    range: Range
    value: float
    low95: float | None
    high95: float | None
    boundary: str | None

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return {name: getattr(self, name) for name in ("value", "low95", "high95", "boundary")}

    def __str__(self) -> str:
        unit = unit_of(self.range.key)
        text = f"{amount(self.value, unit)}"
        if self.low95 is not None and self.high95 is not None:
            text += f", between {amount(self.low95, unit)} and {amount(self.high95, unit)}"
        if self.boundary:
            text += f" (the {self.boundary} end of its range: the best may lie beyond)"
        return text


@names_arguments
@dataclass(frozen=True)
class Optimum:
    """The largest mean power over ranges of keys.

    The interval of each key is where the optimum lies: at 95 % for an engine that samples (sampling, shape of the
    surface and bias of the step), within the model's stated error for a formula; ``why`` says why there is none.
    ``estimate`` is the engine's answer at the best place; an engine that samples makes it with noise that had no part
    in finding the place, for the highest power of many is too high.  ``peaks`` are all that were found, best first,
    each with its keys and power; ``flat`` says why no place is better than another, and is empty where one is.
    ``scanned`` is False where the budget ended before the whole range was looked at: more power may lie anywhere in it.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> best = hv.optimise(scene, {"nondimensional.mu": (0.1, 10.0)}, hv.Averaged())
    >>> best.keys[0].range.key, best.keys[0].boundary
    ('nondimensional.mu', None)
    """

    engine: str
    keys: tuple[OptimalKey, ...]
    estimate: Estimate
    peaks: tuple[tuple[dict[str, float], Value], ...]
    why: str
    flat: str
    points: tuple[Evaluation, ...]
    seconds: float
    warnings: tuple[str, ...]
    scanned: bool = True

    @property
    def mean_power(self) -> Value:
        """The mean power at the best place."""
        return self.estimate.mean_power

    @property
    def evaluations(self) -> dict[str, int]:
        """The number of evaluations by each engine."""
        names = [p.engine for p in self.points]
        return {name: names.count(name) for name in dict.fromkeys(names)}

    @property
    def failed(self) -> int:
        """The number of evaluations by the engine itself that failed."""
        return sum(p.engine == self.engine and isinstance(p.answer, HarvesterError) for p in self.points)

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The evaluations and the optimum as a matplotlib figure."""
        return figures.optimum(self, title)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return {
            "engine": self.engine,
            "keys": {key.range.key: key.as_json() for key in self.keys},
            "mean_power": number(self.mean_power),
            "reason": self.estimate.reason,
            "no_interval": self.why,
            "flat": self.flat,
            "scanned": self.scanned,
            "peaks": [{"keys": keys, "mean_power": number(power)} for keys, power in self.peaks],
            "evaluations": len(self.points),
            "evaluations_by_engine": self.evaluations,
            "failed": self.failed,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        unit = self.estimate.unit_names.power
        counts = ", ".join(f"{count} by {name}" for name, count in self.evaluations.items())
        width = max(len(key.range.key) for key in self.keys)
        lines = [f"{self.engine}: {self.seconds:.2g} s, {len(self.points)} evaluations ({counts})"]
        lines += [f"  {key.range.key:<{width}}  {key}" for key in self.keys]
        lines.append(f"  {'mean power':<{width}}  {self.mean_power.format(unit)}")
        if self.estimate.reason and self.mean_power.stderr is None:
            lines.append(f"  note: {self.estimate.reason}")
        if self.flat:
            lines.append(f"  flat: {self.flat}")
        elif self.why:
            lines.append(f"  no interval of the keys: {self.why}")
        for keys, power in self.peaks[1:]:
            where = ", ".join(f"{name} = {amount(value, unit_of(name))}" for name, value in keys.items())
            lines.append(f"  another peak: {power.format(unit)} at {where}")
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings])

    def _repr_html_(self) -> str:
        from harvester.presentation import html

        unit = self.estimate.unit_names.power
        rows = [(key.range.key, str(key)) for key in self.keys]
        rows += [("mean power", self.mean_power.format(unit)), ("seconds", f"{self.seconds:.2g}")]
        notes = [f"flat: {self.flat}"] if self.flat else []
        notes += [f"no interval of the keys: {self.why}"] if self.why and not self.flat else []
        notes += [f"note: {self.estimate.reason}"] if self.estimate.reason else []
        return html.table(f"optimum by {self.engine}", (), rows, notes + html.warnings(self.warnings))

    def text(self) -> str:
        """The CSV file of all evaluations, in the order that they were made."""
        ranges = [key.range for key in self.keys]
        names = ("engine", "stage", "seed", "mean_power", "mean_power_stderr", "mean_power_bias", "seconds", "error")
        rows = []
        for p in self.points:
            numbers: list[object] = [None, None, None, "", str(p.answer)]
            if isinstance(p.answer, Estimate):
                power = p.answer.mean_power
                known = [error for error in (power.bias, power.model) if error is not None]
                numbers = [power.value, power.stderr, sum(known) if known else None, f"{p.answer.seconds:.4g}", ""]
            place = [repr(r.value(float(u))) for r, u in zip(ranges, p.u, strict=True)]
            rows.append([*place, p.engine, p.stage, p.seed, *numbers])
        return csv_text([*(r.key for r in ranges), *names], rows)


def end(face: float) -> str | None:
    """The name of the end of a range, from a face of the unit cube: -1 low, 1 high."""
    return _ENDS.get(int(face))
