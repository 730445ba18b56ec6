"""Tolerances of a netlist: a law through runs of each key alone, checked by more expensive runs.

A run of a compiled circuit needs a second or more, so that a study of many keys has few of them.
They are spent in this order, all on the same noise:

1. each key alone at its ends: the parabolas of `harvester.studies.tolerance.curved_law`, and with
   them a first answer;
2. the same engine with the reference of its model, in the middle and at the two places of
   `curved_law.steepest`, which corrects the level of all devices and states its error;
3. sampled devices until the time is over, which state the law's error, and a polynomial through
   the rest as soon as there are enough.
"""

import contextlib
import itertools
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.device_runs import DeviceRun, DeviceWorkers
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.machine.execution import Execution
from harvester.machine.progress import remark
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.scene.scene import Scene
from harvester.studies.tolerance import answer_levels, curved_law, design
from harvester.studies.tolerance.curved_law import CurvedLaw
from harvester.studies.tolerance.distribution import wilson
from harvester.studies.tolerance.first_order import FAR, error_of_difference
from harvester.studies.tolerance.samples import QUANTITIES, Samples
from harvester.studies.tolerance.study import (
    RUNS,
    ToleranceRequest,
    ToleranceRuns,
    answer_at,
    check_devices,
)
from harvester.uncertainty.value import amount, half95

BUDGET = 60.0  # s, if none is given
TRAJECTORIES = 512  # of each device, for an engine that computes several together
SPENT = 0.9  # of the budget: when the last runs are to end
# of the time that is left: what the first judged run, and a later one, may take
FIRST_JUDGED, JUDGED_SHARE = 0.8, 0.7
LATE = 1.1  # of the budget: a study that needs longer says so
FLAT = 1e-6  # of the power in the middle: a smaller change by all slopes is rounding
MARGIN = 1.2  # times the longest run of a kind, that another one may need


class RunKind(Enum):
    """The purpose of a run: a key at its end, a steepest place, the reference, a sampled device."""

    ALONE = auto()
    CORNER = auto()
    JUDGED = auto()
    DRAWN = auto()


# the remarks on runs without an answer
FAILURES = {
    RunKind.JUDGED: "judged_runs_failed",
    RunKind.CORNER: "corners_failed",
    RunKind.DRAWN: "samples_failed",
}
Answers = dict[Enum, dict[int, Estimate | HarvesterError]]


def is_study_of_circuit(engine: Any) -> bool:
    """Whether an engine may leave out the reference of its model: a study has cheap and expensive runs."""
    return bool(getattr(engine, "judged", False))


