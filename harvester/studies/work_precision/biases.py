"""Biases, measured one by one: of the step, of ngspice's tolerance, of the model; relative, each with its error.

What is compared runs on the same noise, so that the differences are known better than either mean.  The cheap model of
a scene is the ensemble: with the exact update of its load resistor, or with the ideal circuit of its netlist.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.arrays import Floats
from harvester.engines import Spice
from harvester.engines.ensemble import Model
from harvester.equations.problem import Problem
from harvester.errors import UnboundedResponseError
from harvester.uncertainty.value import NORMAL_QUANTILE, Value

if TYPE_CHECKING:
    from harvester.engines.spice.runs import Runs
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories

RUNGS = (0.5, 1.0, 2.0)  # of the default step: the finer one of each pair
MOST = 0.5  # relative difference of two steps beyond which an expansion in the step says nothing
TOLERANCES = (1e-5, 1e-4, 1e-3)  # ngspice's reltol, finest first, tenfold apart
ORDER = 2.0 / 3.0  # error against reltol: a step of (reltol)^(1/3), and an integrator of second order


@dataclass(frozen=True)
class Bias:
    """A relative bias with its sign, and its standard error."""

    value: float
    stderr: float

    @property
    def counted(self) -> float:
        """What a total error counts of it: max(|bias|, 2 stderr).

        One that was not seen counts as large as it may be without being seen: never zero, and no jump where it shows.
        """
        return max(abs(self.value), 2.0 * self.stderr)

    def scaled(self, factor: float) -> "Bias":
        """Both times ``factor`` > 0."""
        return Bias(factor * self.value, factor * self.stderr)

    def __add__(self, other: "Bias") -> "Bias":
        """Of two causes, measured independently."""
        return Bias(self.value + other.value, math.hypot(self.stderr, other.stderr))


NONE = Bias(0.0, 0.0)  # of what the others are measured against


@dataclass(frozen=True)
class Ladder:
    """The cheap model as its step goes to zero, E_h = E_0 (1 + c2 h^2 + c4 h^4) with the nondimensional step h.

    ``mean`` is E_0 of the moment that its power is made of, with its standard error, nondimensional;
    ``coefficients`` are (c2, c4) or, from one rung, (c2), with their ``covariance``.
    """

    mean: Value
    coefficients: Floats
    covariance: Floats

    def at(self, h: float) -> Bias:
        """(E_h - E_0)/E_0."""
        powers = _powers(h)[: len(self.coefficients)]
        return Bias(float(powers @ self.coefficients), math.sqrt(powers @ self.covariance @ powers))


def _powers(h: Any) -> Floats:
    return np.stack([np.asarray(h) ** 2, np.asarray(h) ** 4], axis=-1)


def ladder(model: Model, h: float, trajectories: int, seed: int, seconds: float) -> Ladder:
    """The scheme is of second order (Kloeden and Platen, section 14.2); pairs of steps show its constant.

    The pairs (h/2, h), (h, 2h), (2h, 4h) run on the same noise each, and the least squares of their differences,
    weighed with their errors, give c2 and c4; where the differences lie further from that than their errors allow, the
    covariance is made as much larger.  Steps that are unstable are left out.

    Raises
    ------
    UnboundedResponseError
        where even the finest pair is unstable.
    """
    from harvester.mechanics.ensemble.trajectories import Trajectories

    rungs: list[tuple[float, Value, tuple[float, float]]] = []
    for k, factor in enumerate(RUNGS):
        noise = np.random.SeedSequence([seed, k])
        many = Trajectories(model.eqs, trajectories, noise, factor * h, circuit=model.circuit)
        try:
            pair = _filled(many, seconds / len(RUNGS))
        except UnboundedResponseError:
            break
        with np.errstate(over="ignore", invalid="ignore"):
            mean, (third, error) = Value(*pair.mean(model.name)), pair.bias(model.name)
        if pair.coarse_is_stopped or not abs(3.0 * third) < MOST * abs(mean.value):  # twice the step is unstable
            break
        rungs.append((many.h, mean, (3.0 * third, 3.0 * error)))
    if not rungs:
        raise UnboundedResponseError(f"the response grows without bound at a step of {h:g}/w0 and below")
    steps, means, differences = zip(*rungs, strict=True)
    return _fitted(np.array(steps), means, np.array(differences))


def _fitted(h: Floats, means: Sequence[Value], differences: Floats) -> Ladder:
    """From the means at steps h, and the differences to twice the step with their errors, shape (n, 2)."""
    scale = abs(means[0].value)
    y, error = differences.T / scale
    terms = (_powers(2.0 * h) - _powers(h))[:, : min(len(h), 2)]
    normal = (terms / error[:, None] ** 2).T
    covariance = np.linalg.inv(normal @ terms)
    coefficients = covariance @ normal @ y
    if len(y) > len(coefficients):
        excess = (((y - terms @ coefficients) / error) ** 2).sum() / (len(y) - len(coefficients))
        covariance *= max(excess, 1.0)
    rough = Ladder(means[0], coefficients, covariance)  # relative to the mean at the finest step
    zero = [_less(mean, rough.at(step), scale) for mean, step in zip(means, h, strict=True)]
    weights = np.array([1.0 / (one.stderr or 0.0) ** 2 for one in zero])
    mean = Value(float(weights @ [one.value for one in zero] / weights.sum()), float(weights.sum() ** -0.5))
    ratio = scale / mean.value
    return Ladder(mean, ratio * coefficients, ratio**2 * covariance)


def _less(mean: Value, bias: Bias, scale: float) -> Value:
    """A mean less its bias, which is given in units of ``scale``."""
    return Value(mean.value - scale * bias.value, math.hypot(mean.stderr or 0.0, scale * bias.stderr))


def _filled(many: "Trajectories", seconds: float) -> "RichardsonPair":
    """A pair over as long a time as ``seconds`` allow, and at least the burn-in's."""
    from harvester.mechanics.ensemble.burn_in import burn_in
    from harvester.mechanics.ensemble.richardson import RichardsonPair

    begin = time.perf_counter()
    burn_in(many)
    pair = RichardsonPair(many, many.time)
    spent = time.perf_counter() - begin  # on twice the burn-in at this step, and at twice the step
    if seconds > spent:
        pair.extend(pair.duration * 2.0 * (seconds / spent - 1.0))
    return pair


