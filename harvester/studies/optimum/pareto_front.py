"""The Pareto front of two objectives: designs of which none has both more power and a better other quantity."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.tolerance.device_limits import QUANTITIES
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class FrontPoint:
    """A design on the front: the values of the keys, the power, and the second quantity (`ParetoFront.quantity`).

    ``quantity_error95`` is its error if an engine samples; None: that of `ParetoFront`.
    """

    keys: dict[str, float]
    mean_power: Value
    quantity: float
    quantity_error95: float | None = None


class ParetoFront(TableResult):
    """Designs none of which has both more power and a better second quantity, in order of power.

    Peaks are at the unsafe end of their error; a quantity has the relative error of the engine
    otherwise.

    Attributes
    ----------
    engine : str
        the name of the engine that computed it.
    quantity : str
        the name of the second quantity.
    sign : int
        -1 if it is to be low, 1 if high.
    points : tuple of FrontPoint
        the designs, each with its ``keys``, ``mean_power`` and ``quantity``.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    seconds : float
        the time of computing, without compilation (s).
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).
    alike : tuple of FrontPoint
        designs that an engine that samples cannot distinguish from the Pareto front: they are
        beaten by less than the errors; in the table they are behind the Pareto front.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> front = hv.optimise(
    ...     scene, vary={"nondimensional.mu": (0.1, 10.0)}, objective="mean_square_voltage", points=3, engine="exact"
    ... )
    >>> [point.mean_power.value < front.points[-1].mean_power.value for point in front.points]
    [True, True, False]
    """

    FILE: ClassVar[str] = "pareto"  # the name of its files
    DERIVED = ("sense", "designs")
    INTERNAL = frozenset({"points", "alike", "sign"})
    NOT_SHOWN = frozenset({"quantity", "sense"})
    NOT_IN_JSON = frozenset({"sense", "designs"})
    SHORT = ("engine", "quantity", "sense", "points")

    engine: str
    quantity: str
    sign: int
    points: tuple[FrontPoint, ...]
    physical: bool
    seconds: float
    diagnostics: tuple[Diagnostic, ...] = ()
    alike: tuple[FrontPoint, ...] = ()

    @property
    def sense(self) -> str:
        """Whether the quantity is to be "high" or "low"."""
        return "high" if self.sign > 0 else "low"

    @property
    def unit(self) -> str:
        """The unit of the second quantity."""
        return QUANTITIES[self.quantity].unit if self.physical else ""

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the designs of the Pareto front and those like them."""
        designs = {"front": self.points, "not_told_from_front": self.alike}
        return (
            super().as_json()
            | {"aim": self.sense}
            | {name: [self._design(point) for point in points] for name, points in designs.items()}
        )

    def _design(self, point: FrontPoint) -> dict[str, Any]:
        power = {"mean_power": point.mean_power.value, "error95": point.mean_power.error95}
        return {
            "keys": point.keys,
            **power,
            self.quantity: point.quantity,
            f"{self.quantity}_error95": point.quantity_error95,
        }

    @property
    def designs(self) -> Table:
        """The designs of the Pareto front."""
        return self._rows(self.points)

    @property
    def table(self) -> Table:
        """The designs of the Pareto front, and if an engine samples those that cannot be distinguished from it."""
        points = (*self.points, *self.alike)
        table = self._rows(points)
        if self.points[0].quantity_error95 is None:
            return table
        return Table(
            (*table.columns, Column("on_front", [point in self.points for point in points])),
            table.title,
        )

    def _rows(self, points: Sequence[FrontPoint]) -> Table:
        columns = [
            Column(key, [point.keys[key] for point in points], unit_of(key))
            for key in self.points[0].keys
        ]
        known = any(point.quantity_error95 is not None for point in points)
        values = [
            Value(point.quantity, model=point.quantity_error95) if known else point.quantity
            for point in points
        ]
        columns.append(Column(self.quantity, values, self.unit))
        columns.append(
            Column("mean_power", [point.mean_power for point in points], self.unit_names.power)
        )
        return Table(tuple(columns), "none has more power and a better other quantity")

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The power against the other quantity as a matplotlib figure."""
        return drawing.draw(self, title, ax)


def remarks(
    quantity: str, sign: int, points: Sequence[FrontPoint], alike: Sequence[FrontPoint]
) -> list[Diagnostic]:
    """The remarks on a front: its objectives, the unknown part of its errors, how many designs are alike."""
    diagnostics = [note("two_aims", quantity=quantity, sense="high" if sign > 0 else "low")]
    unknown = dict.fromkeys(
        point.mean_power.unknown for point in points if point.mean_power.unknown
    )
    diagnostics += [note("error_unknown", part=part) for part in unknown]
    return diagnostics + ([note("alike_designs", count=len(alike))] if alike else [])
