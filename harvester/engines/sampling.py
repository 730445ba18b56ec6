"""The common part of the engines of trajectories: the model, number and duration, burn-in, and the error of a mean."""

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from harvester.averaging.kramers import hopping_rates
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.uncertainty.target import Target
from harvester.uncertainty.value import Value, amount, mean_and_error, stderr_of95

if TYPE_CHECKING:
    from harvester.answers.estimate import SteadyResponse
    from harvester.mechanics.ensemble.hopping import Hopping
    from harvester.mechanics.ensemble.own_circuit import OwnCircuit
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
    from harvester.mechanics.kernels.moments import Moments

KNOWN = 0.1  # of the target: a bias that is known so well needs no further measurement
TRAJECTORIES, FEWEST = 4096, 256
# trajectories at first towards a target above `FINE`: the effort grows by their duration
PURSUING = 512
FINE = 1e-3
# trajectories on records of tabulated noise: 64 of them are one independent sample
DRAWN, FEWEST_DRAWN = 1024, 128
# target from which on so few trajectories do: their burn-in is most of what it costs
LOOSE = 0.01
LEAST = 128
LOOSEST = 0.05  # the same, of a compiled circuit
FEWEST_OWN = 64
FIRST = 0.125  # of that, of a compiled circuit towards a target: a loose one needs no more
FORGOTTEN = 0.02  # share of a target, which the rest of an expensive circuit's start may be
LEAST_SHARE = 0.125  # of the burn-in's time that is averaged, whatever the budget
FEW_OWN = 16  # trajectories of a compiled circuit that does not come back to a steady excitation
SLOWER = 8.0  # times fewer trajectories of a circuit with a kernel of its own
CHARGING = 300.0  # time constant of a capacitor beyond which it is charged by fewer trajectories
# relative differences of trajectories that are: between them, of impacts' places in a step
ALIKE, UNLIKE = 1e-3, 0.05
SHOCK_STEPS = 8  # of a shock, at least
# times shorter than the step of the response: a shock that is shorter is a blow, whatever its shape
SHORTER = 64
NEGLIGIBLE = 1e-4  # power into storage that is left out, over the load's power
ENOUGH = 10.0  # times 1/rate, of a burn-in that makes the shares of the wells stationary


@dataclass(frozen=True)
class Model:
    """The simulation: the equations, the circuit if it is not a resistor, and the moments of its power.

    Nondimensional, the power is ``factor`` times the moment ``name``.
    """

    eqs: Equations
    circuit: "IdealCircuit | OwnCircuit | None"
    name: str
    factor: float

    @property
    def is_compiled(self) -> bool:
        """Whether the circuit has a kernel of its own, whose steps are a hundred times more expensive."""
        return has_own_kernel(self.circuit)


class Sampler(Protocol):
    """A sampler of a mean power that can continue."""

    def power_so_far(self) -> Value:
        """The mean power with its errors, or a moment in proportion to it."""
        ...

    @property
    def sampling_seconds(self) -> float:
        """The seconds of sampling to the present error, without burn-in and preparation."""
        ...

    def improve(self, target: Target) -> Diagnostic | None:
        """Add the effort that the target asks for; or add none, and state why it cannot be reached."""
        ...


def refine(sampler: Sampler, target: Target) -> Diagnostic | None:
    """Sequential sampling: continue until the target is reached; or state why it cannot be."""
    while not target.reached(value := sampler.power_so_far()):
        target.sampling_seconds = sampler.sampling_seconds
        if target.is_hopeless(value):
            return warning("target_missed", **target.shortfall(value))
        if (obstacle := sampler.improve(target)) is not None:
            return obstacle
    return None


def has_own_kernel(circuit: "IdealCircuit | OwnCircuit | None") -> bool:
    """Whether a circuit is a netlist's, with a kernel of its own."""
    return circuit is not None and circuit.has_own_kernel


