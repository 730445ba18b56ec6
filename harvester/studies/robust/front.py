"""The front of two aims: designs of which none has both more power and a better other quantity."""

from dataclasses import dataclass
from typing import Any

from harvester import figures
from harvester.errors import names_arguments
from harvester.printing.answer_units import AnswerUnits
from harvester.printing.columns import columns
from harvester.scene.keys import unit_of
from harvester.studies.output_folder import csv_text
from harvester.studies.tolerance.limits import QUANTITIES
from harvester.uncertainty.value import Value


@dataclass(frozen=True)
class FrontPoint:
    """A design on the front: the values of the keys, the power, and the second quantity (`Front.quantity`)."""

    keys: dict[str, float]
    mean_power: Value
    quantity: float


@names_arguments
@dataclass(frozen=True)
class Front:
    """Designs of which none has both more power and a better ``quantity``, from the best quantity to the most power.

    ``sign`` is -1 where the quantity is to be low, 1 where high.  Peaks are at the unsafe end of their error; a
    quantity has the relative error of the engine otherwise.

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
        rows = [
            {"keys": one.keys, "mean_power": one.mean_power.value, "error95": one.mean_power.whole_error95}
            | {self.quantity: one.quantity}
            for one in self.points
        ]
        return {
            "engine": self.engine,
            "quantity": self.quantity,
            "aim": "high" if self.sign > 0 else "low",
            "front": rows,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
        }

    def text(self) -> str:
        """The CSV file: a row a design."""
        keys = list(self.points[0].keys)
        rows = [
            [*one.keys.values(), one.quantity, one.mean_power.value, one.mean_power.whole_error95]
            for one in self.points
        ]
        return csv_text([*keys, self.quantity, "mean_power", "mean_power_error95"], rows)

    def __str__(self) -> str:
        keys = list(self.points[0].keys)
        rows = [[self.quantity, "largest mean power", *keys]]
        for one in self.points:
            there = [Value(one.keys[key]).text(unit_of(key).removeprefix("1")) for key in keys]
            power = one.mean_power.text(self.unit_names.power)
            rows.append([Value(one.quantity).text(self.unit), power, *there])
        aim = "high" if self.sign > 0 else "low"
        lines = [f"{self.engine}: {self.seconds:.2g} s; {self.quantity} is to be {aim}, the power large"]
        lines += [f"  {row}" for row in columns(rows, "  ")]
        return "\n".join([*lines, *(f"  warning: {w}" for w in self.warnings)])
