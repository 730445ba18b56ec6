"""The request of a charging study: its options, read and checked, and the defaults of those that are left out."""

import math

from harvester.engines import Compiled, Ideal, Slow, Spice
from harvester.engines.options import Request, number
from harvester.engines.protocol import served
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, refused, unknown
from harvester.netlists.probes import STORE, Probe
from harvester.presentation.diagnostic import Diagnostic, note, refusal
from harvester.quantities.kinds import NUMBER_ABOVE_0, TIME, Kind, with_prefix
from harvester.studies.charging.by_slow import charges_slowly, refusal_of_slow

ENGINES = {engine.NAME: engine for engine in (Ideal, Compiled, Slow, Spice)}
RUNS = {Ideal.NAME: 2048, Compiled.NAME: 512, Slow.NAME: 2048, Spice.NAME: 16}
MOST_RUNS = 100_000
# nondimensional: what is watched by default, at least and at most
SHORTEST = 120.0 * math.pi
LONGEST = 2e4
CHARGED = 5.0  # time constants of storage capacitor and load, after which the voltage grows no more
MOST = 1e6  # nondimensional duration
SMALLEST_STEP, LARGEST_STEP = 1e-5, 1.0  # nondimensional


def choose_engine(
    problem: Problem, probe: Probe, engine: str | None, slowly: bool = True
) -> tuple[str, Diagnostic | None]:
    """The engine's name, and why it is that one if it was not chosen: not `Slow` unless ``slowly``."""
    if engine is not None and engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    by_request = engine is not None and ENGINES[engine].by_mean_current
    if by_request or (engine is None and slowly and charges_slowly(problem)):
        slow = refusal_of_slow(problem, probe)
        if slow is None:
            return Slow.NAME, None
        if by_request:
            raise CannotServeError(slow)
    if engine is not None:
        served(ENGINES[engine], problem)
        if not ENGINES[engine].runs_ngspice and (why := _refusal(problem, probe, engine)):
            raise CannotServeError(str(why))
        return engine, None
    excuse = Ideal.refusal(problem) or _refusal(problem, probe, Ideal.NAME)
    if not excuse:
        return Ideal.NAME, None
    served(Spice, problem)
    return Spice.NAME, note("engine_chosen", engine=Spice.NAME, why=str(excuse))


def _refusal(problem: Problem, probe: Probe, engine: str) -> Diagnostic | None:
    """Why an engine of trajectories side by side cannot charge a scene that it supports otherwise.

    None if it can.
    """
    if probe.name != STORE:
        return refusal("store_alone", engine=engine, probe=probe.name)
    if problem.equations.shaking_period is not None:
        return refusal("noise_alone", engine=engine)
    return None


def read_target(to: str | float, probe: Probe, problem: Problem) -> float:
    """The target in the scene's units."""
    kind = NUMBER_ABOVE_0
    if problem.physical:
        names = {"V": "a voltage (V)", "A": "a current (A)", "W": "a power (W)"}
        kind = Kind(
            names[probe.unit],
            probe.unit,
            {"V": "'3.3 V'", "A": "'1 mA'", "W": "'5 uW'"}[probe.unit],
            above=0.0,
        )
    try:
        return with_prefix(to.strip(), kind) if isinstance(to, str) else kind.read(to)
    except ValueError as error:
        raise refused("`to`", error, to) from None


def read_runs(trajectories: int | str | None) -> tuple[int | None, float]:
    """The number of runs (None: that of the engine), and the time (s) of all (infinite: any)."""
    if not isinstance(trajectories, str):
        return trajectories, math.inf
    return None, number(Request(budget=trajectories).budget) or math.inf


def count_of_runs(trajectories: int | None, engine: str, steady: bool) -> int:
    """How many runs there are."""
    if trajectories is None:
        return 1 if steady else RUNS[engine]
    if steady:
        raise InputError(
            "`trajectories` must be left out if nothing is random, as all runs are the same, but is given: with "
            "`anywhere` each begins at another place of the excitation"
        )
    if not 2 <= trajectories <= MOST_RUNS:
        raise invalid("`trajectories`", f"be between 2 and {MOST_RUNS}", trajectories)
    return trajectories


def check_anywhere(anywhere: bool, problem: Problem) -> None:
    """Refuse to begin anywhere in an excitation without a beginning."""
    eqs = problem.equations
    if anywhere and eqs.drive is None and eqs.record is None:
        raise InputError(
            "`anywhere` must be used with a record or a harmonic excitation, which noise is not, but is given"
        )


def time_watched(duration: str | float | None, problem: Problem, slow: bool) -> tuple[float, bool]:
    """How long runs are watched at most, in the scene's unit, and whether that was asked for.

    ``slow``: by `Slow`.
    """
    unit = problem.units.frequency
    least = 1.0
    longest = math.inf if slow else LONGEST
    most = math.inf if slow else MOST
    if duration is None:
        storage = (problem.circuit.storage if problem.circuit else None) or math.inf
        charged = CHARGED * storage * problem.scales.frequency
        return min(max(charged, SHORTEST), longest) / unit, False
    watched = read_time("duration", duration, problem)
    if not least <= watched * unit <= most:
        raise invalid(
            "`duration`", f"be between {least / unit:.3g} and {most / unit:.3g}", duration
        )
    return watched, True


def read_step(dt: str | float | None, problem: Problem) -> float | None:
    """The nondimensional step; None for that of the scene."""
    if dt is None:
        return None
    unit = problem.units.frequency
    h = read_time("dt", dt, problem) * unit
    if not SMALLEST_STEP <= h <= LARGEST_STEP:
        raise invalid(
            "`dt`", f"be between {SMALLEST_STEP / unit:.3g} and {LARGEST_STEP / unit:.3g}", dt
        )
    return h


def read_time(name: str, value: str | float, problem: Problem) -> float:
    """A time in the scene's unit: s, or a number of 1/w0."""
    kind = TIME if problem.physical else NUMBER_ABOVE_0
    try:
        return with_prefix(value.strip(), kind) if isinstance(value, str) else kind.read(value)
    except ValueError as error:
        raise refused(f"`{name}`", error, value) from None
