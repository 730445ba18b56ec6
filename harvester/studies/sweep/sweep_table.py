"""The table that a sweep makes: rows of values with all their errors, as labelled data, a text and a figure."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.glossary import term
from harvester.presentation.result import TableResult
from harvester.presentation.sheet import unit_of
from harvester.presentation.table import Table
from harvester.scene.scene import Scene
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import QUANTITIES, SweepRow, columns_of, powers_of

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class SweepTable(TableResult):
    """The rows of a sweep: a row for each point and engine.

    Attributes
    ----------
    axes : tuple of Axis
        the varied keys with their values.
    rows : tuple of SweepRow
        a row for each point and engine: ``varied`` (keys in SI units), ``engine``, ``mean_power``,
        ``mean_square_voltage``, ``seconds``, ``error``, ``warnings``.
    points : sequence of int
        the number of each row's point, in the order of the grid (the last key fastest) or of the
        list.
    listed : bool
        whether the points are not grid: each has the n-th value of every axis.
    about : mapping
        the provenance: versions, scene, seed, machine.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> table = hv.sweep(scene, vary={"nondimensional.mu": [0.5, 2.0]}, engines=[hv.Averaged()])
    >>> table.column("nondimensional.mu", "averaged").tolist(), table.to_xarray().sizes["nondimensional.mu"]
    ([0.5, 2.0], 2)
    >>> table.to_pandas()["engine"].tolist()
    ['averaged', 'averaged']
    """

    DERIVED = ("engines", "vary", "table", "powers")
    INTERNAL = frozenset({"axes", "rows", "points", "listed", "about"})
    NOT_SHOWN = frozenset({"engines", "vary", "table"})
    NOT_IN_JSON = frozenset({"powers"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"table": "rows"}
    SHORT = ("vary", "engines", "rows")

    axes: tuple[Axis, ...]
    rows: tuple[SweepRow, ...] = ()
    points: Sequence[int] = ()
    listed: bool = False
    about: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        units = {name: unit_of(term(name), self.unit_names) for name in QUANTITIES}
        object.__setattr__(self, "rows", tuple(row.with_units(units) for row in self.rows))

    @property
    def physical(self) -> bool:
        """Whether its numbers have SI units."""
        return "nondimensional" not in self.about.get("scene", {})

    @property
    def keys(self) -> list[str]:
        """The varied scene keys."""
        return [axis.key for axis in self.axes]

    @property
    def vary(self) -> dict[str, list[float]]:
        """The varied scene keys and the values of each."""
        return {axis.key: list(axis.values) for axis in self.axes}

    @property
    def engines(self) -> list[str]:
        """The engines that answered."""
        return list(dict.fromkeys(row.engine for row in self.rows))

    @property
    def curve_axis(self) -> Axis:
        """The axis that curves are drawn along: that with the most values, the first of equals.

        In a list the first.
        """
        return self.axes[0] if self.listed else max(self.axes, key=lambda axis: len(axis.values))

    @property
    def table(self) -> Table:
        """All the contents of sweep.csv."""
        return columns_of(self.keys, self.rows, self.unit_names)

    @property
    def powers(self) -> Table:
        """The mean powers, with their total errors."""
        return powers_of(self.keys, self.rows, self.unit_names)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """For each engine the first warning, how many points have several responses, and why the first point failed."""
        in_place = self.about.get("in_place_of", {}).items()
        stand_ins = [
            note("stands_for_formulas", name, formulas=" and ".join(those))
            for name, those in in_place
        ]
        check = self.about.get("check", "")
        return (
            *stand_ins,
            *_of_check(check, self.of(check), self.rows),
            *(remark for name in self.engines for remark in _remarks(name, self.of(name))),
        )

    def of(self, engine: str) -> list[SweepRow]:
        """The rows of an engine."""
        return [row for row in self.rows if row.engine == engine]

    def column(self, name: str, engine: str) -> "np.ndarray[Any, np.dtype[np.float64]]":
        """One column of sweep.csv of one engine's rows as numbers.

        Nan if absent, as if a point failed.
        """
        cells = columns_of(self.keys, self.of(engine), self.unit_names).plain()[name]
        return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)

    def text(self) -> str:
        """The CSV file."""
        return self.table.csv(units=False)

    def to_xarray(self) -> "xarray.Dataset":
        """The table as a dataset with labels and units, over engine and varied keys."""
        from harvester.studies.sweep.dataset import dataset

        return dataset(self)

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """Mean power against the key of the most values, ``title`` (empty: the scene's; None: none) above."""
        scene = self.about.get("scene", {})
        if title == "" and ax is None and scene:
            title = scene.get("title") or Scene(**scene).name
        return drawing.draw(self, title, ax)


def _of_check(
    check: str, checked: Sequence[SweepRow], rows: Sequence[SweepRow]
) -> Iterator[Diagnostic]:
    """How far the engine that a check is for is from it, at the points of the check."""
    last = next((row.engine for row in reversed(rows) if row.engine != check), "")
    there = {tuple(row.varied.values()): row for row in rows if row.engine == last}
    pairs = [
        (row.mean_power, other.mean_power)
        for row in checked
        if row.mean_power and (other := there.get(tuple(row.varied.values()))) and other.mean_power
    ]
    if not pairs:
        return
    differences = [abs(mine.value - its.value) for mine, its in pairs]
    beyond = sum(
        far > math.hypot(mine.known_error95, its.known_error95)
        for far, (mine, its) in zip(differences, pairs, strict=True)
    )
    # Next to a power of 0 the other power is the scale; two of them do not differ.
    scales = np.array([abs(its.value) for _, its in pairs])
    scales = np.where(scales > 0.0, scales, np.maximum(differences, np.finfo(float).tiny))
    largest = float(np.max(np.array(differences) / scales))
    numbers: dict[str, Any] = {"engine": last, "count": len(pairs), "largest": largest}
    yield (
        warning("check_differs", check, beyond=beyond, **numbers)
        if beyond
        else note("check_agrees", check, **numbers)
    )


def _remarks(engine: str, rows: Sequence[SweepRow]) -> Iterator[Diagnostic]:
    """The remarks of an engine's rows: the first of each kind, and how many have it."""
    warned = [row.warnings[0] for row in rows if row.warnings]
    several = [row.responses for row in rows if row.responses is not None]
    failed = [row.error for row in rows if row.error]
    if warned:
        yield warning(
            "warned_at_points", engine, count=len(warned), total=len(rows), first=str(warned[0])
        )
    if more := [count for count in several if count > 1]:
        yield warning(
            "several_responses_at_points",
            engine,
            count=len(more),
            total=len(several),
            most=max(more),
        )
    if failed:
        yield warning(
            "failed_at_points", engine, count=len(failed), total=len(rows), first=failed[0]
        )
