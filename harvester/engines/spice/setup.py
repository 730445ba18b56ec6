"""What engine `spice` needs before its first ngspice run: circuit, step, burn-in, and the cheap model beside it.

Long because step, burn-in, cheap model and starts of the runs depend on each other.
"""

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.sampling import (
    DRAWN,
    FINE,
    KNOWN,
    LOOSE,
    affordable,
    first_duration,
    run_burn_in,
    step_and_effort,
)
from harvester.equations.effects import RULE, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import UnboundedResponseError, invalid
from harvester.netlists.probes import Probe
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.messages.unknown_parts import WELLS
from harvester.uncertainty.target import Target, best_factor

if TYPE_CHECKING:
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.cosimulation.runs import CoupledDevice, Start
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.ideal_circuit import IdealCircuit

LONGEST_CHARGING = 2e4  # nondimensional
LONGEST_COMPILED = 4e3  # where a compiled circuit goes beside
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
    diagnostics: list[Diagnostic]
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

    def biases(self, tolerance_measured: bool, followed: int) -> Diagnostic | None:
        """What is known of the bias of the step, where it is not that of the very same equations.

        ``followed`` are the runs of ngspice beside which others made twice the step.
        """
        if self.resistive:
            return None
        known = {"cheap_model": self.pair is not None, "tolerance_measured": tolerance_measured}
        return note("biases", followed=followed, **known)

    def n_steps(self, duration: float) -> int:
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

    def chosen(self, within: float, unit: float, physical: bool) -> Diagnostic:
        """The step that was chosen for a target, and why."""
        if self.pair is None:
            return note("step_chosen", within=within, step=self.device.h / unit, physical=physical)
        return step_and_effort(self.pair, self.quantity, within, unit, physical)


def set_up(
    problem: Problem,
    options: MonteCarloOptions,
    reltol: float = 1e-4,
    gaussian: bool = False,
    settled: bool = False,
    probes: tuple[Probe, ...] = (),
) -> SpiceSetup:
    """Step, burn-in and bias come from an ensemble: with a load resistor, or ideal elements, it makes the same steps.

    Where runs may begin ``settled``, they begin in states of the circuit of ideal elements (`_settled_starts`).

    MissingProgramError when ngspice is not installed.
    """
    from harvester.cosimulation.cheap_circuit import cheap_circuit
    from harvester.cosimulation.idealised import ideal_circuit
    from harvester.cosimulation.ngspice.locate_libngspice import find_library
    from harvester.cosimulation.runs import CoupledDevice
    from harvester.mechanics.ensemble.burn_in import CHARGING_TIMES, CORRELATION_TIMES, TRANSIENTS, slowest_transient

    find_library()
    eqs, scales, unit, circuit = problem.equations, problem.scales, problem.units.frequency, problem.circuit
    assert circuit is not None, "the engine refuses an open circuit"
    repeat = eqs.shaking_period
    charging = CHARGING_TIMES * (circuit.storage or 0.0) * scales.frequency
    # ngspice finds a periodic response itself, and a long charging takes a compiled circuit minutes.
    itself = (repeat is not None and not eqs.is_random) or charging > LONGEST_COMPILED
    cheap = ideal_circuit if itself else cheap_circuit
    ideal = cheap(circuit, scales) if charging <= LONGEST_CHARGING and eqs.mu is None else None
    ngspice_rule = unknown_to(RULE).isdisjoint(problem.effects) and eqs.mu is not None
    begin = time.perf_counter()
    pilot, compilation_seconds = _pilot(problem, options, ideal, ngspice_rule)
    begin += compilation_seconds  # which are not counted
    try:
        diagnostics = run_burn_in(pilot, problem, number(options.budget))
    except UnboundedResponseError as error:
        if ideal is None:
            raise
        feeds = "in the netlist, look for a negative capacitor or resistor, or a controlled source, that feeds it"
        raise UnboundedResponseError(f"{error}; {feeds}") from None
    settled_after = pilot.time
    if eqs.is_steady and (slowest := slowest_transient(eqs)):  # others of the pilot's starts may take longer
        settled_after = min(settled_after, TRANSIENTS * CORRELATION_TIMES * slowest)
    from_rest = max(settled_after, min(charging, LONGEST_CHARGING))
    if charging > LONGEST_CHARGING:
        diagnostics.append(warning("charging_cut_short", time=from_rest / unit, storage=circuit.storage))
    from_rest = _whole_periods(from_rest, repeat)
    pair: RichardsonPair | None = None
    if eqs.mu is not None or ideal is not None:
        pair = _cheap_model(pilot, from_rest, options, begin)
        pilot = pair.trajectories
    burn_in, starts = from_rest, None
    if settled and ideal is not None and pair is not None and eqs.is_random and not eqs.is_shaken_otherwise:
        burn_in, starts = _settled_starts(pair, charging / CHARGING_TIMES, from_rest, options.seed)
    device = CoupledDevice(
        eqs,
        scales,
        circuit,
        pilot.h,
        max(1, round(READING / pilot.h)) if repeat is None else pilot.stride,
        reltol=reltol,
        gaussian=gaussian,
        ideal=ideal,
        ngspice_rule=ngspice_rule,
        probes=probes,
    )
    unknown = "" if pilot.hopping is None else WELLS
    seconds = time.perf_counter() - begin
    return SpiceSetup(device, burn_in, diagnostics, pair, seconds, starts, from_rest, unknown)


