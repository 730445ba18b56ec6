"""The front of two aims by an engine that samples: the best of places that fill the ranges, and what cannot be told.

All places are computed with the same noise, coarse to fine, until the budget ends.  A place is on the front where none
has both more power and a better other quantity.  Of one that is beaten, the front may still hold it: by each place that
beats it, in one aim or the other by less than the root of both squared errors,

    e^2 = e1^2 + e2^2   (95 % each; the noise that they share makes the true one smaller).
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, SimulationError
from harvester.studies.extremes.levels import limited_peaks
from harvester.studies.optimum.evaluations import Evaluation, SpentError, Surface, Tick, with_options
from harvester.studies.optimum.ranges import Range, problem_at, scan
from harvester.studies.robust.front import FrontPoint
from harvester.studies.tolerance.limits import PEAKS, Limit
from harvester.studies.tolerance.peaks import BLOCKS
from harvester.uncertainty.value import Value

PLACES = {1: 25, 2: 65, 3: 97, 4: 129}  # by the number of keys
FEWEST = 3  # places that a front is made of


@dataclass(frozen=True)
class SampledFront:
    """Designs of the front, those that cannot be told from it, and warnings."""

    points: tuple[FrontPoint, ...]
    alike: tuple[FrontPoint, ...]
    warnings: tuple[str, ...]


def sampled_front(
    problem: Problem,
    ranges: Sequence[Range],
    aimed: Limit,
    limits: Sequence[Limit],
    engine: Any,
    lifetime: float | None,
    within: float,
    budget: float,
    tick: Tick | None,
) -> SampledFront:
    """The front of the power and of the quantity that ``aimed`` names, to be low or high by its sign, under limits.

    Raises SimulationError where fewer than `FEWEST` places have an answer that keeps the limits, with what to change.
    """
    begin, warnings = time.perf_counter(), list[str]()
    surface = Surface(problem.scene, tuple(ranges), budget, tick)
    engine = with_options(engine, within=within) if getattr(engine, "trajectories", None) is None else engine
    designs: list[FrontPoint] = []
    refused: HarvesterError | None = None
    places = scan(PLACES[len(ranges)], len(ranges))
    try:
        for u in places:
            there = surface.evaluate(u[None], engine, "scan")[0]
            try:
                design = _design(surface, there, aimed, limits, lifetime, engine.seed)
            except HarvesterError as error:
                refused = error
                continue
            designs += [] if design is None else [design]
    except SpentError:
        warnings.append(f"the budget of {budget:.3g} s ended after {len(surface.points)} of {len(places)} places")
    if len(designs) < FEWEST:
        why = f": {refused}" if refused is not None else ""
        raise SimulationError(
            f"a front must have {FEWEST} places with an answer that keeps all limits, but {len(designs)} of "
            f"{len(surface.points)} have, in {time.perf_counter() - begin:.2g} s: allow a longer `budget` or other "
            f"ranges{why}"
        )
    points, alike = split(designs, aimed.sign)
    return SampledFront(points, alike, tuple(warnings))


def split(designs: Sequence[FrontPoint], sign: int) -> tuple[tuple[FrontPoint, ...], tuple[FrontPoint, ...]]:
    """The designs that none beats in both aims, and those that are beaten within the errors only.

    From the best quantity to the most power; ``sign`` is 1 where the quantity is to be high.
    """
    points, alike = list[FrontPoint](), list[FrontPoint]()
    for one in sorted(designs, key=lambda point: (-sign * point.quantity, -point.mean_power.value)):
        beaten = [other for other in designs if other is not one and _beats(other, one, sign)]
        if not beaten:
            points.append(one)
        elif not any(_surely(other, one, sign) for other in beaten):
            alike.append(one)
    return tuple(points), tuple(alike)


def _gains(one: FrontPoint, other: FrontPoint, sign: int) -> tuple[float, float]:
    """What one has more than another of the power, and of what is good in the quantity."""
    return one.mean_power.value - other.mean_power.value, sign * (one.quantity - other.quantity)


def _beats(one: FrontPoint, other: FrontPoint, sign: int) -> bool:
    power, quantity = _gains(one, other, sign)
    return power >= 0.0 and quantity >= 0.0 and (power > 0.0 or quantity > 0.0)


def _surely(one: FrontPoint, other: FrontPoint, sign: int) -> bool:
    """Whether one beats another beyond the errors of both, in both aims."""
    power, quantity = _gains(one, other, sign)
    own, theirs = one.quantity_error95 or 0.0, other.quantity_error95 or 0.0
    return power > math.hypot(one.mean_power.known_error95, other.mean_power.known_error95) and quantity > math.hypot(
        own, theirs
    )


def _design(
    surface: Surface, there: Evaluation, aimed: Limit, limits: Sequence[Limit], lifetime: float | None, seed: int
) -> FrontPoint | None:
    """The design at a place; None where it breaks a limit, at the unsafe end of the error."""
    if not isinstance(there.answer, Estimate):
        raise there.answer
    values = _quantities(there.answer)
    if any(one.quantity in PEAKS for one in (*limits, aimed)):
        assert lifetime is not None
        values |= limited_peaks(problem_at(surface.scene, surface.ranges, there.u), lifetime, seed, BLOCKS)
    for one in limits:
        value = values[one.quantity]
        if one.sign * (value.value - one.bound) < value.known_error95:
            return None
    value = values[aimed.quantity]
    return FrontPoint(surface.values(there.u), there.answer.mean_power, value.value, value.known_error95)


def _quantities(answer: Estimate) -> dict[str, Value]:
    """What an answer says of the quantities that a limit may have."""
    square = answer.mean_square_voltage
    root = math.sqrt(max(square.value, 0.0))
    rms = Value(root, model=square.known_error95 / (2.0 * root) if root else 0.0)
    return {"mean_power": answer.mean_power, "mean_square_voltage": square, "voltage_rms": rms}
