"""The largest displacement, voltage and impact over a lifetime, and how that was found."""

from dataclasses import dataclass
from typing import Any

from harvester.engines.protocol import AnyScene
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, names_arguments, shown
from harvester.presentation.answer_units import AnswerUnits
from harvester.presentation.columns import columns
from harvester.quantities.units import Seconds, time
from harvester.studies.extremes.levels import SHARES, STRAIN, check_served, counted_levels, linear_peaks, rice_holds
from harvester.uncertainty.value import Value, number

RICE = "Rice's formula: the response is Gaussian; the model's error is up to where every passage counts alone"


@names_arguments
@dataclass(frozen=True)
class Extremes:
    """The levels that a device's displacement, voltage and impacts stay below over a ``lifetime``, in `unit_names`.

    ``levels`` map a quantity (peak_displacement, peak_voltage, peak_impact_speed, and peak_strain where the scene has
    its piezo.strain_per_displacement) to the level for each of `SHARES`;
    ``impact_rate`` is the mean number of impacts a unit of time, None without a stop; ``method`` says how it was found.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.extremes(scene, 1e6)
    >>> f"{found.levels['peak_displacement'][0.5].value:.2f}"
    '1.82'
    """

    lifetime: float
    levels: dict[str, dict[float, Value]]
    impact_rate: Value | None
    method: str
    physical: bool

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    def _unit(self, name: str) -> str:
        units = self.unit_names
        known = {"peak_displacement": units.length, "peak_voltage": units.voltage, STRAIN: ""}
        return known.get(name, units.speed)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return {
            "lifetime": self.lifetime,
            **{name: {f"{p:g}": number(one) for p, one in of.items()} for name, of in self.levels.items()},
            "impact_rate": None if self.impact_rate is None else number(self.impact_rate),
            "method": self.method,
        }

    def rows(self) -> list[list[str]]:
        """A table: its heads, then the levels of each quantity, and the impacts where there is a stop."""
        rows = [["largest in the lifetime", *(f"below this in {p:.0%} of devices" for p in SHARES)]]
        for name, of in self.levels.items():
            rows.append([name, *(of[p].format(self._unit(name)) for p in SHARES)])
        if self.impact_rate is not None:
            rows.append(["impacts, mean rate", self.impact_rate.format(self.unit_names.rate), ""])
        return rows

    def __str__(self) -> str:
        lines = [f"over {Value(self.lifetime).format('')} {self.unit_names.time}".rstrip() + ":"]
        return "\n".join([*lines, *(f"  {row}" for row in columns(self.rows())), f"  note: {self.method}"])


@names_arguments
def extremes(scene: AnyScene, lifetime: float | str, seed: int = 0, *, counted: bool = False) -> Extremes:
    """The largest displacement, voltage and impact speed that a scene under white noise has over a lifetime.

    ``lifetime`` is in seconds (nondimensional scene: 1/w0) or a text such as "5 years".  A linear scene under white
    noise of its base is Gaussian, and Rice's formula holds (`harvester.linear.level_crossings`); else the largest
    values of
    blocks of a long path are extrapolated (`harvester.studies.extremes.extreme_value_fit`): everywhere, where
    ``counted``.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.extremes(scene, 1e6).impact_rate is None
    True

    Raises
    ------
    InputError
        for a lifetime that is none, or with a unit where the scene has none.
    CannotServeError
        for a netlist, and a scene that is not shaken by white noise alone.
    SimulationError
        where no stationary response exists.
    """
    problem = Problem.of(scene)
    seconds = read_lifetime(lifetime, problem.physical)
    check_served(problem)
    levels: dict[str, dict[float, Value]] = {}
    if rice_holds(problem) and not counted:
        for share in SHARES:
            for name, level in linear_peaks(problem, seconds, share).items():
                levels.setdefault(name, {})[share] = level
        return Extremes(seconds, levels, None, RICE, problem.physical)
    found = counted_levels(problem, seconds, seed)
    path, many = found.path, len(found.path.x)
    longer = f", {found.blocks / many:.3g} times what was counted" if found.blocks > many else ""
    method = (
        f"extrapolated from the largest values of {many} blocks of a path of "
        f"{path.time / problem.units.frequency:.3g}{' s' if problem.physical else ''}{longer}"
    )
    return Extremes(seconds, found.levels, found.rate, method, problem.physical)


def extremes_both_ways(scene: AnyScene, lifetime: float | str, seed: int = 0) -> list[Extremes]:
    """The largest values by Rice's formula, where it holds, and counted on a path; else as `extremes`."""
    found = [extremes(scene, lifetime, seed)]
    return [*found, extremes(scene, lifetime, seed, counted=True)] if found[0].method == RICE else found


def check_asked(scene: AnyScene, lifetime: float | str) -> None:
    """Raise what `extremes` would for a lifetime that is none, or a scene that has no largest values."""
    problem = Problem.of(scene)
    read_lifetime(lifetime, problem.physical)
    check_served(problem)


def has_lifetime(problem: Problem) -> bool:
    """Whether a scene has largest values over a lifetime."""
    try:
        check_served(problem)
    except CannotServeError:
        return False
    return True


def read_lifetime(lifetime: float | str, physical: bool) -> float:
    """A lifetime above 0, in seconds or in 1/w0; raises InputError for another."""
    try:
        found = time(lifetime) if isinstance(lifetime, str) else float(lifetime)
        if not 0.0 < found < 1e30:
            raise ValueError("must be a time above 0, such as '5 years'")
    except ValueError as error:
        raise InputError(f"`lifetime` {error}, but is {shown(lifetime)}") from None
    if isinstance(found, Seconds) and not physical:
        raise InputError(f"`lifetime` must be a number of 1/w0 for a nondimensional scene, but is {shown(lifetime)}")
    return float(found)
