"""The decision of `harvester design`: the circuit with its parts, its answer, and the alternatives."""

from typing import TYPE_CHECKING, ClassVar

from harvester.equations.power_bound import PowerBound
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.result import Result, TableResult
from harvester.presentation.sheet import table_of
from harvester.presentation.table import Table
from harvester.scene.scene import Scene
from harvester.studies.tolerance.distribution import ShareInterval
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class DesignCandidate(Result):
    """A circuit that was looked at.

    Attributes
    ----------
    circuit, coil : str or None
        the name of the netlist, and that of the inductor; None without one.
    available : Value
        a `Value`: the mean power (W) that is there at the voltage needed.
    share_met : float or None
        the fraction of devices that meet everything; None if it was not computed.
    wake : float or None
        the time (s) from empty to the voltage needed; None if it is never reached.
    meets : bool
        whether the device of the scene meets everything.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.DesignCandidate.SHORT
    ('circuit', 'available')
    """

    SHORT = ("circuit", "available")

    circuit: str
    coil: str | None
    available: Value
    share_met: float | None
    wake: float | None
    meets: bool


class DesignResult(TableResult):
    """A decision, and the candidates among which it was made.

    Attributes
    ----------
    circuit, coil : str or None
        the name of the netlist, and that of the inductor; None without one.
    settings : dict
        the netlist's parameters, in SI units, next to load and capacitor.
    power_needed : float
        the power needed (W).
    load_resistance : float
        the resistance (ohm) that draws the power needed at the voltage needed.
    capacitor : float
        the smallest of the series E6 (F) that keeps the voltage within 1 % over half a period, or a
        node's packet.
    available : Value
        a `Value`: the mean power (W) that is there at the voltage needed.
    wake : float
        the time (s) from empty to the voltage needed.
    largest_displacement : float or None
        the largest on the way there (m); None under noise.
    met : ShareInterval or None
        the fraction of devices that meet everything, with its interval; None without a spread.
    verdict : dict
        each requirement, and whether the device of the scene meets it.
    runner_up : str or None
        the circuit that comes second; None if no other meets everything.
    bound : PowerBound or None
        the most that any device of this mass could absorb (W), and why; None if no bound applies.
    candidates : tuple of DesignCandidate
        all that were looked at, in the order of the decision.
    scene : Scene
        the scene with the chosen parts.
    seconds, steps : float or int
        the cost of the computation.
    physical : bool
        whether its numbers are in SI units: they are.
    diagnostics : tuple of Diagnostic
        notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> hv.DesignResult.SHORT
    ('circuit', 'available')
    """

    DERIVED = (*("share_of_possible", "share_met", "share_met_between"), "table")
    NOT_SHOWN = frozenset({"bound", "met", "table"})
    NOT_IN_JSON = frozenset({"share_met", "share_met_between", "table"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"met": "yield"}
    OPTIONAL = frozenset({"bound", "share_of_possible"})
    INTERNAL = frozenset({"scene"})
    SHORT = ("circuit", "available")
    engine: ClassVar[str] = "slow"

    circuit: str
    coil: str | None
    settings: dict[str, float]
    power_needed: float
    load_resistance: float
    capacitor: float
    available: Value
    wake: float
    largest_displacement: float | None
    met: ShareInterval | None
    verdict: dict[str, bool]
    runner_up: str | None
    bound: PowerBound | None
    candidates: tuple[DesignCandidate, ...]
    scene: Scene
    seconds: float
    steps: int
    physical: bool = True
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def share_of_possible(self) -> float | None:
        """The available power over the upper bound for any device of this mass.

        None without a bound.
        """
        return None if self.bound is None else self.available.value / self.bound.value

    @property
    def share_of_possible_value(self) -> Value | None:
        """The same, with the errors of the numerator; the bound has none."""
        return None if self.bound is None else self.available.scaled(1.0 / self.bound.value)

    @property
    def share_met(self) -> float | None:
        """The fraction of devices that meet everything; None without a spread."""
        return None if self.met is None else self.met.value

    @property
    def share_met_between(self) -> tuple[float, float] | None:
        """The 95 % interval of that fraction."""
        return (
            None
            if self.met is None
            else (self.met.low or 0.0, 1.0 if self.met.high is None else self.met.high)
        )

    @property
    def table(self) -> Table:
        """The candidates."""
        return table_of(self.candidates, "", self.unit_names)

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """Draw the power of each circuit next to the requirement, as a matplotlib figure."""
        return drawing.draw(self, self.scene.title if title == "" and ax is None else title, ax)
