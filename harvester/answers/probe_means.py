"""What a probe of the circuit says: mean, root of the mean square, and extremes, with their errors."""

from dataclasses import dataclass

from harvester.presentation.result import Result
from harvester.uncertainty.value import Value


@dataclass(frozen=True, repr=False, eq=False)
class ProbeMeans(Result):
    """A quantity of the circuit in its ``unit`` (V, A or W; "" for a nondimensional scene).

    ``mean`` and ``rms`` are over time; ``least`` and ``largest`` are the extremes in a time of ``window`` (s, or 1/w0),
    on average over the runs: in a longer time they are farther apart.
    """

    NOT_SHOWN = frozenset({"unit"})
    SHORT = ("mean", "rms")

    unit: str
    window: float
    mean: Value
    rms: Value
    least: Value
    largest: Value
