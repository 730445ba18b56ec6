"""What a compiled circuit differs by from ngspice, on the same motion."""

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.engines.options import MonteCarloOptions, number
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, MissingProgramError, OutOfTimeError
from harvester.uncertainty.paired_difference import difference95, half_if_enough, share95

if TYPE_CHECKING:
    from harvester.cosimulation.runs import Start

# how many, and the nondimensional time that each averages over
RUNS = 8
AVERAGED = 64.0
SHARE = 0.25  # of a budget, that these runs may take
RELTOL = 1e-5  # of ngspice, which is the judge here


def difference_from_ngspice(
    problem: Problem,
    h: float,
    starts: "Sequence[Start]",
    settling: float,
    options: MonteCarloOptions,
    enough: float = 0.0,
) -> dict[str, float]:
    """The relative differences of E[V^2] ("V2") and of the load's power ("load"), the largest at 95 %.

    Runs begin in states of the circuit's own trajectories of the step ``h``, and ``settling`` is
    left out of each. Both move as the compiled circuit lets the mass move, so that they stay
    together near a stop; how the mass answers to the difference is left out, which is of the size
    of the coupling times it.  Half of the runs do if they show that the load's power differs by
    less than ``enough``.  Empty if ngspice is missing, gives no answer, or has not ended in `SHARE`
    of the budget.
    """
    from harvester.circuits.compiled_circuit import compiled_circuit
    from harvester.cosimulation.runs import CoupledDevice
    from harvester.cosimulation.same_motion import same_motion_means
    from harvester.cosimulation.worker_pool import map_in_workers

    assert problem.circuit is not None, "a compiled circuit is that of a netlist"
    circuit = compiled_circuit(problem.circuit, problem.scales)
    budget = number(options.budget)
    device = CoupledDevice(
        problem.equations, problem.scales, problem.circuit, h, 1, reltol=RELTOL, ideal=circuit
    )
    n_steps = math.ceil((settling + AVERAGED) / h)
    seeds = np.random.SeedSequence([options.seed, 5]).spawn(RUNS)
    deadline = math.inf if budget is None else time.monotonic() + SHARE * budget
    jobs = [
        (device, seed, n_steps, settling, deadline, start)
        for seed, start in zip(seeds, starts, strict=False)
    ]

    def in_workers(some: Sequence[tuple[Any, ...]]) -> list[dict[str, tuple[float, float]]]:
        return list(map_in_workers(same_motion_means, some))

    try:
        return half_if_enough(
            jobs, in_workers, _shares, lambda shares: shares.get("load", 1.0) < enough
        )
    except (CircuitError, MissingProgramError, OutOfTimeError):
        return {}


def _shares(runs: list[dict[str, tuple[float, float]]]) -> dict[str, float]:
    """The largest relative differences of means above 0, at 95 %."""
    shares = dict[str, float]()
    for name in runs[0]:
        high, low = np.array([means[name] for means in runs]).T
        size = float(low.mean())
        if size > 0.0:
            shares[name] = share95(difference95(high, low), size)
    return shares
