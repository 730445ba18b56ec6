"""Engine `spice`: Monte Carlo with the electrical side in ngspice."""

import contextlib
import dataclasses
import math
import time
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.moment_existence import MomentExistence, existence
from harvester.engines.not_periodic import sampled_instead
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import AnyScene, Engine, Progress, needs_circuit, served
from harvester.engines.sampling import refine
from harvester.engines.spice.coexisting_responses import with_others
from harvester.engines.spice.estimates import partial_answer, sampled_estimate, steady_estimate
from harvester.engines.spice.first_batch import TRAJECTORIES, first_batch
from harvester.engines.spice.probed_answer import Watch, watch_of, with_steady_probes
from harvester.engines.spice.runs import Runs
from harvester.engines.spice.setup import SpiceSetup, set_up
from harvester.engines.spice.steady import Steady
from harvester.engines.spice.steady_response import is_the_only_one, may_come_back, steady_response
from harvester.equations.effects import BEYOND_CIRCUITS
from harvester.equations.problem import Problem
from harvester.errors import (
    CircuitError,
    ConvergenceError,
    HarvesterError,
    MissingProgramError,
    OutOfTimeError,
    invalid,
)
from harvester.netlists.for_ngspice import RELTOL, SHUNTS
from harvester.presentation.diagnostic import Diagnostic, refusal
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.target import Target

if TYPE_CHECKING:
    from harvester.cosimulation.periodic_responses import Neighbour

GRACE, SLACK = 1.1, 1.0  # all may last so many times the `budget`, and so many seconds more
# of what the burn-in leaves, for the runs at least: their processes take some seconds to start
RUNNING = 0.5
AS_GOOD = 1.1  # times an error, that is not taken for a larger one
# times the seconds so far, that runs with a `TENTH` of the tolerance need; the smallest tolerance
TIGHTER = 2.0
TENTH = 0.1
TIGHTEST = 1.1e-6


def _is_better(now: Runs, before: Runs) -> bool:
    """Whether runs with a smaller tolerance measured its effect, and have hardly a larger error."""
    if now.tolerance is None:
        return False
    return before.tolerance is None or (
        now.power().value.known_error95 < AS_GOOD * before.power().value.known_error95
    )