def _whole_periods(time: float, period: float | None) -> float:
    """A time rounded up to whole periods of the shaking, where it has one."""
    return time if period is None else period * math.ceil(time / period - 1e-6)


def _pilot(
    problem: Problem, options: MonteCarloOptions, ideal: "IdealCircuit | CompiledCircuit | None", ngspice_rule: bool
) -> "tuple[Trajectories, float]":
    """The trajectories of the cheap model, compiled, and the seconds that compiling took."""
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.ensemble.richardson import compile_pair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.compiled import compilation

    eqs = problem.equations
    seed = np.random.SeedSequence([options.seed, 1])
    h = None if options.dt is None else options.dt * problem.units.frequency
    many = None if options.within is None else FINE  # for they weigh the controls of few runs
    if isinstance(ideal, CompiledCircuit):
        many = LOOSE  # whose steps take a hundred times as long
    count = max(affordable(eqs.is_steady, ideal, many), 0 if eqs.density is None else DRAWN)
    pilot = Trajectories(eqs, count, seed, h, circuit=ideal, ngspice_rule=ngspice_rule, controlled=True)
    with compilation() as compiling:
        compile_pair(pilot)
    return pilot, compiling.seconds


def _cheap_model(pilot: "Trajectories", burn_in: float, options: MonteCarloOptions, begin: float) -> "RichardsonPair":
    """The cheap model with the bias of its step, known well enough for the target, in its share of the budget."""
    from harvester.mechanics.ensemble.richardson import RichardsonPair

    budget, within, spent = number(options.budget), number(options.within), time.perf_counter() - begin
    share = None if budget is None else SHARE * budget
    pair = RichardsonPair(pilot, first_duration(burn_in, spent, share), budget)
    if within is None:
        return pair
    return _with_best_step(pair, "load", Target(within, share, begin), options.dt is not None)


def _settled_starts(
    pair: "RichardsonPair", charging_time: float, from_rest: float, seed: int
) -> "tuple[float, list[Start]]":
    """The burn-in of runs that begin in states of the circuit of ideal elements, and these states.

    It is `MEMORIES` of the response or of the charging: the circuits differ by little, and controls take what is left.
    """
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.ensemble.burn_in import memory

    pilot = pair.trajectories
    slowest = max(memory(pilot, pair.moments, pair.duration), charging_time)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 3]))
    states = rng.permutation(np.moveaxis(pilot.state, 1, 2).reshape(-1, pilot.state.shape[1]))
    own = isinstance(pilot.circuit, CompiledCircuit)  # which has more states than x, x', V and that of Csmooth
    starts: list[Start] = [(*map(float, one[:4]), *([one[4:]] if own else [])) for one in states]
    return min(MEMORIES * slowest, from_rest), starts


def stand_in(problem: Problem) -> Diagnostic | None:
    """Which device stands in for a nondimensional scene; None for a physical one."""
    s = problem.scales
    numbers = {"mass": s.mass, "frequency": s.frequency, "capacitance": s.capacitance, "coupling": s.coupling}
    return None if problem.physical else note("stand_in", **numbers)


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
