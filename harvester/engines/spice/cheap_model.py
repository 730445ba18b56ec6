"""The cheap model paired with runs of ngspice: its circuit, its trajectories, their step, and starts from them."""

import time
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
    has_own_kernel,
)
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import InputError, SimulationError
from harvester.uncertainty.target import Target, best_factor

if TYPE_CHECKING:
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.cosimulation.runs import Start
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
    from harvester.netlists.load_circuit import LoadCircuit

LONGEST_CHARGING = 2e4  # nondimensional
LONGEST_COMPILED = 4e3  # where a compiled circuit goes beside
CLOSE = 0.02  # a target below which circuits that switch go beside their compiled circuit
MEMORIES = 2.0  # time constants of the slowest change, of a burn-in from settled states
TWINS = 0.2  # of a target, for the step: a circuit that switches costs hardly more at a smaller one
FIRST = 0.25  # of the burn-in, that a compiled circuit averages over at first
SHARE = 0.5  # of the budget, for the cheap model at most: the rest is for ngspice


def cheap_circuit(
    problem: Problem, options: MonteCarloOptions, charging: float, settled: bool
) -> "tuple[IdealCircuit | CompiledCircuit | None, IdealCircuit | CompiledCircuit | None, bool]":
    """The circuit without ngspice that is paired with it, its twin, and whether runs are `SpiceSetup.short`.

    It is made of ideal elements if these are possible; a target that is close asks for the compiled
    circuit, which follows ngspice through every switching, and whose twin is made of ideal
    elements.  Others are their own.  None if absent.  Neither waits for a periodic response, which
    ngspice finds itself; a long ``charging`` takes a compiled circuit minutes.
    """
    from harvester.circuits.compiled_circuit import compiled_circuit

    eqs = problem.equations
    scales = problem.scales
    load = problem.circuit
    assert load is not None, "the engine refuses an open circuit"
    if charging > LONGEST_CHARGING or eqs.mu is not None:
        return None, None, False
    ideal = ideal_elements(problem, load)
    if charging > LONGEST_COMPILED or not _bears_compiled(eqs):
        return ideal, ideal, False
    short = (
        settled
        and _tells_paths_apart(eqs)
        and (options.trajectories, options.duration) == (None, None)
    )
    closely = short and (number(options.within) or 1.0) < CLOSE
    if ideal is not None and not (closely and ideal.hysteresis is not None):
        return ideal, ideal, False
    try:
        compiled = compiled_circuit(load, scales)
    except InputError:
        return ideal, ideal, False
    return compiled, ideal or compiled, short


def ideal_elements(problem: Problem, load: "LoadCircuit") -> "IdealCircuit | None":
    """The circuit of ideal elements of a package's netlist, or of a user's bridge while trajectories stay together."""
    from harvester.circuits.idealised import ideal_circuit
    from harvester.storage.rectifier_cut import plain_bridge

    ideal = ideal_circuit(load, problem.scales)
    if ideal is not None or problem.equations.has_stop or not _bears_compiled(problem.equations):
        return ideal
    try:
        return plain_bridge(load, problem.scales)
    except InputError:
        return None


def _bears_compiled(eqs: Equations) -> bool:
    """Whether a compiled circuit may be paired: there is no periodic response."""
    return eqs.shaking_period is None or eqs.is_random


def _tells_paths_apart(eqs: Equations) -> bool:
    """Whether two models of a circuit soon part on the same white noise, as near a stop."""
    return eqs.has_stop and eqs.is_shaken_by_white_noise


def pilot_of(
    problem: Problem,
    options: MonteCarloOptions,
    ideal: "IdealCircuit | CompiledCircuit | None",
    ngspice_rule: bool,
) -> "tuple[Trajectories, float]":
    """The trajectories of the cheap model, compiled, and the seconds of the compilation."""
    from harvester.mechanics.ensemble.compiled_pair import compile_pair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.compiled import compilation

    eqs = problem.equations
    seed = np.random.SeedSequence([options.seed, 1])
    h = options.step(problem.units.frequency)
    many = None if options.within is None else FINE  # for they weigh the controls of few runs
    if has_own_kernel(ideal):
        many = LOOSE  # whose steps take a hundred times as long
    count = max(affordable(eqs.is_steady, ideal, many), 0 if eqs.density is None else DRAWN)
    pilot = Trajectories(
        eqs, count, seed, h, circuit=ideal, ngspice_rule=ngspice_rule, controlled=True
    )
    with compilation() as compiling:
        compile_pair(pilot, number(options.budget))
    return pilot, compiling.seconds