def affordable(
    steady: bool, circuit: "IdealCircuit | OwnCircuit | None", within: float | None = None
) -> int:
    """Trajectories by default, between `FEWEST` and `TRAJECTORIES`: the burn-in of each is lost.

    Few if nothing is random, of a compiled circuit without a target, if each must wait long
    for a large capacitor, and if no more are needed for an error of ``within``: `PURSUING` with
    controls come to about `FINE` in the time of their burn-in, `LEAST` to `LOOSE`.
    """
    is_compiled = has_own_kernel(circuit)
    if is_compiled and not steady and within is not None and within >= LOOSEST:
        return FEWEST_OWN
    if steady or (is_compiled if within is None else within >= LOOSE):
        return (FEW_OWN if is_compiled else FEWEST) if steady else LEAST
    share = 1.0
    if circuit is not None:
        share = min(CHARGING / circuit.memory, 1.0) / (SLOWER if is_compiled else 1.0)
    if within is not None:
        share *= min(PURSUING / TRAJECTORIES * max(FINE / within, 1.0) ** 2, 1.0)
    return max(round(share * TRAJECTORIES), FEWEST)


def run_burn_in(
    trajectories: "Trajectories",
    problem: Problem,
    budget: float | None,
    within: float | None = None,
) -> list[Diagnostic]:
    """Burn in within a ``budget`` in seconds, as `harvester.mechanics.ensemble.burn_in.burn_in` does: its warnings.

    An expensive circuit towards a target ``within`` waits until exp(-t/T) with its correlation time
    T is `FORGOTTEN` of that.

    Under shocks the step is made shorter before, unless it is fixed: the part of a shock that a
    grid of steps cannot carry is left out, and near a stop that moves the impacts.  The bias that
    is measured at twice the step sees that only if both steps carry nearly all of it.  Transitions
    between unlike wells that are too rare for their shares to become stationary are a warning of
    their own.
    """
    from harvester.mechanics.ensemble.burn_in import CORRELATION_TIMES, burn_in

    shocks, h = problem.events, trajectories.h
    if shocks is not None and shocks.briefest is not None and not trajectories.step_is_fixed:
        shorter = max(shocks.briefest * problem.units.frequency / SHOCK_STEPS, h / SHORTER)
        if shorter < h:
            trajectories.restart(shorter)
    times = CORRELATION_TIMES
    if within is not None and trajectories.loaded.is_dear:
        times = min(times, -math.log(FORGOTTEN * within))
    diagnostics = burn_in(trajectories, budget, times)
    if trajectories.hopping is not None:
        diagnostics.append(_rare_hops(trajectories.hopping, trajectories.h, problem))
    return diagnostics


def _rare_hops(hops: "Hopping", h: float, problem: Problem) -> Diagnostic:
    """The warning that inter-well transitions are rare, how rare, and the effort of an answer at a step of ``h``."""
    eqs, unit = problem.equations, problem.units
    metre = "m" if problem.physical else ""
    rates = hopping_rates(eqs) if problem.load.is_in_equations else None
    rate = hops.rate if hops.hops or rates is None else sum(rates)
    return warning(
        "rare_hops",
        wells=" and ".join(f"x = {amount(x * unit.length, metre)}" for x in eqs.resting_places),
        hops=hops.hops,
        time=hops.count * hops.time / unit.frequency,
        formula_time=None if rates is None else 1.0 / max(rates) / unit.frequency,
        burn_in=ENOUGH / rate / unit.frequency,
        steps=ENOUGH / rate / h * hops.count,
        at_least=rates is None and not hops.hops,
        physical=problem.physical,
    )


def first_duration(burn_in: float, spent: float, budget: float | None) -> float:
    """The time of the first averages: that of the burn-in, or less if the budget does not leave so much.

    They are paired with trajectories of twice the step, which have the burn-in to make up for.
    """
    if budget is None:
        return burn_in
    left = ((budget - spent) / spent - 0.5) / 1.5
    return burn_in * min(max(left, LEAST_SHARE), 1.0)


def mean_with_errors(pair: "RichardsonPair", name: str, exact: bool = False) -> Value:
    """One moment's mean with its sampling errors, unless it is ``exact``, and step; and of wells that are apart."""
    hops = pair.trajectories.hopping
    bias = pair.largest_bias(name)
    if hops is not None:
        every = getattr(pair.moments, name)
        together = pair.trajectories.together
        return dataclasses.replace(
            hops.mean(pair.entries(name) if together == 1 else every, together), bias=bias
        )
    mean, error = pair.mean(name)
    charging = pair.charging if name == "load" else 0.0
    if charging > NEGLIGIBLE * mean:
        error = math.hypot(error, stderr_of95(charging))
        exact = False
    dof = None if pair.trajectories.together == 1 else len(pair.entries(name)) - 1.0
    return Value(mean, None if exact else error, bias, dof=dof)


