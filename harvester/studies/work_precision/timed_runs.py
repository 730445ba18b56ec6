"""The runs that show the cost of accuracy: engines at as many settings as a budget allows."""

import contextlib
import dataclasses
import math
import statistics
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

from harvester.answers.estimate import Estimate
from harvester.engines import Ensemble, Spice
from harvester.engines.formula import Formula
from harvester.engines.options import MonteCarloOptions, Request, number
from harvester.engines.protocol import Engine
from harvester.engines.selection import ENGINES, refusals
from harvester.engines.spice.means import FEWEST as FEWEST_RUNS
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, HarvesterError, SimulationError
from harvester.machine.progress import NO_PROGRESS, Progress
from harvester.studies.work_precision import settings
from harvester.studies.work_precision.ngspice_bias import TOLERANCES, NgspiceBias, ngspice_bias
from harvester.studies.work_precision.richardson_ladder import (
    STEP_FACTORS,
    RichardsonLadder,
    richardson_ladder,
)

# of the remaining budget: for the first run of an engine, for the accuracies of an engine whose error is that of its
# resolution, and for the differences of ngspice
FIRST = 0.25
RESOLVED = 0.15
NGSPICE = 0.3
CALLS = 5  # of a formula after its first
FEWEST = 256  # trajectories that measure a bias
SHORTEST = 0.1  # s of a budget
CUT = "ngspice_left_out", "mean_while_settling"  # warnings that ngspice had not ended


@dataclass(frozen=True)
class Run:
    """An engine's answer at one setting.

    ``warm_up`` is its time in addition to the answer's ``seconds``.
    """

    engine: Engine
    answer: Estimate
    warm_up: float

    @property
    def work(self) -> float:
        """The trajectory-steps of the run, burn-in included."""
        d = self.answer.details
        return d["trajectories"] * (d["burn_in"] + d["duration"]) / d["step"]

    @property
    def sampling(self) -> float:
        """The half-width of the 95 % interval, relative to the answer."""
        return self.answer.mean_power.sampling95 / abs(self.answer.mean_power.value)


