"""The table that a sweep makes: its rows as texts, columns as numbers, labelled data and a figure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester import figures
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import COLUMNS, TEXTS, Row, lines

if TYPE_CHECKING:
    import pandas
    import xarray


@names_arguments
@dataclass
class SweepTable:
    """The rows of a sweep as they are written: the varied keys, then `COLUMNS`, all as text.

    ``points`` are the numbers of the rows' points, in the order of the grid (the last key fastest) or of the list.
    ``listed`` says that the points are no grid: each takes the n-th value of every axis.  ``about`` is the provenance.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> table = hv.sweep(scene, "nondimensional.mu", [0.5, 2.0], engines=[hv.Averaged()])
    >>> table.column("nondimensional.mu", "averaged").tolist(), table.to_xarray().sizes["nondimensional.mu"]
    ([0.5, 2.0], 2)
    """

    axes: tuple[Axis, ...]
    rows: list[Row] = field(default_factory=list)
    points: Sequence[int] = ()
    listed: bool = False
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def along(self) -> Axis:
        """The axis that curves are drawn along: that of the most values, the first of equals; of a list the first."""
        return self.axes[0] if self.listed else max(self.axes, key=lambda axis: len(axis.values))

    def text(self) -> str:
        """The CSV file."""
        return "".join(lines([a.key for a in self.axes], self.rows))

    def column(self, name: str, engine: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """One column of one engine's rows as numbers; nan where a point failed."""
        values = [row[name] for row in self.rows if row["engine"] == engine]
        return np.array([_number(v) for v in values])

    def to_xarray(self) -> "xarray.Dataset":
        """The table as a dataset with labels and units, over engine and varied keys (`dataset`)."""
        from harvester.studies.sweep.dataset import dataset

        return dataset(self)

    def to_pandas(self) -> "pandas.DataFrame":
        """The table as a data frame: a row for each point and engine, numbers as numbers (nan where there is none).

        >>> import harvester as hv
        >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
        >>> frame = hv.sweep(scene, "nondimensional.mu", [0.5, 2.0], engines=[hv.Averaged()]).to_pandas()
        >>> frame.loc[frame["mean_power"].idxmax(), "nondimensional.mu"]
        2.0
        """
        import pandas

        frame = pandas.DataFrame(self.rows, columns=[*(a.key for a in self.axes), *COLUMNS])
        numbers = [name for name in frame if name not in ("engine", *TEXTS)]
        frame[numbers] = frame[numbers].map(_number)
        return frame

    def _repr_html_(self) -> str:
        from harvester.presentation import html
        from harvester.studies.sweep import printed_rows

        head, shown = printed_rows.cells(self.rows[: html.MOST_ROWS], self.unit_names)
        more = len(self.rows) - len(shown)
        notes = [f"{more} rows more"] if more > 0 else []
        return html.table(
            "sweep", head, shown, notes + printed_rows.warnings(self.rows) + printed_rows.failures(self.rows)
        )

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its powers and voltages."""
        return AnswerUnits.of("nondimensional" not in self.about.get("scene", {}))

    def plot(self, title: str | None = "") -> "figures.Plot":
        """Mean power against the key of the most values, ``title`` (empty: the scene's; None: none) above."""
        scene = self.about.get("scene", {})
        return figures.sweep(self, scene.get("title", "") if title == "" else title)


def _number(cell: str) -> float:
    return float(cell) if cell else math.nan
