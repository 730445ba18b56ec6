"""The remedies if ngspice does not converge at a step that nobody chose: a smaller one, then a little capacitance."""

from collections.abc import Callable
from typing import TypeVar

from harvester.equations.problem import Problem
from harvester.errors import ConvergenceError
from harvester.netlists.for_ngspice import SHUNTS
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.uncertainty.value import amount

# Each try: parts of the step, and the capacitance from each node to ground as a part of the
# piezo's.
TRIES = ((1.0, 0.0), (4.0, 0.0), (16.0, 0.0), *((1.0, shunt) for shunt in SHUNTS if shunt))
Answer = TypeVar("Answer")


def at_smaller_steps(
    problem: Problem, h: float, compute: Callable[[float, float], Answer]
) -> tuple[Answer, float, tuple[Diagnostic, ...]]:
    """The result of ``compute`` at the step ``h`` (1/w0) without a shunt, else by the first of `TRIES` that converges.

    Also the step that was used, and the remedy if that was not the first.

    Raises ConvergenceError if ngspice converges at none of them, and the errors of ``compute``
    otherwise.
    """

    def in_units(step: float) -> str:
        return amount(step / problem.units.frequency, "s" if problem.physical else "")

    least = h / max(parts for parts, _ in TRIES)
    for parts, shunt in TRIES:
        step = h / parts
        try:
            answer = compute(step, shunt)
        except ConvergenceError as error:
            if (parts, shunt) == TRIES[-1]:
                farads = amount(shunt * problem.scales.capacitance, "F")
                tried = f"steps of {in_units(h)} to {in_units(least)} and {farads} from each node to ground were tried"
                raise ConvergenceError(f"{error}; {tried}") from None
            continue
        if shunt:
            remark = warning(
                "shunt_converges", share=shunt, capacitance=shunt * problem.scales.capacitance
            )
        else:
            remark = note("smaller_step_converges", asked=in_units(h), taken=in_units(step))
        return answer, step, (remark,) if shunt or parts > 1.0 else ()
    raise AssertionError("every try returns or raises")
