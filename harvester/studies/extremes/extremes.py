"""The largest displacement, voltage and impact over a lifetime, and how that was found."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from harvester.engines.protocol import AnyScene
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments, shown
from harvester.machine.execution import as_in_version_0_1
from harvester.presentation.diagnostic import Diagnostic, has, note
from harvester.presentation.plain import plain
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.quantities.units import Seconds, time
from harvester.studies.extremes.counted import SHORTEST
from harvester.studies.extremes.levels import SHARES, STRAIN, check_served, counted_levels, linear_peaks, rice_holds
from harvester.uncertainty.value import Value, amount


@names_arguments
@dataclass(frozen=True, repr=False)
class Extremes(TableResult):
    """The levels that a device's displacement, voltage and impacts stay below over a ``lifetime``, in `unit_names`.

    ``levels`` map a quantity (peak_displacement, peak_voltage, peak_impact_speed, and peak_strain where the scene has
    its piezo.strain_per_displacement) to the level for each of `SHARES`;
    ``impact_rate`` is the mean number of impacts a unit of time, None without a stop; ``method`` says how it was found.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.extremes(scene, lifetime=1e6)
    >>> f"{found.levels['peak_displacement'][0.5].value:.2f}"
    '1.82'
    """

    DERIVED: ClassVar[tuple[str, ...]] = ("method", "table")
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset({"lifetime", "levels", "method"})
    NOT_IN_JSON: ClassVar[frozenset[str]] = frozenset({"levels", "table"})
    SHORT: ClassVar[tuple[str, ...]] = ("lifetime", "levels", "impact_rate")

    lifetime: float
    levels: dict[str, dict[float, Value]]
    impact_rate: Value | None
    physical: bool
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def method(self) -> str:
        """How it was found."""
        return "; ".join(map(str, self.notes))

    @property
    def table(self) -> Table:
        """A row a quantity, and the levels for each of `SHARES`."""
        of = self.unit_names
        known = {"peak_displacement": of.length, "peak_voltage": of.voltage, STRAIN: ""}
        units = [known.get(name, of.speed) for name in self.levels]
        columns = [Column("largest", [*self.levels], label="largest in the lifetime")]
        for share in SHARES:
            levels, label = [one[share] for one in self.levels.values()], f"below this in {share:.0%} of devices"
            columns.append(Column(f"level_{share:g}", levels, units=units, label=label))
        return Table(tuple(columns), f"over {amount(self.lifetime, of.time)}", ("largest",))

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the levels of each quantity by its name."""
        return super().as_json() | {name: plain(of) for name, of in self.levels.items()}


@as_in_version_0_1("lifetime", "seed", executes=False)
@names_arguments
def extremes(scene: AnyScene, *, lifetime: float | str, seed: int = 0, counted: bool = False) -> Extremes:
    """The largest displacement, voltage and impact speed that a scene under white noise has over a lifetime.

    ``lifetime`` is in seconds (nondimensional scene: 1/w0) or a text such as "5 years".  A linear scene under white
    noise of its base is Gaussian, and Rice's formula holds (`harvester.linear.level_crossings`); else the largest
    values of blocks of a long path are extrapolated (`harvester.studies.extremes.extreme_value_fit`): everywhere, where
    ``counted``.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.extremes(scene, lifetime=1e6).impact_rate is None
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
    span = read_lifetime(lifetime, problem)
    check_served(problem)
    if rice_holds(problem) and not counted:
        of_share = {share: linear_peaks(problem, span, share) for share in SHARES}
        levels = {name: {share: of_share[share][name] for share in SHARES} for name in of_share[SHARES[0]]}
        return Extremes(span, levels, None, problem.physical, (note("by_rice"),))
    found = counted_levels(problem, span, seed)
    path, many, unit = found.path, len(found.path.x), " s" * problem.physical
    counted_time = path.time / problem.units.frequency
    said = note("by_blocks", blocks=many, time=counted_time, unit=unit, times=found.blocks / many)
    return Extremes(span, found.levels, found.rate, problem.physical, (said,))


def extremes_both_ways(scene: AnyScene, lifetime: float | str, seed: int = 0) -> list[Extremes]:
    """The largest values by Rice's formula, where it holds, and counted on a path; else as `extremes`."""
    found = extremes(scene, lifetime=lifetime, seed=seed)
    if not has(found.diagnostics, "by_rice"):
        return [found]
    return [found, extremes(scene, lifetime=lifetime, seed=seed, counted=True)]


def check_asked(scene: AnyScene, lifetime: float | str) -> None:
    """Raise what `extremes` would for a lifetime that is none, or a scene that has no largest values."""
    problem = Problem.of(scene)
    read_lifetime(lifetime, problem)
    check_served(problem)


def has_lifetime(problem: Problem) -> bool:
    """Whether a scene has largest values over a lifetime."""
    try:
        check_served(problem)
    except CannotServeError:
        return False
    return True


def read_lifetime(lifetime: float | str, problem: Problem) -> float:
    """A lifetime of `SHORTEST` cycles or more, in seconds or in 1/w0; raises InputError for another."""
    try:
        found = time(lifetime) if isinstance(lifetime, str) else float(lifetime)
        if not 0.0 < found < 1e30:
            raise ValueError("must be a time above 0, such as '5 years'")
    except ValueError as error:
        raise InputError(f"`lifetime` {error}, but is {shown(lifetime)}") from None
    if isinstance(found, Seconds) and not problem.physical:
        raise InputError(f"`lifetime` must be a number of 1/w0 for a nondimensional scene, but is {shown(lifetime)}")
    least = 2.0 * math.pi * SHORTEST / problem.units.frequency
    if found < least:
        unit = " s" if problem.physical else ""
        raise invalid("`lifetime`", f"be at least {SHORTEST} cycles of the device, {least:.3g}{unit}", lifetime)
    return float(found)
