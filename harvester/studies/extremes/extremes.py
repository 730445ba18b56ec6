"""The largest displacement, voltage and impact over a lifetime, and how that was found."""

import math
from dataclasses import replace
from typing import Any

from harvester.engines.protocol import AnyScene, served
from harvester.equations.impact_order import accumulation
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments, reading, shown
from harvester.machine.automatic import reporting
from harvester.machine.progress import ProgressCallback, listening
from harvester.presentation.diagnostic import Diagnostic, has, note, warning
from harvester.presentation.plain import plain
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.quantities.units import Seconds, time
from harvester.studies.extremes.counted import SHORTEST
from harvester.studies.extremes.levels import (
    SHARES,
    SPEED,
    STRAIN,
    check_served,
    counted_levels,
    linear_peaks,
    rice_holds,
    strain_factor,
)
from harvester.uncertainty.value import Value, amount, in_percent

LONGEST = 1e30  # of a lifetime, in s or in 1/w0
WITHIN = 1e-3  # of the density whose first passages are asked for


class Extremes(TableResult):
    """The levels that a device's displacement, voltage and impacts stay below over a lifetime.

    Attributes
    ----------
    lifetime : float
        how long the device is used (s, or 1/w0).
    levels : dict
        of each quantity (peak_displacement, peak_voltage, peak_impact_speed, and peak_strain if
        the scene has its piezo.strain_per_displacement) the level, a `Value`, that a fraction of
        devices stays below: ``levels["peak_voltage"][0.95]`` (m, V, m/s).
    impact_rate : Value or None
        a `Value`: the mean number of impacts a unit of time; None without a stop and if impacts
        accumulate.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> result = hv.extremes(scene, lifetime=1e6)
    >>> f"{result.levels['peak_displacement'][0.5].value:.2f}"
    '1.82'
    """

    DERIVED = ("method", "table")
    NOT_SHOWN = frozenset({"lifetime", "levels", "method"})
    NOT_IN_JSON = frozenset({"levels", "table"})
    SHORT = ("lifetime", "levels", "impact_rate")

    lifetime: float
    levels: dict[str, dict[float, Value]]
    impact_rate: Value | None
    physical: bool
    diagnostics: tuple[Diagnostic, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        units = self._units
        levels = {
            name: {k: replace(v, unit=units[name]) for k, v in row.items()}
            for name, row in self.levels.items()
        }
        object.__setattr__(self, "levels", levels)

    @property
    def _units(self) -> dict[str, str]:
        """The unit of each quantity."""
        units = self.unit_names
        known = {"peak_displacement": units.length, "peak_voltage": units.voltage, STRAIN: ""}
        return {name: known.get(name, units.speed) for name in self.levels}

    @property
    def method(self) -> str:
        """How it was found."""
        return "; ".join(map(str, self.notes))

    @property
    def table(self) -> Table:
        """A row a quantity, and the level that each fraction of devices stays below."""
        names = self.unit_names
        units = [*self._units.values()]
        columns = [Column("largest", [*self.levels], label="largest in the lifetime")]
        for share in SHARES:
            levels = [level[share] for level in self.levels.values()]
            label = f"below this in {in_percent(share, '.0f')} of devices"
            columns.append(Column(f"level_{share:g}", levels, units=units, label=label))
        return Table(tuple(columns), f"over {amount(self.lifetime, names.time)}", ("largest",))

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints: its fields, with the levels of each quantity by its name."""
        return super().as_json() | {name: plain(by_share) for name, by_share in self.levels.items()}


@names_arguments
def extremes(
    scene: AnyScene,
    *,
    lifetime: float | str,
    seed: int = 0,
    counted: bool = False,
    passages: bool = False,
    progress: ProgressCallback | bool | None = None,
) -> Extremes:
    """The largest displacement, voltage and impact speed that a scene under white noise has over a lifetime.

    A linear scene under white noise of its base is Gaussian, and Rice's formula holds; else the
    largest values of blocks of a long trajectory are extrapolated.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    lifetime : float or str
        in seconds (nondimensional scene: 1/w0), or a text such as "5 years".
    seed : int, default 0
        the same seed, the same noise.
    counted : bool, default False
        extrapolate from a trajectory also if Rice's formula holds.
    passages : bool, default False
        by the rate of first passages of engine `Density`, without sampling: the displacement alone.
    progress : callable or bool, optional
        called with the fraction of the trajectory that is done.  By default a bar on a terminal or
        in a notebook, if that lasts longer than a second; False: none.

    Returns
    -------
    Extremes
        the levels (m, V, m/s; nondimensional scene: without units) that 50 % and 95 % of such
        devices stay below.

    Raises
    ------
    InputError
        for an invalid lifetime, or with a unit if the scene has none.
    CannotServeError
        for a netlist, and a scene that is not excited by white noise alone.
    SimulationError
        if no stationary response exists.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.extremes(scene, lifetime=1e6).impact_rate is None
    True
    """
    problem = Problem.of(scene)
    span = read_lifetime(lifetime, problem)
    check_served(problem)
    if passages:
        return _by_passages(problem, span)
    if rice_holds(problem) and not counted:
        of_share = {share: linear_peaks(problem, span, share) for share in SHARES}
        levels = {
            name: {share: of_share[share][name] for share in SHARES} for name in of_share[SHARES[0]]
        }
        return Extremes(span, levels, None, problem.physical, (note("by_rice"),))
    with reporting(progress, "extremes") as report, listening(report):
        result = counted_levels(problem, span, seed)
    path = result.path
    n_blocks = len(result.path.x)
    unit = " s" * problem.physical
    counted_time = path.time / problem.units.frequency
    by_blocks = note(
        "by_blocks", blocks=n_blocks, time=counted_time, unit=unit, times=result.blocks / n_blocks
    )
    hit = 0 if path.speed is None else int((path.speed > 0.0).sum())
    few = (
        []
        if path.speed is None or SPEED in result.levels
        else [warning("few_impacts", blocks=n_blocks, hit=hit)]
    )
    if (uncounted := accumulation(problem.equations)) is not None:
        return Extremes(span, result.levels, None, problem.physical, (by_blocks, uncounted, *few))
    return Extremes(span, result.levels, result.rate, problem.physical, (by_blocks, *few))


def _by_passages(problem: Problem, span: float) -> Extremes:
    """The largest displacement by first passages."""
    from harvester.engines.density import Density
    from harvester.studies.extremes.passage_levels import PassageLevels

    if math.isfinite(sum(problem.equations.rigid_stops)):
        raise CannotServeError(
            "`passages` must be used with a side without a rigid stop, but both sides have one"
        )
    served(Density, problem)
    units = problem.units
    _, answer = Density(within=WITHIN).solve(problem)
    passages = PassageLevels(problem, answer)
    by_share = {
        share: passages.level(share, span * units.frequency).scaled(units.length)
        for share in SHARES
    }
    levels = {"peak_displacement": by_share}
    if (strain := strain_factor(problem)) is not None:
        levels[STRAIN] = {share: level.scaled(strain) for share, level in by_share.items()}
    return Extremes(
        span,
        levels,
        None,
        problem.physical,
        (note("by_first_passages", solved=len(passages.known)),),
    )


def extremes_both_ways(scene: AnyScene, lifetime: float | str, seed: int = 0) -> list[Extremes]:
    """The largest values by Rice's formula, if it holds, and counted on a trajectory.

    Else as `extremes`.
    """
    result = extremes(scene, lifetime=lifetime, seed=seed)
    if not has(result.diagnostics, "by_rice"):
        return [result]
    return [result, extremes(scene, lifetime=lifetime, seed=seed, counted=True)]


def check_extremes(scene: AnyScene, lifetime: float | str) -> None:
    """Raise the errors of `extremes` for an invalid lifetime, or a scene that has no largest values."""
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
    """A lifetime of `SHORTEST` cycles or more, in seconds or in 1/w0.

    Raises InputError for another.
    """
    span = reading("`lifetime`", time, lifetime) if isinstance(lifetime, str) else float(lifetime)
    if not 0.0 < span < LONGEST:
        must = f"be a time above 0 and below {LONGEST:g} (s, or 1/w0), such as '5 years'"
        raise invalid("`lifetime`", must, lifetime)
    if isinstance(span, Seconds) and not problem.physical:
        raise InputError(
            f"`lifetime` must be a number of 1/w0 for a nondimensional scene, but is {shown(lifetime)}"
        )
    least = 2.0 * math.pi * SHORTEST / problem.units.frequency
    if span < least:
        unit = " s" if problem.physical else ""
        raise invalid(
            "`lifetime`",
            f"be at least {SHORTEST} cycles of the device, {least:.3g}{unit}",
            lifetime,
        )
    return float(span)
