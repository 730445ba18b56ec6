"""The largest power for most of the devices and under limits: the search for an optimum, by the engine `Robust`."""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from harvester import figures
from harvester.engines import Averaged, Exact
from harvester.engines.formula import Formula
from harvester.engines.options import Request
from harvester.engines.options import number as number_of
from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, names_arguments
from harvester.quantities.units import fraction
from harvester.scene.scene import Scene
from harvester.studies.extremes.counted import BLOCKS
from harvester.studies.extremes.levels import limited_peaks, rice_holds
from harvester.studies.optimum.answer import Optimum
from harvester.studies.optimum.evaluations import SHORTEST, Tick
from harvester.studies.optimum.optimise import optimise
from harvester.studies.optimum.ranges import Range, ranges
from harvester.studies.robust.engine import BINDS, Place, Robust
from harvester.studies.robust.peaks import SHARE, place_peaks
from harvester.studies.tolerance.limits import PEAKS, QUANTITIES, Limit, lifetime_of
from harvester.studies.tolerance.limits import parse as read_limit
from harvester.studies.tolerance.spreads import spreads
from harvester.uncertainty.value import Value, amount, number

LONG = 4  # times the usual blocks, of the path that checks the best design


@names_arguments
@dataclass(frozen=True)
class RobustOptimum:
    """The best design for most of the devices, and under limits.

    ``optimum`` is the search, its power that of the ``share`` (None: the mean); ``place`` what the devices give there;
    ``binds`` are the limits that keep the power from growing.  ``peaks`` are those of a long path of the best design
    itself, where the scene is not linear and no part scatters.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> over = {"nondimensional.mu": (0.1, 10.0)}
    >>> best = hv.optimise_robust(scene, over, limits=["mean_square_voltage < 0.05"], engine="exact")
    >>> [limit.quantity for limit in best.binds]
    ['mean_square_voltage']
    """

    optimum: Optimum
    engine: str
    share: float | None
    limits: tuple[Limit, ...]
    place: Place
    binds: tuple[Limit, ...]
    peaks: dict[str, Value] = field(default_factory=dict)

    @property
    def straddled(self) -> tuple[Limit, ...]:
        """The limits of which a long path cannot tell whether they are met: its interval holds the bound."""
        known = [(one, self.peaks[one.quantity]) for one in self.limits if one.quantity in self.peaks]
        return tuple(one for one, peak in known if abs(peak.value - one.bound) <= peak.known_error95)

    @property
    def met(self) -> bool:
        """Whether all limits are met."""
        return self.place.broken <= BINDS

    @property
    def aim(self) -> str:
        """What was made as large as it can be, in words."""
        if self.share is None:
            return "the mean power"
        return f"what all but {100.0 * self.share:.3g} % of the devices exceed"

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The evaluations and the optimum as a matplotlib figure."""
        return self.optimum.plot(title)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return self.optimum.as_json() | {
            "engine": self.engine,
            "for": self.share,
            "limits": {one.written: value for one, value in zip(self.limits, self.place.quantities, strict=True)},
            "binds": [one.written for one in self.binds],
            "peaks": {name: number(one) for name, one in self.peaks.items()},
            "straddled": [one.written for one in self.straddled],
            "met": self.met,
        }

    def __str__(self) -> str:
        lines = [f"by {self.engine}; the power is {self.aim}", str(self.optimum)]
        for one, value in zip(self.limits, self.place.quantities, strict=True):
            word = ", it is broken" if _spare(one, value) < -BINDS else ", it binds" if one in self.binds else ""
            unit = QUANTITIES[one.quantity].unit if self.optimum.estimate.physical else ""
            told = amount(value, unit) + " at the unsafe end of its error" * (one.quantity in PEAKS)
            lines.append(f"  {one.written}: {told}{word}")
            if one.quantity in self.peaks:
                lines.append(f"    a long path of this design says {self.peaks[one.quantity].format(unit)}")
        lines += [f"  warning: {word}" for word in self._doubts()]
        return "\n".join(lines)

    def _doubts(self) -> list[str]:
        """What the long path says against the search."""
        words = []
        for one in self.limits:
            if one in self.straddled:
                words.append(f"whether {one.written} is met cannot be told: the long path's interval holds the bound")
            elif one.quantity in self.peaks and _spare(one, self.peaks[one.quantity].value) < 0.0:
                words.append(f"{one.written} is not met, by the long path")
        return words


@names_arguments
def optimise_robust(
    scene: AnyScene,
    over: Sequence[Range] | Mapping[str, tuple[float | str, float | str]],
    vary: Mapping[str, str] | Sequence[str] = (),
    share: float | str | None = None,
    limits: Sequence[str] = (),
    engine: Named | None = None,
    *,
    lifetime: float | str | None = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    out: str | Path | None = None,
    tick: Tick | None = None,
    vector: Sequence[str] = (),
) -> RobustOptimum:
    """Find the values of keys with the largest power of most devices, under limits.

    ``over``, ``within``, ``budget``, ``out``, ``tick`` and ``vector`` are those of `harvester.optimise`; ``vary``,
    ``limits`` and ``lifetime`` those of `harvester.tolerance`, a percentage being of the values of each place.
    ``share`` such as "5%" makes the power that of which only 5 % of the devices have less; None: the mean of all.  Of a
    limited quantity the value counts that all but this share keep.  ``engine`` is one of formulas: by default `Exact`
    where it serves, else `Averaged`.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> over, vary = {"nondimensional.mu": (0.1, 10.0)}, {"nondimensional.mu": "40%"}
    >>> best = hv.optimise_robust(scene, over, vary, "5%", budget=3)
    >>> best.engine, best.met
    ('exact', True)

    Raises
    ------
    InputError
        for a spread, limit, share or range that cannot be, a share without ``vary``, and an engine that samples.
    HarvesterError
        where the engine fails everywhere, the last error.
    """
    problem, found = Problem.of(scene), ranges(over)
    part = read_share(share)
    texts = [limits] if isinstance(limits, str) else limits
    bounds = tuple(read_limit(text, problem.physical) for text in texts)
    years = lifetime_of(bounds, lifetime, problem)
    robust = robust_engine(problem, found, vary, part, bounds, engine, years)
    left, told = number_of(Request(budget=budget).budget) or 0.0, tick
    if years is not None and not rice_holds(problem):
        robust, left, told = with_counted_peaks(robust, problem, found, left, tick)
    best = optimise(problem, found, robust, within, left, out, told, vector)
    there = problem.scene.varied({key.range.key: key.value for key in best.keys})
    place = robust.place(there)[1]
    own = {}
    if years is not None and robust.counted is not None and not robust.vary:
        own = limited_peaks(Problem(there), years, robust.engine.seed + 1, LONG * BLOCKS)
    binds = _binding(robust, best, there, place)
    aim = Value(place.aim, model=None if place.off is None else place.off * abs(place.aim))  # without the penalty
    best = dataclasses.replace(best, estimate=dataclasses.replace(best.estimate, mean_power=aim))
    answer = RobustOptimum(best, robust.engine.NAME, part, bounds, place, binds, own)
    if answer.met:
        return answer
    word = f"no place in the range meets all limits: this one breaks them by {answer.place.broken:.2g} relatively"
    return dataclasses.replace(answer, optimum=dataclasses.replace(best, warnings=(*best.warnings, word)))


def robust_engine(
    problem: Problem,
    found: Sequence[Range],
    vary: Mapping[str, str] | Sequence[str],
    part: float | None,
    bounds: tuple[Limit, ...],
    engine: Named | None,
    years: float | None,
) -> Robust:
    """The engine of a search over ``found``, as the arguments of `optimise_robust` describe it, with its errors."""
    inner = engine_of((Averaged if Exact.refusal(problem) else Exact)() if engine is None else engine)
    if not isinstance(inner, Formula):
        raise InputError(
            "`engine` must be one of formulas, such as 'averaged', where `vary`, `limit` or a series is "
            f"given, but is {inner.NAME!r}"
        )
    if reason := inner.refusal(problem):
        raise InputError(reason)
    start = problem.scene.varied({one.key: one.value(0.5) for one in found})  # a key that is searched has a value
    parts = spreads(vary, start) if vary else ()
    if part is not None and not parts:
        raise InputError("`for` must go with `vary`, which makes devices differ, but there is none")
    return Robust(inner, tuple((one.key, one.written) for one in parts), part, bounds, years)


def with_counted_peaks(
    robust: Robust, problem: Problem, found: Sequence[Range], budget: float, tick: Tick | None
) -> tuple[Robust, float, Tick | None]:
    """The engine with the surfaces of its peaks, the seconds of the budget that are left, and the rest's progress."""
    begin, told = time.perf_counter(), tick or (lambda share: None)
    assert robust.lifetime is not None
    tell = lambda share: told(SHARE * share)  # noqa: E731
    counted = place_peaks(problem.scene, found, robust.vary, robust.lifetime, budget, robust.engine.seed, tell)
    left = max(budget - (time.perf_counter() - begin), SHORTEST)
    return dataclasses.replace(robust, counted=counted), left, lambda share: told(SHARE + (1.0 - SHARE) * share)


