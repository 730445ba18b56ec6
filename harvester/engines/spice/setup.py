"""What engine `spice` needs before its first ngspice run: circuit, step, burn-in, and the cheap model beside it."""

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from harvester.engines.ensemble import DRAWN, FINE, KNOWN, affordable, first_duration, step_and_effort
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.settling import settle
from harvester.equations.effects import RULE, unknown_to
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.errors import invalid
from harvester.uncertainty.target import Target, best_factor

if TYPE_CHECKING:
    from harvester.cosimulation.runs import CoupledDevice, Start
    from harvester.mechanics.ensemble.richardson import RichardsonPair

LONGEST_CHARGING = 2e4  # nondimensional
MEMORIES = 2.0  # time constants of the slowest change, of a burn-in from settled states
SHARE = 0.5  # of the budget, for the cheap model at most: the rest is for ngspice
READING = 0.4  # nondimensional time between readings: V^2 varies on the scale of 1


@dataclass(frozen=True)
class SpiceSetup:
    """What runs, and what is known of it before.

    ``burn_in`` is nondimensional; ``pair`` is the cheap model of the same device, settled, which makes the same steps
    (None where no circuit of ideal elements serves); ``seconds`` is what all this took, without compilation;
    ``starts`` are states of that model, from which runs begin near their stationary law (None: at rest, which takes a
    ``burn_in_from_rest``); ``unknown`` is a part of every mean's error that nothing tells.
    """

    device: "CoupledDevice"
    burn_in: float
    warnings: list[str]
    pair: "RichardsonPair | None"
    seconds: float
    starts: "list[Start] | None" = None
    burn_in_from_rest: float = 0.0
    unknown: str = ""

    def from_rest(self) -> "SpiceSetup":
        """The same, with runs that begin at rest and burn in for longer."""
        return replace(self, burn_in=self.burn_in_from_rest, starts=None)

    @property
    def resistive(self) -> bool:
        """Whether the load is a resistance of the equations, and no netlist."""
        return self.device.eqs.mu is not None

    @property
    def has_controls(self) -> bool:
        """Whether the noise makes sums of mean zero from step to step."""
        return self.device.eqs.has_new_noise

    @property
    def quantity(self) -> str:
        """The moment that the power is made of."""
        return "V2" if self.resistive else "load"

    def relative_bias(self, name: str) -> float | None:
        """Of the step, as the cheap model shows it; None where there is none."""
        return None if self.pair is None else abs(self.pair.relative_bias(name)[0])

    def known(self, tolerance: dict[str, float] | None, followed: int = 0) -> str:
        """What is known of the bias of the step, where it is not that of the very same equations.

        ``tolerance`` are the errors by ngspice's tolerance, None where they were not measured; ``followed`` the runs of
        ngspice beside which others made twice the step.
        """
        if self.resistive:
            return ""
        if self.pair is None and not followed:
            return "the bias of the step is not known, as no ideal circuit serves: compare with half of `dt`"
        measured = "was measured against a tenth of it on the same motion"
        if tolerance is None:
            measured = "was not measured (for want of time, or as a warning says)"
        step = "that of the ideal circuit"
        if self.pair is None:
            step = (
                f"the most that {followed} runs of ngspice and those of twice the step on the same noise leave at 95 %"
            )
        return (
            f"the bias of the step is {step}, that of ngspice's tolerance {measured}; "
            "the ledger is of the ngspice runs alone"
        )

    def kicks(self, duration: float) -> int:
        """Steps of a trajectory of that nondimensional duration after its burn-in.

        They make whole readings and periods of the shaking, and are an even number.

        Raises InputError for more than one trajectory may make.
        """
        from harvester.mechanics.ensemble.trajectories import MOST_STEPS

        if duration > MOST_STEPS * self.device.h:
            found = f"{duration / self.device.h:.3g} steps"
            raise invalid("`duration`", f"be at most {MOST_STEPS:.0e} steps", found)
        device, repeat = self.device, self.device.eqs.shaking_period
        whole = math.lcm(device.stride, 2) if repeat is None else round(repeat / device.h)
        return math.ceil((self.burn_in + duration) / device.h / whole - 1e-6) * whole

    def chosen(self, unit: float, physical: bool) -> str:
        """The step, and why."""
        if self.pair is None:
            return f"a step of {self.device.h / unit:.3g}{' s' if physical else ''}"
        return step_and_effort(self.pair, self.quantity, unit, physical)


