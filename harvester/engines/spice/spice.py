"""Engine `spice`: Monte Carlo with the electrical side in ngspice."""

import dataclasses
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.engines.agreement import NO_NOISE, disagreement
from harvester.engines.moment_existence import existence
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.power_balance import power_balance
from harvester.engines.protocol import AnyScene, Engine, Progress, estimate, served
from harvester.engines.spice.coexisting_responses import with_others
from harvester.engines.spice.effort import FEWEST, fewest_pairs
from harvester.engines.spice.partial_answer import unfinished
from harvester.engines.spice.probes import Watch, watch_of, with_sampled_probes, with_steady_probes
from harvester.engines.spice.runs import Runs
from harvester.engines.spice.sequential_sampling import sequential_sampling
from harvester.engines.spice.setup import SpiceSetup, prepare, stand_in
from harvester.engines.spice.steady import Steady
from harvester.engines.spice.steady_answer import steady_estimate
from harvester.engines.spice.steady_response import along, follows, steady_response
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, HarvesterError, OutOfTimeError, SimulationError, invalid, names_arguments
from harvester.machine.folders import machine_code
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.target import Target

if TYPE_CHECKING:
    from harvester.cosimulation.responses import Neighbour

BLOCK = 32.0  # nondimensional time of a block, with controls of its own: five periods or so
GRACE, SLACK = 1.1, 1.0  # all may last so many times the `budget`, and so many seconds more
RUNNING = 0.5  # of what the burn-in leaves, for the runs at least: their processes take some seconds to start


