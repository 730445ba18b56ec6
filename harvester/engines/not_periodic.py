"""Why the response of a circuit to a steady drive does not repeat: the likely cause, as data."""

import math

from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import Diagnostic, note

PERIODS = 100.0  # of the drive: a store that takes longer to settle is the likely cause
_RHYTHM = "sw"  # letters of switches, which with their hysteresis have a rhythm of their own


def not_periodic(problem: Problem) -> Diagnostic:
    """The note of a response that does not repeat, with its likely cause, and a store's time (in the scene's unit)."""
    cause, seconds = "", 0.0
    circuit, drive = problem.circuit, problem.equations.drive_frequency
    if circuit is not None and problem.netlist is not None:
        storage, w0 = circuit.storage or 0.0, problem.scales.frequency
        if drive and storage * w0 * drive > 2.0 * math.pi * PERIODS:
            cause, seconds = "store", storage * w0 / problem.units.frequency
        elif any(part.kind in _RHYTHM for part in circuit.parts):
            cause = "rhythm"
        elif any("ic" in part.options for part in circuit.parts):
            cause = "initial"
    return note("not_periodic", cause=cause, time=seconds, physical=problem.physical)
