"""A step that does not converge is not an answer: if too many fail, the answer is refused, and the element is named."""

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.substeps import MOST
from harvester.circuits.system import System
from harvester.errors import CircuitError
from harvester.presentation.diagnostic import refusal


def check_converged(system: System, steps: float, failed: float, returned: Floats) -> None:
    """Raise CircuitError if more than `MOST` of so many steps ``failed``.

    ``returned`` is the number that the solver returned if steps failed last
    (`harvester.circuits.newton_parts.SIGNATURE`), of any shape; 0 if none did.  The elements that
    it reports are named, or all that have a function if it reports none.
    """
    if not failed > MOST * steps:
        return
    functions = sorted({round(-2.0 - code) for code in np.unique(returned) if code <= -2.0})
    many = len(system.diodes) + len(system.functions)
    names = dict.fromkeys(system.element_of(k) for k in functions or range(many))
    share = float(failed / max(steps, 1.0))
    raise CircuitError(str(refusal("circuit_fails", share=share, elements=", ".join(names))))
