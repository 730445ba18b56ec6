"""Engine `ensemble`: Monte Carlo of the coupled equations.

Long because the engine explains its options to users.
"""

import dataclasses
import math
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.answers.open_balance import open_balance
from harvester.engines import sampling
from harvester.engines.coexisting_responses import may_have_several, steady_responses
from harvester.engines.driven_motion import driven_motion
from harvester.engines.moment_existence import MomentExistence, existence
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import (
    AnyScene,
    Engine,
    Progress,
    estimate,
    needs_resistance,
    served,
)
from harvester.engines.sampling import Model
from harvester.equations.impact_order import accumulation
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.linear.record_doubts import join_beyond, join_change
from harvester.machine.progress import listening, stage
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.target import Target, added_effort, best_factor
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories

BURN_IN = 0.35  # fraction of the time until the first means are known
OF_PILOT = 0.3  # fraction of the burn-in by the circuit of ideal elements, if there is one
LONG_COMPILATION = 0.5  # seconds of compilation that are worth a word
AT_ONCE = 0.5  # of the seconds that are left: other programs may begin to take theirs meanwhile


@dataclass(frozen=True)
class EnsembleSetup:
    """Trajectories of a ``model`` after their burn-in, with their diagnostics.

    The answer's seconds count from ``begin``, a budget from ``budget_begin`` (`time.perf_counter`):
    compilation is in neither, and loading compiled code is in the budget.
    """

    problem: Problem
    model: Model
    trajectories: "Trajectories"
    diagnostics: list[Diagnostic]
    begin: float
    budget_begin: float
    compilation_seconds: float

    @property
    def unit(self) -> float:
        """The nondimensional time in one unit of the scene's time."""
        return self.problem.units.frequency


