"""The best answer of engine `spice` where its time was over before ngspice had one, and what is missing from it."""

from dataclasses import replace

from harvester.answers.estimate import Estimate
from harvester.engines.ensemble import mean_with_errors
from harvester.engines.protocol import estimate
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.problem import Problem
from harvester.errors import OutOfTimeError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.uncertainty.value import Value

WITHOUT, CUT = "leaving ngspice out", "a response that was cut short"


def unfinished(
    name: str, problem: Problem, error: OutOfTimeError, seconds: float, ready: SpiceSetup | None = None
) -> Estimate:
    """What the cheap model of ``ready`` knows, or else the means that one run of ngspice had come to.

    Either comes with a warning, and without a whole error.  Where there is neither, the error is raised.
    """
    if ready is not None and ready.pair is not None:
        return _by_cheap_model(name, problem, error, seconds, ready)
    if error.so_far is None:
        raise error
    watts, square, covered = error.so_far
    found = Value(square / problem.scales.volts**2, unknown=CUT), Value(watts / problem.scales.watts, unknown=CUT)
    said = warning("mean_while_settling", covered=covered, why=str(error), steady=problem.equations.is_steady)
    return _completed(estimate(name, problem, *found, seconds, 0, "", ()), problem, said)


def _by_cheap_model(name: str, problem: Problem, error: OutOfTimeError, seconds: float, ready: SpiceSetup) -> Estimate:
    """The means of the long ensemble that the runs of ngspice were to be paired with."""
    pair, beta = ready.pair, problem.equations.beta or 0.0
    assert pair is not None
    moment, factor, what = "load", beta, "its circuit made of ideal diodes and switches, as of engine 'ideal'"
    if ready.resistive:
        moment, factor, what = "V2", beta * (problem.equations.mu or 0.0), "the same equations, as of engine 'ensemble'"
    said = warning("ngspice_left_out", what=what, why=str(error))
    v2, power = mean_with_errors(pair, "V2"), mean_with_errors(pair, moment).scaled(factor)
    details = {"step": ready.device.h / problem.units.frequency, "burn_in": pair.burn_in / problem.units.frequency}
    details |= {"duration": pair.duration / problem.units.frequency, "trajectories": pair.trajectories.count}
    known = v2.with_unknown(WITHOUT), power.with_unknown(WITHOUT)
    answer = estimate(name, problem, *known, seconds, pair.steps, "", tuple(ready.warnings), details)
    return _completed(answer, problem, said)


def _completed(answer: Estimate, problem: Problem, said: Diagnostic) -> Estimate:
    """The answer with its warning, and with the netlist among its effects where the scene has one."""
    effects = (*problem.effects, *["netlist"] * (problem.netlist is not None))
    return replace(answer, effects=effects, diagnostics=(*answer.diagnostics, said))
