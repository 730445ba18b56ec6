"""The responses to a steady excitation that a search from many starts finds, if the mass is not linear.

It is made by the model without ngspice: the equations with a load resistor, or with a circuit of
ideal elements.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.answers.estimate import SteadyResponse
from harvester.arrays import Floats
from harvester.equations.bounds import linear_growth
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.presentation.messages.unknown_parts import STEP
from harvester.uncertainty.value import Value, half95

if TYPE_CHECKING:
    from harvester.engines.sampling import Model
    from harvester.mechanics.ensemble.coexisting_responses import Attractor
    from harvester.mechanics.ensemble.trajectories import Trajectories

AGAIN = 0.25  # of the time that the search took: for what moves to half the step


def may_have_several(problem: Problem) -> bool:
    """Whether a steady excitation may have several responses, which a linear mass has not."""
    return problem.equations.is_steady and linear_growth(problem.equations) is None


@dataclass(frozen=True)
class SearchedResponse:
    """A response, and one of its states, at the part ``phase`` of a period.

    The state is as of `harvester.mechanics.ensemble.loads.Loaded.start`.
    """

    response: SteadyResponse
    state: tuple[Any, ...]
    phase: float


def steady_responses(
    problem: Problem, model: "Model", seed: int, engine: str, unknown: str = ""
) -> tuple[SearchedResponse, ...]:
    """The responses of the ``engine``'s model, the most frequent first.

    None if the search does not settle.

    They are those that stay at half the step of the search.  A mean has the time-step error, from
    the same response before, and of sampling: that of the excitation's phase on the grid of steps
    if it comes back, else of the motion.  The responses that the longer step lacks, and the error
    of the model (``unknown``), are not known.
    """
    from harvester.mechanics.ensemble.coexisting_responses import (
        attractors,
        from_many_starts,
        section,
    )

    try:
        trajectories = from_many_starts(model.eqs, np.random.SeedSequence(seed), model.circuit)
        rough = attractors(trajectories)
        finer = trajectories.continued(model.eqs, 0.5 * trajectories.h)
        finer.run(AGAIN * trajectories.time)
        fine = attractors(finer)
    except SimulationError:
        return ()
    scale = model.factor * problem.units.watts
    candidates = []
    for attractor in fine:
        power = _power(attractor, rough, model.name).scaled(scale).with_unknown(unknown)
        members = attractor.members
        periods = attractor.turns or None
        middle = members[np.argsort(attractor.entries(model.name))[len(members) // 2]]
        state, phase = _in_mid_kick(finer, *section(finer, int(middle)))
        response = SteadyResponse(
            power, len(members) / finer.count, periods, attractor.chaotic, engine
        )
        candidates.append(SearchedResponse(response, finer.loaded.start(state), phase))
    return tuple(candidates)


def _in_mid_kick(trajectories: "Trajectories", state: Floats, phase: float) -> tuple[Floats, float]:
    """A `section` in the middle of its last kick, at which the velocity is that of its time."""
    from harvester.cosimulation.poincare_sections import unkicked
    from harvester.mechanics.kernels.forcing import forcing
    from harvester.mechanics.trace import at_rest

    eqs = trajectories.eqs
    assert eqs.shaking_period is not None, "the drive is steady"
    size = round(eqs.shaking_period / trajectories.h)
    shaking = forcing(eqs, eqs.shaking_period / size, size)
    assert shaking is not None, "the drive is steady"
    a = float(np.interp(phase * size, np.arange(size + 1), shaking))
    moving = at_rest(eqs).size
    middle = state.copy()
    middle[:moving] = unkicked(eqs, state[:moving], trajectories.h, a)
    return middle, phase


def _power(attractor: "Attractor", rough: "list[Attractor]", name: str) -> Value:
    """The mean of a response, with its errors; ``rough`` are the responses at twice the step."""
    entries = attractor.entries(name)
    spread_of_mean = (
        float(entries.std(ddof=1)) / math.sqrt(len(entries)) if len(entries) > 1 else 0.0
    )
    stderr = None if attractor.turns else spread_of_mean
    same = next((other for other in rough if other.like(attractor)), None)
    mean = float(entries.mean())
    if same is None:
        return Value(mean, stderr, unknown=STEP)
    # that of the places of impacts in a step
    spread = half95(spread_of_mean) if attractor.turns else 0.0
    return Value(mean, stderr, abs(float(same.entries(name).mean()) - mean) / 3.0 + spread)
