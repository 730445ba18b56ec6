"""Engine `ensemble`: Monte Carlo of the coupled equations."""

import dataclasses
import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.engines.agreement import NO_NOISE, disagreement
from harvester.engines.coexisting_responses import may_have_several, steady_responses
from harvester.engines.model import Model
from harvester.engines.moment_existence import existence
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.power_balance import power_balance, power_balance_bias
from harvester.engines.protocol import OPEN_CIRCUIT, AnyScene, Engine, Progress, estimate, needs_resistance, served
from harvester.engines.settling import BETWEEN, HALF, settle
from harvester.equations.problem import Problem
from harvester.errors import names_arguments
from harvester.machine.folders import machine_code
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.target import Target, best_factor, further
from harvester.uncertainty.value import NORMAL_QUANTILE, Value

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.rectifiers.circuit import IdealCircuit

TOLD = 0.5  # seconds of compilation that are worth a word
KNOWN = 0.1  # of the target: a bias that is known so well needs no further measurement
TRAJECTORIES, FEWEST = 4096, 256
PURSUING = 512  # trajectories at first towards a target above `FINE`: the effort grows by their duration
FINE = 1e-3
DRAWN, FEWEST_DRAWN = 1024, 128  # trajectories on records of tabulated noise: 64 of them are one independent entry
LOOSE, LEAST = 0.01, 128  # target from which on so few trajectories do: their burn-in is most of what it costs
AT_ONCE = 0.5  # of the seconds that are left: other programs may begin to take theirs meanwhile
LEAST_SHARE = 0.125  # of the burn-in's time that is averaged, whatever the budget
CHARGING = 300.0  # time constant of a capacitor beyond which it is charged by fewer trajectories


@names_arguments
@dataclass(frozen=True, kw_only=True)
class Ensemble(MonteCarloOptions, Engine):
    """Monte Carlo of the fully coupled equations (Eq. 2) with the exact RC update.

    >>> import harvester as hv
    >>> engine = hv.Ensemble(within="1%", seed=1)
    >>> engine.within
    0.01
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> power = engine.run(scene).mean_power
    >>> bool(power.known_error95 <= 0.01 * power.value)
    True

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    UnboundedResponseError
        where no stationary response exists.
    """

    NAME: ClassVar[str] = "ensemble"
    LOOK: ClassVar[EngineLook] = EngineLook(
        "ensemble (exact RC)", "#999999", "s", width=4.0, order=2.0, paler=0.6, trust=4
    )
    samples: ClassVar[bool] = True
    has_frequency_response: ClassVar[bool] = True
    TRAJECTORIES: ClassVar[int] = TRAJECTORIES
    REASON: ClassVar[str] = ""  # why an error of the model is not stated
    UNKNOWN: ClassVar[str] = ""  # what that error comes from

    @classmethod
    def refusal(cls, problem: Problem) -> str:
        """Why the engine cannot serve a problem; empty where it can."""
        return needs_resistance(problem, cls.NAME)

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """Burn in until the start is forgotten, then average over time and trajectories."""
        from harvester.mechanics.ensemble.richardson import RichardsonPair, compile_pair
        from harvester.mechanics.ensemble.trajectories import Trajectories
        from harvester.mechanics.kernels.compiled import compilation

        problem = served(type(self), scene)
        self.check_times(problem.physical)
        exists = existence(problem)
        what = self.model(problem)
        eqs, circuit = what.eqs, what.circuit
        unit = problem.units.frequency
        seed = np.random.SeedSequence(self.seed)
        h = None if self.dt is None else (number(self.dt) or 0.0) * unit
        code, begin = machine_code(), time.perf_counter()
        count = self.trajectories or affordable(eqs.is_steady, circuit, number(self.within) if self.CONTROLS else None)
        if eqs.density is not None:
            count = max(count, FEWEST_DRAWN if self.trajectories else DRAWN)
        trajectories = Trajectories(eqs, count, seed, h, circuit=circuit, controlled=self.CONTROLS)
        with compilation() as first:
            compile_pair(trajectories)
        only_loaded = 0 < code == machine_code()  # nothing was compiled
        begin += first.seconds  # which are not counted
        loaded = begin - first.seconds * only_loaded  # from when the budget counts
        warnings = exists.warnings + settle(trajectories, problem, number(self.budget))
        if progress is not None:
            progress(0.0)  # here the clock begins: what compiling and settling took says nothing of the rest
        spent = time.perf_counter() - loaded
        duration = first_duration(trajectories.time, spent, number(self.budget))
        duration = duration if self.duration is None else (number(self.duration) or 0.0) * unit
        pair = RichardsonPair(trajectories, duration, number(self.budget))
        reasons = [self.REASON, HALF if trajectories.hopping else ""]
        several = may_have_several(problem) and (self.budget, self.trajectories, self.duration) == (None, None, None)
        found = steady_responses(problem, what, self.seed, self.NAME, self.UNKNOWN) if several else ()
        responses = tuple(one.response for one in found)
        agreed = disagreement(pair.moments, what.name, responses) if eqs.is_steady else None
        if agreed is not None:
            (reasons if agreed == NO_NOISE else warnings).append(agreed)
        within = number(self.within)
        if within is not None and exists.can_reach(within, warnings):
            pair = self._sequential_sampling(
                pair, what, Target(within, number(self.budget), loaded), warnings, progress
            )
            reasons.insert(0, f"`within` {within:.3g} chose {step_and_effort(pair, what.name, unit, problem.physical)}")
        seconds, exact = time.perf_counter() - begin, agreed == NO_NOISE
        if eqs.mu is None and circuit is None:
            warnings.append(OPEN_CIRCUIT)
        details = {"step": pair.trajectories.h / unit, "burn_in": pair.burn_in / unit, "duration": pair.duration / unit}
        details["trajectories"] = trajectories.count
        if first.seconds > TOLD:
            details["compilation_seconds"] = first.seconds
        if circuit is None:
            details["power_balance"], details["power_balance_stderr"] = power_balance(
                pair.moments.averaged(trajectories.together), eqs
            )
            details["power_balance_bias"] = power_balance_bias(pair, eqs)
        answer = estimate(
            self.NAME,
            problem,
            mean_with_errors(pair, "V2", exact).with_unknown(self.UNKNOWN).with_unknown(exists.unknown),
            mean_with_errors(pair, what.name, exact)
            .scaled(what.factor)
            .with_unknown(self.UNKNOWN)
            .with_unknown(exists.unknown),
            seconds,
            pair.steps,
            "; ".join(reason for reason in reasons if reason),
            tuple(warnings),
            details,
            pair.entries("V2"),
            pair.entries(what.name) * what.factor,
        )
        return dataclasses.replace(answer, responses=responses)

    def model(self, problem: Problem) -> Model:
        """What is simulated for a problem that the engine serves."""
        eqs = problem.equations
        return Model(eqs, None, "V2", (eqs.beta or 0.0) * (eqs.mu or 0.0))

    def _sequential_sampling(
        self, pair: "RichardsonPair", model: Model, target: Target, warnings: list[str], progress: Progress | None
    ) -> "RichardsonPair":
        """Go on, at the step that is best for the target, until it is reached or the budget is spent."""
        while True:
            value = mean_with_errors(pair, model.name)
            if target.reached(value):
                return pair
            if (value.model or 0.0) > target.within * abs(value.value):
                warnings.append(f"`within` {target.within:.3g} cannot be promised: {BETWEEN}")
                return pair
            bias, bias_error = pair.relative_bias(model.name)
            factor = best_factor(target.within, abs(bias), bias_error)
            seconds = time.perf_counter() - target.begin
            if factor < 1.0 and self.dt is not None:
                warnings.append(f"`within` {target.within:.3g} needs a step below `dt` {self.dt:g}")
                return pair
            if factor != 1.0 and self.dt is None:
                if target.seconds_left < seconds / factor:
                    warnings.append(target.missed(value))
                    return pair
                if progress is not None:
                    progress(0.0)
                pair = pair.with_step(factor * pair.trajectories.h)
                continue
            if bias_error < KNOWN * target.within:
                pair.stop_coarse()
            variance = target.variance(value)
            needed = pair.duration * (value.stderr or 0.0) ** 2 / variance if variance > 0.0 else math.inf
            more = min(further(pair.duration, needed), AT_ONCE * target.seconds_left / pair.seconds_a_unit)
            if more < 0.02 * pair.duration:
                warnings.append(target.missed(value))
                return pair
            if progress is not None:
                progress(min(pair.duration / needed, 1.0))
            pair.extend(more)


