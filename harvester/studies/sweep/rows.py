"""The rows of a sweep as they stand in sweep.csv: one for each point and engine, all cells as text."""

import math
from collections.abc import Iterable, Iterator

from harvester.answers.estimate import Estimate
from harvester.errors import HarvesterError
from harvester.studies.output_folder import csv_lines
from harvester.uncertainty.value import Value

Row = dict[str, str]

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
    "responses",  # how many a steady drive has, where a search from many starts was made
)
TEXTS = ("error", "warnings")  # the columns of sentences
_ANSWER = ("mean_square_voltage", "mean_power", "seconds")  # a row without these is cut off


def lines(keys: Iterable[str], rows: Iterable[Row]) -> Iterator[str]:
    """The lines of sweep.csv: the varied keys, then `COLUMNS`."""
    names = [*keys, *COLUMNS]
    return csv_lines(names, ([row[name] for name in names] for row in rows))


def answered(estimate: Estimate) -> Row:
    """The row of a point that an engine answered."""

    def text(value: float | None) -> str:
        return "" if value is None else f"{value:.9g}"

    return {
        "engine": estimate.engine,
        "mean_square_voltage": text(estimate.mean_square_voltage.value),
        "mean_square_voltage_stderr": text(estimate.mean_square_voltage.stderr),
        "mean_power": text(estimate.mean_power.value),
        "mean_power_stderr": text(estimate.mean_power.stderr),
        "seconds": f"{estimate.seconds:.4g}",
        "error": "",
        "mean_power_bias": text(_bias(estimate.mean_power)),
        "warnings": "; ".join(map(str, estimate.warnings)),
        "responses": str(len(estimate.responses) or ""),
    }


def failed(engine: str, error: HarvesterError) -> Row:
    """The row of a point that failed."""
    return dict.fromkeys(COLUMNS, "") | {"engine": engine, "error": " ".join(str(error).split())}


def holds_an_answer(row: Row) -> bool:
    """Whether a row is whole, and of a point that did not fail."""
    return row["error"] == "" and all(_is_number(row[name]) for name in _ANSWER)


def _bias(value: Value) -> float | None:
    known = [error for error in (value.bias, value.model) if error is not None]
    return sum(known) if known else None


def _is_number(text: str | None) -> bool:
    try:
        return text is not None and math.isfinite(float(text))
    except ValueError:
        return False