def with_model(value: Value, error: float | None, unknown: str) -> Value:
    """A mean with the relative ``error`` of its model.

    None: the part of the error that is ``unknown`` then.
    """
    if error is None:
        return value.with_unknown(unknown)
    return dataclasses.replace(value, model=(value.model or 0.0) + error * abs(value.value))


def step_and_effort(
    pair: "RichardsonPair", name: str, within: float, unit: float, physical: bool
) -> Diagnostic:
    """The choice for a target, and why."""
    bias, error = pair.relative_bias(name)
    return note(
        "effort",
        within=within,
        step=pair.trajectories.h / unit,
        bias=bias,
        bias_error=error,
        duration=pair.duration / unit,
        trajectories=pair.trajectories.count,
        physical=physical,
    )


def agreement(
    moments: "Moments", name: str = "V2", responses: "tuple[SteadyResponse, ...]" = ()
) -> Diagnostic | None:
    """Whether the trajectories of a response to a steady excitation agree: a note, or a warning if they differ.

    They are compared by V^2 and by the moment ``name``, which the power is made of, whichever
    differs more.  None if they differ a little, or if all starts are known to come to one periodic
    response: then they differ only by the place within a step at which impacts and switchings lie.
    """
    of = {"V2": "E[V^2]", "load": "the load's power"}
    entries = {moment: getattr(moments, moment) for moment in ("V2", name)}
    name = max(entries, key=lambda moment: np.ptp(entries[moment]) / (entries[moment].max() or 1.0))
    values = entries[name]
    low, high = values.min(), values.max()
    if high - low <= UNLIKE * high:
        return note("starts_agree") if high - low <= ALIKE * high else None
    if len(responses) == 1 and responses[0].periods:
        return None
    low, high = (float(mean / values.mean()) for mean in (low, high))
    return warning("starts_differ", of=of[name], low=low, high=high)


def power_balance(moments: "Moments", eqs: Equations) -> tuple[float, float]:
    """Power in less power out over power in, and its standard error.

    Zeros if nothing gives power (docs/model.md).

    N1 + N2 E[x^2] + 2 N12 E[x] + E[a x'] = E[f x'^2] + beta mu E[V^2] + the power lost in stops
    """
    if not (eqs.is_shaken or eqs.is_random):
        return 0.0, 0.0
    with np.errstate(invalid="ignore", divide="ignore"):
        balance = mean_and_error(moments.balance(eqs))
    return balance if np.isfinite(balance).all() else (0.0, 0.0)


def power_balance_bias(pair: "RichardsonPair", eqs: Equations) -> float:
    """Size of the step's part in the power balance: measured as that of a mean.

    Strong impacts make most of it, as a drift meets the stop at a speed that is off by order h^2.
    No number of trajectories removes it.  0 if nothing gives power.
    """
    if not (eqs.is_shaken or eqs.is_random):
        return 0.0
    moments = pair.moments
    gained = _factors(n2=("x2", eqs.n2), n12=("x", eqs.n12 and 2.0 * eqs.n12))
    gained |= {"driven": 1.0} if eqs.is_shaken_otherwise else {}
    loads = eqs.beta and eqs.mu and eqs.beta * eqs.mu
    lost = {"damped": 1.0} | _factors(load=("V2", loads))
    lost |= {"impact_loss": 1.0} if eqs.has_stop else {}
    mass = eqs.modes.shaken_mass if eqs.modes else 1.0
    means = {name: float(getattr(moments, name).mean()) for name in gained}
    power_in = mass * (eqs.n1 or 0.0) + sum(gained[name] * mean for name, mean in means.items())
    bias = pair.bias_of_sum(gained | {name: -factor for name, factor in lost.items()})
    return abs(bias / power_in) if power_in else 0.0


def _factors(**terms: tuple[str, float | None]) -> dict[str, float]:
    """The moments that have a factor, with these."""
    return {name: factor for name, factor in terms.values() if factor}
