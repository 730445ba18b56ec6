"""What a compiled circuit differs by from ngspice, on the same motion."""

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harvester.engines.options import MonteCarloOptions, number
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, MissingProgramError, OutOfTimeError
from harvester.uncertainty.value import Value, mean_and_error

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
    done = []
    differences = dict[str, float]()
    for half in (jobs[: RUNS // 2], jobs[RUNS // 2 :]):
        try:
            done += list(map_in_workers(same_motion_means, half))
        except (CircuitError, MissingProgramError, OutOfTimeError):
            return {}
        for name in done[0]:
            high, low = np.array([means[name] for means in done]).T
            off = Value(*mean_and_error(high - low), dof=len(done) - 1.0)
            if low.mean() > 0.0:
                differences[name] = (abs(off.value) + off.sampling95) / float(low.mean())
        if differences.get("load", 1.0) < enough:
            break
    return differences
