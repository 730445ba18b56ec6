"""The engines that answer while a slider turns: the three formulas over a grid of one key, and at the working point."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.protocol import Engine
from harvester.engines.selection import ENGINES, refusals
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.explore.slider_scale import Slide
from harvester.presentation.diagnostic import Diagnostic
from harvester.scene.scene import Scene

# The formulas, that which is nearest to the truth first.
FORMULAS: dict[str, type[Engine]] = {
    name: kind
    for name, kind in sorted(ENGINES.items(), key=lambda entry: -entry[1].LOOK.trust)
    if kind.is_formula
}
# Points of a curve that are computed while a slider turns, and after that; `PEAKED` where a closed
# form has peaks that a coarse grid would miss, as under a harmonic excitation.
POINTS, PEAKED = (11, 41), (41, 601)
TURNING = 7  # points of the first curve while a slider turns, off by some per cent at its ends
# Points between two looks whether a newer request waits, in the time of the closed form; of a
# theory a few.
AT_ONCE = 61
DRAWN = 97  # points of a curve through fewer


@dataclass(frozen=True)
class PowerCurve:
    """The mean power of an engine over the key, in W or nondimensional.

    ``x``, ``power``, ``low`` and ``high`` have shape (n,): the places, the power, and its ends with
    the error that the engine states (the power itself if it states none).  ``answers`` are those of
    the points that were computed, by place; between them the curve is a cubic through their
    logarithms.
    """

    x: Floats
    power: Floats
    low: Floats
    high: Floats
    answers: dict[float, Estimate]


@dataclass(frozen=True)
class Live:
    """The formulas' results for a scene: a curve each, the answer at the working point, or why there is none.

    ``instead`` states that the load is a netlist, which no formula knows: the curves are those of a
    resistor of the same resistance in its place.  ``earlier`` names the curves that are of the
    design before, until they are computed. ``serving`` has why each engine cannot support the
    scene, None if it can; nothing while that is not known.
    """

    problem: Problem
    key: str
    at: float
    instead: bool
    curves: dict[str, PowerCurve] = field(default_factory=dict)
    here: dict[str, Estimate] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    earlier: frozenset[str] = frozenset()
    serving: dict[str, Diagnostic | None] = field(default_factory=dict)


def grid(slide: Slide, count: int) -> Floats:
    """The places of a curve: by ratio or even, as the slider's."""
    low, high = slide.ends
    if not slide.by_ratio:
        return np.linspace(low, high, count)
    return np.asarray(slide.sign * np.geomspace(slide.low, slide.high, count))[:: int(slide.sign)]


def live(
    scene: Scene,
    key: str,
    at: float,
    slide: Slide,
    fine: bool,
    overtaken: Callable[[], bool] = lambda: False,
    curves: dict[str, PowerCurve] | None = None,
    first: bool = False,
    known: Live | None = None,
) -> Live | None:
    """The answers of the formulas to a scene whose ``key`` is ``at``.

    On a ``fine`` grid, or on one that is quick.

    Ends with None once it is ``overtaken``.  ``curves`` are those of the same scene at another
    value of the key, if they are known already: then the working point alone is computed.
    ``first``: only by the formula that is nearest to the truth.  ``known`` is such an answer, to
    which the other formulas are added.

    Raises InputError for a scene that cannot be.
    """
    problem = Problem(scene)
    base, key_of_base = _without_netlist(problem, key)
    serving = refusals(problem) if known is None else known.serving
    if base is None:
        return Live(
            problem,
            key,
            at,
            False,
            refused={name: str(serving[name]) for name in FORMULAS},
            serving=serving,
        )
    before = (known.curves, known.here, known.refused) if known is not None else ({}, {}, {})
    snapshot = Live(problem, key, at, not problem.load.is_in_equations, *map(dict, before))  # type: ignore[arg-type]
    snapshot.serving.update(serving)
    snapshot.curves.update(curves or {})
    for name, engine in FORMULAS.items():
        if name in snapshot.here or name in snapshot.refused:
            continue
        values = grid(slide, _count(engine, problem, fine, first)) if curves is None else None
        if not _add(
            snapshot, name, base, key_of_base, values=values, slide=slide, overtaken=overtaken
        ):
            return None
        if first and snapshot.here:
            return snapshot
    return snapshot


def _count(engine: type[Engine], problem: Problem, fine: bool, first: bool) -> int:
    """The points of a curve."""
    if engine.is_exact and problem.equations.is_shaken_otherwise:
        return PEAKED[fine]
    return TURNING if first else POINTS[fine]


