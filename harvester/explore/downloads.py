"""What can be removed from the page: the scene file, the figure, the report."""

import dataclasses
from typing import Any

from harvester import report
from harvester.errors import SimulationError
from harvester.explore.live import Live
from harvester.studies.output_folder import provenance
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable


def table(live: Live, runs: list[dict[str, Any]]) -> SweepTable:
    """The curves of the page, and its runs of the present design, as the table of a sweep.

    Raises SimulationError if there is nothing yet.
    """
    rows = []
    for curve in live.curves.values() if not live.instead else ():
        rows += [_at(live, x, SweepRow.answered(estimate)) for x, estimate in curve.answers.items()]
    rows += [_at(live, run["x"], SweepRow.read(run["row"])) for run in runs if run["own"]]
    if not rows:
        raise SimulationError(
            "there is no answer of this circuit yet to be drawn: run 'ideal' or 'spice' first"
        )
    values = sorted({row.varied[live.key] for row in rows})
    about = provenance(
        live.problem,
        points="grid",
        vary={live.key: values},
        engines={row.engine: {} for row in rows},
    )
    about["command"] = ["explore"]
    points = [values.index(row.varied[live.key]) for row in rows]
    return SweepTable((Axis(live.key, tuple(values)),), tuple(rows), points, False, about)


def _at(live: Live, x: float, row: SweepRow) -> SweepRow:
    """The row of a point on the page's axis, with the digits by which a run is found on a curve."""
    return dataclasses.replace(row, varied={live.key: float(f"{x:.9g}")})


def figure(live: Live, runs: list[dict[str, Any]], form: str) -> bytes:
    """The figure of the table: png or svg."""
    drawn = table(live, runs).plot()
    from harvester.presentation.plot import image  # and with it matplotlib, which has drawn it

    return image(drawn, form)


def page(live: Live, runs: list[dict[str, Any]]) -> str:
    """The report of the table, one HTML file."""
    return report.html(report.of_sweep(live.problem, table(live, runs)))
