"""The largest power for most of the devices and under limits: the search for an optimum, by the engine `Robust`.

Long because the result explains its fields to users.
"""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import field

from harvester.engines.cheapest import formula
from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, InputError
from harvester.machine.progress import PartOfProgress, Progress
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.table import Column, Table
from harvester.scene.scene import Scene
from harvester.studies.extremes.counted import BLOCKS
from harvester.studies.extremes.levels import limited_peaks, rice_holds
from harvester.studies.optimum.evaluations import SHORTEST
from harvester.studies.optimum.objective import Objective
from harvester.studies.optimum.optimum_result import Optimum
from harvester.studies.optimum.place_peaks import SHARE, place_peaks
from harvester.studies.optimum.ranges import Vary, ranges
from harvester.studies.optimum.robust import BINDS, CLOSE, DesignOutcome, Robust
from harvester.studies.optimum.search import Search, SearchRequest
from harvester.studies.output_folder import OutputFolder
from harvester.studies.tolerance.device_limits import PEAKS, QUANTITIES, Limit, lifetime_of, limits
from harvester.studies.tolerance.spreads import spreads
from harvester.uncertainty.value import Value

FAR = 0.05  # relative error of the polynomial at which the values that it led to are in doubt
LEAST = 0.2  # of the budget, for devices one by one
LONG = 4  # times the usual blocks, of the trajectory that checks the best design


class RobustOptimum(Optimum, kw_only=True):
    """The best design for most of the devices, and under limits.

    Attributes
    ----------
    engine, keys, estimate, peaks, points, seconds, diagnostics, scanned : see Optimum
        as of `Optimum`.
    share : float or None
        the fraction of the devices that may have less power; None: the power is the mean.
    limits : tuple of Limit
        the constraints.
    outcome : DesignOutcome
        the answers of the devices at the best design.
    binds : tuple of Limit
        the limits that keep the power from growing.
    limited_peaks : dict
        those of a long trajectory of the best design itself, if the scene is not linear and no part
        scatters; each is a `Value`.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> limit = "mean_square_voltage < 0.05"
    >>> best = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, constraints=[limit], engine="exact")
    >>> [limit.quantity for limit in best.binds]
    ['mean_square_voltage']
    """

    DERIVED = (*Optimum.DERIVED, "limit_table", "limit_values", "straddled", "met")
    INTERNAL = Optimum.INTERNAL | {"outcome", "peaks", "limits"}
    NOT_SHOWN = Optimum.NOT_SHOWN | {
        *("share", "binds", "limited_peaks", "limit_values", "straddled", "met")
    }
    NOT_IN_JSON = Optimum.NOT_IN_JSON | {"limit_table"}
    JSON_NAMES = Optimum.JSON_NAMES | {
        "share": "for",
        "limit_values": "limits",
        "limited_peaks": "peaks",
    }

    share: float | None
    limits: tuple[Limit, ...]
    outcome: DesignOutcome
    binds: tuple[Limit, ...]
    limited_peaks: dict[str, Value] = field(default_factory=dict)

    @property
    def straddled(self) -> tuple[Limit, ...]:
        """The limits of which a long trajectory does not show whether they are met: its interval holds the bound."""
        known = ((limit, self.limited_peaks.get(limit.quantity)) for limit in self.limits)
        return tuple(
            limit
            for limit, peak in known
            if peak and abs(peak.value - limit.bound) <= peak.known_error95
        )

    @property
    def met(self) -> bool:
        """Whether all limits are met."""
        return self.outcome.violation <= BINDS

    @property
    def limit_values(self) -> dict[str, float]:
        """The value of each limited quantity, by the limit as it was written."""
        return {
            limit.written: value
            for limit, value in zip(self.limits, self.outcome.quantities, strict=True)
        }

    @property
    def limit_table(self) -> Table | None:
        """The value of each limited quantity, and its value on a long trajectory.

        None without limits.
        """
        if not self.limits:
            return None
        units = [QUANTITIES[limit.quantity].unit if self.physical else "" for limit in self.limits]
        values = self.outcome.quantities
        columns = [
            Column("limit", [limit.written for limit in self.limits]),
            Column("value", values, units=units),
        ]
        states = [
            self._state(limit, value) for limit, value in zip(self.limits, values, strict=True)
        ]
        columns.append(Column("state", states))
        if self.limited_peaks:
            paths = [self.limited_peaks.get(limit.quantity) for limit in self.limits]
            columns.append(Column("on_a_long_path", paths, units=units))
        return Table(tuple(columns), "limits")

    def _state(self, limit: Limit, value: float) -> str:
        if limit.margin(value) < -BINDS:
            return "broken"
        return "binds" if limit in self.binds else "met"

    def remarks(self) -> list[Diagnostic]:
        """The diagnostics of the objective and of the limits."""
        diagnostics = (
            [] if self.share is None else [note("power_of_most", percent=100.0 * self.share)]
        )
        diagnostics += (
            [note("unsafe_end")] if any(limit.quantity in PEAKS for limit in self.limits) else []
        )
        if not self.met:
            diagnostics.append(warning("limits_broken", broken=self.outcome.violation))
        for limit in self.limits:
            if limit in self.straddled:
                diagnostics.append(warning("limit_not_told", limit=limit.written))
            elif (
                limit.quantity in self.limited_peaks
                and limit.margin(self.limited_peaks[limit.quantity].value) < 0.0
            ):
                diagnostics.append(warning("limit_broken_on_path", limit=limit.written))
        return diagnostics


