"""A sweep's rows as they are printed on a terminal and in a notebook: powers with their errors at 95 %.

The mean square voltages and all digits are in sweep.csv.
"""

import itertools

from harvester.engines import Ideal
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.scene.keys import unit_of
from harvester.uncertainty.value import NORMAL_QUANTILE, amount, percent

MOST_ROWS = 60
WIDEST = 100  # letters of a line
FAILED, UNKNOWN = "failed", "not known"


def cells(rows: list[dict[str, str]], units: AnswerUnits) -> tuple[list[str], list[list[str]]]:
    """The heads of the columns, and the cells: the varied keys, the engine, the power, its error, and the seconds."""
    keys = list(itertools.takewhile(lambda name: name != "engine", rows[0] if rows else ()))
    of = {key: unit_of(key) for key in keys}
    body = [
        [*(amount(float(row[key]), of[key]) for key in keys), row["engine"], *_power(row, units), _seconds(row)]
        for row in rows
    ]
    return [*keys, "engine", "mean power", "error, 95 %", "seconds"], body


def grid(rows: list[dict[str, str]], units: AnswerUnits) -> str:
    """The table that a sweep ends with, at most `WIDEST` letters wide; of a long one the first and the last rows."""
    shown = rows if len(rows) <= MOST_ROWS else rows[: MOST_ROWS // 2] + rows[-MOST_ROWS // 2 :]
    head, body = cells(shown, units)
    lines = columns([head, *body], right=True)
    if max(map(len, lines)) > WIDEST:  # keys without their tables
        lines = columns([[name.rpartition(".")[2] for name in head], *body], right=True)
    if len(shown) < len(rows):
        lines.insert(1 + MOST_ROWS // 2, f"({len(rows) - len(shown)} rows more in sweep.csv)")
    return "\n".join(lines)


def warnings(rows: list[dict[str, str]]) -> list[str]:
    """The first warning of each engine, and at how many of its points it warned, or found several responses."""
    lines = _first_of_each(rows, "warnings", "warning")
    for engine in dict.fromkeys(row["engine"] for row in rows):
        found = [int(row["responses"]) for row in rows if row["engine"] == engine and row["responses"]]
        if several := [one for one in found if one > 1]:
            lines.append(
                f"{engine} finds several responses to the drive at {len(several)} of {len(found)} points, "
                f"{max(several)} at most: a run of such a point lists each with its mean"
            )
    return lines


def failures(rows: list[dict[str, str]]) -> list[str]:
    """Why the first point of each engine failed, and how many of its points did."""
    return _first_of_each(rows, "error", "failed")


def _first_of_each(rows: list[dict[str, str]], column: str, word: str) -> list[str]:
    """The first text of a column for each engine, and at how many of its points there is one."""
    lines = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        of_engine = [row for row in rows if row["engine"] == engine]
        told = [row[column] for row in of_engine if row[column]]
        if told:
            lines.append(f"{word}, {engine} at {len(told)} of {len(of_engine)} points: {told[0]}")
    return lines


def _power(row: dict[str, str], units: AnswerUnits) -> list[str]:
    """The mean power, and its whole error at 95 % in percent of it, or that a part of the error is not known."""
    if row["error"] or not row["mean_power"]:
        return [FAILED, ""]
    power = float(row["mean_power"])
    stderr, bias = row["mean_power_stderr"], row["mean_power_bias"]
    if not (stderr or bias) or power == 0.0:
        return [amount(power, units.power), UNKNOWN if power else ""]
    error = percent(NORMAL_QUANTILE * float(stderr or 0.0) + float(bias or 0.0), power)
    whole = bias and row["engine"] != Ideal.NAME  # what ideal diodes and switches make of the power is not known
    return [amount(power, units.power), error if whole else f"at least {error}"]


def _seconds(row: dict[str, str]) -> str:
    return f"{float(row['seconds']):.2g}" if row["seconds"] else ""
