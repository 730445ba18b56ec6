"""How engine `spice` finds the response to a steady excitation: from rest, or by continuation from a neighbouring one.

If the mass is linear and the circuit feeds nothing there is one response only, and from that of
a neighbouring scene it is found in a few periods.
"""

import dataclasses
import time
from typing import TYPE_CHECKING

from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import Progress
from harvester.engines.refinement import FEWEST_STEPS, WITHIN
from harvester.engines.spice.steady import HALVINGS, RUNNING, Steady
from harvester.equations.bounds import linear_growth
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.netlists.for_ngspice import SHUNTS
from harvester.netlists.probes import Probe

if TYPE_CHECKING:
    from harvester.cosimulation.periodic_responses import Neighbour


def may_come_back(problem: Problem) -> bool:
    """Whether a periodic response is sought: under a steady drive."""
    return problem.equations.is_steady


def is_the_only_one(options: MonteCarloOptions, problem: Problem) -> bool:
    """Whether the response is periodic, and the only one: that of a linear mass, whose circuit feeds nothing."""
    from harvester.cosimulation.load_elements import feeds_nothing

    if not may_come_back(problem) or (options.trajectories, options.duration) != (None, None):
        return False
    linear = linear_growth(problem.equations) is not None
    return linear and feeds_nothing(problem.load_circuit)


def steady_response(
    options: MonteCarloOptions,
    problem: Problem,
    reltol: float,
    progress: Progress | None = None,
    probes: tuple[Probe, ...] = (),
    near: "Steady | Neighbour | None" = None,
) -> Steady | None:
    """The response from rest to a steady excitation, and its errors; None if it does not come back.

    With ``near``, the response of a scene a little different, it is that which a slow change leads
    to.  It continues to smaller steps and tolerances until the target is reached, the budget spent,
    or nothing is left.

    Raises as `harvester.cosimulation.runs.run_in_this_process`.
    """
    from harvester.cosimulation.runs import warm_up_workers
    from harvester.mechanics.kernels.compiled import machine_code

    steady = to_be_found(options, problem, reltol, probes)
    budget = number(options.budget)
    start = 0.0
    if near is None:
        code = machine_code()
        warm = warm_up_workers(steady.first)
        start = warm if 0 < code == machine_code() else 0.0  # compilation is not in the budget
        steady.warm_up_seconds = warm
    if budget is not None:
        steady.deadline = time.monotonic() + max(budget - start, RUNNING * budget)
    if isinstance(near, Steady):
        # of a long way no more is kept
        steady.near = near
        near.near = None
    response = _precise(
        steady, near.responses[0, 0] if isinstance(near, Steady) else near, progress
    )
    if response is None and near is not None:
        return steady_response(options, problem, reltol, progress, probes)
    return response


def _precise(steady: Steady, near: "Neighbour | None", progress: Progress | None) -> Steady | None:
    """The response made precise.

    If ngspice does not converge, with a capacitance from each node to ground.

    The package's own netlists need none: their diodes have capacitances.  If a circuit needs more
    than all that are tried, it is the first response that was found; None if none was.
    """
    first = None
    shunts = SHUNTS if steady.first.load.topology is None else (0.0,)
    for shunt in shunts:
        device = dataclasses.replace(steady.first, shunt=shunt)
        tried = dataclasses.replace(steady, first=device, responses={})
        if tried.begin(near):
            tried.make_precise(progress)
            first = first or tried
            if tried.unknown is None:
                return tried
        if not tried.diverged:
            break
    return first


def to_be_found(
    options: MonteCarloOptions, problem: Problem, reltol: float, probes: tuple[Probe, ...] = ()
) -> Steady:
    """A response that is not yet found, with the device of its longest step."""
    from harvester.cosimulation.runs import CoupledDevice

    eqs, circuit = problem.equations, problem.load_circuit
    h, halvings = steps_in_period(eqs, options.step(problem.units.frequency))
    device = CoupledDevice(
        eqs, problem.scales, circuit, h, 1, reltol=reltol, probes=probes, trapezoidal=True
    )
    return Steady(first=device, halvings=halvings, within=number(options.within) or WITHIN)


def steps_in_period(eqs: Equations, dt: float | None) -> tuple[float, int]:
    """The longest step, and how often it may be halved.

    Twice down to a ``dt`` that is given (nondimensional).
    """
    from harvester.mechanics.kernels.step_size import STEP, typical_frequency, whole_steps

    period = eqs.shaking_period
    if dt is None:
        dt = STEP / typical_frequency(eqs, max(position**2 for position in eqs.resting_places))
        return whole_steps(dt, period), HALVINGS
    h = whole_steps(dt, period)
    assert period is not None, "the drive is steady"
    larger = 2 if round(period / h) % 4 == 0 and period / h > 3.9 * FEWEST_STEPS else 0
    return h * 2**larger, larger
