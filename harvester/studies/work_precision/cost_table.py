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
SHOWN = (*TARGETS, 0.001)  # the last one predicted, or measured by chance


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
    """The cost of accuracy: all rows, their reference, and the engines that refused.

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
        """The seconds of each engine to each of `SHOWN`, and the fastest that was measured.

        Each measured time is followed by its prediction from rows with larger errors.
        """
        columns = [Column("within", [100.0 * target for target in SHOWN], "%")]
        for name in self.engines:
            cells = [self._cell(name, target) for target in SHOWN]
            columns.append(Column(name, cells, label=name))
        title = (
            "seconds to the mean power (~: predicted; -: its biases are not known to be smaller)"
        )
        fastest = Column("fastest", [self.fastest(target)[0] for target in SHOWN])
        return Table((*columns, fastest), title)

    def _cell(self, engine: str, within: float) -> str:
        """The seconds to an error, measured and predicted."""
        needed, predicted = self.needed(engine, within), self.predicted(engine, within)
        texts = [] if needed is None or not needed[1] else [two_digits(needed[0])]
        texts += [] if predicted is None else [f"~{two_digits(predicted)}"]
        return " ".join(texts) or "-"

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
        """The engine that reached a total error first, and its seconds.

        An empty name if none did.
        """
        needed = {name: self.needed(name, target) for name in self.engines}
        measured = {name: n[0] for name, n in needed.items() if n is not None and n[1]}
        name = min(measured, key=lambda name: measured[name], default="")
        return name, measured.get(name)

    def needed(self, engine: str, within: float) -> tuple[float, bool] | None:
        """The seconds of an engine to a total error, measured (True) or predicted (False).

        Measured: the fastest row that reaches it; predicted: `predicted`, None if there is none.
        """
        reached = [s for s, _, total in self._known(engine) if total <= within]
        if reached:
            return min(reached), True
        predicted = self.predicted(engine, within)
        return None if predicted is None else (predicted, False)

    def predicted(self, engine: str, within: float) -> float | None:
        """The seconds in which an engine would reach a total error, by its rows with larger ones.

        A prediction prolongs a row until sampling has the part its biases leave,
        seconds (sampling/rest)^2; None if no row's biases leave anything.  A smaller error of
        `SHOWN` that is predicted sooner counts.
        """
        here = self._prolonged(engine, within)
        if here is None:
            return None
        beyond = [self._prolonged(engine, smaller) for smaller in SHOWN if smaller < within]
        return min([here, *(seconds for seconds in beyond if seconds is not None)])

    def _prolonged(self, engine: str, within: float) -> float | None:
        """The seconds of the row with a larger total error that is the soonest prolonged to one."""
        longer = [
            s * (e / (within - total + e)) ** 2
            for s, e, total in self._known(engine)
            if total - e < within < total
        ]
        return min(longer, default=None)

    def _known(self, engine: str) -> list[tuple[float, float, float]]:
        """The seconds, sampling error and total error of an engine's rows that have them."""
        return [
            (row.seconds, row.sampling_error or 0.0, row.total_error)
            for row in self.rows
            if row.engine == engine and row.seconds is not None and row.total_error is not None
        ]

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """Total error against seconds as a matplotlib figure."""
        return drawing.draw(self, title, ax)


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Places of the points (seconds, error) that no other is as good as in both, fastest first."""
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
