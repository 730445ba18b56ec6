"""Other responses that a steady excitation may have: found without ngspice from many starts, each continued by ngspice.

The search (`harvester.engines.coexisting_responses`) is by the equations with a load resistor or
with ideal elements. A run of ngspice begins in a state of each response that it names, and moves to
the periodic one near it, if there is one.
"""

import dataclasses
import time

import numpy as np

from harvester.answers.estimate import Estimate, SteadyResponse
from harvester.engines.coexisting_responses import (
    SearchedResponse,
    may_have_several,
    steady_responses,
)
from harvester.engines.ideal import without_ngspice
from harvester.engines.options import MonteCarloOptions
from harvester.engines.spice.steady import Steady
from harvester.engines.spice.steady_response import to_be_found
from harvester.equations.problem import Problem
from harvester.errors import CircuitError
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.uncertainty.value import Value

NAME = "spice"


def with_others(
    options: MonteCarloOptions,
    answer: Estimate,
    problem: Problem,
    reltol: float,
    steady: Steady | None,
) -> Estimate:
    """The answer with all responses to the same drive, each with ngspice's mean, and the consequence for the answer.

    ``steady`` is the response from rest, None if it does not come back.  Not searched is a linear
    mass, which has one response, and a circuit whose ideal elements are not known; nor if runs or a
    budget are asked for.
    """
    if (options.trajectories, options.duration, options.budget) != (
        None,
        None,
        None,
    ) or not may_have_several(problem):
        return answer
    problem = problem.plain
    kind = without_ngspice(problem)
    if kind is None:
        return _with_remark(answer, note("others_not_sought"))
    engine = kind()
    begin = time.perf_counter()
    candidates = steady_responses(
        problem, engine.model(problem), engine.seed, engine.NAME, engine.UNKNOWN
    )
    if not candidates:
        answer = _with_remark(answer, warning("search_not_settled"))
    elif steady is not None and [candidate.response.periods for candidate in candidates] == [
        steady.last.turns
    ]:
        only = dataclasses.replace(
            candidates[0].response, mean_power=answer.mean_power, engine=NAME
        )
        answer = _with_remark(answer, note("no_other_response", engine=engine.NAME), only)
    else:
        responses = _continued(options, problem, reltol, steady, answer.mean_power, candidates)
        numbers = {"responses": len(responses), "from_rest": steady is not None}
        answer = _with_remark(
            answer, warning("several_responses", engine=engine.NAME, **numbers), *responses
        )
    return dataclasses.replace(answer, seconds=answer.seconds + time.perf_counter() - begin)


def _with_remark(answer: Estimate, said: Diagnostic, *responses: SteadyResponse) -> Estimate:
    """The answer with one more diagnostic, and the responses that were found."""
    return dataclasses.replace(answer, responses=responses, diagnostics=(*answer.diagnostics, said))


def _continued(
    options: MonteCarloOptions,
    problem: Problem,
    reltol: float,
    rest: Steady | None,
    mean_power: Value,
    candidates: tuple[SearchedResponse, ...],
) -> tuple[SteadyResponse, ...]:
    """The responses of ngspice that the ``candidates`` lead to, the most frequent first.

    That of ``rest`` is known.

    One that leads to none which comes back keeps its own mean.  Those that lead to the same share
    their starts.
    """
    ends = [_continued_from(options, problem, reltol, candidate) for candidate in candidates]
    reached: list[tuple[SteadyResponse | None, Steady]] = [] if rest is None else [(None, rest)]
    pairs = zip(candidates, ends, strict=True)
    reached += [(candidate.response, end) for candidate, end in pairs if isinstance(end, Steady)]
    responses = []
    for same in _alike(reached):
        steady = same[0][1]  # that of rest, where it is among them
        power = mean_power
        if steady is not rest:
            steady.make_precise()
            power = steady.value("power").scaled(problem.units.watts / problem.scales.watts)
        shares = [response.share_of_starts for response, _ in same if response is not None]
        remark = "" if shares else str(note("only_from_rest"))
        remark = str(note("lead_together", responses=len(shares))) if len(shares) > 1 else remark
        responses.append(SteadyResponse(power, sum(shares), steady.last.turns, False, NAME, remark))
    for candidate, end in zip(candidates, ends, strict=True):
        if not isinstance(end, Steady):
            responses.append(dataclasses.replace(candidate.response, note=str(end)))
    return tuple(sorted(responses, key=lambda response: -response.share_of_starts))


def _alike(
    reached: list[tuple[SteadyResponse | None, Steady]],
) -> list[list[tuple[SteadyResponse | None, Steady]]]:
    """The starts that led to the same response of ngspice, together."""
    from harvester.mechanics.ensemble.coexisting_responses import linked

    if len(reached) < 2:
        return [reached] if reached else []
    numbers = linked(np.array([_means(steady) for _, steady in reached]))
    return [
        [entry for entry, its in zip(reached, numbers, strict=True) if its == number]
        for number in dict.fromkeys(numbers)
    ]


def _continued_from(
    options: MonteCarloOptions, problem: Problem, reltol: float, candidate: SearchedResponse
) -> Steady | Diagnostic:
    """The periodic response of ngspice from a state of one without it, or why there is none."""
    from harvester.cosimulation.poincare_sections import CoupledState, Origin

    x, v, voltage, stored, *higher = candidate.state
    volts = problem.scales.volts
    section = CoupledState(
        x,
        v,
        across=(voltage * volts, stored * volts),
        higher_modes=tuple(np.ravel(higher).tolist()),
    )
    steady = to_be_found(options, problem, reltol)
    try:
        comes_back = steady.begin(
            None, Origin(section, candidate.phase, candidate.response.periods or 1)
        )
    except CircuitError as error:
        return note("not_followed", error=str(error))
    return steady if comes_back else note("does_not_come_back")


def _means(steady: Steady) -> list[float]:
    """The means of V^2, x^2 and x (nondimensional) of a response at the longest step."""
    response = steady.responses[0, 0]
    return [
        response.square,
        float(np.mean(response.wave[:, 0] ** 2)),
        float(np.mean(response.wave[:, 0])),
    ]
