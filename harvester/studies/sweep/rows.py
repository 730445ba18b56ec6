"""The rows of a sweep: an engine's answer at a point, or why there is none.

In the journal, and as a table's columns.

Numbers have nine digits from the first, so that a row that is read from sweep.csv is the one that
was written there.
"""

import dataclasses
import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.errors import HarvesterError
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.presentation.glossary import term
from harvester.presentation.sheet import unit_of as unit_of_term
from harvester.presentation.table import FAILED, PARTS, Cell, Column, Table
from harvester.scene.keys import unit_of
from harvester.uncertainty.value import Value, percent

POWER = ("mean_power",)
QUANTITIES = ("mean_square_voltage", *POWER)
# The columns of sweep.csv behind the varied keys that come first, in this order; those of the other
# parts follow.
COLUMNS = (
    "engine",
    "mean_square_voltage",
    "mean_square_voltage_stderr",
    "mean_power",
    "mean_power_stderr",
    "seconds",
    "error",
    "mean_power_bias",  # estimated error of step and model, where the engine knows one
    "warnings",
    "responses",  # how many a steady excitation has, where a search from many starts was made
)
MOST_RESPONSES = 1_000_000  # of one point
AT_ONCE = 1000  # rows that are written at once


@dataclass(frozen=True)
class SweepRow:
    """An engine's answer at a point of a sweep, whose scene keys are those ``varied``, in SI units.

    Without an answer its numbers are None, and ``error`` states why.  ``responses`` is how many a
    steady excitation has, if a search from many starts was made; ``bound`` the most that any device
    of this mass could absorb from the excitation.

    >>> SweepRow.answered(Estimate("exact", False, Value(0.1), Value(0.2), {}, (), 0.0123, 0)).mean_power
    0.1
    """

    engine: str
    mean_square_voltage: Value | None = None
    mean_power: Value | None = None
    seconds: float | None = None
    error: str = ""
    warnings: tuple[Diagnostic, ...] = ()
    responses: int | None = None
    bound: float | None = None
    varied: Mapping[str, float] = field(default_factory=dict)

    @staticmethod
    def answered(estimate: Estimate) -> "SweepRow":
        """The row of a point that an engine answered."""
        return SweepRow(
            estimate.engine,
            _nine_digits(estimate.mean_square_voltage),
            _nine_digits(estimate.mean_power),
            seconds=float(f"{estimate.seconds:.4g}"),
            warnings=estimate.warnings,
            responses=len(estimate.responses) or None,
            bound=None if estimate.bound is None else float(f"{estimate.bound.value:.9g}"),
        )

    @staticmethod
    def failed(engine: str, error: HarvesterError) -> "SweepRow":
        """The row of a point that failed."""
        return SweepRow(engine, error=" ".join(str(error).split()))

    @staticmethod
    def read(text: str) -> "SweepRow":
        """The row that `written` wrote; ValueError, KeyError or TypeError if it did not."""
        parts = json.loads(text)
        values = {name: Value(**parts[name]) for name in QUANTITIES if name in parts}
        return SweepRow(
            **parts
            | values
            | {"warnings": tuple(Diagnostic(**w) for w in parts.get("warnings", ()))}
        )

    @property
    def written(self) -> str:
        """The row as JSON: for each value the parts that it has, for each warning its code and numbers."""
        parts = dataclasses.asdict(self, dict_factory=_without_empty)
        return json.dumps(parts, default=lambda scalar: scalar.item(), separators=(",", ":"))

    def with_units(self, units: Mapping[str, str]) -> "SweepRow":
        """The row with the units of its values, which a file of an earlier run lacks."""
        values = {name: getattr(self, name) for name in units}
        known = {
            name: dataclasses.replace(v, unit=units[name])
            for name, v in values.items()
            if v is not None
        }
        return (
            dataclasses.replace(self, **known)
            if any(values[name].unit != units[name] for name in known)
            else self
        )

    def at(self, varied: Mapping[str, float]) -> "SweepRow":
        """The row at values of the varied keys."""
        return dataclasses.replace(self, varied=varied)


