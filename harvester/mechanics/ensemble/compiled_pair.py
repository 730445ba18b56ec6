"""The kernels of a pair of trajectories and others of twice the step, compiled before they run."""

import contextlib
import time

from harvester.equations.impact_order import STRONG, step_order
from harvester.errors import CircuitError, UnboundedResponseError
from harvester.mechanics.ensemble.affordable_steps import FIRST_WINDOW, check_cost, check_pace
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.intervals import update_of

# which sets of effects this process has compiled
_COMPILED: set[object] = set()


def compile_pair(trajectories: Trajectories, budget: float | None = None) -> None:
    """Compile all that a `RichardsonPair` of trajectories calls, by a few steps of a single block.

    Kernels that this process has compiled once are not compiled again.

    Raises SimulationError, before the trajectories run, if the shortest burn-in would exceed the
    ``budget``.
    """
    check_cost(trajectories, FIRST_WINDOW, budget, time.perf_counter())
    if not is_compiled(trajectories):
        _compile(trajectories)
    check_pace(trajectories, budget)


def _compile(trajectories: Trajectories) -> None:
    """Call all kernels of a pair once."""
    eqs = trajectories.eqs
    # else in records
    block = trajectories.brief(1e-3 if eqs.shaking_period is None and eqs.density is None else None)
    # for a very stiff scene this step is too long, and failed steps count among many
    with contextlib.suppress(UnboundedResponseError, CircuitError):
        block.run(block.h)
        block.snapshot()
        RichardsonPair(block, block.h)
    if (kind := _kind(trajectories)) is not None:
        _COMPILED.add(kind)


def is_compiled(trajectories: Trajectories) -> bool:
    """Whether `compile_pair` has loaded all kernels of such trajectories in this process."""
    return _kind(trajectories) in _COMPILED


def _kind(trajectories: Trajectories) -> object:
    """The numbers for their kernels; None for kernels of a circuit's or several modes' own."""
    eqs = trajectories.eqs
    if trajectories.loaded.numbers is None:
        return None
    flags = trajectories.controlled, trajectories.ngspice_rule, step_order(eqs) < STRONG
    updates = [update_of(eqs, h, trajectories.ngspice_rule) for h in (1e-3, trajectories.h)]
    numbers = trajectories.loaded.numbers, trajectories.shakers[0], updates
    return flags, present(numbers)


def present(numbers: object) -> object:
    """Which of some numbers are there, in tuples of tuples, for which a kernel is compiled."""
    if isinstance(numbers, tuple | list):
        return type(numbers), *map(present, numbers)
    return type(numbers)
