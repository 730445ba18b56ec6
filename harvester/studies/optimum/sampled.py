"""The optimum of an engine that samples.

Candidates come from a scout, a cheaper engine, or from a coarse scan of its own.  From each, boxes of points with a
polynomial through them (`harvester.studies.optimum.response_surface`) climb at a coarse accuracy, and grow or shrink
until the power falls by `DROP` between the middle and a face: a smaller box drowns in noise, a larger one has a shape
that no cubic has.  The last box is evaluated at full accuracy, again and again with new noise, until its curvature
stands above the noise and little power is lost at the ends of the keys' interval.
"""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines import Averaged, Ensemble, Ideal, Spice
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, SimulationError
from harvester.studies.optimum import certain
from harvester.studies.optimum.evaluations import Point, SpentError, Surface, peaks, served, with_options
from harvester.studies.optimum.peaks import Found, Peak
from harvester.studies.optimum.ranges import problem_at, spread
from harvester.studies.optimum.response_surface import CUBIC, QUADRATIC, SEEN, Fit, Q, design_size, exponents
from harvester.uncertainty.value import Value

SCAN = {1: 13, 2: 33, 3: 65, 4: 129}
CANDIDATES = 3
DROP = 0.1  # of the power, between the middle of a box and its faces
FIRST = 0.06  # half-width of the first box
MOVES, BOXES, ROUNDS = 16, 4, 16
COARSE, FEWEST = 8, 256  # a coarse evaluation has so many times fewer trajectories, but not fewer than that
RESOLVED = 8.0  # standard errors that a curvature must have to be believed
ROUNDING = 1e-9  # relative noise of a power that has no other
LOST = 0.25  # of the target error: power that may be lost at the ends of the keys' interval
TRUSTED = 0.05  # a scout's own error, at most
SCOUTED = 0.5  # of the budget, for the scout at most


