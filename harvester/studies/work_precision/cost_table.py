"""The table of what accuracy costs, its Pareto front, and what it says of an accuracy that is asked for."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

from harvester import figures
from harvester.presentation.columns import columns
from harvester.studies.output_folder import csv_text
from harvester.uncertainty.value import Value

TARGETS = (0.1, 0.03, 0.01, 0.003)


@dataclass(frozen=True)
class CostRow:
    """The time and errors of one engine at one setting; None is what does not apply, or is not known.

    Step and duration as for ``--dt``; errors and biases relative; ``warm_up_seconds`` is what the run took beside its
    computation: imports, compilation, start of ngspice, as far as no earlier row had paid for it.
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


@dataclass(frozen=True)
class Cost:
    """What accuracy costs: all rows, the reference that they are measured against, and the engines that refused.

    ``reference`` names the finest engine, ``power`` is its mean power.
    """

    rows: tuple[CostRow, ...]
    reference: str
    power: Value
    refused: dict[str, str]

    @property
    def best(self) -> list[CostRow]:
        """The Pareto front, fastest first."""
        return sorted((row for row in self.rows if row.best), key=lambda row: row.seconds or 0.0)

    def text(self) -> str:
        """The CSV file."""
        return csv_text([f.name for f in dataclasses.fields(CostRow)], (vars(row).values() for row in self.rows))

    def needed(self, engine: str, within: float) -> tuple[float, bool] | None:
        """The seconds in which an engine reaches a total error, and whether they were measured or (False) predicted.

        Measured is the fastest row that reaches it.  A prediction prolongs a row until sampling takes what its biases
        leave, seconds (sampling/rest)^2; None where no row's biases leave anything.
        """
        rows = [(row.seconds, row.sampling_error or 0.0, row.total_error) for row in self.rows if row.engine == engine]
        known = [(s, sampling, total) for s, sampling, total in rows if s is not None and total is not None]
        reached = [s for s, _, total in known if total <= within]
        if reached:
            return min(reached), True
        longer = [s * (e / (within - total + e)) ** 2 for s, e, total in known if total - e < within]
        return (min(longer), False) if longer else None

    def needed_cells(self) -> tuple[list[str], list[list[str]]]:
        """The engines, and for each of `TARGETS` each one's seconds in words and the fastest measured."""
        engines = list(dict.fromkeys(row.engine for row in self.rows if not row.error))
        rows = []
        for target in TARGETS:
            needed = {name: self.needed(name, target) for name in engines}
            measured = {name: one[0] for name, one in needed.items() if one is not None and one[1]}
            cells = ["-" if one is None else f"{'' if one[1] else '~'}{one[0]:.2g}" for one in needed.values()]
            rows.append([*cells, min(measured, key=lambda name: measured[name], default="")])
        return engines, rows

    def plot(self, title: str | None = "") -> "figures.Plot":
        """Total error against seconds as a matplotlib figure."""
        known = ((row.engine, row.seconds, row.total_error, row.best) for row in self.rows)
        return figures.cost([(name, s, error, best) for name, s, error, best in known if s and error], title)


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """The places of the points (seconds, error) that no other equals or betters in both, fastest first."""
    best: list[int] = []
    for place in sorted(range(len(points)), key=lambda k: points[k]):
        if not best or points[place][1] < points[best[-1]][1]:
            best.append(place)
    return best


def report(cost: Cost) -> str:
    """The text that the command prints: the front, and each engine's seconds for each of `TARGETS`."""
    cells = [["engine", "setting", "seconds", "sampling", "step", "model", "total"]]
    for row in cost.best:
        errors = (row.sampling_error, row.step_bias, row.model_bias, row.total_error)
        cells.append([row.engine, row.setting, f"{row.seconds:.2g}", *(_percent(error) for error in errors)])
    lines = [f"no other is as fast and as accurate (errors relative to {cost.reference!r}):", *columns(cells, "  ")]
    engines, needed = cost.needed_cells()
    cells = [["within", *engines, "fastest"]]
    cells += [[f"{100 * target:g} %", *row] for target, row in zip(TARGETS, needed, strict=True)]
    lines += [
        "seconds to know the mean power (~: a prediction; -: its biases are not known to be smaller):",
        *columns(cells, "  "),
    ]
    if any(row.step is not None and row.step_bias is None for row in cost.rows):
        lines.append("the bias of the step is not known for a netlist of one's own, and not counted")
    lines += [f"{row.engine} ({row.setting}) failed: {row.error}" for row in cost.rows if row.error]
    return "\n".join(lines + [f"{name} did not run: {why}" for name, why in cost.refused.items()])


def _percent(error: float | None) -> str:
    return "" if error is None else f"{error:.2%}".replace("-0.00%", "0.00%")