@dataclass(frozen=True)
class Beside:
    """ngspice beside the cheap model: ``cheap`` is that model's bias, ``tolerances`` that of ngspice's reltol."""

    cheap: Bias
    tolerances: dict[float, Bias]


def beside(problem: Problem, model: Model, steps: Ladder, h: float, seed: int, seconds: float) -> Beside:
    """Runs of ngspice with all `TOLERANCES`, and the cheap model, on the same noise and at the same step h.

    The errors of both from the step are the same and leave no trace.  That of the finest tolerance is taken from its
    difference to the next, at the `ORDER` of the error.

    Raises
    ------
    MissingProgramError
        when ngspice is not installed.
    CircuitError
        when ngspice refuses the circuit or does not converge.
    """
    from harvester.engines.spice.preparation import prepare
    from harvester.engines.spice.runs import FEWEST, Runs
    from harvester.uncertainty.control_variate import controlled

    ready = prepare(problem, Spice(seed=seed, dt=h / problem.units.frequency))
    begin = time.perf_counter()
    whole = math.lcm(ready.device.stride, 2)
    kicks = math.ceil(2.0 * ready.burn_in / h / whole) * whole  # short: a grazing impact parts the paths for good
    tolerances = (Spice.reltol,) if ready.device.load.linear else TOLERANCES
    runs = [
        Runs(
            replace(ready, device=replace(ready.device, reltol=r)), True, kicks, np.random.SeedSequence([seed, 2]), None
        )
        for r in tolerances
    ]
    rounds = 0
    while not rounds or (time.perf_counter() - begin) * (rounds + 1) < seconds * rounds:
        for one in runs:
            one.more(FEWEST)
        rounds += 1
    high = [_high(one, model) for one in runs]
    exact = high[0] if len(high) == 1 else high[0] + (high[0] - high[1]) / (10.0**ORDER - 1.0)
    low = np.array([getattr(one.control, model.name)[0] for one in runs[0].done])
    known = steps.mean.value * (1.0 + steps.at(h).value)
    found = controlled(exact, low, Value(known, 0.0)).value
    ratio = found.value / known
    return Beside(
        Bias(1.0 / ratio - 1.0, found.sampling95 / NORMAL_QUANTILE / abs(known) / ratio**2),
        {r: _mean((one - exact) / exact.mean()) for r, one in zip(tolerances, high, strict=True)} if high[1:] else {},
    )


def _high(runs: "Runs", model: Model) -> Floats:
    """The moment that the power is made of, as ngspice has it, one entry a run."""
    if model.circuit is None:
        return np.array([one.moments.V2[0] for one in runs.done])
    watts = runs.ready.device.scales.watts * model.factor
    return np.array([one.load_power for one in runs.done]) / watts


def _mean(values: Floats) -> Bias:
    """Mean and standard error, as large as few values ask for (Student)."""
    error = Value(0.0, float(values.std(ddof=1)) / math.sqrt(len(values)), freedom=len(values) - 1.0)
    return Bias(float(values.mean()), error.sampling95 / NORMAL_QUANTILE)
