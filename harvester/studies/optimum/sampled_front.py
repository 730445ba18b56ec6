"""The Pareto front of two objectives by an engine that samples: the best of many points, and those within its errors.

All places are computed with the same noise, coarse to fine, until the budget ends.  A place is on
the front if none has both more power and a better other quantity.  For one that is beaten, the
front may still hold it: by each place that beats it, in one objective or the other by less than the
root of both squared errors,

    e^2 = e1^2 + e2^2   (95 % each; the noise that they share makes the true one smaller).
"""

import math
import time
from collections.abc import Sequence

from harvester.answers.estimate import Estimate
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError, SimulationError
from harvester.machine.progress import Progress
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.studies.extremes.levels import limited_peaks
from harvester.studies.optimum.evaluations import Evaluation, SpentError, Surface, with_options
from harvester.studies.optimum.pareto_front import FrontPoint, ParetoFront, remarks
from harvester.studies.optimum.ranges import problem_at, scan
from harvester.studies.optimum.search import Search, SearchRequest
from harvester.studies.tolerance.device_limits import PEAKS, Limit, lifetime_of, limits
from harvester.studies.tolerance.peaks import BLOCKS

SCAN_SIZE = {1: 25, 2: 65, 3: 97, 4: 129}  # by the number of keys
FEWEST = 3  # places that a front is made of


def sampled_front(
    request: SearchRequest,
    second: Limit,
    constraints: Sequence[str] | str,
    lifetime: float | str | None,
    progress: Progress,
) -> ParetoFront:
    """The front of the power and of the quantity that ``aimed`` names, to be low or high by its sign, under limits.

    Raises InputError for limits that cannot be and an engine that does not support the scene;
    SimulationError if fewer than `FEWEST` places have an answer that keeps the limits, with
    the arguments to change.
    """
    begin = time.perf_counter()
    warnings = list[Diagnostic]()
    problem = Problem.of(request.scene)
    bounds = limits(constraints, problem.physical)
    years = lifetime_of([*bounds, second], lifetime, problem)
    if reason := request.engine.refusal(problem):
        raise InputError(reason)
    surface = Search.begin(request, progress).surface
    engine = request.engine
    if getattr(engine, "trajectories", None) is None:
        engine = with_options(engine, within=request.within)
    sound, others = list[FrontPoint](), list[FrontPoint]()
    refused: HarvesterError | None = None
    candidates = scan(SCAN_SIZE[len(request.ranges)], len(request.ranges))
    try:
        for u in candidates:
            evaluation = surface.evaluate(u[None], engine, "scan")[0]
            try:
                design = _design(surface, evaluation, second, bounds, years)
            except HarvesterError as error:
                refused = error
                continue
            if design is not None:
                (sound if evaluation.is_sound else others).append(design)
    except SpentError:
        done = len(surface.points)
        warnings.append(
            warning("front_cut_short", budget=request.budget, done=done, places=len(candidates))
        )
    designs = sound if len(sound) >= FEWEST else [*sound, *others]
    if others and designs is sound:
        count = len(surface.points)
        left_out = len(others)
        warnings.append(
            warning("evaluations_unsound", unsound=left_out, count=count, engine=engine.NAME)
        )
    if len(designs) < FEWEST:
        why = f": {refused}" if refused is not None else ""
        raise SimulationError(
            f"a front must have {FEWEST} places with an answer that keeps all limits, but {len(designs)} of "
            f"{len(surface.points)} have, in {time.perf_counter() - begin:.2g} s: allow a longer `budget` or other "
            f"ranges{why}"
        )
    points, alike = split(designs, second.sign)
    diagnostics = (*warnings, *remarks(second.quantity, second.sign, points, alike))
    return ParetoFront(
        engine.NAME,
        second.quantity,
        second.sign,
        points=points,
        physical=problem.physical,
        seconds=time.perf_counter() - begin,
        diagnostics=diagnostics,
        alike=alike,
    )


def split(
    designs: Sequence[FrontPoint], sign: int
) -> tuple[tuple[FrontPoint, ...], tuple[FrontPoint, ...]]:
    """The designs that none beats in both objectives, and those that are beaten within the errors only.

    From the best quantity to the most power; ``sign`` is 1 if the quantity is to be high.
    """
    points, alike = list[FrontPoint](), list[FrontPoint]()
    for design in sorted(
        designs, key=lambda point: (-sign * point.quantity, -point.mean_power.value)
    ):
        beaten = [other for other in designs if other is not design and _beats(other, design, sign)]
        if not beaten:
            points.append(design)
        elif not any(_beats_beyond_errors(other, design, sign) for other in beaten):
            alike.append(design)
    return tuple(points), tuple(alike)


def _gains(design: FrontPoint, other: FrontPoint, sign: int) -> tuple[float, float]:
    """The gain of one over another in the power, and in the good direction of the quantity."""
    return design.mean_power.value - other.mean_power.value, sign * (
        design.quantity - other.quantity
    )


def _beats(design: FrontPoint, other: FrontPoint, sign: int) -> bool:
    power, quantity = _gains(design, other, sign)
    return power >= 0.0 and quantity >= 0.0 and (power > 0.0 or quantity > 0.0)


def _beats_beyond_errors(design: FrontPoint, other: FrontPoint, sign: int) -> bool:
    """Whether one beats another beyond the errors of both, in both objectives."""
    power, quantity = _gains(design, other, sign)
    error, other_error = design.quantity_error95 or 0.0, other.quantity_error95 or 0.0
    power_error = math.hypot(design.mean_power.known_error95, other.mean_power.known_error95)
    return power > power_error and quantity > math.hypot(error, other_error)


def _design(
    surface: Surface,
    evaluation: Evaluation,
    second: Limit,
    limits: Sequence[Limit],
    lifetime: float | None,
) -> FrontPoint | None:
    """The design at a place; None if it breaks a limit, at the unsafe end of the error."""
    answer, u = evaluation.answer, evaluation.u
    if not isinstance(answer, Estimate):
        raise answer
    square = answer.mean_square_voltage
    values = {
        "mean_power": answer.mean_power,
        "mean_square_voltage": square,
        "voltage_rms": square.root(),
    }
    if any(limit.quantity in PEAKS for limit in (*limits, second)):
        assert lifetime is not None
        values |= limited_peaks(
            problem_at(surface.scene, surface.ranges, u), lifetime, evaluation.seed or 0, BLOCKS
        )
    for limit in limits:
        value = values[limit.quantity]
        if limit.sign * (value.value - limit.bound) < value.known_error95:
            return None
    value = values[second.quantity]
    return FrontPoint(surface.values(u), answer.mean_power, value.value, value.known_error95)
