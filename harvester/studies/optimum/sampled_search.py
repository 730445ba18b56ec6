"""The search for the optimum of an engine that samples.

Candidates come from a scout, a cheaper engine, or from a coarse scan of its own.  From each, boxes
of points with a polynomial through them (`response_surface`, `box_fit`) climb at a coarse accuracy,
and grow or shrink until the power falls by `DROP` between the middle and a face: a smaller box
drowns in noise, a larger one has a shape that no cubic has.  The last box is evaluated at full
accuracy, again and again with new noise, until its curvature exceeds the noise and little
power is lost at the ends of the keys' interval.

The file is long because all steps share the knowledge of the search: its seeds, the pilot, the
scan, the last box.
"""

import dataclasses
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.cheapest import formula
from harvester.engines.ideal import without_ngspice
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.studies.optimum import formula_search
from harvester.studies.optimum.box_fit import fit_box, next_box, peak_of_box
from harvester.studies.optimum.evaluations import (
    Evaluation,
    SpentError,
    Surface,
    local_maxima,
    served,
    with_options,
)
from harvester.studies.optimum.ranges import problem_at, scan, spread
from harvester.studies.optimum.response_surface import CUBIC, QUADRATIC, Fit, design_size
from harvester.studies.optimum.search_result import Peak, SearchResult
from harvester.uncertainty.value import half95

SCAN = {1: 13, 2: 33, 3: 65, 4: 129}
CANDIDATES = 3
FIRST = 0.06  # half-width of the first box
MOVES = 16
BOXES = 4
ROUNDS = 16
# a coarse evaluation has so many times fewer trajectories, but not fewer than that
COARSE, FEWEST = 8, 256
RESOLVED = 8.0  # standard errors that a curvature must have to be believed
LOST = 0.25  # of the target error: power that may be lost at the ends of the keys' interval
TRUSTED = 0.05  # a scout's own error, at most
SCOUTED = 0.5  # of the budget, for the scout at most