def robust_request(
    scene: AnyScene,
    vary: Vary,
    objective: Objective,
    constraints: Sequence[str],
    spread: Mapping[str, str] | Sequence[str],
    engine: Named | None,
    lifetime: float | str | None,
    within: float | str,
    budget: float | str,
) -> SearchRequest:
    """The search by engine `Robust` that the arguments of `harvester.optimise` ask for, checked.

    The second objective, if there is one, is the last of the limits.  Raises InputError as that
    does.
    """
    problem = Problem.of(scene)
    searched = ranges(vary)
    bounds = limits(constraints, problem.physical)
    bounds = bounds if objective.second is None else (*bounds, objective.second)
    years = lifetime_of(bounds, lifetime, problem)
    inner = engine_of(formula(problem).NAME if engine is None else engine)
    if not inner.is_formula:
        raise InputError(
            "`engine` must be one of formulas, such as 'averaged', if `spread`, `constraints` or a series is "
            f"given, but is {inner.NAME!r}"
        )
    if reason := inner.refusal(problem):
        raise InputError(reason)
    # a key that is searched has a value
    start = problem.scene.varied({r.key: r.value(0.5) for r in searched})
    parts = spreads(spread, start, "spread") if spread else ()
    if objective.share is not None and not parts:
        raise InputError(
            "`objective` of a share must be used with `spread`, which makes devices differ, but there is none"
        )
    robust = Robust(
        inner, tuple((part.key, part.written) for part in parts), objective.share, bounds, years
    )
    return SearchRequest.of(problem, searched, robust, within, budget)


def with_counted_peaks(
    request: SearchRequest, progress: Progress
) -> tuple[SearchRequest, Progress]:
    """The request with surfaces of the limited peaks, if these are counted, and the progress of the rest."""
    robust = robust_of(request)
    scene = request.scene
    if robust.lifetime is None or rice_holds(Problem(scene)):
        return request, progress
    begin = time.perf_counter()
    part = PartOfProgress(progress, 0.0, SHARE)
    counted = place_peaks(
        scene,
        request.ranges,
        vary=robust.vary,
        lifetime=robust.lifetime,
        budget=request.budget,
        seed=robust.path_seed,
        progress=part,
    )
    left = max(request.budget - (time.perf_counter() - begin), SHORTEST)
    robust = dataclasses.replace(robust, counted=counted)
    return dataclasses.replace(request, engine=robust, budget=left), PartOfProgress(
        progress, SHARE, 1.0 - SHARE
    )


def robust_of(request: SearchRequest) -> Robust:
    """The engine of a `robust_request`."""
    assert isinstance(request.engine, Robust), "a robust request asks for it"
    return request.engine


def under_limits(
    request: SearchRequest, progress: Progress, folder: OutputFolder | None
) -> RobustOptimum:
    """The values of keys with the largest power of most devices, under limits.

    Raises HarvesterError if the engine fails everywhere, the last error.
    """
    request, progress = with_counted_peaks(request, progress)
    robust = robust_of(request)
    best = Search.begin(request, progress).finish(folder)
    scene = request.scene.varied({key.range.key: key.value for key in best.keys})
    searched = robust.outcome(scene)[1]
    left = max(request.budget - best.seconds, LEAST * request.budget)
    outcome, warnings = followed(robust, scene, searched, left, request.budget)
    peaks = {}
    if robust.lifetime is not None and robust.counted is not None and not robust.vary:
        peaks = limited_peaks(Problem(scene), robust.lifetime, robust.path_seed + 1, LONG * BLOCKS)
    estimate = dataclasses.replace(best.estimate, mean_power=outcome.power)  # without the penalty
    fields = {f.name: getattr(best, f.name) for f in dataclasses.fields(best)}
    fields |= {"engine": robust.engine.NAME, "estimate": estimate}
    answer = RobustOptimum(
        **fields,
        share=robust.share,
        limits=robust.limits,
        outcome=outcome,
        binds=_binding(robust, best, scene, outcome, searched.objective),
        limited_peaks=peaks,
    )
    return dataclasses.replace(
        answer, diagnostics=(*best.diagnostics, *warnings, *answer.remarks())
    )


def followed(
    robust: Robust, scene: Scene, searched: DesignOutcome, seconds: float, budget: float
) -> tuple[DesignOutcome, list[Diagnostic]]:
    """The outcome by devices one by one, if the polynomial of the ``searched`` one is off, and warnings.

    ``seconds`` are those of the ``budget`` that are left.
    """
    if searched.unresolved <= CLOSE:
        return searched, []
    warnings = []
    try:
        outcome = robust.resolved(scene, seconds)
    except HarvesterError as error:
        outcome = searched
        warnings.append(warning("spread_without_answers", why=str(error)))
    if searched.unresolved > FAR:
        numbers = {"error": searched.unresolved, "devices": searched.devices}
        warnings.append(warning("spread_not_followed", **numbers))
    if outcome.unresolved > CLOSE and outcome is not searched:
        warnings.append(warning("spread_unresolved", error=outcome.unresolved, budget=budget))
    return outcome, warnings


def _binding(
    robust: Robust, best: Optimum, scene: Scene, outcome: DesignOutcome, power: float
) -> tuple[Limit, ...]:
    """The limits with hardly anything to spare, or that a next value of a series with more power would break.

    ``power`` is computed as that of the next values.
    """
    binding = {
        k for k, limit in enumerate(robust.limits) if limit.margin(outcome.quantities[k]) <= BINDS
    }
    for key in best.keys:
        steps = key.range.steps
        index = steps.index(key.value) if key.value in steps else 0
        for value in steps[max(index - 1, 0) : index + 2] if steps else ():
            beside = robust.outcome(scene.vary(key.range.key, value))[1]
            if beside.objective > power:
                binding |= {
                    k
                    for k, limit in enumerate(robust.limits)
                    if limit.margin(beside.quantities[k]) < 0.0
                }
    return tuple(robust.limits[k] for k in sorted(binding))
