"""The table of the cost of accuracy, its Pareto front, and its entry for a requested accuracy."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.uncertainty.value import Value, two_digits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TARGETS = (0.1, 0.03, 0.01, 0.003)


@dataclass(frozen=True)
class CostRow:
    """The time and errors of one engine at one setting; None: it does not apply, or is not known.

    Step and duration as for ``--dt``; errors and biases relative; ``warm_up_seconds`` is the time
    that the run used in addition to its computation: imports, compilation, start of ngspice, as far
    as no earlier row had paid for it.
    """

    engine: str
    setting: str = ""
    step: float | None = None
    duration: float | None = None
    trajectories: int | None = None
    reltol: float | None = None
    noise: str = ""
    mean_power: float | None = None
    seconds: float | None = None
    warm_up_seconds: float | None = None
    sampling_error: float | None = None
    step_bias: float | None = None
    step_bias_stderr: float | None = None
    model_bias: float | None = None
    model_bias_stderr: float | None = None
    total_error: float | None = None
    best: bool = False  # no other is as fast and as accurate
    error: str = ""


class Cost(TableResult):
    """The cost of accuracy: all rows, the reference that they are measured against, and the engines that refused.

    ``reference`` names the finest engine, ``power`` is its mean power.
    """

    DERIVED = ("mean_power", "front", "seconds_needed", "table")
    INTERNAL = frozenset({"rows"})
    NOT_SHOWN = frozenset({"power", "refused", "table"})
    NOT_IN_JSON = frozenset({"mean_power", "front"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"table": "rows"}
    SHORT = ("reference", "power", "rows")

    rows: tuple[CostRow, ...]
    reference: str
    power: Value
    refused: dict[str, str]
    physical: bool = False

    @property
    def best(self) -> list[CostRow]:
        """The Pareto front, fastest first."""
        return sorted((row for row in self.rows if row.best), key=lambda row: row.seconds or 0.0)

    @property
    def mean_power(self) -> Value:
        """The mean power of the reference."""
        return self.power

    @property
    def engines(self) -> list[str]:
        """The engines that were measured."""
        return list(dict.fromkeys(row.engine for row in self.rows if not row.error))

    @property
    def table(self) -> Table:
        """All rows, as cost.csv has them."""
        units = self.unit_names
        unit_of = dict.fromkeys(("step", "duration"), units.time)
        unit_of["mean_power"] = units.power
        return Table(
            tuple(
                Column(
                    field.name,
                    [getattr(row, field.name) for row in self.rows],
                    unit_of.get(field.name, ""),
                )
                for field in dataclasses.fields(CostRow)
            )
        )

    @property
    def front(self) -> Table:
        """The settings that no other beats in both time and error."""
        return errors_of(
            self.best,
            f"no other is as fast and as accurate (errors relative to {self.reference!r})",
        )

    @property
    def seconds_needed(self) -> Table:
        """The seconds in which each engine reaches each of `TARGETS`, and the fastest that was measured."""
        columns = [Column("within", [100.0 * target for target in TARGETS], "%")]
        by_engine = {
            name: [self.needed(name, target) for target in TARGETS] for name in self.engines
        }
        for name, needed in by_engine.items():
            cells = [
                "-" if n is None else f"{'' if n[1] else '~'}{two_digits(n[0])}" for n in needed
            ]
            columns.append(Column(name, cells, label=name))
        title = "seconds to know the mean power (~: a prediction; -: its biases are not known to be smaller)"
        return Table(
            (*columns, Column("fastest", [self.fastest(target)[0] for target in TARGETS])), title
        )

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The uncounted parts, which settings failed, and which engines did not run."""
        unknown = any(row.step is not None and row.step_bias is None for row in self.rows)
        failed = [
            warning("setting_failed", row.engine, setting=row.setting, why=row.error)
            for row in self.rows
            if row.error
        ]
        refused = [note("did_not_run", name, why=why) for name, why in self.refused.items()]
        return (*[note("step_bias_not_counted")] * unknown, *failed, *refused)

    def fastest(self, target: float) -> tuple[str, float | None]:
        """The engine that reached a total error in the least time, and that; an empty name if none did."""
        needed = {name: self.needed(name, target) for name in self.engines}
        measured = {name: n[0] for name, n in needed.items() if n is not None and n[1]}
        name = min(measured, key=lambda name: measured[name], default="")
        return name, measured.get(name)

    def needed(self, engine: str, within: float) -> tuple[float, bool] | None:
        """The seconds in which an engine reaches a total error, and whether they were measured or (False) predicted.

        Measured: the fastest row that reaches it.  A prediction prolongs a row until sampling has
        the part its biases leave, seconds (sampling/rest)^2; None if no row's biases leave
        anything.
        """
        rows = [
            (row.seconds, row.sampling_error or 0.0, row.total_error)
            for row in self.rows
            if row.engine == engine
        ]
        known = [
            (s, sampling, total)
            for s, sampling, total in rows
            if s is not None and total is not None
        ]
        reached = [s for s, _, total in known if total <= within]
        if reached:
            return min(reached), True
        longer = [
            s * (e / (within - total + e)) ** 2 for s, e, total in known if total - e < within
        ]
        return (min(longer), False) if longer else None

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """Total error against seconds as a matplotlib figure."""
        return drawing.draw(self, title, ax)


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """The places of the points (seconds, error) that no other equals or betters in both, fastest first."""
    best: list[int] = []
    for index in sorted(range(len(points)), key=lambda k: points[k]):
        if not best or points[index][1] < points[best[-1]][1]:
            best.append(index)
    return best


def errors_of(rows: Sequence[CostRow], title: str) -> Table:
    """Settings with their seconds and their errors in percent."""
    columns = [
        Column(name, [getattr(row, name) for row in rows])
        for name in ("engine", "setting", "seconds")
    ]
    for name in ("sampling_error", "step_bias", "model_bias", "total_error"):
        errors = [getattr(row, name) for row in rows]
        columns.append(
            Column(name, [None if e is None else round(100.0 * e, 4) + 0.0 for e in errors], "%")
        )
    return Table(tuple(columns), title)
