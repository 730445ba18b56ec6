"""The other responses that a steady drive may have: found without ngspice from many starts, each followed by ngspice.

The search (`harvester.engines.coexisting_responses`) is by the equations with a load resistor or with ideal elements.
A run of
ngspice begins in a state of each response that it names, and goes to the periodic one near it, where there is one.
"""

import dataclasses
import time

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.answers.responses import SteadyResponse
from harvester.engines.coexisting_responses import SearchedResponse, may_have_several, steady_responses
from harvester.engines.ensemble import Ensemble
from harvester.engines.ideal import Ideal
from harvester.engines.options import MonteCarloOptions
from harvester.engines.spice.steady import Steady
from harvester.engines.spice.steady_response import make_precise, to_be_found
from harvester.equations.problem import Problem
from harvester.errors import CircuitError
from harvester.presentation.diagnostic import worded
from harvester.uncertainty.value import Value

NAME = "spice"


def with_others(
    options: MonteCarloOptions, answer: Estimate, problem: Problem, reltol: float, steady: Steady | None
) -> Estimate:
    """The answer with all responses to the same drive, each with ngspice's mean, and what that says of the answer.

    ``steady`` is the response from rest, None where it does not come back.  Not searched is a linear mass, which has
    one response, and a circuit whose ideal elements are not known; nor where runs or a budget are asked for.
    """
    asked = options.trajectories, options.duration, options.budget
    if asked != (None, None, None) or not may_have_several(problem):
        return answer
    problem = problem.plain
    engine = Ensemble() if problem.netlist is None else Ideal()
    if engine.refusal(problem):
        return dataclasses.replace(
            answer, diagnostics=(*answer.diagnostics, worded("other responses to the drive are not looked for", "note"))
        )
    begin = time.perf_counter()
    found = steady_responses(problem, engine.model(problem), engine.seed, engine.NAME, engine.UNKNOWN)
    told = f"engine {engine.NAME!r} from many starts"
    if not found:
        word = "a search for other responses to the drive, from other starts, did not settle"
        answer = dataclasses.replace(answer, diagnostics=(*answer.diagnostics, worded(word)))
    elif steady is not None and [one.response.periods for one in found] == [steady.last.turns]:
        only = dataclasses.replace(found[0].response, mean_power=answer.mean_power, engine=NAME)
        known = (*answer.diagnostics, worded(f"{told} finds no other response to the drive", "note"))
        answer = dataclasses.replace(answer, responses=(only,), diagnostics=known)
    else:
        responses = _followed(options, problem, reltol, steady, answer.mean_power, found)
        this = "the mean is that of runs from rest" if steady is None else "this is the one from rest"
        word = f"the drive has {len(responses)} responses, and {this}; the others are found by {told}"
        answer = dataclasses.replace(answer, responses=responses, diagnostics=(*answer.diagnostics, worded(word)))
    return dataclasses.replace(answer, seconds=answer.seconds + time.perf_counter() - begin)


def _followed(
    options: MonteCarloOptions,
    problem: Problem,
    reltol: float,
    rest: Steady | None,
    mean_power: Value,
    found: tuple[SearchedResponse, ...],
) -> tuple[SteadyResponse, ...]:
    """The responses of ngspice that those ``found`` lead to, the most frequent first; that of ``rest`` is known.

    One that leads to none which comes back keeps its own mean.  Those that lead to the same share their starts.
    """
    from harvester.mechanics.ensemble.coexisting_responses import linked

    ends = [_followed_from(options, problem, reltol, one) for one in found]
    there = [(-1, rest)] if rest is not None else []
    there += [(k, one) for k, one in enumerate(ends) if isinstance(one, Steady)]
    numbers = linked(np.array([_means(one) for _, one in there])) if len(there) > 1 else np.ones(len(there), int)
    responses = []
    for number in dict.fromkeys(numbers):
        leading = [k for (k, _), one in zip(there, numbers, strict=True) if one == number]
        steady = next(one for (_, one), its in zip(there, numbers, strict=True) if its == number)
        if steady is not rest:
            make_precise(steady)
        power = mean_power if steady is rest else _power(problem, steady)
        shares = [found[k].response.share_of_starts for k in leading if k >= 0]
        note = f"{len(shares)} responses without ngspice lead there" if len(shares) > 1 else ""
        note = note if shares else "only from rest"
        responses.append(SteadyResponse(power, sum(shares), steady.last.turns, False, NAME, note))
    for one, end in zip(found, ends, strict=True):
        if not isinstance(end, Steady):
            responses.append(dataclasses.replace(one.response, note=end))
    return tuple(sorted(responses, key=lambda one: -one.share_of_starts))


def _followed_from(
    options: MonteCarloOptions, problem: Problem, reltol: float, found: SearchedResponse
) -> Steady | str:
    """The periodic response of ngspice from a state of one without it, or why there is none."""
    from harvester.cosimulation.poincare_sections import CoupledState, Origin

    x, v, voltage, stored = found.state
    volts = problem.scales.volts
    section = CoupledState(x, v, across=(voltage * volts, stored * volts))
    steady = to_be_found(options, problem, reltol)
    try:
        comes_back = steady.begin(None, Origin(section, found.phase, found.response.periods or 1))
    except CircuitError as error:
        return f"ngspice does not follow it: {error}"
    return steady if comes_back else "ngspice finds none near it that comes back"


def _power(problem: Problem, steady: Steady) -> Value:
    """The mean power of a response, in the scene's unit."""
    return steady.value("power").scaled(problem.units.watts / problem.scales.watts)


def _means(steady: Steady) -> list[float]:
    """The means of V^2, x^2 and x (nondimensional) of a response at the longest step."""
    one = steady.found[0, 0]
    return [one.square, float(np.mean(one.wave[:, 0] ** 2)), float(np.mean(one.wave[:, 0]))]
