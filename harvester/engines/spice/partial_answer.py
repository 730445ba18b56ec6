"""The best answer of engine `spice` where its time was over before ngspice had one, and what is missing from it."""

from dataclasses import replace

from harvester.answers.estimate import Estimate
from harvester.engines.ensemble import mean_with_errors
from harvester.engines.protocol import estimate
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.problem import Problem
from harvester.errors import OutOfTimeError
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
    said = f"the mean is over {covered:.3g} s of ngspice, in which the response may still have settled: {error}"
    if problem.equations.is_steady:
        said += "; a periodic response takes several such runs"
    found = Value(square / problem.scales.volts**2, unknown=CUT), Value(watts / problem.scales.watts, unknown=CUT)
    return _with_netlist(estimate(name, problem, *found, seconds, 0, "", (said,)), problem)


def _by_cheap_model(name: str, problem: Problem, error: OutOfTimeError, seconds: float, ready: SpiceSetup) -> Estimate:
    """The means of the long ensemble that the runs of ngspice were to be paired with."""
    pair, beta = ready.pair, problem.equations.beta or 0.0
    assert pair is not None
    moment, factor, what = "load", beta, "its circuit made of ideal diodes and switches, as of engine 'ideal'"
    if ready.resistive:
        moment, factor, what = "V2", beta * (problem.equations.mu or 0.0), "the same equations, as of engine 'ensemble'"
    said = f"ngspice gave no answer in the `budget`, and the mean is that of {what}, without it: {error}"
    v2, power = mean_with_errors(pair, "V2"), mean_with_errors(pair, moment).scaled(factor)
    details = {"step": ready.device.h / problem.units.frequency, "burn_in": pair.burn_in / problem.units.frequency}
    details |= {"duration": pair.duration / problem.units.frequency, "trajectories": pair.trajectories.count}
    known = v2.with_unknown(WITHOUT), power.with_unknown(WITHOUT)
    answer = estimate(name, problem, *known, seconds, pair.steps, "", (*ready.warnings, said), details)
    return _with_netlist(answer, problem)


def _with_netlist(answer: Estimate, problem: Problem) -> Estimate:
    """The answer, with the netlist among its effects where the scene has one."""
    return answer if problem.netlist is None else replace(answer, effects=(*problem.effects, "netlist"))