def prepare(
    problem: Problem, options: MonteCarloOptions, reltol: float = 1e-4, gaussian: bool = False, settled: bool = False
) -> SpiceSetup:
    """Step, burn-in and bias come from an ensemble: with a load resistor, or ideal elements, it makes the same steps.

    Where runs may begin ``settled``, in states of the circuit of ideal elements, the burn-in is `MEMORIES` of the
    response or of the charging: the circuits differ by little, and controls take what is left of that.

    MissingProgramError when ngspice is not installed.
    """
    from harvester.cosimulation.idealised import ideal_circuit
    from harvester.cosimulation.ngspice.locate_libngspice import find_library
    from harvester.cosimulation.runs import CoupledDevice
    from harvester.mechanics.ensemble.burn_in import CHARGING_TIMES, memory
    from harvester.mechanics.ensemble.richardson import RichardsonPair, compile_pair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.compiled import compilation

    find_library()
    eqs, s, unit, circuit = problem.equations, problem.scales, problem.units.frequency, problem.circuit
    assert circuit is not None, "the engine refuses an open circuit"
    repeat = eqs.shaking_period
    charging = CHARGING_TIMES * (circuit.storage or 0.0) * s.frequency
    ideal = ideal_circuit(circuit, s) if charging <= LONGEST_CHARGING else None
    ngspice_rule = unknown_to(RULE).isdisjoint(problem.effects) and eqs.mu is not None
    seed, h = np.random.SeedSequence([options.seed, 1]), None if options.dt is None else options.dt * unit
    begin = time.perf_counter()
    many = None if options.within is None else FINE  # for they weigh the controls of few runs
    count = max(affordable(eqs.is_steady, ideal, many), 0 if eqs.density is None else DRAWN)
    pilot = Trajectories(eqs, count, seed, h, circuit=ideal, ngspice_rule=ngspice_rule, controlled=True)
    with compilation() as compiling:
        compile_pair(pilot)
    begin += compiling.seconds  # which are not counted
    warnings = settle(pilot, problem, number(options.budget))
    time_of_burn_in = max(pilot.time, min(charging, LONGEST_CHARGING))
    if charging > LONGEST_CHARGING:
        warnings.append(
            f"burn-in stopped at {time_of_burn_in / unit:g} before the load's capacitor was charged: "
            f"Rload Csmooth = {circuit.storage:g} s"
        )
    if repeat is not None:
        time_of_burn_in = repeat * math.ceil(time_of_burn_in / repeat - 1e-6)
    pair: RichardsonPair | None = None
    if eqs.mu is not None or ideal is not None:
        budget, spent = number(options.budget), time.perf_counter() - begin
        first = first_duration(time_of_burn_in, spent, None if budget is None else SHARE * budget)
        pair = RichardsonPair(pilot, first, budget)
        if (within := number(options.within)) is not None:
            target = Target(within, None if budget is None else SHARE * budget, begin)
            pair = _with_best_step(pair, "load", target, options.dt is not None)
            pilot = pair.trajectories
    stride = max(1, round(READING / pilot.h)) if repeat is None else pilot.stride
    device = CoupledDevice(
        eqs, s, circuit, pilot.h, stride, reltol=reltol, gaussian=gaussian, ideal=ideal, ngspice_rule=ngspice_rule
    )
    starts, from_rest = None, time_of_burn_in
    if settled and ideal is not None and pair is not None and eqs.is_random and not eqs.is_shaken_otherwise:
        slowest = max(memory(pilot, pair.moments, pair.duration), charging / CHARGING_TIMES)
        time_of_burn_in = min(MEMORIES * slowest, from_rest)
        rng = np.random.default_rng(np.random.SeedSequence([options.seed, 3]))
        states = np.moveaxis(pilot.state[:, :4], 1, 2).reshape(-1, 4)
        starts = [(float(x), float(v), float(V), float(U)) for x, v, V, U in rng.permutation(states)]
    unknown = "" if pilot.hopping is None else "the share of each well"
    return SpiceSetup(device, time_of_burn_in, warnings, pair, time.perf_counter() - begin, starts, from_rest, unknown)


def stand_in(s: Scales) -> str:
    """Which device stands in for a nondimensional scene."""
    return (
        f"ngspice ran on a device of {s.mass:g} kg, w0 = {s.frequency:g} rad/s, Cp = {s.capacitance:g} F, "
        f"theta = {s.coupling:.4g} N/V; results are nondimensional"
    )


def _with_best_step(pair: "RichardsonPair", name: str, target: Target, fixed: bool) -> "RichardsonPair":
    """The pair with its bias known well enough for the target, at a smaller step where that is called for.

    A longer step would save little of the few ngspice runs that are needed.
    """
    while True:
        bias, error = pair.relative_bias(name)
        factor = 1.0 if fixed else best_factor(target.within, abs(bias), error)
        if error < KNOWN * target.within:
            pair.stop_coarse()
        if factor < 1.0:
            pair = pair.with_step(factor * pair.trajectories.h)
        elif error < 0.25 * target.within or target.seconds_left < pair.seconds_a_unit * pair.duration:
            return pair
        else:
            pair.extend(pair.duration)