@dataclass
class Search:
    """An engine on a surface; ``within`` is the relative error of the power that a full evaluation is to have."""

    surface: Surface
    engine: Any
    within: float
    warnings: list[str] = field(default_factory=list)
    seeds: int = 0  # used so far
    pilot: Estimate | None = None
    rough: Peak | None = None  # what the last box shows
    led: bool = False  # to the last box by a scout that samples, too

    def seed(self) -> int:
        """Another at each call."""
        self.seeds += 1
        root = [getattr(self.engine, "seed", 0), self.seeds]
        return int(np.random.SeedSequence(root).generate_state(1)[0])

    def find(self) -> Found:
        """The peaks, best first.

        Raises
        ------
        HarvesterError
            where every place fails, the last error.
        """
        begin, flat = len(self.surface.points), ""
        found: list[Peak] = []
        try:
            for u, width in self._scouted() or self._scan():
                peak, flat = self._refine(u, width)
                near = [p for p in found if np.all(np.abs(p.u - peak.u) <= _box(p) + _box(peak))]
                if near and flat == "":
                    continue
                found.append(peak)
                if flat:
                    break
        except SpentError:
            if self.rough is not None and self.rough.low is not None and not any(p is self.rough for p in found):
                found.append(self.rough)
            elif not found:
                found = [self._so_far(begin)]
            self.warnings.append(self._missing("the last box" if found[-1].low is not None else "the search for peaks"))
        found.sort(key=lambda p: -p.power.value)
        for other in found[1:]:
            error = np.hypot(other.power.stderr or 0.0, found[0].power.stderr or 0.0)
            if found[0].power.value - other.power.value < Q * error:
                self.warnings.append("another peak is as high within the error of sampling: see peaks")
                break
        return Found(tuple(found), flat, tuple(self.warnings))

    def full(self, seed: int) -> Any:
        """The engine at full accuracy, as the pilot chose it."""
        assert self.pilot is not None
        d = self.pilot.details
        if not self.shared:
            return with_options(self.engine, within=self.within, budget=max(self.surface.left, 1.0), seed=seed)
        options = {"dt": d.get("step"), "duration": d.get("duration"), "trajectories": int(d.get("trajectories", 0))}
        known = {k: v for k, v in options.items() if v}
        return with_options(self.engine, **known, within=None, budget=None, seed=seed)

    def coarse(self, seed: int) -> Any:
        """The engine at a coarse accuracy."""
        if self.pilot is None or not self.shared:
            known: dict[str, Any] = {"trajectories": FEWEST} if isinstance(self.engine, Ensemble) else {}
            return with_options(self.engine, within=None, budget=None, seed=seed, **known)
        whole = self.full(seed)
        many = max((whole.trajectories or 0) // COARSE, FEWEST)
        return with_options(whole, trajectories=many, duration=self.engine.duration)

    @property
    def shared(self) -> bool:
        """Whether the same seed at every point is worth while: the answers say what each trajectory gave."""
        return self.pilot is not None and self.pilot.power_samples is not None

    def _scouted(self) -> list[tuple[Floats, Floats]]:
        """Places and boxes where a cheaper engine has peaks; none where no such engine can be trusted."""
        surface, engine, begin = self.surface, self.engine, len(self.surface.points)
        surface.share, before = SCOUTED * surface.share, surface.share
        try:
            if isinstance(engine, Spice):
                kind = Ensemble if Problem.of(surface.scene).netlist is None else Ideal
                names = {f.name for f in dataclasses.fields(kind)}
                cheap = kind(**{k: v for k, v in vars(engine).items() if k in names})
                found = Search(surface, cheap, max(self.within, 0.01)).find().peaks
                self.led = any(p.width is not None for p in found)
                return [(p.u, _box(p)) for p in found if p.width is not None][:CANDIDATES]
            if type(engine) is Ensemble:
                Averaged().run(problem_at(surface.scene, surface.ranges, np.full(surface.dimensions, 0.5)))
                found = certain.search(surface, Averaged(), interval=False).peaks
                best = [p for p in found if p.power.value >= (1.0 - 2.0 * TRUSTED) * found[0].power.value]
                if certain.trusted(surface.points[begin:], TRUSTED):
                    return [(p.u, np.full(surface.dimensions, FIRST)) for p in best][:CANDIDATES]
        except (HarvesterError, SpentError):
            pass
        finally:
            surface.share = before
        return []

    def _scan(self) -> list[tuple[Floats, Floats]]:
        """Peaks of a coarse scan with the same noise everywhere, best first."""
        n, begin = self.surface.dimensions, len(self.surface.points)
        self.surface.evaluate(spread(SCAN[n], n), self.coarse(self.seed()), "scan")
        u, power, _ = served(self.surface.points[begin:])
        if not len(power):
            self._so_far(begin)
        width = np.full(n, max(FIRST, SCAN[n] ** (-1.0 / n)))
        return [(u[k], width) for k in peaks(u, power)[:CANDIDATES]]

    def _refine(self, u: Floats, width: Floats) -> tuple[Peak, str]:
        """The peak near a place, and what to say if there is none: it is flat."""
        self.rough = None
        engine = with_options(self.engine, within=self.within, budget=max(0.3 * self.surface.left, 0.1))
        first = self.surface.evaluate(u[None], with_options(engine, seed=self.seed()), "pilot")[0]
        if isinstance(first.answer, HarvesterError):
            raise first.answer
        self.pilot = first.answer
        if first.answer.mean_power.value <= 0.0:
            return Peak(u, first.answer.mean_power, np.zeros(len(u))), "the load takes no power"
        return self._settle(*((u, width) if self.led else self._climb(u, width)))

    def _climb(self, u: Floats, width: Floats) -> tuple[Floats, Floats]:
        """The middle and half-widths of a box with a resolved peak in it, by quadratics."""
        for _ in range(MOVES):
            fit, _ = self._fit([self._design(u, width, "climb", coarse=True)], u, width, QUADRATIC)
            place = np.clip(u + width * fit.best, 0.0, 1.0)
            doubtful = fit.held & ~fit.pressed
            if fit.leaves.any():
                u, width = place, np.minimum((1.0 if fit.resolution > SEEN else 1.5) * width, 0.5)
            elif fit.resolution < SEEN and fit.bent:
                u = np.clip(u + width * fit.x[int(np.argmax(fit.power))], 0.0, 1.0)
                width = np.where(fit.pressed, 1.0, 0.5) * width
            elif fit.resolution < SEEN or (doubtful.any() and not fit.walls.all()):
                if fit.walls.all():
                    break
                grown = np.minimum(2.0 * width, 0.5)
                width = grown if fit.resolution < SEEN else np.where(doubtful, grown, width)
                u = np.where(width >= 0.5, 0.5, place)
            else:
                size = np.minimum(np.clip(_size(fit, width), 0.25 * width, 4.0 * width), 0.5)
                near = np.all((size < 1.5 * width) & (width < 1.5 * size))
                u, width = place, size
                if near:
                    break
        return u, width

    def _settle(self, u: Floats, width: Floats) -> tuple[Peak, str]:
        """The peak in a box, by cubics at full accuracy."""
        for box in range(BOXES):
            rounds: list[list[Point]] = []
            while len(rounds) < ROUNDS:
                rounds.append(self._design(u, width, "box"))
                fit, bias = self._fit(rounds, u, width)
                if fit.leaves.any() or self._known(fit) or fit.bent:
                    break
            last = box == BOXES - 1
            if not fit.leaves.any() or last:
                if self._known(fit) and (last or not fit.bent):
                    break
                whole = bool(fit.walls.all())
                if whole and fit.level:
                    return self._peak(fit, bias, u, width), "no place is seen to be better than another"
                if whole and np.ptp(fit.power) < LOST * self.within * fit.power.mean():
                    return self._peak(fit, bias, u, width), "the power changes less than a quarter of `within`"
                width = np.where(fit.pressed, 1.0, 0.6) * width if fit.bent and not last else width
            if not last:
                place = np.clip(u + width * fit.best, 0.0, 1.0)
                u = np.where((width >= 0.5) & fit.level, 0.5, place)
        return self._peak(fit, bias, u, width), ""

    def _known(self, fit: Fit) -> bool:
        """Whether the peak is resolved, and little is lost at the ends of the keys' interval."""
        return (
            not fit.level
            and fit.resolution >= RESOLVED
            and fit.lost <= LOST * self.within * abs(fit.value(fit.best)[0])
        )

    def _peak(self, fit: Fit, bias: Floats, u: Floats, width: Floats) -> Peak:
        """The fit's highest place as a peak, with the interval that sampling and the bias of the step leave."""
        place = np.clip(u + width * fit.best, 0.0, 1.0)
        power = Value(*fit.value(fit.best))
        faces = np.where(place <= 0.0, -1.0, np.where(place >= 1.0, 1.0, 0.0))
        if fit.leaves.any() or fit.resolution < SEEN:
            why = "the curvature does not stand above the noise"
            return Peak(place, power, faces, width=width, why=why)
        half = width * (fit.half + fit.shift(bias))
        return Peak(place, power, faces, np.clip(place - half, 0.0, 1.0), np.clip(place + half, 0.0, 1.0), width)

    def _design(self, u: Floats, width: Floats, stage: str, coarse: bool = False) -> list[Point]:
        """Points that fill the box, with the same noise if that is worth while."""
        n = self.surface.dimensions
        low, high = np.maximum(u - width, 0.0), np.minimum(u + width, 1.0)
        where = low + spread(design_size(n), n) * (high - low)
        make, seed = self.coarse if coarse else self.full, self.seed()
        if self.shared:
            return self.surface.evaluate(where, make(seed), stage)
        return [self.surface.evaluate(one[None], make(self.seed()), stage)[0] for one in where]

    def _fit(self, rounds: list[list[Point]], u: Floats, width: Floats, degree: int = CUBIC) -> tuple[Fit, Floats]:
        """The polynomial through the means of rounds of one design, and the bias of the step at each of its points.

        Raises SimulationError where too many points fail for that.
        """
        good = [k for k in range(len(rounds[0])) if all(one[k].power is not None for one in rounds)]
        if len(good) <= len(exponents(len(u))):
            failed = next(p.answer for one in rounds for p in one if p.power is None)
            raise SimulationError(f"too few points near the optimum have an answer; the last that failed: {failed}")
        kept = [[one[k] for k in good] for one in rounds]
        values = [[p.power for p in one if p.power is not None] for one in kept]
        power = np.mean([[v.value for v in one] for one in values], axis=0)
        bias = np.mean([[v.bias or 0.0 for v in one] for one in values], axis=0)
        covariance = np.sum([_covariance(one) for one in kept], axis=0) / len(rounds) ** 2
        covariance = covariance + (ROUNDING * power.mean()) ** 2 * np.eye(len(good))
        low, high = np.maximum(u - width, 0.0), np.minimum(u + width, 1.0)
        x = (np.array([p.u for p in kept[0]]) - u) / width
        walls = np.array([low <= 0.0, high >= 1.0])
        fit = Fit(x, power, covariance, (low - u) / width, (high - u) / width, walls, degree)
        self.rough = self._peak(fit, bias, u, width)
        return fit, bias

    def _so_far(self, begin: int) -> Peak:
        """The best place of those seen; raises the last error where there is none."""
        u, power, values = served(self.surface.points[begin:])
        if not len(power):
            error = self.surface.points[-1].answer
            raise error if isinstance(error, HarvesterError) else SimulationError("no place was evaluated")
        best = int(np.argmax(power))
        return Peak(u[best], values[best], np.zeros(len(u)), why="the budget ended before it was narrowed")

    def _missing(self, stage: str) -> str:
        own = [p.answer for p in self.surface.points if p.engine == self.engine.NAME]
        seconds = [one.seconds for one in own if isinstance(one, Estimate)]
        more = f", each of {np.mean(seconds):.2g} s" if seconds else ", which first compiles it"
        return (
            f"the budget of {self.surface.budget:g} s ended in {stage}, after {len(own)} evaluations by "
            f"{self.engine.NAME!r}: a search takes some {4 * design_size(self.surface.dimensions)}{more}"
        )


def _box(peak: Peak) -> Floats:
    return np.full(len(peak.u), FIRST) if peak.width is None else peak.width


def _size(fit: Fit, width: Floats) -> Floats:
    """Half-widths at which the power falls by `DROP`; of keys at the end of their range the present ones."""
    curvature = -np.diag(fit.hessian)
    wanted = np.sqrt(2.0 * DROP * abs(fit.value(fit.best)[0]) / np.maximum(curvature, 1e-300))
    return np.where((fit.faces != 0.0) | (curvature <= 0.0), width, width * wanted)


def _covariance(points: list[Point]) -> Floats:
    """Of the powers of a design, shape (m, m): from the trajectories where they share their noise."""
    answers = [p.answer for p in points if isinstance(p.answer, Estimate)]
    samples = [a.power_samples for a in answers]
    known = [s for s in samples if s is not None]
    if len(known) == len(points) and len({p.seed for p in points}) == len({len(s) for s in known}) == 1:
        return np.asarray(np.cov(np.array(known)) / len(known[0]))
    return np.diag([(a.mean_power.stderr or 0.0) ** 2 for a in answers])
