"""Several frequency responses side by side: for several values of scene keys, such as loads, and by several engines."""

from typing import TYPE_CHECKING, Any

from harvester.presentation import drawing
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.diagnostic import Diagnostic, note, without_repeats
from harvester.presentation.result import TableResult
from harvester.presentation.table import Cell, Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.frequency_response.curve import FrequencyResponse

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# remarks that many responses count instead
ONE_EACH = frozenset({"hysteresis", "peak_at_an_end", "peak_between"})


class FrequencyResponses(TableResult):
    """Responses over the same frequencies, one for each engine and combination of the varied keys' values.

    Attributes
    ----------
    curves : tuple of FrequencyResponse
        a `FrequencyResponse` each.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> result = hv.responses(scene, [0.9, 1.0, 1.1], {"nondimensional.mu": [0.5, 2.0]})
    >>> [(curve.varied, curve.peak("up").frequency) for curve in result.curves]
    [({'nondimensional.mu': 0.5}, 1.0), ({'nondimensional.mu': 2.0}, 1.0)]
    """

    DERIVED = ("engine", "peaks")
    INTERNAL = frozenset({"curves"})
    SHORT = ("engine", "curves")

    curves: tuple[FrequencyResponse, ...]

    @property
    def engine(self) -> str:
        """The engines, in one text."""
        return ", ".join(dict.fromkeys(curve.engine for curve in self.curves))

    @property
    def keys(self) -> list[str]:
        """The varied scene keys."""
        return list(self.curves[0].varied)

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return self.curves[0].unit_names

    @property
    def table(self) -> Table:
        """The varied keys and the engine, then the columns of one response."""
        return self._stacked([curve.table for curve in self.curves])

    @property
    def peaks(self) -> Table:
        """The peaks of all responses."""
        return self._stacked([curve.peaks for curve in self.curves])

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The remarks of the responses, each once.

        For many responses with hysteresis how many there are.
        """
        several = len(self.curves) > 1
        remarks = without_repeats(remark for curve in self.curves for remark in curve.diagnostics)
        rest = [remark for remark in remarks if not several or remark.code not in ONE_EACH]
        if several and (with_it := sum(bool(curve.hysteresis) for curve in self.curves)):
            rest.append(note("hysteresis_in_several", several=with_it, of=len(self.curves)))
        return tuple(rest)

    def plot(
        self, title: str | None = "", per_g: bool = False, ax: "Axes | None" = None
    ) -> "Figure":
        """Draw the curves; for many values of one key a map of the power over frequency and value."""
        return drawing.draw(self, title, ax, per_g=per_g)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: that of the one response, or ``responses``, one of each."""
        if len(self.curves) == 1:
            return self.curves[0].as_json()
        return {"responses": [curve.as_json() for curve in self.curves]}

    def _stacked(self, tables: list[Table]) -> Table:
        """The rows of one table a response below each other, with the varied keys and the engine before them."""
        pairs = list(zip(self.curves, tables, strict=True))

        def before(name: str, cells: list[Cell], unit: str = "") -> Column:
            return Column(
                name,
                [
                    cell
                    for cell, (_, table) in zip(cells, pairs, strict=True)
                    for _ in range(len(table))
                ],
                unit,
            )

        units = {key: unit_of(key) for key in self.keys}
        keys = [
            before(k, [c.varied[k] for c in self.curves], "" if u == "1" else u)
            for k, u in units.items()
        ]
        engine = before("engine", [curve.engine for curve in self.curves])
        # A column that only some of them have, such as the bandwidth, is empty in the rows of the
        # others.
        named = {column.name: column.unit for table in tables for column in table.columns}
        rest = [
            Column(name, [cell for table in tables for cell in table.cells_or_none(name)], unit)
            for name, unit in named.items()
        ]
        return Table((*keys, engine, *rest))
