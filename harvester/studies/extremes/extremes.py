"""The largest displacement, voltage and impact over a lifetime, and how that was found."""

from dataclasses import dataclass
from typing import Any

from harvester.engines.exact import Exact
from harvester.engines.protocol import AnyScene, needs_resistance
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, names_arguments, shown
from harvester.printing.answer_units import AnswerUnits
from harvester.printing.columns import columns
from harvester.scene.units import Seconds, time
from harvester.studies.extremes.counted import count
from harvester.studies.extremes.tail import fit
from harvester.uncertainty.value import Value, number

SHARES = (0.5, 0.95)  # of devices, whose largest value in a lifetime is below the level
RICE = "Rice's formula: the response is Gaussian; the model's error is up to where every passage counts alone"
STRAIN = "peak_strain"  # of the piezo, where the scene has its piezo.strain_per_displacement
LEAST_TIMES = 1.0  # of a block: a lifetime that is shorter has no tail


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
            rows.append([name, *(of[p].text(self._unit(name)) for p in SHARES)])
        if self.impact_rate is not None:
            rows.append(["impacts, mean rate", self.impact_rate.text(self.unit_names.rate), ""])
        return rows

    def __str__(self) -> str:
        lines = [f"over {Value(self.lifetime).text('')} {self.unit_names.time}".rstrip() + ":"]
        return "\n".join([*lines, *(f"  {row}" for row in columns(self.rows())), f"  note: {self.method}"])


@names_arguments
def extremes(scene: AnyScene, lifetime: float | str, seed: int = 0, *, counted: bool = False) -> Extremes:
    """The largest displacement, voltage and impact speed that a scene under white noise has over a lifetime.

    ``lifetime`` is in seconds (nondimensional scene: 1/w0) or a text such as "5 years".  A linear scene under white
    noise of its base is Gaussian, and Rice's formula holds (`harvester.linear.peaks`); else the largest values of
    blocks of a long path are extrapolated (`harvester.studies.extremes.tail`): everywhere, where ``counted``.

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
    eqs, units = problem.equations, problem.units
    seconds = read_lifetime(lifetime, problem.physical)
    check_served(problem)
    span = seconds * units.frequency
    scales = {"peak_displacement": units.length, "peak_voltage": units.volts}
    levels: dict[str, dict[float, Value]] = {}
    if rice_holds(problem) and not counted:
        for share in SHARES:
            for name, level in linear_peaks(problem, seconds, share).items():
                levels.setdefault(name, {})[share] = level
        return Extremes(seconds, levels, None, RICE, problem.physical)
    path = count(eqs, seed)
    blocks = span / path.block
    if blocks < LEAST_TIMES:
        raise InputError(
            f"`lifetime` must be at least {path.block / units.frequency:.3g}, which the motion takes to forget "
            f"itself, but is {seconds:.3g}"
        )
    named = {"peak_displacement": path.x, "peak_voltage": path.V}
    if path.speed is not None:
        named["peak_impact_speed"] = path.speed
        scales["peak_impact_speed"] = units.length * units.frequency
    for name, maxima in named.items():
        if maxima.max() > 0.0:
            tail = fit(maxima, seed)
            levels[name] = {p: tail.largest(p, blocks).scaled(scales[name]) for p in SHARES}
    if (strain := _strain(problem)) is not None and "peak_displacement" in levels:
        levels[STRAIN] = {p: one.scaled(strain) for p, one in levels["peak_displacement"].items()}
    rate = None if path.impacts is None else path.impacts.scaled(units.frequency)
    longer = f", {blocks / len(path.x):.3g} times what was counted" if blocks > len(path.x) else ""
    method = (
        f"extrapolated from the largest values of {len(path.x)} blocks of a path of "
        f"{path.time / units.frequency:.3g}{' s' if problem.physical else ''}{longer}"
    )
    return Extremes(seconds, levels, rate, method, problem.physical)


def extremes_both_ways(scene: AnyScene, lifetime: float | str, seed: int = 0) -> list[Extremes]:
    """The largest values by Rice's formula, where it holds, and counted on a path; else as `extremes`."""
    found = [extremes(scene, lifetime, seed)]
    return [*found, extremes(scene, lifetime, seed, counted=True)] if found[0].method == RICE else found


def check_asked(scene: AnyScene, lifetime: float | str) -> None:
    """Raise what `extremes` would for a lifetime that is none, or a scene that has no largest values."""
    problem = Problem.of(scene)
    read_lifetime(lifetime, problem.physical)
    check_served(problem)


def rice_holds(problem: Problem) -> bool:
    """Whether a problem that is served is linear, so that its response is Gaussian."""
    return not Exact.refusal(problem) and problem.equations.n2 is None


def _strain(problem: Problem) -> float | None:
    """The largest strain of the piezo over the displacement, in 1/m; None where the scene does not have it."""
    return None if problem.scene.piezo is None else problem.scene.piezo.strain_per_displacement


def check_served(problem: Problem) -> None:
    """Raise CannotServeError for a problem that has no largest values over a lifetime: a netlist, other shaking."""
    if reason := needs_resistance(problem, "ensemble"):
        raise CannotServeError(f"`lifetime` is for a load resistance or none: {reason}")
    if problem.equations.is_shaken_otherwise or not problem.equations.is_random:
        raise CannotServeError(
            "`lifetime` must go with white noise alone, but the scene has other shaking, or no noise"
        )


def has_lifetime(problem: Problem) -> bool:
    """Whether a scene has largest values over a lifetime."""
    try:
        check_served(problem)
    except CannotServeError:
        return False
    return True


def linear_peaks(problem: Problem, lifetime: float, share: float = SHARES[-1]) -> dict[str, Value]:
    """The levels that |displacement| and |voltage| of a linear scene stay below over a lifetime with a probability.

    And the piezo's strain where the scene has its piezo.strain_per_displacement.  In the scene's units; the error is up
    to where every passage counts alone (`harvester.linear.peaks`).

    Raises CannotServeError for a scene that is not linear under white noise of its base alone.
    """
    from harvester.linear.peaks import peaks

    eqs, units = problem.equations, problem.units
    if Exact.refusal(problem) or eqs.n2 is not None or eqs.is_shaken_otherwise:
        raise CannotServeError(
            "a limit of a peak must go with a linear scene under white noise of its base alone, but this one is not"
        )
    found: dict[str, Value] = {}
    scales = {"peak_displacement": units.length, "peak_voltage": units.volts}
    for (name, factor), one in zip(scales.items(), peaks(eqs), strict=True):
        span = lifetime * units.frequency
        low, high = one.largest(share, span), one.bound(share, span)
        found[name] = Value(low, model=max(high - low, 0.0)).scaled(factor)
    if (strain := _strain(problem)) is not None:
        found[STRAIN] = found["peak_displacement"].scaled(strain)
    return found


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