@dataclass
class SampledSearch:
    """The search for the optimum of an engine that samples.

    ``within`` is the relative power error that an evaluation at full accuracy is to have.
    """

    surface: Surface
    engine: Any
    within: float
    warnings: list[Diagnostic] = field(default_factory=list)
    seeds: int = 0  # used so far
    pilot: Estimate | None = None
    rough_peak: Peak | None = None  # what the last box shows
    scanned: bool = False  # the whole range was looked at, if coarsely
    scouted_by_samples: bool = False  # the boxes are those of a scout that samples, too
    _cheaper: "SampledSearch | None" = None
    _scan_seed: int = 0

    def new_seed(self) -> int:
        """A seed that no evaluation has had."""
        self.seeds += 1
        return int(
            np.random.SeedSequence([getattr(self.engine, "seed", 0), self.seeds]).generate_state(1)[
                0
            ]
        )

    def find(self) -> SearchResult:
        """Find the peaks, best first.

        Raises HarvesterError if every place fails, the last error.
        """
        begin = len(self.surface.points)
        flat = None
        peaks: list[Peak] = []
        try:
            starts = self._scouted() or self._scan()
            self.scanned = True
            for u, width in starts:
                peak, flat = self._refine(u, width)
                if flat or not any(_overlap(peak, other) for other in peaks):
                    peaks.append(peak)
                if flat:
                    break
        except SpentError:
            self._end_early(peaks, begin)
        peaks.sort(key=lambda p: -p.power.value)
        if any(_as_high(other, peaks[0]) for other in peaks[1:]):
            self.warnings.append(warning("other_peak_within_sampling"))
        return SearchResult(tuple(peaks), flat, tuple(self.warnings), self.scanned)

    def _end_early(self, peaks: list[Peak], begin: int) -> None:
        """Add the peak of the last box to the peaks, or failing that the best place since ``begin``, with a warning."""
        rough = self.rough_peak
        if rough is not None and rough.low is not None and not any(p is rough for p in peaks):
            peaks.append(rough)
        elif not peaks:
            peaks.append(self.best_so_far(self.surface.points[begin:] or self.surface.points))
        self.warnings.append(self._budget_spent(peaks[-1].low is not None))

    def full(self, seed: int) -> Any:
        """The engine at full accuracy, with the step and effort that the pilot run chose."""
        assert self.pilot is not None
        d = self.pilot.details
        if not self.shares_noise:
            return with_options(
                self.engine, within=self.within, budget=self.surface.left_now, seed=seed
            )
        options = {
            "dt": d.get("step"),
            "duration": d.get("duration"),
            "trajectories": int(d.get("trajectories", 0)),
        }
        known = {k: v for k, v in options.items() if v}
        return with_options(self.engine, **known, within=None, budget=None, seed=seed)

    def coarse(self, seed: int) -> Any:
        """The engine at a coarse accuracy."""
        if self.pilot is None or not self.shares_noise:
            has_trajectories = (
                self.engine.samples and not self.engine.runs_ngspice and not self._finds_periods
            )
            known: dict[str, Any] = {"trajectories": FEWEST} if has_trajectories else {}
            return with_options(self.engine, within=None, budget=None, seed=seed, **known)
        full = self.full(seed)
        trajectories = max((full.trajectories or 0) // COARSE, FEWEST)
        return with_options(full, trajectories=trajectories, duration=self.engine.duration)

    @cached_property
    def _finds_periods(self) -> bool:
        """Whether the engine finds a periodic response, for which it needs no trajectories."""
        return self.engine.follows_periods and Problem.of(self.surface.scene).equations.is_steady

    @property
    def shares_noise(self) -> bool:
        """Whether all points of a design get the same seed: if answers hold each trajectory's power."""
        return self.pilot is not None and self.pilot.power_samples is not None

    @property
    def scan_seed(self) -> int:
        """The seed of the coarse scan, that of all its places."""
        if not self._scan_seed:
            self._scan_seed = self.new_seed()
        return self._scan_seed

    @property
    def of_scan(self) -> list[Evaluation]:
        """The evaluations of the coarse scan by this engine, in its order."""
        return [
            point
            for point in self.surface.points
            if (point.stage, point.engine) == ("scan", self.engine.NAME)
        ]

    def scout(self) -> "SampledSearch | None":
        """The search by a cheaper engine that also samples: for ngspice the circuit of ideal elements, if it has one.

        Under a steady excitation there is none: ngspice's periodic response is the cheaper one, and
        the truer.
        """
        problem = Problem.of(self.surface.scene)
        if self.engine.runs_ngspice and self._cheaper is None and not problem.equations.is_steady:
            kind: Any = without_ngspice(problem)
            if kind is not None:
                names = {f.name for f in dataclasses.fields(kind)}
                cheap = kind(**{k: v for k, v in vars(self.engine).items() if k in names})
                self._cheaper = SampledSearch(self.surface, cheap, max(self.within, 0.01))
        return self._cheaper

    def _scouted(self) -> list[tuple[Floats, Floats]]:
        """Places and half-widths of boxes if a cheaper engine has peaks.

        None if none can be trusted.
        """
        surface = self.surface
        engine = self.engine
        begin = len(self.surface.points)
        before = surface.share
        surface.share = SCOUTED * before
        try:
            if engine.runs_ngspice:
                if (cheaper := self.scout()) is None:
                    return []
                peaks = cheaper.find().peaks
                self.scouted_by_samples = any(p.width is not None for p in peaks)
                return [(p.u, _box_widths(p)) for p in peaks if p.width is not None][:CANDIDATES]
            if engine.samples and not engine.takes_netlists:
                middle = problem_at(surface.scene, surface.ranges, np.full(surface.dimensions, 0.5))
                scout = formula(middle)()
                scout.run(middle)
                peaks = formula_search.search(surface, scout, interval=False).peaks
                best = [
                    p
                    for p in peaks
                    if p.power.value >= (1.0 - 2.0 * TRUSTED) * peaks[0].power.value
                ]
                if formula_search.trusted(surface.points[begin:], TRUSTED):
                    return [(p.u, np.full(surface.dimensions, FIRST)) for p in best][:CANDIDATES]
        except (HarvesterError, SpentError):
            pass
        finally:
            surface.share = before
        return []

    def _scan(self) -> list[tuple[Floats, Floats]]:
        """Places and half-widths of the peaks of a coarse scan with the same noise everywhere, best first."""
        n = self.surface.dimensions
        points = scan(SCAN[self.surface.dimensions], self.surface.dimensions)
        self.surface.evaluate(points[len(self.of_scan) :], self.coarse(self.scan_seed), "scan")
        u, power, _ = served(self.of_scan)
        width = np.full(n, max(FIRST, SCAN[n] ** (-1.0 / n)))
        return [(u[k], width) for k in local_maxima(u, power)[:CANDIDATES]]

    def _refine(self, u: Floats, width: Floats) -> tuple[Peak, Diagnostic | None]:
        """The peak near a place, and the reason why it is missing if the surface is flat."""
        self.rough_peak = None
        engine = with_options(self.engine, within=self.within, budget=0.3 * self.surface.left_now)
        first = self.surface.evaluate(u[None], with_options(engine, seed=self.new_seed()), "pilot")[
            0
        ]
        if isinstance(first.answer, HarvesterError):
            raise first.answer
        self.pilot = first.answer
        if first.answer.mean_power.value <= 0.0:
            return Peak(u, first.answer.mean_power, np.zeros(len(u))), note("no_power")
        return self._refine_box(*((u, width) if self.scouted_by_samples else self._climb(u, width)))

    def _climb(self, u: Floats, width: Floats) -> tuple[Floats, Floats]:
        """The middle and half-widths of a box with a resolved peak in it, by quadratics."""
        for _ in range(MOVES):
            fit, _ = self._fit([self._design(u, width, "climb", coarse=True)], u, width, QUADRATIC)
            u, width, done = next_box(fit, u, width)
            if done:
                break
        return u, width

    def _refine_box(self, u: Floats, width: Floats) -> tuple[Peak, Diagnostic | None]:
        """The peak in a box, by cubics at full accuracy, and why there is none if the box is flat."""
        for box in range(BOXES):
            fit, bias = self._sample_box(u, width)
            inside = not fit.exits.any()
            last = box == BOXES - 1
            if inside or last:
                if self._known(fit) and (last or not fit.misfit_dominates):
                    break
                if flat := self._flatness(fit):
                    return peak_of_box(fit, bias, u, width), flat
            if last:
                break
            if inside and fit.misfit_dominates:
                width = np.where(fit.surely_on_face, 1.0, 0.6) * width
            u = np.where((width >= 0.5) & fit.flat, 0.5, np.clip(u + width * fit.best, 0.0, 1.0))
        return peak_of_box(fit, bias, u, width), None

    def _sample_box(self, u: Floats, width: Floats) -> tuple[Fit, Floats]:
        """Evaluate a box with new noise again and again, until its fit gives the direction, or the peak."""
        rounds: list[list[Evaluation]] = []
        while len(rounds) < ROUNDS:
            rounds.append(self._design(u, width, "box"))
            fit, bias = self._fit(rounds, u, width)
            if fit.exits.any() or self._known(fit) or fit.misfit_dominates:
                break
        return fit, bias

    def _flatness(self, fit: Fit) -> Diagnostic | None:
        """Why no place is better than another, if the box is the whole of the ranges and none is."""
        if not fit.walls.all():
            return None
        if fit.flat:
            return note("no_place_better")
        return (
            note("power_changes_little")
            if np.ptp(fit.power) < LOST * self.within * fit.power.mean()
            else None
        )

    def _known(self, fit: Fit) -> bool:
        """Whether the peak is resolved, and little is lost at the ends of the keys' interval."""
        return (
            not fit.flat
            and fit.resolution >= RESOLVED
            and fit.power_lost <= LOST * self.within * abs(fit.value(fit.best)[0])
        )

    def _design(
        self, u: Floats, width: Floats, stage: str, coarse: bool = False
    ) -> list[Evaluation]:
        """Evaluate points that fill the box, with the same noise if `shares_noise`."""
        n = self.surface.dimensions
        low = np.maximum(u - width, 0.0)
        high = np.minimum(u + width, 1.0)
        where = low + spread(design_size(n), n) * (high - low)
        make = self.coarse if coarse else self.full
        seed = self.new_seed()
        if self.shares_noise:
            return self.surface.evaluate(where, make(seed), stage)
        return [
            self.surface.evaluate(point[None], make(self.new_seed()), stage)[0] for point in where
        ]

    def _fit(
        self, rounds: list[list[Evaluation]], u: Floats, width: Floats, degree: int = CUBIC
    ) -> tuple[Fit, Floats]:
        """The fit of a box (`fit_box`), whose peak is kept in case the budget ends here."""
        fit, bias = fit_box(rounds, u, width, degree)
        self.rough_peak = peak_of_box(fit, bias, u, width)
        return fit, bias

    def best_so_far(self, points: list[Evaluation]) -> Peak:
        """The best of some places; raises the last error if none has an answer."""
        return Peak.best_of(points, note("not_narrowed"))

    def _budget_spent(self, boxed: bool) -> Diagnostic:
        """The warning that the budget ended the search, in its last box or before."""
        answers = [p.answer for p in self.surface.points if p.engine == self.engine.NAME]
        seconds = [answer.seconds for answer in answers if isinstance(answer, Estimate)]
        needed = 4 * design_size(self.surface.dimensions)
        early = "search" if self.scanned else "first scan"
        return warning(
            "budget_spent",
            budget=self.surface.budget,
            stage="refinement" if boxed else early,
            evaluations=len(answers),
            engine=self.engine.NAME,
            typical=needed,
            each=float(np.mean(seconds)) if seconds else None,
        )


def _box_widths(peak: Peak) -> Floats:
    """The half-widths of the box about a peak."""
    return np.full(len(peak.u), FIRST) if peak.width is None else peak.width


def _overlap(peak: Peak, other: Peak) -> bool:
    """Whether the boxes about two peaks overlap."""
    return bool(np.all(np.abs(other.u - peak.u) <= _box_widths(other) + _box_widths(peak)))


def _as_high(other: Peak, best: Peak) -> bool:
    """Whether the sampling error does not separate another peak's power from that of the best."""
    error = np.hypot(other.power.stderr or 0.0, best.power.stderr or 0.0)
    return bool(best.power.value - other.power.value < half95(error))
