"""What a probe of the circuit says: mean, root of the mean square, and extremes, with their errors."""

from dataclasses import dataclass, fields
from typing import Any

from harvester.presentation.columns import columns
from harvester.uncertainty.value import Value, number


@dataclass(frozen=True)
class ProbeMeans:
    """A quantity of the circuit in its ``unit`` (V, A or W; "" for a nondimensional scene).

    ``mean`` and ``rms`` are over time; ``least`` and ``largest`` are the extremes in a time of ``window`` (s, or 1/w0),
    on average over the runs: in a longer time they are farther apart.
    """

    unit: str
    window: float
    mean: Value
    rms: Value
    least: Value
    largest: Value

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        values = {name: number(getattr(self, name)) for name in ("mean", "rms", "least", "largest")}
        return {"unit": self.unit, "window": self.window} | values

    def lines(self, name: str) -> list[str]:
        """Its lines in the text of an answer."""
        time = f"{self.window:.4g}{' s' if self.unit else ''}"
        rows = [[one.name, getattr(self, one.name).format(self.unit)] for one in fields(self)[2:]]
        return [f"  {name} (least and largest in {time}):", *columns(rows, "    ")]
