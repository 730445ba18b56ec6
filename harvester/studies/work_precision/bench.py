"""The runs that show what accuracy costs: which engines at which settings, as many as a budget allows."""

import contextlib
import dataclasses
import math
import statistics
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from harvester.answers.estimate import Estimate
from harvester.engines import Averaged, Ensemble, Published, Spice
from harvester.engines.options import Sampled, number
from harvester.engines.protocol import Engine
from harvester.engines.selection import ENGINES, refusals
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, HarvesterError, SimulationError
from harvester.studies.work_precision.biases import RUNGS, TOLERANCES, Beside, Ladder, beside, ladder
from harvester.studies.work_precision.cost_table import TARGETS

ALONE = "spice alone"
FACTORS = (0.5, 1.0, 2.0, 4.0)  # of the default step
CALLS = 5  # of a formula after its first
FEWEST = 256  # trajectories that measure a bias

Tick = Callable[[str, float], None]  # told what runs, and the fraction of the budget that is spent
Sampler = Ensemble | Spice


def label(engine: Engine) -> str:
    """An engine's name in the table: ngspice alone is one of its own."""
    return ALONE if isinstance(engine, Spice) and engine.alone else engine.NAME


def setting(engine: Engine) -> str:
    """The options that are not the default's, as one would give them."""
    told = []
    for one in dataclasses.fields(engine):  # type: ignore[arg-type]
        value = getattr(engine, one.name)
        if value != one.default and one.name not in ("seed", "budget", "alone"):
            told.append(one.name if value is True else f"{one.name}={value:.4g}")
    return " ".join(told) or "default"


@dataclass(frozen=True)
class Run:
    """An engine that has answered, and what that took beside the answer's ``seconds``."""

    engine: Engine
    answer: Estimate
    warm_up: float

    @property
    def work(self) -> float:
        """Trajectory-steps, burn-in included."""
        d = self.answer.details
        return d["trajectories"] * (d["burn_in"] + d["duration"]) / d["step"]

    @property
    def sampling(self) -> float:
        """Half-width of the 95 % interval, relative to the answer."""
        return self.answer.mean_power.sampling95 / abs(self.answer.mean_power.value)


