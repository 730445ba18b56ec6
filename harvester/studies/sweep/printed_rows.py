"""A sweep's rows as they are printed on a terminal and in a notebook."""

from harvester.printing.answer_units import AnswerUnits
from harvester.printing.columns import columns

MOST_ROWS = 60


def cells(rows: list[dict[str, str]], units: AnswerUnits) -> tuple[list[str], list[list[str]]]:
    """The heads of the columns with their units, and the shortened cells; no column for errors where there are none."""
    known = {"mean_square_voltage": units.mean_square_voltage, "mean_power": units.power}
    unit_of = {name + end: f" ({unit})" for name, unit in known.items() if unit for end in ("", "_stderr", "_bias")}
    hidden = ("warnings", *(("error",) if not any(row["error"] for row in rows) else ()))
    names = [name for name in (rows[0] if rows else {}) if name not in hidden]
    return [name + unit_of.get(name, "") for name in names], [[_short(row[name]) for name in names] for row in rows]


def grid(rows: list[dict[str, str]], units: AnswerUnits) -> str:
    """The table that a sweep ends with; of a long one the first and the last rows."""
    shown = rows if len(rows) <= MOST_ROWS else rows[: MOST_ROWS // 2] + rows[-MOST_ROWS // 2 :]
    head, body = cells(shown, units)
    lines = columns([head, *body], right=True)
    if len(shown) < len(rows):
        lines.insert(1 + MOST_ROWS // 2, f"({len(rows) - len(shown)} rows more in sweep.csv)")
    return "\n".join(lines)


def warnings(rows: list[dict[str, str]]) -> list[str]:
    """The first warning of each engine, and at how many of its points it warned."""
    lines = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        of_engine = [row for row in rows if row["engine"] == engine]
        warned = [row["warnings"] for row in of_engine if row["warnings"]]
        if warned:
            lines.append(f"warning, {engine} at {len(warned)} of {len(of_engine)} points: {warned[0]}")
    return lines


def _short(text: str) -> str:
    try:
        return f"{float(text):.4g}"
    except ValueError:
        return text if len(text) <= 60 else text[:57] + "..."
