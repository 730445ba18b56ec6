"""The rows of a sweep: what an answer looks like in sweep.csv, and the table that they make."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.errors import HarvesterError, names_arguments
from harvester.printing.answer_units import AnswerUnits
from harvester.studies.sweep.points import Axis
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    import xarray

    from harvester.figures import Plot

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
)
_ANSWER = ("mean_square_voltage", "mean_power", "seconds")  # a row without these is cut off


@names_arguments
@dataclass
class Table:
    """Rows of a sweep as they are written: the varied keys, then `COLUMNS`, all as text.

    ``points`` says which point each row is of, in the order of the grid (the last key fastest) or of the list;
    ``listed``: the axes hold the n-th point's values together, and no grid; ``about`` is where the rows come from.

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

    def text(self) -> str:
        """The CSV file."""
        return "".join(lines([a.key for a in self.axes], self.rows))

    def column(self, name: str, engine: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """One column of one engine's rows as numbers; nan where a point failed."""
        values = [row[name] for row in self.rows if row["engine"] == engine]
        return np.array([float(v) if v else math.nan for v in values])

    def to_xarray(self) -> "xarray.Dataset":
        """As a labelled dataset with units over engine and varied keys; see `harvester.studies.sweep.dataset`."""
        from harvester.studies.sweep.dataset import dataset

        return dataset(self)

    def _repr_html_(self) -> str:
        from harvester.printing import notebook
        from harvester.studies.sweep import printed_rows

        head, shown = printed_rows.cells(self.rows[: notebook.MOST_ROWS], self.unit_names)
        more = len(self.rows) - len(shown)
        notes = [f"{more} rows more"] if more > 0 else []
        return notebook.table("sweep", head, shown, notes + printed_rows.warnings(self.rows))

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its powers and voltages."""
        return AnswerUnits.of("nondimensional" not in self.about.get("scene", {}))

    def plot(self, title: str | None = "") -> "Plot":
        """Mean power against the first key as a matplotlib figure, ``title`` (empty: the scene's; None: none) above."""
        from harvester import figures

        scene = self.about.get("scene", {})
        return figures.sweep(self, scene.get("title", "") if title == "" else title)


def lines(keys: Iterable[str], rows: Iterable[Row]) -> Iterator[str]:
    """The CSV file line by line, its header first."""
    out = io.StringIO()
    writer = csv.DictWriter(out, [*keys, *COLUMNS], lineterminator="\n")
    writer.writeheader()
    for row in rows:
        yield out.getvalue()
        out.seek(0)
        out.truncate()
        writer.writerow(row)
    yield out.getvalue()


def answered(estimate: Estimate) -> Row:
    """What a row says of an answer."""

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
        "warnings": "; ".join(estimate.warnings),
    }


def failed(engine: str, error: HarvesterError) -> Row:
    """What a row says of a point that failed."""
    return dict.fromkeys(COLUMNS, "") | {"engine": engine, "error": " ".join(str(error).split())}


def holds_an_answer(row: Row) -> bool:
    """Whether a row is whole and of a point that did not fail."""
    return row["error"] == "" and all(_is_number(row[name]) for name in _ANSWER)


def _bias(value: Value) -> float | None:
    known = [error for error in (value.bias, value.model) if error is not None]
    return sum(known) if known else None


def _is_number(text: str | None) -> bool:
    try:
        return text is not None and math.isfinite(float(text))
    except ValueError:
        return False