class Ensemble(MonteCarloOptions, Engine):
    """Monte Carlo of the fully coupled equations (Eq. 2) with the exact RC update.

    Examples
    --------
    >>> import harvester as hv
    >>> engine = hv.Ensemble(within="1%", seed=1)
    >>> engine.within
    0.01
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> power = engine.run(scene).mean_power
    >>> bool(power.known_error95 <= 0.01 * power.value)
    True

    Parameters
    ----------
    within, budget, seed, duration, trajectories, dt : float or str or int, optional
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    UnboundedResponseError
        if no stationary response exists.
    """

    NAME = "ensemble"
    LOOK = EngineLook(
        "ensemble (exact RC)", "#666666", "s", width=4.0, order=2.0, paler=0.6, trust=4
    )
    samples = True
    has_frequency_response = True
    TRAJECTORIES: ClassVar[int] = sampling.TRAJECTORIES
    SEARCHES: ClassVar[bool] = True  # for other responses to a steady excitation, from many starts
    MODEL_NOTE: ClassVar[str] = ""  # the code of a warning why an error of the model is not stated
    UNKNOWN: ClassVar[str] = ""  # what that error comes from
    # whether that error is measured before the effort is chosen, for which less time is left
    JUDGED_FIRST: ClassVar[bool] = False
    BEYOND: ClassVar[str] = ""  # the code of a warning that the error is larger than the target

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the engine does not support a problem; None if it can."""
        return needs_resistance(problem, cls.NAME)

    def model(self, problem: Problem) -> Model:
        """The simulation for a problem that the engine supports."""
        eqs = problem.equations
        return Model(eqs, None, "V2", (eqs.beta or 0.0) * (eqs.load or 0.0))

    def model_errors(
        self, problem: Problem, pair: "RichardsonPair", begin: float
    ) -> tuple[dict[str, float], str]:
        """Relative model error by moments, none if they are not known, and the code of a note on them."""
        return {}, self.MODEL_NOTE

    def late_model_errors(
        self, problem: Problem, pair: "RichardsonPair", left: float
    ) -> tuple[dict[str, float], str]:
        """The same after sampling, if they are not known, within the seconds ``left``."""
        return {}, self.MODEL_NOTE

    def pilot(self, problem: Problem, trajectories: "Trajectories") -> "Trajectories":
        """The trajectories, compiled, that burn in: these, or cheaper ones in whose states these begin."""
        return trajectories

    def not_covered(
        self, problem: Problem, pair: "RichardsonPair"
    ) -> tuple[str, Diagnostic | None]:
        """The unknown part of a mean's error if averages lack a part of the response, and its warning."""
        return "", None

    def cover(self, problem: Problem, pair: "RichardsonPair", begin: float) -> None:
        """Average for longer if a response repeats slowly and a budget since ``begin`` allows it."""

    def remark(self, code: str) -> Diagnostic | None:
        """The statement of the model's error: a warning if it is not known."""
        return (warning if code == self.MODEL_NOTE else note)(code) if code else None

    def _towards(
        self,
        problem: Problem,
        sampler: "EnsembleSampler",
        exists: MomentExistence,
        within: float | None,
    ) -> tuple[tuple[dict[str, float], str], list[Diagnostic | None]]:
        """Sample for a target, if there is one: `model_errors`, and the diagnostics."""
        setup = sampler.setup
        name = setup.model.name
        judge = partial(self.model_errors, problem, sampler.pair, setup.budget_begin)
        if within is None:
            return judge(), []
        known = judge() if self.JUDGED_FIRST else None
        join = join_change(problem.equations)
        obstacle = exists.obstacle(within) or join_beyond(problem.equations, within)
        said: list[Diagnostic | None] = []
        beyond = known is not None and known[0].get(name, 0.0) > within
        if obstacle is None and not (beyond and self.GIVES_UP):
            budget = number(self.budget)
            target = Target(within, budget, setup.budget_begin, gives_up=self.GIVES_UP)
            target.leave(join + (known[0].get(name, 0.0) if known is not None else 0.0))
            obstacle = sampling.refine(sampler, target)
            said.append(sampler.effort(within))
        known = known or judge()
        if self.JUDGED_FIRST and not known[0]:
            left = setup.budget_begin + (number(self.budget) or 0.0) - time.perf_counter()
            known = self.late_model_errors(problem, sampler.pair, left)
        return known, [*said, obstacle, self._missed(within, known[0].get(name, 0.0))]

    def _missed(self, within: float | None, error: float) -> Diagnostic | None:
        """A warning if the model's error is larger than the target."""
        if within is None or error <= within or not self.BEYOND:
            return None
        return warning(self.BEYOND, within=within, error=error)

    def pair_diagnostic(self, pair: "RichardsonPair") -> Diagnostic | None:
        """The objection of the trajectories to their means; None if there is none."""
        return None

    @property
    def runs_together(self) -> bool:
        """Whether scenes of the same effects may run side by side, as `run_many` does."""
        return True

    def many_at_once(self, problem: Problem) -> int:
        """How many scenes like this one `run_many` runs side by side."""
        from harvester.engines.many_designs import many_at_once

        return many_at_once(self, problem)

    def run_many(
        self, scenes: Sequence[AnyScene], seeds: Sequence[int] | None = None
    ) -> list[Estimate | HarvesterError]:
        """`run` for each scene, or the error that it raises; like scenes run side by side."""
        from harvester.engines.many_designs import run_many

        return run_many(self, scenes, [self.seed] * len(scenes) if seeds is None else seeds)

    def remarked(self, answer: Estimate, problem: Problem) -> Estimate:
        """The answer with the diagnostics of its circuit."""
        return answer

    def looked_into(self, answer: Estimate, problem: Problem, pair: "RichardsonPair") -> Estimate:
        """The answer with further quantities of a circuit, if they are asked for."""
        return answer

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """Burn in until transients have died out, then average over time and trajectories."""
        problem = served(type(self), scene)
        self.check_times(problem.physical)
        exists = existence(problem)
        with listening(progress):
            with stage(0.0, BURN_IN):
                setup = self._set_up(problem)
            with stage(BURN_IN, 1.0):
                sampler = self._first_samples(setup, progress)
        searched = (
            self.SEARCHES
            and may_have_several(problem)
            and (self.budget, self.trajectories, self.duration) == (None, None, None)
        )
        candidates = (
            steady_responses(problem, setup.model, self.seed, self.NAME, self.UNKNOWN)
            if searched
            else ()
        )
        responses = tuple(candidate.response for candidate in candidates)
        steady, moments = problem.equations.is_steady, sampler.pair.moments
        agreed = sampling.agreement(moments, setup.model.name, responses) if steady else None
        diagnostics = [exists.warning, accumulation(problem.equations), *setup.diagnostics]
        within = number(self.within)
        (errors, remark), said = self._towards(problem, sampler, exists, within)
        diagnostics += said
        between = None if setup.trajectories.hopping is None else note("between_wells")
        diagnostics += [self.remark(remark), between, agreed, self.pair_diagnostic(sampler.pair)]
        if problem.equations.load is None and setup.model.circuit is None:
            diagnostics.append(warning("open_circuit"))
        exact = agreed is not None and agreed.severity == "note"
        uncovered, why = self.not_covered(problem, sampler.pair)
        diagnostics.append(why)
        v2, power = (
            sampling.with_model(sampler.mean(name, exact), errors.get(name), self.UNKNOWN)
            .with_unknown(exists.unknown)
            .with_unknown(uncovered)
            .scaled(factor)
            for name, factor in (("V2", 1.0), (setup.model.name, setup.model.factor))
        )
        details = sampler.details()
        steps = sampler.pair.steps
        seconds = time.perf_counter() - setup.begin
        diagnostics.append(sampler.open_balance(details))
        answer = estimate(
            self.NAME,
            problem,
            v2,
            power,
            diagnostics,
            seconds,
            steps=steps,
            details=details,
            samples=sampler.pair.entries("V2"),
            power_samples=sampler.pair.entries(setup.model.name) * setup.model.factor,
        )
        return self.looked_into(
            dataclasses.replace(answer, responses=responses), problem, sampler.pair
        )

    def _set_up(self, problem: Problem) -> EnsembleSetup:
        """Trajectories that are compiled, have their step, and have burnt in."""
        from harvester.mechanics.ensemble.compiled_pair import compile_pair, is_compiled
        from harvester.mechanics.ensemble.trajectories import Trajectories
        from harvester.mechanics.kernels.compiled import Compilation, compilation, machine_code

        model = self.model(problem)
        unit = problem.units.frequency
        seed = np.random.SeedSequence(self.seed)
        begin = time.perf_counter()
        within = number(self.within) if self.CONTROLS else None
        count = self.trajectories or sampling.affordable(model.eqs.is_steady, model.circuit, within)
        if model.eqs.density is not None:
            count = max(count, sampling.FEWEST_DRAWN if self.trajectories else sampling.DRAWN)
        trajectories = Trajectories(
            model.eqs, count, seed, self.step(unit), circuit=model.circuit, controlled=self.CONTROLS
        )
        known = is_compiled(trajectories)
        code = 0 if known else machine_code()
        with nullcontext(Compilation()) if known else compilation() as first:
            compile_pair(trajectories, number(self.budget))
            pilot = self.pilot(problem, trajectories)
        begin += first.seconds
        # no new code: all was loaded
        compiled = first.seconds if code and code == machine_code() else 0.0
        with stage(0.0, 1.0 if pilot is trajectories else OF_PILOT):
            diagnostics = sampling.run_burn_in(pilot, problem, number(self.budget), within)
        if pilot is not trajectories:
            from harvester.circuits.beside_ideal import settle_from

            with stage(OF_PILOT, 1.0):
                settle_from(trajectories, pilot, number(self.budget), begin - compiled)
        return EnsembleSetup(
            problem=problem,
            model=model,
            trajectories=trajectories,
            diagnostics=diagnostics,
            begin=begin,
            budget_begin=begin - compiled,
            compilation_seconds=first.seconds,
        )

    def _first_samples(self, setup: EnsembleSetup, progress: Progress | None) -> "EnsembleSampler":
        """The first averages, together with others of twice the step."""
        from harvester.mechanics.ensemble.richardson import RichardsonPair

        budget = number(self.budget)
        spent = time.perf_counter() - setup.budget_begin
        duration = sampling.first_duration(setup.trajectories.time, spent, budget)
        if self.within is not None and setup.model.is_compiled:
            duration *= sampling.FIRST
        if self.duration is not None:
            duration = (number(self.duration) or 0.0) * setup.unit
        pair = RichardsonPair(setup.trajectories, duration, budget)
        self.cover(setup.problem, pair, setup.budget_begin)
        return EnsembleSampler(setup, pair, number(self.dt), progress)


