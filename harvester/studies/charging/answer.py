"""The answer of a charging study: the time to a voltage and its spread, the curve, and the power on the way."""

from typing import TYPE_CHECKING, Any

from harvester.arrays import Floats
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.result import Result, TableResult
from harvester.presentation.sheet import table_of
from harvester.presentation.table import Column, Table
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FEW = 20  # runs, of which 5 % are less than one


class Level(Result):
    """One voltage on the way: the storage capacitor's energy there, and the times and the power until there.

    ``time`` is None if a run never gets there; ``low`` and ``high`` are the times by which 5 and 95
    % of the runs have; ``power`` is the mean from the level before, None if a run never gets there
    or the probe is not the storage capacitor.
    """

    SHORT = ("voltage", "time")

    voltage: float
    energy: float | None
    reached: float
    time: Value | None
    low: float | None
    high: float | None
    power: Value | None


class ChargingResult(TableResult):
    """How a circuit charges from empty, in the scene's units.

    The curve is in arrays over the times ``t``, of shape (n,).

    Attributes
    ----------
    engine : str
        the name of the engine that computed it.
    probe : str
        the quantity of the circuit that is looked at.
    unit : str
        its unit.
    target : float
        the value to reach.
    duration : float
        how long a run was watched (s, or 1/w0).
    time : Value or None
        a `Value`: the mean time to the target; None if a run never reaches it within the duration.
    at_least : Value
        a `Value`: a lower bound of that time, the mean with such a run counted as the duration.
    low, high : float or None
        the times by which 5 % and 95 % of the runs have arrived; None if fewer have.
    runs : int
        the number of runs.
    reached, reached_between : float or tuple
        the fraction of them that arrive, and its 95 % interval.
    levels : tuple of Level
        voltages on the way to the target, with time, energy and power of each.
    t, voltage, stderr : ndarray or ndarray or None
        times, the mean over the runs and its standard error (None for one run), shape (n,).
    quantiles, arrived : tuple or ndarray
        5 and 95 % quantiles over the runs, and the fraction that has arrived by then.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    seconds : float
        the time of computing, without compilation (s).
    steps : int
        steps of all runs.
    afterwards : Value or None
        a `Value`: the fraction of the time at or above the target after the first arrival; None if
        it was not asked for.
    rises : float or None
        how often a run rises to the target; None if it was not asked for.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.load("examples/plate_bridge.toml")
    >>> found = hv.charge(scene, to="2 V", engine="ideal", trajectories=256)
    >>> found.reached, found.time.value > 0.0
    (1.0, True)
    """

    DERIVED = ("lower_bound", "energy", "power_to_target", "strongest")
    NOT_SHOWN = frozenset({"unit", "duration", "levels", "at_least"})
    NOT_IN_JSON = frozenset({"unit", "low", "high", *DERIVED})
    INTERNAL = frozenset({"t", "voltage", "stderr", "quantiles", "arrived"})
    SHORT = ("engine", "probe", "target", "time", "reached")

    engine: str
    probe: str
    unit: str
    target: float
    duration: float
    time: Value | None
    at_least: Value
    low: float | None
    high: float | None
    runs: int
    reached: float
    reached_between: tuple[float, float]
    t: Floats
    voltage: Floats
    stderr: Floats | None
    quantiles: tuple[Floats, Floats]
    arrived: Floats
    levels: tuple[Level, ...]
    physical: bool
    seconds: float
    steps: int
    afterwards: Value | None = None
    rises: float | None = None
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def strongest(self) -> Level | None:
        """The level on whose way the storage receives the most power; None if that is not known."""
        known = [level for level in self.levels if level.power is not None]
        return (
            max(known, key=lambda level: level.power.value if level.power else 0.0)
            if known
            else None
        )

    @property
    def lower_bound(self) -> Value | None:
        """`at_least` if the mean time is not known."""
        return self.at_least if self.time is None else None

    @property
    def energy(self) -> float | None:
        """The energy in the storage at the target; None if the probe is not the storage."""
        return self.levels[-1].energy

    @property
    def power_to_target(self) -> Value | None:
        """That energy over the mean time to the target, with its relative errors."""
        if self.energy is None or self.time is None:
            return None
        return self.time.scaled(self.energy / self.time.value**2)

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """Draw the curve with its band, the fraction of runs that have arrived, and the power."""
        return drawing.draw(self, title, ax)

    @property
    def table(self) -> Table:
        """The curve: mean and quantiles of the probe over time, and the fraction of the runs that have arrived."""
        known = [self.voltage, *self.quantiles]
        names = [f"{self.probe}_{column}" for column in ("mean", "low", "high")]
        columns = [Column(name, cells, self.unit) for name, cells in zip(names, known, strict=True)]
        columns = [
            Column("time", self.t, self.unit_names.time, "time"),
            *columns,
            Column("share_arrived", self.arrived),
        ]
        if self.stderr is not None:
            columns.append(Column(f"{self.probe}_mean_stderr", self.stderr, self.unit))
        return Table(tuple(columns), index=("time",))

    @property
    def ladder(self) -> Table:
        """The levels: times and power on the way to each, with their errors."""
        return table_of(self.levels, "on the way", self.unit_names, self.unit)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the quantiles next to the mean time."""
        fields = super().as_json()
        time = fields["time"] or {"value": None, "stderr": None}
        return fields | {"time": time | {"low": self.low, "high": self.high}}
