"""What to do where ngspice does not converge at a step that nobody chose: the same again at a smaller one."""

from collections.abc import Callable
from typing import TypeVar

from harvester.equations.problem import Problem
from harvester.errors import ConvergenceError
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.uncertainty.value import amount

PARTS, TRIES = 4.0, 3  # each try has a step so many times smaller than the one before
Found = TypeVar("Found")


def at_smaller_steps(
    problem: Problem, h: float, compute: Callable[[float], Found]
) -> tuple[Found, float, tuple[Diagnostic, ...]]:
    """What ``compute`` gives at the step ``h`` (1/w0), or a smaller one; that step, and a note where it is smaller.

    Raises ConvergenceError where ngspice does not converge at any of them, and what ``compute`` raises otherwise.
    """

    def said(step: float) -> str:
        return amount(step / problem.units.frequency, "s" if problem.physical else "")

    for k in range(TRIES):
        step = h / PARTS**k
        try:
            found = compute(step)
        except ConvergenceError as error:
            if k == TRIES - 1:
                raise ConvergenceError(f"{error}; steps of {said(h)} to {said(step)} were tried") from None
            continue
        taken = note("smaller_step_converges", asked=said(h), taken=said(step))
        return found, step, (taken,) if k else ()
    raise AssertionError("every try returns or raises")