def columns_of(keys: Sequence[str], rows: Sequence[SweepRow], units: AnswerUnits) -> Table:
    """The rows as a table: all the contents of sweep.csv."""
    columns = [
        Column(key, [row.varied[key] for row in rows], unit_of(key), exact=True) for key in keys
    ]
    columns += [Column("engine", [row.engine for row in rows])]
    for name in QUANTITIES:
        values = [getattr(row, name) for row in rows]
        columns.append(Column(name, values, unit_of_term(term(name), units), uncertain=True))
    columns += [
        Column("seconds", [row.seconds for row in rows], "s"),
        Column("error", [row.error for row in rows]),
        Column(
            "mean_power_bias",
            [row.mean_power and row.mean_power.systematic for row in rows],
            units.power,
        ),
        Column("warnings", ["; ".join(map(str, row.warnings)) for row in rows]),
        Column("responses", [row.responses for row in rows]),
        Column("bound", [row.bound for row in rows], units.power),
    ]
    return Table(tuple(columns), first=(*keys, *COLUMNS))


def powers_of(keys: Sequence[str], rows: Sequence[SweepRow], units: AnswerUnits) -> Table:
    """The rows as people read them: the powers with their total errors at 95 %."""
    powers: list[Cell] = [FAILED if row.mean_power is None else row.mean_power for row in rows]
    shown = [
        c
        for c in columns_of(keys, rows, units).columns
        if c.name in (*keys, "engine", *POWER, "seconds")
    ]
    shown = [dataclasses.replace(c, cells=powers) if c.name in POWER else c for c in shown]
    shares = [
        percent(row.mean_power.value, row.bound) if row.mean_power and row.bound else None
        for row in rows
    ]
    return Table((*shown, *([Column("share_of_possible", shares)] if any(shares) else [])))


def lines(keys: Sequence[str], rows: Iterable[SweepRow], units: AnswerUnits) -> Iterator[str]:
    """The lines of sweep.csv, made as they are written: a long sweep has more rows than memory needs to hold."""
    left = iter(rows)
    yield from columns_of(keys, [], units).csv_lines(units=False)
    while few := list(itertools.islice(left, AT_ONCE)):
        yield from itertools.islice(columns_of(keys, few, units).csv_lines(units=False), 1, None)


def read_cells(cells: Mapping[str, str]) -> SweepRow | None:
    """The row in a line of sweep.csv, without its keys.

    None if it was cut off or is of a point that failed.
    """
    try:
        voltage, power = (_read_value(cells, name) for name in QUANTITIES)
        responses = int(cells["responses"]) if cells["responses"] else None
        bound = _number(cells["bound"])
        seconds = float(cells["seconds"])
        if not (0.0 <= seconds < math.inf and (responses or 0) in range(MOST_RESPONSES)):
            return None
    except (
        ValueError,
        TypeError,
        KeyError,
        HarvesterError,
    ):  # no such cells; numbers that are none, or not finite
        return None
    if cells["error"]:
        return None
    earlier = (warning("said_by_earlier_run", text=cells["warnings"]),) if cells["warnings"] else ()
    return SweepRow(
        cells["engine"], voltage, power, seconds, warnings=earlier, responses=responses, bound=bound
    )


def _read_value(cells: Mapping[str, str], name: str) -> Value:
    """The value whose parts are in columns that begin with its name."""
    texts = {part: cells[name + end] for end, part in PARTS.items() if part != "error95"}
    parts: dict[str, Any] = {
        part: text if part == "unknown" else _number(text) for part, text in texts.items()
    }
    return Value(**parts)


def _without_empty(parts: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Names and parts without the empty ones: a short row, of which a long sweep has many."""
    return {name: part for name, part in parts if part is not None and part not in ("", (), {})}


def _nine_digits(value: Value) -> Value:
    parts: dict[str, Any] = dataclasses.asdict(value)
    parts |= {name: float(f"{part:.9g}") for name, part in parts.items() if isinstance(part, float)}
    return Value(**parts)


def _number(text: str) -> float | None:
    return float(text) if text else None
