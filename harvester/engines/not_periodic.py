"""Why the response of a circuit to a steady drive does not repeat: the likely cause, as data."""

import math

from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import Diagnostic, note

PERIODS = 100.0  # of the drive: a store that takes longer to settle is the likely cause
_RHYTHM = "sw"  # letters of switches, which with their hysteresis have a rhythm of their own


def not_periodic(problem: Problem) -> Diagnostic:
    """The note of a response that does not repeat, with its likely cause.

    A store's time is in the unit of the scene.
    """
    cause = ""
    circuit = problem.circuit
    parts = circuit.parts if circuit else ()
    storage = (circuit and circuit.storage) or 0.0  # s
    settling = storage * problem.scales.frequency
    if settling * (problem.equations.drive_frequency or 0.0) > 2.0 * math.pi * PERIODS:
        cause = "store"
    elif any(part.kind in _RHYTHM for part in parts):
        cause = "rhythm"
    elif any("ic" in part.options for part in parts):
        cause = "initial"
    time = settling / problem.units.frequency
    return note("not_periodic", cause=cause, time=time, physical=problem.physical)