def affordable(steady: bool, circuit: "IdealCircuit | None", within: float | None = None) -> int:
    """Trajectories by default, between `FEWEST` and `TRAJECTORIES`: what each does before it counts is lost.

    Few where nothing is random, where each must wait long for a large capacitor, and where no more are needed for an
    error of ``within``: `PURSUING` with controls come to about `FINE` in the time of their burn-in, `LEAST` to `LOOSE`.
    """
    if steady or (within is not None and within >= LOOSE):
        return FEWEST if steady else LEAST
    share = 1.0 if circuit is None else min(CHARGING / circuit.memory, 1.0)
    if within is not None:
        share *= min(PURSUING / TRAJECTORIES * max(FINE / within, 1.0) ** 2, 1.0)
    return max(round(share * TRAJECTORIES), FEWEST)


def first_duration(burn_in: float, spent: float, budget: float | None) -> float:
    """The time of the first averages: that of the burn-in, or less where the budget does not leave so much.

    Beside them go trajectories of twice the step, which have the burn-in to make up for.
    """
    if budget is None:
        return burn_in
    left = ((budget - spent) / spent - 0.5) / 1.5
    return burn_in * min(max(left, LEAST_SHARE), 1.0)


def mean_with_errors(pair: "RichardsonPair", name: str, exact: bool = False) -> Value:
    """One moment's mean with its errors of sampling, unless it is ``exact``, and step; and of wells that are apart."""
    hops, bias = pair.trajectories.hopping, abs(pair.bias(name)[0])
    if hops is not None:
        every, together = getattr(pair.moments, name), pair.trajectories.together
        return dataclasses.replace(hops.mean(pair.entries(name) if together == 1 else every, together), bias=bias)
    mean, error = pair.mean(name)
    dof = None if pair.trajectories.together == 1 else len(pair.entries(name)) - 1.0
    return Value(mean, None if exact else error, bias, dof=dof)


def step_and_effort(pair: "RichardsonPair", name: str, unit: float, physical: bool) -> str:
    """What was chosen, and why."""
    bias, error = pair.relative_bias(name)
    second = " s" if physical else ""
    return (
        f"a step of {pair.trajectories.h / unit:.3g}{second}, whose bias is {bias:.2%} +- "
        f"{NORMAL_QUANTILE * error:.2%}, measured against twice the step on the same noise, and "
        f"{pair.duration / unit:.3g}{second} of {pair.trajectories.count} trajectories, for the spread of their means"
    )