@dataclass
class EnsembleSampler:
    """Averages over trajectories, which continue at the best step for a target.

    ``dt`` is a step that is fixed.
    """

    setup: EnsembleSetup
    pair: "RichardsonPair"
    dt: float | None
    progress: Progress | None

    def mean(self, name: str, exact: bool) -> Value:
        """One moment's mean; ``exact``: without a sampling error."""
        return sampling.mean_with_errors(self.pair, name, exact)

    def power_so_far(self) -> Value:
        """The mean of the moment that the power is made of."""
        return self.mean(self.setup.model.name, exact=False)

    @property
    def sampling_seconds(self) -> float:
        """The seconds of averaging for the present duration, by the rate of the last part."""
        return self.pair.seconds_a_unit * self.pair.averaged

    def improve(self, target: Target) -> Diagnostic | None:
        """Begin again at a better step, or continue at this one; or state why neither reaches the target."""
        value = self.power_so_far()
        if (value.model or 0.0) > target.within * abs(value.value):
            return warning("within_between_wells", within=target.within)
        bias, bias_error = self.pair.relative_bias(self.setup.model.name)
        factor = best_factor(target.room, abs(bias), bias_error, self.pair.order)
        if factor < 1.0 and self.dt is not None:
            return warning("needs_smaller_step", within=target.within, dt=self.dt)
        if factor != 1.0 and self.dt is None:
            return self._change_step(factor, target, value)
        if self.pair.extrapolates_in_vain(self.setup.model.name, target.room):
            self.pair.stop_coarse()
            return None
        if bias_error < sampling.KNOWN * target.room and not self.pair.extrapolates:
            self.pair.stop_coarse()
        return self._extend(target, value)

    def _change_step(self, factor: float, target: Target, value: Value) -> Diagnostic | None:
        """Begin again at ``factor`` times the step, if the time is left for that."""
        if target.seconds_left < (time.perf_counter() - target.begin) / factor:
            return warning("target_missed", **target.shortfall(value))
        if self.progress is not None:
            self.progress(0.0)
        self.pair = self.pair.with_step(factor * self.pair.trajectories.h)
        return None

    def _extend(self, target: Target, value: Value) -> Diagnostic | None:
        """Average for longer, if the time is left for that."""
        pair = self.pair
        variance = target.variance(value)
        needed = (
            pair.averaged * (value.stderr or 0.0) ** 2 / variance if variance > 0.0 else math.inf
        )
        more = min(
            added_effort(pair.averaged, needed), AT_ONCE * target.seconds_left / pair.seconds_a_unit
        )
        if more < 0.02 * pair.duration:
            return warning("target_missed", **target.shortfall(value))
        if self.progress is not None:
            self.progress(min(pair.duration / needed, 1.0))
        pair.extend(more)
        return None

    def effort(self, within: float) -> Diagnostic:
        """The note that shows the choice for a target."""
        setup = self.setup
        return sampling.step_and_effort(
            self.pair, setup.model.name, within, setup.unit, setup.problem.physical
        )

    def open_balance(self, details: dict[str, float]) -> Diagnostic | None:
        """The warning of a power balance among the details that is not closed; None without one."""
        if "power_balance" not in details:
            return None
        names = "power_balance", "power_balance_stderr", "power_balance_bias"
        balance, stderr, bias = (details[name] for name in names)
        entries = self.setup.trajectories.count // self.setup.trajectories.together
        return open_balance(Value(balance, stderr, bias, dof=entries - 1.0))

    def details(self) -> dict[str, float]:
        """The numbers of the run, and if the equations have no circuit, its power balance."""
        pair, setup = self.pair, self.setup
        times = {"step": pair.trajectories.h, "burn_in": pair.burn_in, "duration": pair.duration}
        details: dict[str, float] = {name: time / setup.unit for name, time in times.items()}
        details["trajectories"] = setup.trajectories.count
        if setup.compilation_seconds > LONG_COMPILATION:
            details["compilation_seconds"] = setup.compilation_seconds
        details |= driven_motion(setup.problem, pair)
        if pair.trajectories.loaded.balances:
            moments = pair.moments.averaged(setup.trajectories.together)
            eqs = setup.model.eqs
            details["power_balance"], details["power_balance_stderr"] = sampling.power_balance(
                moments, eqs
            )
            details["power_balance_bias"] = sampling.power_balance_bias(pair, eqs)
        return details