def _binding(robust: Robust, best: Optimum, there: Scene, place: Place) -> tuple[Limit, ...]:
    """The limits with hardly anything to spare, or that a next value of a series with more power would break."""
    found = {k for k, one in enumerate(robust.limits) if _spare(one, place.quantities[k]) <= BINDS}
    for key in best.keys:
        steps = key.range.steps
        at = steps.index(key.value) if key.value in steps else 0
        for value in steps[max(at - 1, 0) : at + 2] if steps else ():
            beside = robust.place(there.vary(key.range.key, value))[1]
            if beside.aim > place.aim:
                found |= {k for k, one in enumerate(robust.limits) if _spare(one, beside.quantities[k]) < 0.0}
    return tuple(robust.limits[k] for k in sorted(found))


def _spare(limit: Limit, value: float) -> float:
    """How far a value is within a limit, relatively; below 0 beyond it."""
    return limit.sign * (value - limit.bound) / (abs(limit.bound) or 1.0)


def read_share(share: float | str | None) -> float | None:
    """A share of devices from 0.1 % to 50 %, from a number or a text such as "5%"; InputError for another."""
    if share is None:
        return None
    try:
        found = fraction(share) if isinstance(share, str) else float(share)
    except ValueError as error:
        raise InputError(f"`for` {error}, but is {share!r}") from None
    if not 0.001 <= found <= 0.5:
        raise invalid("`for`", "be a share of devices between 0.1% and 50%", share)
    return found
