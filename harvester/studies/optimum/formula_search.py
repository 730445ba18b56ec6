"""The search for the optimum of an engine of formulas: a scan, its peaks climbed by the simplex method, a level set.

Where the power is P(u) with an error of the model of at most m(u), the true optimum lies among the u with

    P(u) + m(u) >= P(best) - m(best),

however the errors are correlated.  The interval of each key is the extent of that set, found by scans of ever
smaller boxes about it.
"""

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import Engine
from harvester.errors import HarvesterError, SimulationError
from harvester.studies.optimum.evaluations import Evaluation, SpentError, Surface, local_maxima, served
from harvester.studies.optimum.ranges import spread
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.uncertainty.value import Value

SCAN = {1: 129, 2: 513, 3: 1025, 4: 2049}
STARTS = 5
ROUNDS = 3  # scans of the level set
_SAME = 1e-4  # a relative dip between two peaks that is none
_FLAT = 1e-6  # relative difference of powers that is none
_END = 1e-4  # of the range: nearer to its end than this is at it


def search(surface: Surface, engine: Engine, interval: bool = True) -> SearchResult:
    """Find the peaks that a scan shows, and, where ``interval`` asks for it, the interval of the best.

    Raises HarvesterError where every place fails, the last error.
    """
    begin = len(surface.points)
    climbed: list[Peak] = []
    missing = ""
    try:
        surface.evaluate(spread(SCAN[surface.dimensions], surface.dimensions), engine, "scan")
    except SpentError:
        missing = "the scan"
    u, power, _ = _served(surface, begin)
    if power.max() <= 0.0:
        return SearchResult((_peak(surface, begin),), "the load takes no power anywhere in the range")
    if len(power) > 1 and np.ptp(power) <= _FLAT * power.max():
        return SearchResult((_peak(surface, begin),), "the power is the same all over the range")
    try:
        if not missing:
            climbed = [_climb(surface, engine, u[start], len(u)) for start in local_maxima(u, power)[:STARTS]]
    except SpentError:
        missing = "the climb to the peaks"
    climbed = _apart(surface, engine, climbed) if climbed and not missing else [_peak(surface, begin)]
    best = climbed[0]
    why = "the model's error is not known, so neither is how far off the optimum is"
    if missing:
        why = f"the budget ended in {missing}: give more than `budget` {surface.budget:g}s"
    elif best.power.model is not None and interval:
        try:
            low, high = _level_set(surface, engine, begin)
        except SpentError:
            low, high = _hull(surface, begin)
            missing = "the level set"
        best = _with(_peak(surface, begin), low, high)  # the scans may have come nearer than the climb
        others = [p for p in climbed[1:] if np.all((p.u >= low) & (p.u <= high))]
        warnings = ["another peak is as high within the model's error: the interval holds both"] if others else []
        if missing:
            warnings.append(f"the budget ended in {missing}: the interval is rough")
        flat = "the power changes less over the range than the model's error" if np.all(high - low > 1 - _END) else ""
        return SearchResult((best, *climbed[1:]), flat, tuple(warnings))
    return SearchResult((_with(best, None, None, why), *climbed[1:]), "", (why,) if missing else ())


def _served(surface: Surface, begin: int) -> tuple[Floats, Floats, list[Value]]:
    """The places, powers and values of the evaluations since ``begin``; raises the last error where all failed."""
    found = served(surface.points[begin:])
    if not found[2]:
        error = surface.points[-1].answer
        raise error if isinstance(error, HarvesterError) else SimulationError("no place was evaluated")
    return found


def _peak(surface: Surface, begin: int) -> Peak:
    """The best place so far."""
    u, power, values = _served(surface, begin)
    best = int(np.argmax(power))
    return Peak(u[best], values[best], _faces(u[best]))


def _with(peak: Peak, low: Floats | None, high: Floats | None, why: str = "") -> Peak:
    return Peak(peak.u, peak.power, peak.faces, low, high, peak.width, why)


def _faces(u: Floats) -> Floats:
    return np.where(u < _END, -1.0, np.where(u > 1.0 - _END, 1.0, 0.0))


def _climb(surface: Surface, engine: Engine, start: Floats, scanned: int) -> Peak:
    """Climb by the simplex method within the ranges, from a simplex as large as the scan's spacing."""
    from scipy.optimize import minimize

    begin, n = len(surface.points), len(start)
    size = scanned ** (-1.0 / n)
    simplex = np.vstack([start, start + np.where(start < 0.5, size, -size) * np.eye(n)])
    scale = 0.0

    def down(u: Floats) -> float:
        nonlocal scale
        power = surface.evaluate(u[None], engine, "climb")[0].power
        if power is None:
            return 1.0  # worse than any power
        scale = scale or abs(power.value) or 1.0
        return -power.value / scale

    options = {"initial_simplex": simplex, "xatol": 1e-5, "fatol": 1e-10, "maxfev": 80 * n}
    minimize(down, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * n, options=options)
    return _peak(surface, begin)


def _apart(surface: Surface, engine: Engine, found: list[Peak]) -> list[Peak]:
    """The peaks that have a dip between them, best first; of those on one hill only the best."""
    kept: list[Peak] = []
    for peak in sorted(found, key=lambda p: -p.power.value):
        for other in kept:
            between = peak.u + np.array([0.25, 0.5, 0.75])[:, None] * (other.u - peak.u)
            try:
                values = [p.power for p in surface.evaluate(between, engine, "between")]
            except SpentError:
                values = []
            if all(v is not None and v.value >= (1.0 - _SAME) * peak.power.value for v in values):
                break
        else:
            kept.append(peak)
    return kept


def _hull(surface: Surface, begin: int) -> tuple[Floats, Floats]:
    """The extent of the places that may be the optimum."""
    u, power, values = _served(surface, begin)
    model = np.array([v.known_error95 for v in values])
    best = int(np.argmax(power))
    held = u[power + model >= power[best] - model[best]]
    return held.min(axis=0), held.max(axis=0)


def _level_set(surface: Surface, engine: Engine, begin: int) -> tuple[Floats, Floats]:
    """The `_hull` after scans of ever smaller boxes, its ends moved outwards by the last scan's spacing."""
    n = surface.dimensions
    spacing = np.full(n, SCAN[n] ** (-1.0 / n))
    for _ in range(ROUNDS):
        low, high = _hull(surface, begin)
        low, high = np.maximum(low - 1.5 * spacing, 0.0), np.minimum(high + 1.5 * spacing, 1.0)
        surface.evaluate(low + spread(SCAN[n], n) * (high - low), engine, "level set")
        spacing = (high - low) * SCAN[n] ** (-1.0 / n)
    low, high = _hull(surface, begin)
    return np.maximum(low - spacing, 0.0), np.minimum(high + spacing, 1.0)


def trusted(points: list[Evaluation], most: float) -> bool:
    """Whether all evaluations have answers whose model error is known and at most ``most`` of the power."""
    values = [p.power for p in points]
    return all(v is not None and v.model is not None and v.known_error95 <= most * abs(v.value) for v in values)
