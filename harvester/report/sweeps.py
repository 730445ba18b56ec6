"""The report of `sweep`."""

from harvester.equations.problem import Problem
from harvester.report.numbers import amount, share, signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import scene_page
from harvester.scene.keys import unit_of
from harvester.scene.scene import Scene
from harvester.studies.sweep.printed_rows import warnings
from harvester.studies.sweep.rows import Row
from harvester.studies.sweep.table import Table
from harvester.uncertainty.value import NORMAL_QUANTILE

MOST_ROWS = 400  # of the table on the page


def of_sweep(scene: Scene | Problem, table: Table) -> Page:
    """The page of a sweep: its figure, each engine's best point, all rows, failures, and the scene to start from."""
    about = table.about
    names = list(dict.fromkeys(row["engine"] for row in table.rows))
    best = [_best(table, [row for row in table.rows if row["engine"] == name and not row["error"]]) for name in names]
    seeds = {options["seed"] for options in about["engines"].values() if "seed" in options}
    keys = ", ".join(axis.key for axis in table.axes)
    figure = drawing(
        table.plot(None),
        f"Mean power against {keys}. {'. '.join(line for line in best if line)}.",
        f"Mean power against {table.axes[0].key}, engine by engine.",
    )
    failed = sum(bool(row["error"]) for row in table.rows)
    found = Section(
        "Sweep",
        texts=[f"{failed} of {len(table.rows)} rows failed; the table says why."] if failed else [],
        drawings=[figure],
        tables=[_summary(table, names), _rows(table, failed > 0)],
        warnings=[signs(line.removeprefix("warning, ")) for line in warnings(table.rows)],
    )
    base = f"Where the points start from; each has its own {keys}."
    lead = [line for line in best if line]
    seed = ", ".join(map(str, sorted(seeds))) or "nothing was sampled"
    return scene_page(Problem.of(scene), f"sweep of {keys}", lead, found, about, base, seed=seed)


def _best(table: Table, rows: list[Row]) -> str:
    """The largest power in rows of one engine, with its error where there is one, and its place."""
    if not rows:
        return ""
    row = max(rows, key=lambda one: float(one["mean_power"]))
    where = ", ".join(f"{a.key} = {_value(row[a.key], a.key)}" for a in table.axes)
    error = _sampling(row)
    sampling = "" if error is None else f" ± {share(error, float(row['mean_power']))} (95 %, sampling)"
    return f"{row['engine']}: largest {amount(float(row['mean_power']), table.unit_names.power)}{sampling} at {where}"


def _summary(table: Table, names: list[str]) -> TextTable:
    """The table of what each engine took, and of the largest errors that it states."""
    rows = []
    for name in names:
        mine = [row for row in table.rows if row["engine"] == name]
        good = [row for row in mine if not row["error"]]
        worst = [_worst(good, column, factor) for column, factor in (("stderr", NORMAL_QUANTILE), ("bias", 1.0))]
        seconds = sum(float(row["seconds"]) for row in good)
        failed, warned = len(mine) - len(good), sum(bool(row["warnings"]) for row in mine)
        rows.append([name, str(len(mine)), str(failed), str(warned), *worst, f"{seconds:.2g}"])
    heads = [
        "engine",
        "points",
        "failed",
        "with warnings",
        "sampling, 95 %, at most",
        "step and model, at most",
        "seconds",
    ]
    note = (
        "Errors relative to the mean power of their point; 95 % are 1.96 standard errors."
        " none: nothing is sampled. -: no such error, or not known."
    )
    return TextTable("Engines", heads, rows, range(1, len(heads)), note)


def _sampling(row: Row) -> float | None:
    """The 95 % error of sampling of a row's mean power: 1.96 standard errors, as rows tell no degrees of freedom."""
    return NORMAL_QUANTILE * float(row["mean_power_stderr"]) if row["mean_power_stderr"] else None


def _worst(rows: list[Row], column: str, factor: float) -> str:
    found = [
        factor * abs(float(row[f"mean_power_{column}"]) / float(row["mean_power"]))
        for row in rows
        if row[f"mean_power_{column}"] and float(row["mean_power"])
    ]
    return share(max(found), 1.0) if found else "-" if column == "bias" else "none"


def _rows(table: Table, failures: bool) -> TextTable:
    """The table of all rows, or of the first `MOST_ROWS`."""
    heads = [
        *(a.key for a in table.axes),
        "engine",
        "mean power",
        "sampling, 95 %",
        "step and model",
        "mean square voltage",
    ]
    heads += ["seconds", *(["error"] if failures else [])]
    rows = []
    for row in table.rows[:MOST_ROWS]:
        cells = [_value(row[a.key], a.key) for a in table.axes] + [row["engine"]]
        if row["error"]:
            rows.append([*cells, "-", "-", "-", "-", "-", signs(row["error"])])
            continue
        power = float(row["mean_power"])
        bias = float(row["mean_power_bias"]) if row["mean_power_bias"] else None
        cells += [amount(power, table.unit_names.power), share(_sampling(row), power), share(bias, power)]
        cells += [amount(float(row["mean_square_voltage"]), table.unit_names.mean_square_voltage), row["seconds"]]
        rows.append([*cells, *([""] if failures else [])])
    left = len(table.rows) - len(rows)
    note = "-: no such error, or not known." + (f" {left} rows more are in sweep.csv." if left else "")
    numbers = [n for n in range(len(table.axes) + 6) if n != len(table.axes)]
    return TextTable("Points", heads, rows, numbers, note)


def _value(text: str, key: str) -> str:
    return amount(float(text), unit_of(key))
