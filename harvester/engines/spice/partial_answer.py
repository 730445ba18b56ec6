"""The best answer of engine `spice` where its time was over before ngspice had one, and what is missing from it."""

from dataclasses import replace

from harvester.answers.estimate import Estimate
from harvester.engines.protocol import estimate
from harvester.engines.sampling import mean_with_errors
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.problem import Problem
from harvester.errors import OutOfTimeError
from harvester.presentation.diagnostic import warning
from harvester.presentation.messages.unknown_parts import CUT_SHORT, WITHOUT_NGSPICE
from harvester.uncertainty.value import Value


def partial_answer(
    name: str, problem: Problem, error: OutOfTimeError, seconds: float, setup: SpiceSetup | None = None
) -> Estimate:
    """What the cheap model of a ``setup`` knows, or else the means that one run of ngspice had come to.

    Either comes with a warning, and without a whole error.  Where there is neither, the error is raised.
    """
    if setup is not None and setup.pair is not None:
        answer = _by_cheap_model(name, problem, error, seconds, setup)
    elif error.so_far is None:
        raise error
    else:
        watts, square, covered = error.so_far
        said = warning("mean_while_settling", covered=covered, why=str(error), steady=problem.equations.is_steady)
        v2, power = square / problem.scales.volts**2, watts / problem.scales.watts
        answer = estimate(name, problem, Value(v2, unknown=CUT_SHORT), Value(power, unknown=CUT_SHORT), [said], seconds)
    return answer if problem.netlist is None else replace(answer, effects=(*problem.effects, "netlist"))


def _by_cheap_model(name: str, problem: Problem, error: OutOfTimeError, seconds: float, setup: SpiceSetup) -> Estimate:
    """The means of the long ensemble that the runs of ngspice were to be paired with."""
    pair, eqs, unit = setup.pair, problem.equations, problem.units.frequency
    assert pair is not None
    factor = (eqs.beta or 0.0) * ((eqs.mu or 0.0) if setup.resistive else 1.0)
    v2, power = mean_with_errors(pair, "V2"), mean_with_errors(pair, setup.quantity).scaled(factor)
    details = {"step": setup.device.h / unit, "burn_in": pair.burn_in / unit, "duration": pair.duration / unit}
    details["trajectories"] = pair.trajectories.count
    said = warning("ngspice_left_out", resistive=setup.resistive, why=str(error))
    known = v2.with_unknown(WITHOUT_NGSPICE), power.with_unknown(WITHOUT_NGSPICE)
    return estimate(name, problem, *known, [*setup.diagnostics, said], seconds, pair.steps, details)