def _add(
    snapshot: Live,
    name: str,
    scene: Scene,
    key: str,
    values: Floats | None,
    slide: Slide,
    overtaken: Callable[[], bool],
) -> bool:
    """Add an engine's answer at the working point and its curve through ``values`` of the key, or why it has none.

    Whether it was not overtaken meanwhile.
    """
    engine = FORMULAS[name]
    if (reason := engine.refusal(Problem(scene))) is not None:
        snapshot.refused[name] = str(reason)
        return True
    answers = _answers(engine(), scene, key, np.empty(0) if values is None else values, overtaken)
    if answers is None:
        return False
    here, curve = answers
    if isinstance(here, Estimate):
        snapshot.here[name] = here
    else:
        snapshot.refused[name] = str(here)
    if len(curve) > 1:
        snapshot.curves[name] = _curve(curve, slide)
    return True


def _without_netlist(problem: Problem, key: str) -> tuple[Scene | None, str]:
    """The scene with a resistor in the place of a netlist, and the key there.

    None if that cannot be.
    """
    if problem.load.is_in_equations:
        return problem.scene, key
    # refuses a netlist that is not allowed
    resistance = problem.load.values.get("R")
    key_of_base = "load.resistance" if key == "load.parameters.R" else key
    if resistance is None or key_of_base.startswith("load.parameters."):
        return None, key
    alone = dataclasses.replace(problem.scene, storage=None, node=None)  # which are the netlist's
    return alone.with_load(resistance=resistance), key_of_base


def best(here: dict[str, Estimate]) -> Estimate | None:
    """The answer that is nearest to the truth."""
    return next((here[name] for name in FORMULAS if name in here), None)


def _answers(
    engine: Engine, scene: Scene, key: str, values: Floats, overtaken: Callable[[], bool]
) -> tuple[Estimate | HarvesterError, dict[float, Estimate]] | None:
    """The answer to the scene unchanged, and those at the values if there are any, in their order.

    The first values are computed together with the scene, for hardly more than it alone.  None once
    it is overtaken.
    """
    at_once = AT_ONCE if engine.is_exact else AT_ONCE // 8
    here: list[Estimate | HarvesterError] = []
    estimates: dict[float, Estimate] = {}
    for begin in range(0, max(len(values), 1), at_once):
        if overtaken():
            return None
        each = {float(x): _varied(scene, key, x) for x in values[begin : begin + at_once]}
        some = {x: varied for x, varied in each.items() if varied is not None}
        alone = [] if here else [scene]
        answers = engine.run_many([*alone, *some.values()])
        here += answers[: len(alone)]
        at_places = zip(some, answers[len(alone) :], strict=True)
        estimates |= {x: answer for x, answer in at_places if isinstance(answer, Estimate)}
    return here[0], estimates


def _varied(scene: Scene, key: str, value: float) -> Scene | None:
    """The scene with another value of a key.

    None if it cannot be, such as two stops without room between them.
    """
    try:
        return scene.vary(key, float(value))
    except HarvesterError:
        return None


def _curve(answers: dict[float, Estimate], slide: Slide) -> PowerCurve:
    """The smooth curve through the points."""
    x = np.array([*answers])
    power = np.array([estimate.mean_power.value for estimate in answers.values()])
    error = np.array([estimate.mean_power.known_error95 for estimate in answers.values()])
    low, high = np.sort(np.abs(x[[0, -1]])).tolist()
    across = Slide(low, high, True, slide.sign) if slide.by_ratio else Slide(x[0], x[-1], False)
    fine = np.union1d(grid(across, DRAWN), x) if len(x) < DRAWN else x
    middle, least, most = (
        _smooth(x, values, fine, slide)
        for values in (power, np.maximum(power - error, 0.0), power + error)
    )
    return PowerCurve(fine, middle, least, most, answers)


def _smooth(x: Floats, y: Floats, fine: Floats, slide: Slide) -> Floats:
    """A cubic spline, through the logarithms if there are any: the theories' power is smooth in every key."""
    from scipy.interpolate import make_interp_spline

    inside, across = (np.log(np.abs(x)), np.log(np.abs(fine))) if slide.by_ratio else (x, fine)
    order = np.argsort(inside)
    positive = bool((y > 0.0).all())
    values = make_interp_spline(
        inside[order], (np.log(y) if positive else y)[order], min(3, len(y) - 1)
    )(across)
    return np.asarray(np.exp(values) if positive else values)


def engineering(values: Sequence[float]) -> int:
    """The power of 1000, as one of ten, that brings the largest of some values between 1 and 1000."""
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    return min(max(3 * math.floor(math.log10(largest) / 3), -15), 9) if largest > 0.0 else 0