@dataclass
class Bench:
    """Runs of one scene's engines, one after another, while there is time; warming up does not count.

    ``failed`` and ``refused`` are by engine: the error of one that failed, and of one that cannot serve the scene;
    ``steps`` and ``ngspice`` the biases, None where nothing is known.
    """

    problem: Problem
    seed: int = 0
    budget: float = 60.0
    tick: Tick | None = None
    begin: float = field(default_factory=time.perf_counter)  # later by what warming up takes
    told: float = 0.0
    runs: list[Run] = field(default_factory=list)
    failed: list[tuple[Engine, HarvesterError]] = field(default_factory=list)
    refused: dict[str, CannotServeError] = field(default_factory=dict)
    cheap: Run | None = None
    steps: Ladder | None = None
    ngspice: Beside | None = None

    def measure(self) -> None:
        """From the fastest engine to the slowest; the biases as soon as the default step is known.

        Raises
        ------
        SimulationError
            where the load takes no power.
        """
        for kind in (ENGINES[name] for name in refusals(self.problem)):
            if kind is not Spice:
                self.run(kind())
        self.cheap = next((run for run in self.runs if isinstance(run.engine, Ensemble)), None)
        paired = self.run(Spice()) if self.cheap is not None else None
        alone = self.run(_alone(self.cheap))
        if self.cheap is not None:
            self._biases(self.cheap, paired is not None)
            self.fill(_ensembles(self.cheap), 0.25)
            if paired is not None:
                self.fill(_paired(self.cheap, self.netlist), 0.4)
        if alone is not None:
            self.fill(_alones(alone, self.netlist and self.cheap is not None), 1.0)

    @property
    def netlist(self) -> bool:
        """Whether ngspice's tolerance counts."""
        return self.problem.netlist is not None

    @property
    def unit(self) -> float:
        """Nondimensional time in one of the scene's."""
        return self.problem.units.frequency

    @property
    def power_unit(self) -> float:
        """Power in the scene's unit of one of the moment that the cheap model's power is made of."""
        assert self.cheap is not None and isinstance(self.cheap.engine, Ensemble)
        return self.cheap.engine.model(self.problem).factor * self.problem.units.watts

    def left(self, share: float) -> float:
        """Seconds for a part of what is to come."""
        return max(share * (self.begin + self.budget - time.perf_counter()), 0.0)

    def run(self, engine: Engine) -> Run | None:
        """The answer, kept; None for an error, kept too.  Each setting has noise of its own."""
        self._tell(label(engine))
        if isinstance(engine, Sampled):
            own = zlib.crc32(f"{label(engine)} {setting(engine)}".encode())
            engine = dataclasses.replace(engine, seed=self.seed + own)
        begin = time.perf_counter()
        try:
            answer = engine.run(self.problem, lambda _: self._tell(label(engine)))
        except CannotServeError as error:
            self.refused[label(engine)] = error
            return None
        except HarvesterError as error:
            self.failed.append((engine, error))
            return None
        took = time.perf_counter() - begin
        if isinstance(engine, Published | Averaged):
            later = [engine.run(self.problem).seconds for _ in range(CALLS)]
            answer = dataclasses.replace(answer, seconds=statistics.median(later))
        if answer.mean_power.value <= 0.0:
            raise SimulationError("nothing to measure: the load takes no power")
        self.runs.append(Run(engine, answer, max(took - answer.seconds, 0.0)))
        self.begin += self.runs[-1].warm_up
        return self.runs[-1]

    def fill(self, engines: "Sequence[Sampler]", share: float) -> None:
        """Those that should end within a share of what time is left."""
        end = time.perf_counter() + self.left(share)
        for engine in engines:
            left = end - time.perf_counter()
            if self.predicted(engine) < left:
                self.run(dataclasses.replace(engine, budget=left if engine.within else None))

    def predicted(self, engine: Sampler) -> float:
        """Seconds, from what the same engine took at other settings."""
        before = [run for run in self.runs if label(run.engine) == label(engine)]
        within = number(engine.within)
        if within is not None:
            return min(run.answer.seconds * max((run.sampling / within) ** 2, 1.0) for run in before)
        first = before[0]
        d = first.answer.details
        trajectories = engine.trajectories or d["trajectories"]
        work = trajectories * (d["burn_in"] + (engine.duration or d["duration"])) / (engine.dt or d["step"])
        return first.answer.seconds * work / first.work

    def _biases(self, cheap: Run, ngspice: bool) -> None:
        """Of the step, of the model, and of ngspice where that does not fail."""
        assert isinstance(cheap.engine, Ensemble)
        h = cheap.answer.details["step"] * self.unit
        model = cheap.engine.model(self.problem)
        self._tell("biases")
        seconds = self.left(0.15)
        share = seconds / len(RUNGS) * RUNGS[0] / cheap.answer.seconds  # of that run's trajectories
        trajectories = math.ceil(min(max(share * Ensemble.TRAJECTORIES, FEWEST), Ensemble.TRAJECTORIES))
        self.steps = ladder(model, h, trajectories, self.seed, seconds)
        self._tell("biases")
        with contextlib.suppress(SimulationError):  # of a finer tolerance than engine spice's
            if ngspice:
                self.ngspice = beside(self.problem, model, self.steps, h, self.seed, self.left(0.3))

    def _tell(self, what: str) -> None:
        if self.tick is not None:
            self.told = max(self.told, min((time.perf_counter() - self.begin) / self.budget, 1.0))
            self.tick(what, self.told)


def _ensembles(cheap: Run) -> list[Sampler]:
    """Steps and sizes, then targets."""
    kind, step = type(cheap.engine), cheap.answer.details["step"]
    assert issubclass(kind, Ensemble)
    grid = [kind(dt=f * step, trajectories=n) for n in (256, 1024, 4096) for f in FACTORS]
    return _between([kind(within=one) for one in TARGETS], grid)


def _paired(cheap: Run, netlist: bool) -> list[Sampler]:
    """Steps, tolerances, then targets."""
    step = cheap.answer.details["step"]
    grid = [Spice(dt=f * step, trajectories=8) for f in FACTORS]
    grid += [Spice(reltol=r) for r in TOLERANCES if netlist and r != Spice.reltol]
    return _between([Spice(within=one) for one in TARGETS], grid)


def _alone(cheap: Run | None) -> Spice:
    """Few and short, to begin with."""
    if cheap is None:
        return Spice(alone=True, trajectories=4)
    return Spice(alone=True, duration=cheap.answer.details["burn_in"])


def _alones(first: Run, netlist: bool) -> list[Sampler]:
    """Durations, noise, steps and tolerances, then targets."""
    d = first.answer.details
    longer = 4.0 * d["duration"]
    grid: list[Sampler] = [Spice(alone=True, duration=longer), Spice(alone=True, duration=longer, gaussian=True)]
    grid += [Spice(alone=True, duration=longer, dt=f * d["step"]) for f in reversed(FACTORS) if f != 1.0]
    grid += [
        Spice(alone=True, duration=longer, reltol=r) for r in reversed(TOLERANCES) if netlist and r != Spice.reltol
    ]
    return [*grid, *(Spice(alone=True, within=one, duration=longer) for one in TARGETS)]


def _between(targets: Sequence[Sampler], grid: Sequence[Sampler]) -> list[Sampler]:
    """The two easy targets, the grid, the two hard ones."""
    return [*targets[:2], *grid, *targets[2:]]
