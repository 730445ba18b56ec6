"""Why the response of a circuit to a steady excitation does not repeat: the likely cause, as data."""

import dataclasses
import math
from collections.abc import Callable

from harvester.answers.estimate import Estimate
from harvester.equations.bounds import linear_growth
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import Diagnostic, note

PERIODS = 100.0  # of the excitation: storage that settles more slowly is the likely cause
SWITCHES, PASSIVE = "sw", "rcldkv"  # letters of elements; all others may amplify


def slow_store(problem: Problem) -> float | None:
    """How long storage settles (in the unit of the scene) that needs more than `PERIODS`.

    None without one.
    """
    storage = (problem.circuit and problem.circuit.storage) or 0.0  # s
    settling = storage * problem.scales.frequency
    if settling * (problem.equations.drive_frequency or 0.0) <= 2.0 * math.pi * PERIODS:
        return None
    return settling / problem.units.frequency


def not_periodic(problem: Problem) -> Diagnostic:
    """The note of a response that does not repeat, with its likely cause.

    Searches for periodic responses leave out initial conditions, but the runs that are sampled
    instead begin with them.
    """
    parts = problem.circuit.parts if problem.circuit else ()
    kinds = {part.kind for part in parts}
    store = slow_store(problem)
    cause = ""
    if store is not None:
        cause = "store"
    elif kinds & set(SWITCHES):
        cause = "rhythm"
    elif kinds - set(PASSIVE):
        cause = "oscillates"
    elif linear_growth(problem.equations) is None:
        cause = "mass"
    return note(
        "not_periodic",
        cause=cause,
        initial=any(part.options.get("ic") for part in parts),
        time=store or 0.0,
        physical=problem.physical,
    )


def sampled_instead(problem: Problem, sampling: Callable[[], Estimate]) -> Estimate:
    """The answer of a ``sampling`` in place of a response that does not repeat.

    It, or its error, names a cause.
    """
    cause = not_periodic(problem)
    try:
        answer = sampling()
    except SimulationError as error:
        error.args = (f"{error}; {cause}",)
        raise
    return dataclasses.replace(answer, diagnostics=(*answer.diagnostics, cause))