@names_arguments
@dataclass(frozen=True, kw_only=True)
class Spice(MonteCarloOptions, Engine):
    """The fully coupled equations, the electrical side a netlist in ngspice in lock-step with the mass.

    A few ngspice runs have the standard error of many more, with no bias from that, by two kinds of control variates:
    a cheap model on the same noise, whose mean a long ensemble knows, that is the exact update of a load resistor or
    the netlist's circuit made of ideal diodes and switches (`harvester.uncertainty.control_variate`); and under white
    noise sums of mean zero from ngspice's own states (`harvester.mechanics.kernels.circuit_control_variates`).  With
    ideal elements the runs begin in settled states of these, else at rest.

    >>> import harvester as hv
    >>> hv.Spice(within="1%", budget="30s").budget
    30.0

    alone
        ngspice runs only, from rest, and their plain mean.
    reltol
        ngspice's relative tolerance, for a netlist.
    gaussian
        Gaussian noise in place of the three-point noise of the ensemble; only ``alone``.
    probe
        other quantities of the circuit to tell, such as "store" or "v(a,b)" (`harvester.netlists.probes`).
    ledger
        tell what each element of the circuit takes, too.

    Raises
    ------
    CannotServeError
        without a load or anything that shakes the mass at rest.
    MissingProgramError
        when ngspice is not installed.
    CircuitError
        when ngspice refuses the circuit or does not converge, or too few runs end in the ``budget``.
    UnboundedResponseError
        where no stationary response exists.
    """

    alone: bool = False
    reltol: float = 1e-4
    gaussian: bool = False
    probe: tuple[str, ...] = ()
    ledger: bool = False

    NAME: ClassVar[str] = "spice"
    LOOK: ClassVar[EngineLook] = EngineLook("SPICE (ngspice)", "#0072B2", "o", "none", order=4.0, trust=3)
    samples: ClassVar[bool] = True
    takes_netlists: ClassVar[bool] = True
    runs_ngspice: ClassVar[bool] = True
    has_frequency_response: ClassVar[bool] = True
    share_of_time: ClassVar[float] = 2.0
    TRAJECTORIES: ClassVar[int] = 16
    KICKS: ClassVar[int] = 2_000_000  # of all trajectories alone, unless a duration is given
    PATIENCE: ClassVar[float] = 3e7  # steps of all ngspice runs together: a minute to some minutes
    SHORTEST: ClassVar[float] = 30.0  # s: in a smaller budget a few runs may not end; steps are counted for this
    STEPS_A_SECOND: ClassVar[float] = 1e5  # that a --budget counts for: of a netlist on a slow machine
    WINDOWS: ClassVar[float] = 3.0  # burn-ins that a trajectory goes on for, paired or towards a target
    BLOCKS: ClassVar[float] = 5.0  # that it goes on for at least from settled states, where the burn-in is short

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1e-7 <= self.reltol <= 1e-2:
            raise invalid("reltol", "be between 1e-7 and 1e-2", self.reltol)
        if self.gaussian and not self.alone:
            raise invalid("gaussian", "be given with alone only: pairs share the ensemble's noise", "True")

    @classmethod
    def refusal(cls, problem: Problem) -> str:
        """Why the engine cannot serve a problem; empty where it can."""
        if problem.netlist is None and problem.equations.mu is None:
            return "engine 'spice' must have a load, but the circuit is open: use engine 'ensemble'"
        if not problem.equations.is_shaken:
            return "engine 'spice' starts at rest and needs external noise, or a base that moves: use engine 'ensemble'"
        return ""

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """Independent trajectories, each its own ngspice run; means after the burn-in.

        Under a steady drive the periodic response, where it has one (`harvester.engines.spice.steady`), unless
        trajectories or a duration are given.
        """
        begin, problem = time.perf_counter(), Problem.of(scene)
        try:
            answer, steady = self.follow(problem, None, progress)
            return with_others(self, answer, problem, self.reltol, steady) if problem.equations.is_steady else answer
        except OutOfTimeError as error:
            return unfinished(self.NAME, problem, error, time.perf_counter() - begin)

    def continues(self, problem: Problem) -> bool:
        """Whether the answer is found sooner from that of a neighbouring scene, and is the same."""
        return not self.refusal(problem) and follows(self, problem)

    def run_continued(self, scenes: Sequence[AnyScene]) -> list[Estimate | HarvesterError]:
        """`run` for each scene, where it `continues` from the one before, or the error that it raises."""
        return along(self.NAME, scenes, self.follow, self.continues)

    def follow(
        self, scene: AnyScene, near: "Steady | Neighbour | None", progress: Progress | None = None
    ) -> tuple[Estimate, Steady | None]:
        """As `run`, and the periodic response if it has one: from rest, or on from ``near``, of a drive close by."""
        from harvester.cosimulation import runs as worker

        problem, sought, begin = served(type(self), scene), "", time.perf_counter()
        watch = watch_of(problem, self.probe, self.ledger) if self.probe or self.ledger else Watch()
        problem = problem if self.ledger else problem.plain
        exists = existence(problem)
        self.check_times(problem.physical)
        if problem.equations.is_steady and self.trajectories is None and self.duration is None:
            steady = steady_response(self, problem, self.reltol, progress, watch.all, near)
            if steady is not None:
                found = steady_estimate(self, self.NAME, problem, steady, time.perf_counter() - begin)
                return with_steady_probes(found, problem, watch, steady) if watch.all else found, steady
            sought = "no response was found that comes back within 8 periods of the drive, so that runs are sampled"
        searched, code = time.perf_counter() - begin, machine_code()
        eqs, s, unit = problem.equations, problem.scales, problem.units.frequency
        ready = prepare(problem, self, self.reltol, self.gaussian, settled=self.SETTLED and not self.alone)
        device = dataclasses.replace(ready.device, probes=watch.all)
        ready = dataclasses.replace(ready, device=device, seconds=ready.seconds + searched)
        paired = ready.pair is not None and self.PAIRING and not self.alone and eqs.is_random
        warm = worker.warm_up_workers(ready.device, paired)
        within, budget = number(self.within), number(self.budget)
        start = warm if 0 < code == machine_code() else 0.0  # compilation is not in the budget
        target = None if within is None else Target(within, budget, time.perf_counter() - ready.seconds - start)
        deadline = math.inf
        if budget is not None:
            left = max(GRACE * budget - ready.seconds, 0.0) + SLACK
            deadline = time.monotonic() + max(left - start, RUNNING * left)
        begun = paired, target, deadline, progress
        try:
            runs = self._first_round(problem, ready, *begun)
        except OutOfTimeError as error:
            return unfinished(self.NAME, problem, error, time.perf_counter() - begin, ready), None
        except CircuitError:  # the netlist does not bear states of ideal elements, such as beyond a breakdown
            if ready.starts is None:
                raise
            ready = ready.from_rest()
            runs = self._first_round(problem, ready, *begun)
        runs.measure_tolerance()
        if target is not None and exists.can_reach(target.within, ready.warnings):
            sequential_sampling(runs, target, self.dt is not None)
        h, burnt = ready.device.h / unit, ready.burn_in / unit
        details = {"step": h, "burn_in": burnt, "duration": runs.kicks * h - burnt}
        details |= {"trajectories": len(runs.done)} | runs.details() | {"warm_up_seconds": warm}
        ready.warnings.extend(exists.warnings + runs.doubts())
        moments = runs.moments()
        if ready.resistive and eqs.stop_stiffness is None:  # the balance holds for a load resistor and rigid stops only
            details["power_balance"], details["power_balance_stderr"] = power_balance(moments, eqs)
        else:
            details |= runs.ledger(s.watts / problem.units.watts)
        agreed = disagreement(moments) if eqs.is_steady else None
        if agreed is not None and agreed != NO_NOISE:
            ready.warnings.append(agreed)
        v2, power = (
            dataclasses.replace(one.value, stderr=None)
            if agreed == NO_NOISE
            else one.value.with_unknown(exists.unknown).with_unknown(ready.unknown)
            for one in (runs.mean_square_voltage(), runs.power())
        )
        reasons = [sought, ready.known(runs.tolerance, runs.followed), agreed if agreed == NO_NOISE else ""]
        if target is not None:
            reasons.insert(0, f"`within` {target.within:.3g} chose {ready.chosen(unit, problem.physical)}")
        if not problem.physical:
            reasons.append(stand_in(s))
        answer = estimate(
            self.NAME,
            problem,
            v2,
            power,
            ready.seconds + runs.seconds,
            sum(one.steps for one in (*runs.done, *runs.coarse)),
            "; ".join(reason for reason in reasons if reason),
            tuple(ready.warnings),
            details,
            moments.V2,
        )
        answer = with_sampled_probes(answer, problem, watch, runs) if watch.all else answer
        return dataclasses.replace(answer, effects=(*problem.effects, *["netlist"] * (not ready.resistive))), None

    def _first_round(
        self,
        problem: Problem,
        ready: SpiceSetup,
        paired: bool,
        target: Target | None,
        deadline: float,
        progress: Progress | None,
    ) -> Runs:
        """As many runs as the target is likely to need at least; those of a later round are as long."""
        eqs, unit = problem.equations, problem.units.frequency
        if self.duration is not None:
            duration = (number(self.duration) or 0.0) * unit
        elif paired or not eqs.is_random or self.within is not None:
            least = 0.0 if ready.starts is None else self.BLOCKS * BLOCK
            duration = max(self.WINDOWS * ready.burn_in, least)
        else:
            duration = max(self.KICKS / self.TRAJECTORIES * ready.device.h, 4.0 * ready.burn_in)
        kicks = ready.kicks(duration)
        runs = Runs(ready, paired, kicks, np.random.SeedSequence(self.seed), progress, deadline=deadline)
        if ready.has_controls and self.CONTROLS and not self.alone:
            runs.blocks = max(round((kicks * ready.device.h - ready.burn_in) / BLOCK), 1)
        fewest = fewest_pairs(number(self.within), runs.blocks) if paired else FEWEST
        count = self.trajectories or (self.TRAJECTORIES if target is None else fewest)
        count = max(count, fewest) if paired else count
        asked = kicks if self.duration is None else ready.burn_in / ready.device.h  # a duration is the user's own
        budget = number(self.budget)
        most = self.PATIENCE if budget is None else self.STEPS_A_SECOND * max(budget, self.SHORTEST)
        if asked * count > most:
            instead = "use engine 'ensemble', or " if problem.netlist is None else ""
            raise SimulationError(  # that nobody asked for, and mostly for their burn-in
                f"the ngspice runs would take {asked * count:.1e} steps, as the start is forgotten after "
                f"{ready.burn_in / unit:.3g}{' s' * problem.physical} only: {instead}give fewer `trajectories`, a "
                f"longer `dt` or a `budget` above {asked * count / self.STEPS_A_SECOND:.2g}s"
            )
        runs.more(count)
        return runs
