"""The biases of the cheap model and of ngspice's tolerance, from runs of both on the same noise."""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.engines import Spice
from harvester.engines.sampling import Model
from harvester.engines.spice.runs import Runs
from harvester.equations.problem import Problem
from harvester.studies.work_precision.bias import Bias
from harvester.studies.work_precision.richardson_ladder import RichardsonLadder
from harvester.uncertainty.paired_difference import difference95
from harvester.uncertainty.value import Value

TOLERANCES = (1e-5, 1e-4, 1e-3)  # ngspice's reltol, finest first, tenfold apart


@dataclass(frozen=True)
class NgspiceBias:
    """The relative biases that ngspice shows: ``cheap`` of the cheap model, ``tolerances`` of each of its reltol."""

    cheap: Bias
    tolerances: dict[float, Bias]


def ngspice_bias(
    problem: Problem, model: Model, steps: RichardsonLadder, h: float, seed: int, seconds: float
) -> NgspiceBias:
    """Run ngspice with all `TOLERANCES` and the cheap model on the same noise, at the same step h, and compare them.

    The errors of both from the step are the same and leave no trace.  The bias of the finest tolerance is
    estimated by its difference to the next, at the `harvester.cosimulation.same_motion.ORDER` of
    the error.

    Raises MissingProgramError when ngspice is not installed; CircuitError when ngspice refuses the
    circuit or does not converge.
    """
    from harvester.cosimulation.same_motion import ORDER
    from harvester.engines.spice.means import FEWEST
    from harvester.engines.spice.setup import set_up
    from harvester.uncertainty.control_variate import controlled

    setup = set_up(problem, Spice(seed=seed, dt=h / problem.units.frequency))
    begin = time.perf_counter()
    multiple = math.lcm(setup.device.stride, 2)
    # short: a grazing impact parts the paths
    n_steps = math.ceil(2.0 * setup.burn_in / h / multiple) * multiple
    tolerances = (Spice.reltol,) if setup.device.load.linear else TOLERANCES
    setups = [replace(setup, device=replace(setup.device, reltol=r)) for r in tolerances]
    runs = [
        Runs(setup=s, paired=True, n_steps=n_steps, seed=np.random.SeedSequence([seed, 2]))
        for s in setups
    ]
    rounds = 0
    while not rounds or (time.perf_counter() - begin) * (rounds + 1) < seconds * rounds:
        for run in runs:
            run.run_batch(FEWEST)
        rounds += 1
    high = [_high(run, model) for run in runs]
    exact = high[0] if len(high) == 1 else high[0] + (high[0] - high[1]) / (10.0**ORDER - 1.0)
    low = np.array([getattr(run.control, model.name)[0] for run in runs[0].done])
    known = steps.mean.value * (1.0 + steps.at(h).value)
    estimate = controlled(exact, low, Value(known, 0.0)).value
    ratio = estimate.value / known
    return NgspiceBias(
        Bias(1.0 / ratio - 1.0, estimate.normal_stderr / abs(known) / ratio**2),
        {r: _relative(v, exact) for r, v in zip(tolerances, high, strict=True)} if high[1:] else {},
    )


def _high(runs: Runs, model: Model) -> Floats:
    """The moment that the power is made of, as ngspice has it, one entry a run."""
    if model.circuit is None:
        return np.array([run.moments.V2[0] for run in runs.done])
    watts = runs.setup.device.scales.watts * model.factor
    return np.concatenate([run.load_power for run in runs.done]) / watts


def _relative(high: Floats, exact: Floats) -> Bias:
    """The difference of two means, relative to the second one."""
    difference = difference95(high, exact).scaled(1.0 / float(exact.mean()))
    return Bias(difference.value, difference.normal_stderr)