def cheap_model(
    pilot: "Trajectories",
    circuit: "IdealCircuit | CompiledCircuit | None",
    burn_in: float,
    charging_time: float,
    options: MonteCarloOptions,
    begin: float,
) -> "tuple[RichardsonPair, float]":
    """The cheap model with the bias of its step, known well enough for the target, in its share of the budget.

    If the ``pilot`` is the twin of the ``circuit`` that is paired with it, this one continues
    from it.  Also the time from which seconds count on, without compilation.
    """
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.ensemble.richardson import RichardsonPair

    budget = number(options.budget)
    within = number(options.within)
    spent = time.perf_counter() - begin
    share = None if budget is None else SHARE * budget
    is_twin = pilot.circuit is not circuit
    first = FIRST if pilot.loaded.is_dear else 1.0
    pair = RichardsonPair(pilot, first * first_duration(burn_in, spent, share), budget)
    if within is not None:
        target = Target((TWINS if is_twin else 1.0) * within, share, begin)
        pair = _with_best_step(pair, "load", target, options.dt is not None)
    if is_twin and isinstance(circuit, CompiledCircuit):
        pair, compilation_seconds = _compiled_beside(pair, circuit, charging_time, budget, begin)
        begin += compilation_seconds
    return pair, begin


def _compiled_beside(
    twin: "RichardsonPair",
    circuit: "CompiledCircuit",
    charging_time: float,
    budget: float | None,
    begin: float,
) -> "tuple[RichardsonPair, float]":
    """The compiled circuit at the step of its ``twin``, settled from its states, and the seconds of compiling.

    That is of ideal elements: it knows the step and its bias in a hundredth of the time, and fills
    the storage capacitor.  It is the pair itself if the compiled circuit does not settle, or not
    within its share of the budget.
    """
    from harvester.circuits.beside_ideal import SETTLING, compiled_beside, settle_within
    from harvester.mechanics.ensemble.burn_in import memory
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.kernels.noise import child

    settled = twin.trajectories
    compiled, compilation_seconds = compiled_beside(
        settled, circuit, affordable(False, circuit, LOOSE), child(settled.seed, 4)
    )
    begin += compilation_seconds
    length = SETTLING * max(memory(settled, twin.moments, twin.duration), charging_time)
    share = None if budget is None else SHARE * budget
    try:
        settle_within(compiled, length, share, begin)
    except SimulationError:
        return twin, compilation_seconds
    duration = first_duration(compiled.time, time.perf_counter() - begin, share)
    return RichardsonPair(compiled, duration, budget, twin), compilation_seconds


def settled_starts(
    pair: "RichardsonPair", charging_time: float, from_rest: float, seed: int
) -> "tuple[float, list[Start]]":
    """The burn-in of runs that begin in states of the circuit of ideal elements, and these states.

    It is `MEMORIES` of the response or of the charging: the circuits differ by little, and controls
    remove the rest.
    """
    from harvester.mechanics.ensemble.burn_in import memory

    pilot = pair.trajectories
    slowest = max(memory(pilot, pair.moments, pair.duration), charging_time)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 3]))
    states = rng.permutation(np.moveaxis(pilot.state, 1, 2).reshape(-1, pilot.state.shape[1]))
    return min(MEMORIES * slowest, from_rest), [pilot.loaded.start(state) for state in states]


def _with_best_step(
    pair: "RichardsonPair", name: str, target: Target, fixed: bool
) -> "RichardsonPair":
    """The pair with its bias known well enough for the target, at a smaller step if that is called for.

    A longer step would save little of the few ngspice runs that are needed.
    """
    while True:
        bias, error = pair.relative_bias(name)
        factor = 1.0 if fixed else best_factor(target.within, abs(bias), error, pair.order)
        if error < KNOWN * target.within and not pair.extrapolates:
            pair.stop_coarse()
        if factor < 1.0:
            pair = pair.with_step(factor * pair.trajectories.h)
        elif (
            error < 0.25 * target.within
            or target.seconds_left < pair.seconds_a_unit * pair.duration
        ):
            return pair
        else:
            pair.extend(pair.duration)
