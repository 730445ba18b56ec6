"""The front of two aims: designs of which none has both more power and a better other quantity."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from harvester import figures
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.scene.keys import unit_of
from harvester.studies.output_folder import csv_text
from harvester.studies.tolerance.limits import QUANTITIES
from harvester.uncertainty.value import NORMAL_QUANTILE, Value


@dataclass(frozen=True)
class FrontPoint:
    """A design on the front: the values of the keys, the power, and the second quantity (`ParetoFront.quantity`).

    ``quantity_error95`` is its error where an engine samples; None: that of `ParetoFront`.
    """

    keys: dict[str, float]
    mean_power: Value
    quantity: float
    quantity_error95: float | None = None


@names_arguments
@dataclass(frozen=True)
class ParetoFront:
    """Designs of which none has both more power and a better ``quantity``, from the best quantity to the most power.

    ``sign`` is -1 where the quantity is to be low, 1 where high.  Peaks are at the unsafe end of their error; a
    quantity has the relative error of the engine otherwise.  ``alike`` are designs that an engine that samples cannot
    tell from the front: they are beaten by less than the errors.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> found = hv.pareto(scene, {"nondimensional.mu": (0.1, 10.0)}, "mean_square_voltage", points=3)
    >>> [point.mean_power.value < found.points[-1].mean_power.value for point in found.points]
    [True, True, False]
    """

    engine: str
    quantity: str
    sign: int
    points: tuple[FrontPoint, ...]
    physical: bool
    seconds: float
    warnings: tuple[str, ...]
    alike: tuple[FrontPoint, ...] = ()

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    @property
    def unit(self) -> str:
        """The unit of the second quantity."""
        return QUANTITIES[self.quantity].unit if self.physical else ""

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The power against the other quantity as a matplotlib figure."""
        return figures.front(self, title)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        rows, alike = (
            [
                {"keys": one.keys, "mean_power": one.mean_power.value, "error95": one.mean_power.error95}
                | {self.quantity: one.quantity, f"{self.quantity}_error95": one.quantity_error95}
                for one in some
            ]
            for some in (self.points, self.alike)
        )
        return {
            "engine": self.engine,
            "quantity": self.quantity,
            "aim": "high" if self.sign > 0 else "low",
            "front": rows,
            "not_told_from_front": alike,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
        }

    def text(self) -> str:
        """The CSV file: a row a design, those of the front first."""
        keys = list(self.points[0].keys)
        rows = [
            [*one.keys.values(), one.quantity, one.mean_power.value, one.mean_power.error95]
            + ([] if self.points[0].quantity_error95 is None else [one.quantity_error95, one in self.points])
            for one in (*self.points, *self.alike)
        ]
        more = [] if self.points[0].quantity_error95 is None else [f"{self.quantity}_error95", "on_front"]
        return csv_text([*keys, self.quantity, "mean_power", "mean_power_error95", *more], rows)

    def _told(self, one: FrontPoint) -> str:
        """The second quantity of a design, with its error where that is known."""
        error = one.quantity_error95
        return Value(one.quantity).format(self.unit) if error is None else self.with_error(one.quantity, error)

    def with_error(self, value: float, error95: float) -> str:
        """A value of the second quantity with its whole error at 95 %."""
        return Value(value, stderr=error95 / NORMAL_QUANTILE).format(self.unit).replace("(95 %, sampling)", "(95 %)")

    def __str__(self) -> str:
        keys = list(self.points[0].keys)
        rows = [[self.quantity, "largest mean power", *keys]]
        for one in self.points:
            there = [Value(one.keys[key]).format(unit_of(key).removeprefix("1")) for key in keys]
            power = dataclasses.replace(one.mean_power, unknown="").format(self.unit_names.power)  # a note says it once
            rows.append([self._told(one), power, *there])
        aim = "high" if self.sign > 0 else "low"
        lines = [f"{self.engine}: {self.seconds:.2g} s; {self.quantity} is to be {aim}, the power large"]
        lines += [f"  {row}" for row in columns(rows, "  ")]
        unknown = dict.fromkeys(one.mean_power.unknown for one in self.points if one.mean_power.unknown)
        lines += [f"  note: the error of {part} is not known" for part in unknown]
        if self.alike:
            many = f"{len(self.alike)} more {'design' if len(self.alike) == 1 else 'designs'}"
            lines.append(f"  {many} cannot be told from the front: beaten by less than the errors (--json has them)")
        return "\n".join([*lines, *(f"  warning: {w}" for w in self.warnings)])