@dataclass
class CircuitStudy:
    """A study within ``budget`` seconds; without ``draws`` no devices are sampled.

    If it ``fills`` the budget, devices are sampled until it is spent, rather than as many as a
    study by counts computes.
    """

    request: ToleranceRequest
    execution: Execution
    budget: float
    draws: bool = True
    fills: bool = False
    done: Answers = field(default_factory=dict)
    seconds: dict[Enum, list[float]] = field(default_factory=dict)

    def run(self, engine: Any) -> ToleranceRuns:
        """The powers of all devices, by an engine with the option ``judged``.

        Raises the error of a key's end.
        """
        self.begin = time.monotonic()
        self._is_late = False
        request = self.request
        x = design.values_at(request.spreads, request.u)
        ends = design.values_at(request.spreads, design.one_by_one(len(request.keys)))
        check_devices(request, np.vstack([ends, x]))
        cheap = replace(engine, judged=False)
        if self._at_once(cheap) > 1 and cheap.trajectories is None:
            cheap = replace(cheap, trajectories=TRAJECTORIES)
        remark(self.execution.progress, note("law_in_budget", budget=self.budget))
        with contextlib.closing(DeviceWorkers(self.execution)) as workers:
            self._workers = workers.count
            size = min(self._at_once(cheap), -(-len(ends) // self._workers))
            first = self._judged(engine, ends[:1], FIRST_JUDGED)
            runs = [first, self._runs(RunKind.ALONE, cheap, ends, size)]
            if self._workers == 1:  # the first answer before the reference's
                runs.reverse()
            for kind in self._compute(workers, itertools.chain(*runs)):
                if kind is RunKind.ALONE:
                    self._remark_on_law(ends, x)
            alone = self._alone(ends)
            laws = {name: answer_levels.law(ends, alone, name) for name in QUANTITIES}
            corners = curved_law.steepest(laws["mean_power"], x, FAR)
            for _ in self._compute(workers, self._later(cheap, engine, corners, x)):
                pass
        return self._runs_of(laws, alone, ends, x, cheap.NAME)

    @property
    def _left(self) -> float:
        """The seconds until the last runs are to end."""
        return self.begin + SPENT * self.budget - time.monotonic()

    def _scene(self, values: Floats) -> Scene:
        return self.request.scene.varied(
            dict(zip(self.request.keys, map(float, values), strict=True))
        )

    def _runs(self, kind: Enum, engine: Any, values: Floats, size: int = 1) -> Iterator[DeviceRun]:
        """Runs of an engine at keys' values, shape (n, keys), ``size`` of them at a time."""
        for first in range(0, len(values), size):
            scenes = tuple(self._scene(row) for row in values[first : first + size])
            yield DeviceRun(kind, first, engine, scenes)

    def _judged(self, engine: Any, values: Floats, share: float) -> Iterator[DeviceRun]:
        """Runs with the reference of the model, each within a part of the time that is then left."""
        within = self.request.within
        judge = engine if within is None else replace(engine, within=within)
        for run in self._runs(RunKind.JUDGED, judge, values):
            if self._left <= 0.0:
                return
            yield replace(run, engine=replace(judge, budget=max(share * self._left, 1.0)))

    def _later(self, cheap: Any, engine: Any, corners: Floats, x: Floats) -> Iterator[DeviceRun]:
        """The runs after the law, chosen one by one while there is time.

        These are the corners, with a judged run on each other core, as many sampled devices as a
        polynomial needs, the other judged run, and more sampled devices.
        """
        request = self.request
        at_once = self._at_once(cheap)
        judged = (
            replace(run, index=run.index + 1) for run in self._judged(engine, corners, JUDGED_SHARE)
        )
        most = len(x) if self.fills else request.runs or RUNS * (1 + len(request.keys))
        most = min(most, len(x))
        enough = min(curved_law.PER_PLANE * (1 + len(request.keys)), most)
        size = min(at_once, -(-enough // self._workers))
        drawn = self._runs(RunKind.DRAWN, cheap, x[: most if self.draws else 0], size)
        at_corners = self._runs(RunKind.CORNER, cheap, corners, min(at_once, len(corners)))
        yield from itertools.takewhile(lambda _: self._left > 0.0, at_corners)
        requested = n_judged = 0
        while True:
            run = None
            # a few devices come first, then a judged run on each other core
            ahead = curved_law.FEWEST if n_judged < self._workers - 1 else enough
            if (requested >= ahead or not self.draws) and self._has_time(RunKind.JUDGED):
                run = next(judged, None)
                n_judged += run is not None
            if run is None and self._has_time(RunKind.DRAWN):
                run = next(drawn, None)
                requested += 0 if run is None else len(run.scenes)
            if run is None:
                return
            yield run

    def _at_once(self, cheap: Any) -> int:
        """How many devices an engine computes together, for less than one by one."""
        return int(cheap.many_at_once(Problem(self.request.scene)))

    def _has_time(self, kind: Enum) -> bool:
        """Whether another run of a kind ends in time, by the longest of it or of the law."""
        known = self.seconds.get(kind) or self.seconds[RunKind.ALONE]
        share = JUDGED_SHARE if kind is RunKind.JUDGED else 1.0
        return MARGIN * max(known) < share * self._left

    def _compute(self, workers: DeviceWorkers, runs: Iterator[DeviceRun]) -> Iterator[Enum]:
        """Compute runs into ``done``, and yield the kind of each that is there."""
        for answered in workers.answers(runs):
            run = answered.run
            of_kind = self.done.setdefault(run.kind, {})
            of_kind.update(enumerate(answered.answers, run.index))
            self.seconds.setdefault(run.kind, []).append(answered.seconds)
            spent = (time.monotonic() - self.begin) / self.budget
            self.execution.progress.step(min(spent, 1.0), run.engine.NAME)
            yield run.kind

    def _alone(self, ends: Floats) -> list[Estimate]:
        """The answers of each key alone; an error names the key and its value."""
        answers = [self.done[RunKind.ALONE][k] for k in range(len(ends))]
        keys = self.request.keys
        return [
            answer_at(keys, row, answer, (k - 1) // 2 if k else None)
            for k, (row, answer) in enumerate(zip(ends, answers, strict=True))
        ]

    def _remark_on_law(self, ends: Floats, x: Floats) -> None:
        """Remark on the time that the law needs, if that is beyond the budget, then on its answer."""
        done = len(self.done[RunKind.ALONE])
        if done == len(ends):
            remark(self.execution.progress, self._first_answer(ends, x))
            return
        seconds = self.seconds[RunKind.ALONE]
        if self._is_late:
            return
        rest = (len(ends) - done) * sum(seconds) / done / self._workers
        whole = time.monotonic() - self.begin + rest
        if whole > LATE * self.budget:
            self._is_late = True
            remark(
                self.execution.progress,
                note("law_beyond_budget", seconds=whole, budget=self.budget),
            )

    def _first_answer(self, ends: Floats, x: Floats) -> Diagnostic:
        """The first answer: quantiles of the power, and the key that moves it most.

        Raises the error of a key's end.
        """
        law = answer_levels.law(ends, self._alone(ends), "mean_power")
        low, middle, high = np.quantile(law(x), (0.01, 0.5, 0.99))
        away = x - law.middle
        each = away * law.slopes + away**2 * law.curvatures
        blame = self.request.keys[int(np.argmax(each.std(axis=0)))]
        unit = "W" if self.request.scene.physical else ""
        powers = {"low": low, "middle": middle, "high": high}
        numbers = {name: amount(float(power), unit) for name, power in powers.items()}
        return note("first_answer", seconds=time.monotonic() - self.begin, key=blame, **numbers)

    def _over_budget(self) -> Iterator[Diagnostic]:
        """A warning if the runs that every answer needs took longer than the budget."""
        spent = time.monotonic() - self.begin
        if spent > LATE * self.budget:
            yield warning("over_budget", seconds=spent, budget=self.budget)

    def _remarks(self) -> Iterator[Diagnostic]:
        """The warnings of the judged runs, and failures of the other runs."""
        for answer in self._served(RunKind.JUDGED).values():
            yield from answer.warnings
        for kind, code in FAILURES.items():
            done = self.done.get(kind, {})
            failed = [
                error for _, error in sorted(done.items()) if isinstance(error, HarvesterError)
            ]
            if failed:
                yield warning(code, failed=len(failed), count=len(done), first=str(failed[0]))

    def _served(self, kind: Enum) -> dict[int, Estimate]:
        """The answers of a kind by their index, without errors."""
        return {k: a for k, a in sorted(self.done.get(kind, {}).items()) if isinstance(a, Estimate)}

    def _runs_of(
        self,
        laws: dict[str, CurvedLaw],
        alone: Sequence[Estimate],
        ends: Floats,
        x: Floats,
        name: str,
    ) -> ToleranceRuns:
        """The results of all runs."""
        corners = self._served(RunKind.CORNER)
        drawn = self._served(RunKind.DRAWN)
        judged = self._served(RunKind.JUDGED)
        steepest = curved_law.steepest(laws["mean_power"], x, FAR)
        where = np.vstack([steepest[[*corners]], x[[*drawn]]])
        devices = [*corners.values(), *drawn.values()]
        plain = {0: alone[0]} | {1 + k: answer for k, answer in corners.items()}
        pairs = [(answer, plain[k]) for k, answer in judged.items() if k in plain]
        # a judged run that found no time for its reference has the cheap run's answer
        pairs = [pair for pair in pairs if pair[0].mean_power.error95 is not None] or pairs
        # for a law without slopes the corners are the middle, or anywhere
        moved = float(np.abs(laws["mean_power"].slopes) @ x.std(axis=0))
        steep = moved > FLAT * laws["mean_power"].value and len(corners) == len(steepest)
        is_checked = steep or len(drawn) >= curved_law.FEWEST
        off: dict[str, float | None] = {}
        values: dict[str, Floats] = {}
        least: dict[str, float] = {}
        failed = len(self.done.get(RunKind.DRAWN, {})) - len(drawn)
        # two devices at least have a value: the interval of the share states what is not known
        lost = min(round(failed / max(len(drawn) + failed, 1) * len(x)), len(x) - 2)
        many = x[: len(x) - lost]
        for quantity in QUANTITIES:
            law = laws[quantity]
            y = answer_levels.values(devices, quantity)
            law = curved_law.checked(law, where, y, ends, x, len(corners))
            ratio, level = answer_levels.level(pairs, quantity)
            laws[quantity] = replace(law, ratio=ratio)
            errors = [
                error_of_difference(low, high, quantity)
                for low, high in zip(alone[1::2], alone[2::2], strict=True)
            ]
            bends = answer_levels.bend_errors(ends, alone, quantity)
            noise = half95(curved_law.noise(law, errors, bends, ends, x))
            values[quantity] = laws[quantity](many)
            # the scatter is the same of strong and weak devices
            least[quantity] = ratio * answer_levels.size(law, many)
            share = (law.scatter + noise) / answer_levels.size(law, many)
            off[quantity] = share + level if level is not None and is_checked else None
        law = laws["mean_power"]
        by_judge = "checked_by_judged_runs" if off["mean_power"] is not None else "no_error_stated"
        checks = (
            note(
                answer_levels.code(law, len(drawn), is_checked),
                engine=name,
                runs=len(alone),
                sampled=len(drawn),
                missed=law.scatter / answer_levels.size(law, many),
            ),
            note(by_judge, runs=len(pairs), ratio=law.ratio),
        )
        return ToleranceRuns(
            samples=Samples(
                engine=name,
                values=values,
                served=np.ones(len(many), dtype=bool),
                off=off,
                checks=checks,
                ratio=law.ratio,
                least=least,
            ),
            x=many,
            surface=law,
            alone=law.ratio * answer_levels.values(alone, "mean_power"),
            failed=lost,
            failed_share=wilson(failed, failed + len(drawn)) if failed else None,
            warnings=(*self._over_budget(), *self._remarks()),
            peaks={},
            peaks_off={},
        )
