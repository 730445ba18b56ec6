"""What each figure reads of the thing that it draws: the figures know these attributes, and none of the classes above.

Arrays have the shape (n,) unless another is named; quantities are in the units of ``unit_names`` (`AnswerUnits`).
"""

from collections.abc import Mapping, Sequence
from typing import Protocol

from harvester.arrays import Floats
from harvester.printing.answer_units import AnswerUnits
from harvester.uncertainty.value import Value


class EstimateShape(Protocol):
    """An engine's answer; ``details`` with names that begin with ``ledger_`` are mean powers of the energy ledger."""

    @property
    def engine(self) -> str: ...
    @property
    def unit_names(self) -> AnswerUnits: ...
    @property
    def mean_power(self) -> Value: ...
    @property
    def details(self) -> Mapping[str, float]: ...


class PathShape(Protocol):
    """The voltage of one path from three sources, nondimensional, with relative RMS errors."""

    @property
    def title(self) -> str: ...
    @property
    def t(self) -> Floats: ...
    @property
    def spice(self) -> Floats: ...
    @property
    def exact(self) -> Floats: ...
    @property
    def decoupled(self) -> Floats: ...
    @property
    def spice_error(self) -> float: ...
    @property
    def decoupled_error(self) -> float: ...


class ComparisonShape(Protocol):
    """Answers of several engines to one scene, and paths."""

    @property
    def estimates(self) -> Sequence[EstimateShape]: ...
    @property
    def paths(self) -> Sequence[PathShape]: ...


class CostShape(Protocol):
    """Seconds and relative total error of an engine at one setting; the best are the Pareto front of both."""

    @property
    def engine(self) -> str: ...
    @property
    def seconds(self) -> float | None: ...
    @property
    def total_error(self) -> float | None: ...
    @property
    def best(self) -> bool: ...


class MotionShape(Protocol):
    """One path; rows of ``impacts``, shape (m, 2), are (time, speed), and ``shown`` is the length of its last part."""

    @property
    def t(self) -> Floats: ...
    @property
    def x(self) -> Floats: ...
    @property
    def v(self) -> Floats: ...
    @property
    def voltage(self) -> Floats: ...
    @property
    def acceleration(self) -> Floats | None: ...
    @property
    def impacts(self) -> Floats: ...
    @property
    def stops(self) -> Sequence[float]: ...
    @property
    def shown(self) -> float: ...
    @property
    def unit_names(self) -> AnswerUnits: ...


class RangeShape(Protocol):
    """The ends between which a scene key is searched; ``value`` maps a place from 0 to 1 to the key's value."""

    @property
    def key(self) -> str: ...
    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    @property
    def logarithmic(self) -> bool: ...
    def value(self, u: float) -> float: ...


class BestKeyShape(Protocol):
    """A key's best value and its 95 % interval."""

    @property
    def range(self) -> RangeShape: ...
    @property
    def value(self) -> float: ...
    @property
    def low95(self) -> float | None: ...
    @property
    def high95(self) -> float | None: ...


class EvaluationShape(Protocol):
    """One evaluation at a place ``u`` of the unit cube; a power of None is one that failed."""

    @property
    def engine(self) -> str: ...
    @property
    def u(self) -> Floats: ...
    @property
    def power(self) -> Value | None: ...


class OptimumShape(Protocol):
    """The place with the largest mean power, and the evaluations that found it."""

    @property
    def engine(self) -> str: ...
    @property
    def keys(self) -> Sequence[BestKeyShape]: ...
    @property
    def points(self) -> Sequence[EvaluationShape]: ...
    @property
    def estimate(self) -> EstimateShape: ...


class TheoriesShape(Protocol):
    """A number by both theories and by Monte Carlo with its standard error, nondimensional."""

    @property
    def published(self) -> float: ...
    @property
    def averaged(self) -> float: ...
    @property
    def ensemble(self) -> float: ...
    @property
    def ensemble_stderr(self) -> float: ...


class PaperPointShape(TheoriesShape, Protocol):
    """A point of one of the paper's figures, on a curve of a panel."""

    @property
    def panel(self) -> str: ...
    @property
    def curve(self) -> str: ...
    @property
    def x(self) -> float: ...


class EdgeShape(TheoriesShape, Protocol):
    """The parametric noise at which rest loses its stability, at one time-constant ratio ``mu``."""

    @property
    def mu(self) -> float: ...


class DriveShape(Protocol):
    """The response at one drive frequency."""

    @property
    def frequency(self) -> float: ...
    @property
    def mean_power(self) -> Value: ...
    @property
    def voltage_rms(self) -> Value: ...


class ResponseShape(Protocol):
    """A frequency response; a direction is "up" or "down", the edges are those of the half-power bandwidth."""

    @property
    def unit_names(self) -> AnswerUnits: ...
    def sweep(self, direction: str) -> Sequence[DriveShape]: ...
    def peak(self, direction: str) -> DriveShape: ...
    def edges(self, direction: str) -> tuple[float, float] | None: ...


class AxisShape(Protocol):
    """A varied scene key and the values that it takes, in SI units."""

    @property
    def key(self) -> str: ...
    @property
    def values(self) -> Sequence[float]: ...
    @property
    def logarithmic(self) -> bool: ...


class SweepShape(Protocol):
    """Rows of sweep.csv as texts; ``listed`` says that the axes hold the values of one point after another."""

    @property
    def axes(self) -> Sequence[AxisShape]: ...
    @property
    def rows(self) -> list[dict[str, str]]: ...
    @property
    def listed(self) -> bool: ...
    @property
    def unit_names(self) -> AnswerUnits: ...