class Spice(MonteCarloOptions, Engine):
    """Solve the coupled equations with the netlist in ngspice, in lock-step with the mass.

    Two kinds of control variates reduce the standard error of a few ngspice runs, without bias: a
    cheap model on the same noise, whose mean a long ensemble determines (the exact update of a load
    resistor, or the netlist's circuit of ideal diodes and switches), and under white noise sums of
    mean zero from ngspice's own states. With ideal elements the runs start in settled states of
    these, otherwise at rest.

    Parameters
    ----------
    within, budget, seed, duration, trajectories, dt : float or str or int, optional
        As in `run`.
    alone : bool, default False
        Average plain ngspice runs started from rest, without variance reduction.
    reltol : float, default 0.0001
        ngspice's relative tolerance, for a netlist.
    gaussian : bool, default False
        Gaussian noise in place of the three-point noise of the ensemble; only with ``alone``.
    probe : tuple of str
        Circuit quantities to report, such as "store" or "v(a,b)".
    ledger : bool, default False
        Also report the mean power dissipated in each element.

    Raises
    ------
    CannotServeError
        The scene has no load, or no excitation moves the mass at rest.
    MissingProgramError
        ngspice is not installed.
    CircuitError
        ngspice refuses the circuit or does not converge, or too few runs end within the ``budget``.
    UnboundedResponseError
        No stationary response exists.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Spice(within="1%", budget="30s").budget
    30.0
    """

    alone: bool = False
    reltol: float = RELTOL
    gaussian: bool = False
    probe: tuple[str, ...] = ()
    ledger: bool = False

    NAME = "spice"
    LOOK = EngineLook("SPICE (ngspice)", "#0072B2", "o", "none", order=4.0, trust=3)
    samples = True
    takes_netlists = True
    runs_ngspice = True
    has_frequency_response = True
    follows_periods = True
    share_of_time = 2.0
    TRAJECTORIES: ClassVar[int] = TRAJECTORIES

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1e-7 <= self.reltol <= 1e-2:
            raise invalid("reltol", "be between 1e-7 and 1e-2", self.reltol)
        if self.gaussian and not self.alone:
            raise invalid(
                "gaussian", "be given with alone only: pairs share the ensemble's noise", "True"
            )

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the engine does not support a problem; None if it can."""
        if problem.netlist is None and problem.equations.mu is None:
            return refusal("needs_load", cls.NAME, engine=cls.NAME)
        if problem.netlist is not None:
            needs_circuit(problem, cls.NAME)
        if beyond := sorted(BEYOND_CIRCUITS.intersection(problem.effects)):
            return refusal("beyond_ngspice", effects=" and ".join(beyond))
        return (
            None
            if problem.equations.is_shaken
            else refusal("needs_shaking", cls.NAME, engine=cls.NAME)
        )

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """Independent trajectories, each its own ngspice run; means after the burn-in.

        Under a steady excitation the periodic response, if it has one, unless
        trajectories or a duration are given.
        """
        problem = Problem.of(scene)
        answer, steady = self._run(problem, None, progress)
        if not may_come_back(problem):
            return answer
        return with_others(self, answer, problem, self.reltol, steady)

    def continues(self, problem: Problem) -> bool:
        """Whether the answer is found sooner from that of a neighbouring scene, and is the same."""
        return self.refusal(problem) is None and is_the_only_one(self, problem)

    def run_continued(self, scenes: Sequence[AnyScene]) -> list[Estimate | HarvesterError]:
        """`run` for each scene, by continuation from the one before if it `continues`, or the error that it raises.

        Raises MissingProgramError, which is not a fault of a scene.
        """
        answers = list[Estimate | HarvesterError]()
        near = None
        for scene in scenes:
            try:
                problem = Problem.of(scene)
                answer, near = self._run(problem, near if self.continues(problem) else None)
                answers.append(answer)
            except MissingProgramError:
                raise
            except HarvesterError as error:
                answers.append(error)
                near = None
        return answers

    def _run(
        self, problem: Problem, near: Steady | None, progress: Progress | None = None
    ) -> tuple[Estimate, Steady | None]:
        """`run_near`, or the known part if the time was over before."""
        begin = time.perf_counter()
        try:
            return self.run_near(problem, near, progress)
        except OutOfTimeError as error:
            return partial_answer(self.NAME, problem, error, time.perf_counter() - begin), None

    def run_from(
        self,
        scene: AnyScene,
        near: "Neighbour | None",
        progress: Progress | None = None,
        judged: bool = True,
    ) -> "tuple[Estimate, Neighbour | None]":
        """As `run_near`, and the start of the response of the longest step."""
        answer, steady = self.run_near(scene, near, progress)
        return answer, None if steady is None else steady.responses[0, 0]

    def run_near(
        self, scene: AnyScene, near: "Steady | Neighbour | None", progress: Progress | None = None
    ) -> tuple[Estimate, Steady | None]:
        """As `run`, and any periodic response: from rest, or on from ``near``, of an excitation close by."""
        problem = served(type(self), scene)
        begin = time.perf_counter()
        watch = watch_of(problem, self.probe, self.ledger) if self.probe or self.ledger else Watch()
        problem = problem if self.ledger else problem.plain
        exists = existence(problem)
        self.check_times(problem.physical)
        if may_come_back(problem) and self.trajectories is None and self.duration is None:
            if (
                steady := steady_response(self, problem, self.reltol, progress, watch.all, near)
            ) is not None:
                answer = steady_estimate(
                    self, self.NAME, problem, steady, time.perf_counter() - begin
                )
                return with_steady_probes(
                    answer, problem, watch, steady
                ) if watch.all else answer, steady
            return sampled_instead(
                problem, lambda: self._sampled_answer(problem, watch, exists, begin, progress)
            ), None
        return self._sampled_answer(problem, watch, exists, begin, progress), None

    def _sampled_answer(
        self,
        problem: Problem,
        watch: Watch,
        exists: MomentExistence,
        begin: float,
        progress: Progress | None,
    ) -> Estimate:
        """The answer of sampled runs, or the known part if their time is over.

        It was begun at ``begin``.
        """
        from harvester.mechanics.kernels.compiled import machine_code

        searched = time.perf_counter() - begin
        code = machine_code()
        setup = set_up(
            problem, self, self.reltol, self.gaussian, self.SETTLED and not self.alone, watch.all
        )
        setup = dataclasses.replace(setup, seconds=setup.seconds + searched)
        try:
            runs, chosen = self._all_runs(problem, setup, code, exists, progress)
        except OutOfTimeError as error:
            return partial_answer(self.NAME, problem, error, time.perf_counter() - begin, setup)
        return sampled_estimate(self.NAME, problem, runs, exists, watch, chosen)

    def _all_runs(
        self,
        problem: Problem,
        setup: SpiceSetup,
        code: int,
        exists: MomentExistence,
        progress: Progress | None,
    ) -> tuple[Runs, list[Diagnostic | None]]:
        """The runs of an answer, and the report of their target.

        Again with a shunt if any does not converge.
        """
        begin = time.monotonic()

        def tried(shunt: float, is_last: bool) -> tuple[Runs, list[Diagnostic | None]]:
            """The same with a shunt; the tries before are in the budget as well."""
            spent = time.monotonic() - begin
            so_far = dataclasses.replace(setup.with_shunt(shunt), seconds=setup.seconds + spent)
            runs, target = self._first_runs(problem, so_far, code, progress)
            now = time.monotonic()
            time_for_another = 3.0 * (now - begin) < runs.deadline - now
            runs.measure_tolerance(needed=time_for_another and not is_last)
            if target is None:
                return runs, []
            obstacle = exists.obstacle(target.within)
            reached = refine(runs, target) if obstacle is None else obstacle
            chosen = runs.setup.chosen(target.within, problem.units.frequency, problem.physical)
            spent = time.monotonic() - begin
            if self._may_tighten(reached, setup, target.seconds_left - TIGHTER * spent):
                tighter = setup.with_tolerance(TENTH * setup.device.reltol, spent)
                with contextlib.suppress(CircuitError):
                    better, said = self._all_runs(problem, tighter, code, exists, progress)
                    if _is_better(better, runs):
                        return better, said
            return runs, [reached, chosen]

        for shunt in SHUNTS:
            with contextlib.suppress(ConvergenceError):
                return tried(shunt, False)
        # of a netlist that bears none of them, without one: its tolerance could not be measured
        return tried(0.0, True)

    def _may_tighten(
        self, reached: Diagnostic | None, setup: SpiceSetup, seconds_left: float
    ) -> bool:
        """Whether a tenth of ngspice's default tolerance is called for, and time is left."""
        called_for = reached is not None and reached.code == "needs_smaller_tolerance"
        is_default = self.reltol == type(self).reltol
        return called_for and is_default and seconds_left > 0.0 and setup.device.reltol > TIGHTEST

    def _first_runs(
        self, problem: Problem, setup: SpiceSetup, code: int, progress: Progress | None
    ) -> tuple[Runs, Target | None]:
        """The first batch of runs, and the target that they work towards.

        If the netlist does not bear states of ideal elements, such as beyond a breakdown, they
        begin at rest.
        """
        from harvester.cosimulation import runs as worker
        from harvester.mechanics.kernels.compiled import machine_code

        pairs = self.PAIRING and not self.alone and problem.equations.is_random
        paired = pairs and setup.pair is not None
        warm = worker.warm_up_workers(setup.device, paired)
        start = warm if 0 < code == machine_code() else 0.0  # compilation is not in the budget
        target, deadline = self._clocks(setup, start)
        batch = partial(
            first_batch,
            self,
            problem,
            paired=paired,
            controlled=self.CONTROLS and not self.alone,
            deadline=deadline,
            progress=progress,
        )
        try:
            runs = batch(setup=setup)
        except OutOfTimeError:
            raise
        except CircuitError:
            if setup.starts is None:
                raise
            runs = batch(setup=setup.from_rest())
        runs.warm_up_seconds = warm
        return runs, target

    def _clocks(self, setup: SpiceSetup, start: float) -> tuple[Target | None, float]:
        """The target, whose budget has setup and ``start`` of workers in it, and the deadline."""
        within, budget = number(self.within), number(self.budget)
        target = None
        if within is not None:
            clock = time.perf_counter() - setup.seconds - start
            target = Target(within, budget, clock, gives_up=self.GIVES_UP)
        if budget is None:
            return target, math.inf
        left = max(GRACE * budget - setup.seconds, 0.0) + SLACK
        return target, time.monotonic() + max(left - start, RUNNING * left)
