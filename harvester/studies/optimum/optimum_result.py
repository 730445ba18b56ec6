"""The answer of a search for the largest power: the keys with intervals, the power there, other peaks, its cost."""

from collections import Counter
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from harvester.answers.estimate import Estimate
from harvester.errors import HarvesterError
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, has
from harvester.presentation.result import Result, TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.optimum.evaluations import Evaluation
from harvester.studies.optimum.ranges import Range
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ENDS = {-1: "low", 1: "high"}
# Why no place of the ranges is better than another, and why the best has no interval.
FLAT = (
    *("no_power", "no_power_anywhere", "same_power_everywhere"),
    *("flat_within_model", "no_place_better", "power_changes_little"),
)
NO_INTERVAL = (
    "no_model_error",
    "curvature_in_noise",
    "no_curvature",
    "not_narrowed",
    "search_cut_short",
)
# the budget ended before the search did
CUT_SHORT = ("budget_spent", "search_cut_short", "interval_rough")


class OptimalKey(Result):
    """A key's best value and its interval (None: see `Optimum.why`).

    ``boundary`` is the end of the range there.
    """

    INTERNAL = frozenset({"range"})
    SHORT = ("key", "value", "low95", "high95")

    range: Range
    value: float
    low95: float | None
    high95: float | None
    boundary: str | None

    @property
    def key(self) -> str:
        """The key itself."""
        return self.range.key

    @property
    def unit(self) -> str:
        """Its unit."""
        return unit_of(self.range.key)


class PowerPeak(NamedTuple):
    """A place where the power is larger than at all places near it."""

    keys: dict[str, float]
    mean_power: Value


class Optimum(TableResult, kw_only=True):
    """The largest mean power over ranges of keys.

    The interval of each key has the optimum in it: at 95 % for an engine that samples
    (sampling, shape of the surface and time-step bias), within the model's stated error for a
    formula; ``why`` states the reason why it is missing.

    Attributes
    ----------
    engine : str
        the name of the engine that computed it.
    keys : tuple of OptimalKey
        of each varied key its name ``key``, best ``value`` and interval ``low95`` to ``high95`` (SI
        units).
    estimate : Estimate
        the engine's `Estimate` at the best place; for an engine that samples with noise that had no
        part in finding the place, for the highest power of many is too high.
    peaks : tuple of PowerPeak
        all places of a largest power, the best first, each with its keys and power.
    points : tuple of Evaluation
        all evaluations, in their order.
    seconds : float
        the time of computing, without compilation (s).
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).
    scanned : bool
        False if the budget ended before the whole range was looked at: more power may lie anywhere
        in it.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> best = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, engine="averaged")
    >>> best
    Optimum(engine='averaged', mean_power=0.00322... +- 2.2e-05 (model, estimated))
    """

    FILE: ClassVar[str] = "optimise"  # the name of its files
    DERIVED: ClassVar[tuple[str, ...]] = (
        *(
            "mean_power",
            "evaluation_count",
            "evaluations",
            "failed",
            "key_table",
            "other_peaks",
            "flat",
            "no_interval",
        ),
    )
    INTERNAL = frozenset({"estimate", "points", "keys"})
    NOT_SHOWN = frozenset({"peaks", "scanned", "evaluations", "failed", "flat", "no_interval"})
    NOT_IN_JSON = frozenset({"key_table", "other_peaks"})
    JSON_NAMES: ClassVar[dict[str, str]] = {
        "evaluation_count": "evaluations",
        "evaluations": "evaluations_by_engine",
    }

    engine: str
    keys: tuple[OptimalKey, ...]
    estimate: Estimate
    peaks: tuple[PowerPeak, ...]
    points: tuple[Evaluation, ...]
    seconds: float
    diagnostics: tuple[Diagnostic, ...] = ()
    scanned: bool = True

    @property
    def physical(self) -> bool:
        """Whether its numbers are in SI units."""
        return self.estimate.physical

    @property
    def mean_power(self) -> Value:
        """The mean power at the best place."""
        return self.estimate.mean_power

    @property
    def flat(self) -> str:
        """Why no place is better than another; empty if one is."""
        return self._sentence(FLAT)

    @property
    def why(self) -> str:
        """Why the best values of the keys have no interval; empty if they have."""
        return self._sentence(NO_INTERVAL)

    no_interval = why

    def _sentence(self, codes: tuple[str, ...]) -> str:
        return next(
            (str(diagnostic) for diagnostic in self.diagnostics if diagnostic.code in codes), ""
        )

    @property
    def is_cut_short(self) -> bool:
        """Whether the budget ended before the search did."""
        return has(self.diagnostics, *CUT_SHORT)

    @property
    def evaluation_count(self) -> int:
        """The number of evaluations."""
        return len(self.points)

    @property
    def evaluations(self) -> dict[str, int]:
        """The number of evaluations by each engine."""
        return dict(Counter(p.engine for p in self.points))

    @property
    def own_points(self) -> list[Evaluation]:
        """The evaluations by the engine itself, which makes the last one.

        The others are those of a scout.
        """
        return [p for p in self.points if p.engine == self.points[-1].engine]

    @property
    def failed(self) -> int:
        """The number of evaluations by the engine itself that failed."""
        return sum(isinstance(p.answer, HarvesterError) for p in self.own_points)

    @property
    def key_table(self) -> Table:
        """The best value of each key, and the ends of its interval."""
        rows = self.keys
        units = [key.unit for key in self.keys]
        made = [Column("key", [key.key for key in rows])]
        for name in ("value", "low95", "high95", "boundary"):
            cells = [getattr(key, name) for key in rows]
            made += (
                [Column(name, cells, units=units)]
                if any(cell is not None for cell in cells)
                else []
            )
        return Table(tuple(made), "the largest power is at")

    @property
    def other_peaks(self) -> Table | None:
        """The peaks that are lower; None if there is one alone."""
        if len(self.peaks) < 2:
            return None
        rows = self.peaks[1:]
        columns = [
            Column(key.key, [peak.keys[key.key] for peak in rows], key.unit) for key in self.keys
        ]
        power = Column("mean_power", [peak.mean_power for peak in rows], self.unit_names.power)
        return Table((power, *columns), "another peak" if len(rows) == 1 else "other peaks")

    @property
    def table(self) -> Table:
        """All evaluations, in the order that they were made."""
        points, units = self.points, self.unit_names
        powers = [point.power for point in points]
        values = zip(
            *(
                [key.range.value(float(u)) for key, u in zip(self.keys, p.u, strict=True)]
                for p in points
            ),
            strict=True,
        )
        columns = [
            Column(key.key, cells, key.unit, exact=True)
            for key, cells in zip(self.keys, values, strict=True)
        ]
        columns += [
            Column(name, [getattr(point, name) for point in points])
            for name in ("engine", "stage", "seed")
        ]
        columns.append(Column("mean_power", powers, units.power))
        answers = [point.answer for point in points]
        columns.append(
            Column(
                "seconds", [a.seconds if isinstance(a, Estimate) else None for a in answers], "s"
            )
        )
        columns.append(Column("is_sound", [point.is_sound for point in points]))
        columns.append(
            Column("error", ["" if isinstance(a, Estimate) else str(a) for a in answers])
        )
        return Table(tuple(columns), "evaluations")

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the keys by their names."""
        return super().as_json() | {"keys": {key.key: key.as_json() for key in self.keys}}

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The evaluations and the optimum as a matplotlib figure."""
        return drawing.draw(self, title, ax)


def end(face: float) -> str | None:
    """The name of the end of a range, from a face of the unit cube: -1 low, 1 high."""
    return _ENDS.get(int(face))
