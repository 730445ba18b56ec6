"""A sweep's rows on the screen."""

MOST_ROWS = 60
VALUES = ("mean_square_voltage", "mean_power")


def cells(rows: list[dict[str, str]], physical: bool) -> tuple[list[str], list[list[str]]]:
    """Heads with units, and the rows' cells, short; without a column for errors where there are none."""
    unit = (" (V^2)", " (W)") if physical else ("", "")
    units = {name + end: one for name, one in zip(VALUES, unit, strict=True) for end in ("", "_stderr", "_bias")}
    hidden = ("warnings", *(("error",) if not any(row["error"] for row in rows) else ()))
    names = [name for name in (rows[0] if rows else {}) if name not in hidden]
    return [name + units.get(name, "") for name in names], [[_short(row[name]) for name in names] for row in rows]


def grid(rows: list[dict[str, str]], physical: bool) -> str:
    """The table that a sweep ends with; of a long one the first and the last rows."""
    shown = rows if len(rows) <= MOST_ROWS else rows[: MOST_ROWS // 2] + rows[-MOST_ROWS // 2 :]
    head, body = cells(shown, physical)
    everything = [head, *body]
    widths = [max(len(line[i]) for line in everything) for i in range(len(head))]
    lines = ["  ".join(cell.rjust(w) for cell, w in zip(line, widths, strict=True)) for line in everything]
    if len(shown) < len(rows):
        lines.insert(1 + MOST_ROWS // 2, f"({len(rows) - len(shown)} rows more in sweep.csv)")
    return "\n".join(lines)


def warnings(rows: list[dict[str, str]]) -> list[str]:
    """Each engine's first warning, and at how many of its points it warned."""
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