@dataclass
class Measurement:
    """The runs of one scene's engines at many settings, while there is time.

    Warming up does not count.

    ``failed`` are the settings with their errors, ``refused`` the reasons of engines that cannot
    support the scene; ``cheap`` is the run of the cheap model, ``steps`` and ``ngspice`` the
    biases, None if nothing is known.
    """

    problem: Problem
    seed: int = 0
    budget: float = 60.0
    progress: Progress = NO_PROGRESS
    begin: float = field(default_factory=time.perf_counter)  # later by what warming up takes
    fraction: float = 0.0  # of the budget, as reported: it never goes back
    runs: list[Run] = field(default_factory=list)
    failed: list[tuple[Engine, HarvesterError]] = field(default_factory=list)
    refused: dict[str, CannotServeError] = field(default_factory=dict)
    cheap: Run | None = None
    steps: RichardsonLadder | None = None
    ngspice: NgspiceBias | None = None

    def measure(self) -> None:
        """Run the engines from the fastest to the slowest, and the biases as soon as the default step is known.

        Raises SimulationError if the load draws no power.
        """
        for kind in (ENGINES[name] for name in refusals(self.problem)):
            if not kind.runs_ngspice:
                self.run(self._bounded(kind()))
        self.resolve()
        self.cheap = next((run for run in self.runs if run.engine.samples), None)
        # then by itself one periodic response, whose error is no sampling's
        steady = self.problem.equations.is_steady
        paired = Spice(trajectories=Spice.TRAJECTORIES) if steady else Spice()
        with_control = self.run(self._bounded(paired)) if self.cheap is not None else None
        burn_in = None if self.cheap is None else self.cheap.answer.details["burn_in"]
        spice_alone = self.run(self._bounded(settings.first_alone(burn_in)))
        if self.cheap is not None:
            self.measure_biases(self.cheap, with_control)
            kind = type(self.cheap_model)
            step = self.cheap.answer.details["step"]
            self.fill(settings.ensembles(kind, step), 0.25)
            if with_control is not None:
                self.fill(settings.paired(step, self.netlist), 0.4)
            self.fill(settings.without_each_part(kind, with_control is not None, self.problem), 0.5)
        if spice_alone is not None:
            d = spice_alone.answer.details
            self.fill(
                settings.alone(d["step"], d["duration"], self.netlist and self.cheap is not None),
                1.0,
            )

    def resolve(self) -> None:
        """Run the engines whose error is that of their resolution at several accuracies."""
        for run in [run for run in self.runs if run.engine.is_resolved]:
            self.fill(settings.resolved(run.engine), RESOLVED)

    @property
    def netlist(self) -> bool:
        """Whether the load is a netlist, so that ngspice's tolerance counts."""
        return self.problem.netlist is not None

    @property
    def unit(self) -> float:
        """The nondimensional time in one unit of the scene's time."""
        return self.problem.units.frequency

    @property
    def power_unit(self) -> float:
        """The power, in the scene's unit, of one unit of the moment that the cheap model's power is made of."""
        return self.cheap_model.model(self.problem).factor * self.problem.units.watts

    @property
    def cheap_model(self) -> Ensemble:
        """The engine of the cheap run, which is `Ensemble` or derives from it."""
        assert self.cheap is not None
        return cast(Ensemble, self.cheap.engine)

    def left(self, share: float) -> float:
        """The seconds that a share of the remaining budget is."""
        return max(share * (self.begin + self.budget - time.perf_counter()), 0.0)

    def run(self, engine: Engine) -> Run | None:
        """Run an engine, with noise of its own, and keep its answer or error; None for an error."""
        self._report(settings.label(engine))
        if isinstance(engine, MonteCarloOptions):
            offset = zlib.crc32(f"{settings.label(engine)} {settings.setting(engine)}".encode())
            engine = dataclasses.replace(engine, seed=self.seed + offset)
        begin = time.perf_counter()
        try:
            answer = engine.run(self.problem, lambda _: self._report(settings.label(engine)))
        except CannotServeError as error:
            self.refused[settings.label(engine)] = error
            return None
        except HarvesterError as error:
            self.failed.append((engine, error))
            return None
        took = time.perf_counter() - begin
        if cut := [said for said in answer.diagnostics if said.code in CUT]:
            self.failed.append((engine, SimulationError(str(cut[0]))))
            return None
        if isinstance(engine, Formula):
            later = [engine.run(self.problem).seconds for _ in range(CALLS)]
            answer = dataclasses.replace(answer, seconds=statistics.median(later))
        if answer.mean_power.value <= 0.0:
            raise SimulationError("nothing to measure: the load draws no power")
        self.runs.append(Run(engine, answer, max(took - answer.seconds, 0.0)))
        self.begin += self.runs[-1].warm_up
        return self.runs[-1]

    def fill(self, engines: "Sequence[settings.Sampler]", share: float) -> None:
        """Run those settings that should end within a share of the remaining budget."""
        end = time.perf_counter() + self.left(share)
        for engine in engines:
            left = end - time.perf_counter()
            if self.predicted(engine) < left:
                self.run(dataclasses.replace(engine, budget=left))

    def _bounded(self, engine: Engine) -> Engine:
        """An engine with its share of the remaining budget, if it has one."""
        if isinstance(engine, Formula) or not isinstance(engine, Request):
            return engine
        return dataclasses.replace(engine, budget=max(self.left(FIRST), SHORTEST))

    def predicted(self, engine: settings.Sampler) -> float:
        """The seconds of a setting, predicted from the times of the same engine at others."""
        known = {settings.label(run.engine) for run in self.runs}
        name = (
            settings.label(engine)
            if settings.label(engine) in known
            else settings.base_name(settings.label(engine))
        )
        before = [run for run in self.runs if settings.label(run.engine) == name]
        within = number(engine.within)
        if within is not None:
            return min(
                run.answer.seconds * max((run.sampling / within) ** 2, 1.0) for run in before
            )
        first = before[0]
        d = first.answer.details
        trajectories = engine.trajectories or d["trajectories"]
        duration, step = number(engine.duration) or d["duration"], number(engine.dt) or d["step"]
        return first.answer.seconds * trajectories * (d["burn_in"] + duration) / step / first.work

    def measure_biases(self, cheap: Run, paired: Run | None) -> None:
        """Measure the time-step bias, and those of model and tolerance if ngspice ends in time and does not fail.

        ``paired`` is a run of ngspice next to the cheap model, None if there is none.
        """
        h = cheap.answer.details["step"] * self.unit
        model = self.cheap_model.model(self.problem)
        self._report("biases")
        seconds = self.left(0.15)
        # of that run's trajectories
        share = seconds / len(STEP_FACTORS) * STEP_FACTORS[0] / cheap.answer.seconds
        trajectories = math.ceil(
            min(max(share * Ensemble.TRAJECTORIES, FEWEST), Ensemble.TRAJECTORIES)
        )
        self.steps = richardson_ladder(model, h, trajectories, self.seed, seconds)
        self._report("biases")
        with contextlib.suppress(SimulationError):  # of a finer tolerance than engine spice's
            if paired is not None and self._of_biases(paired) < self.left(NGSPICE):
                self.ngspice = ngspice_bias(
                    self.problem, model, self.steps, h, self.seed, self.left(NGSPICE)
                )

    def _of_biases(self, paired: Run) -> float:
        """The seconds of the first round of `ngspice_bias`, by those of a similar run."""
        d = paired.answer.details
        share = 2.0 * d["burn_in"] / (d["burn_in"] + d["duration"])
        tolerances = len(TOLERANCES) if self.netlist else 1
        return paired.answer.seconds * share * tolerances * FEWEST_RUNS / d["trajectories"]

    def _report(self, stage: str) -> None:
        self.fraction = max(
            self.fraction, min((time.perf_counter() - self.begin) / self.budget, 1.0)
        )
        self.progress.step(self.fraction, stage)
