"""What engine `spice` answers under a steady drive: means and motion of the periodic response, and its ledger."""

import dataclasses

from harvester.answers.estimate import DISPLACEMENT, PHASES, Estimate
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import estimate
from harvester.engines.spice.ledger import gives_power, ledger_doubts, ledger_entries
from harvester.engines.spice.setup import stand_in
from harvester.engines.spice.steady import Steady
from harvester.equations.problem import Problem
from harvester.linear.harmonics import phase_to_base
from harvester.linear.record_doubts import record_doubts
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.uncertainty.value import Value


def steady_estimate(
    options: MonteCarloOptions, name: str, problem: Problem, steady: Steady, seconds: float
) -> Estimate:
    """The answer that a periodic response gives, with its energy ledger, after so many ``seconds`` with compilation."""
    units, last, within = problem.units, steady.last, number(options.within)
    watts, everything = units.watts / problem.scales.watts, steady.found.values()
    power, square = steady.value("power"), steady.value("square")
    if power.value + power.known_error95 < 0.0:
        raise gives_power(-power.value)
    details = {"step": steady.first.h / 2**steady.finest / units.frequency}
    details |= _motion(problem, steady) | {
        "response_periods": last.turns,
        "ngspice_periods": sum(one.periods for one in everything),
    }
    if steady.unknown is None:
        parts = ("step_error", "tolerance_error", "settling_error")
        details |= {part: error * watts for part, error in zip(parts, steady.errors("power")[1], strict=True)}
    details |= {"warm_up_seconds": steady.warm_up_seconds} | ledger_entries([last.ledger], 1.0 / watts)
    diagnostics = [
        *ledger_doubts(2 * [last.ledger]),
        *record_doubts(problem.equations),
        None if within is None else _missed(within, power, steady),
        note("comes_back", periods=last.turns, from_before=steady.continued),
        steady.unknown or note("steady_errors"),
        note("tolerance_reused") if steady.unknown is None and steady.reused is not None else None,
        stand_in(problem),
    ]
    v2, power = square.scaled(problem.scales.volts**-2), power.scaled(1.0 / problem.scales.watts)
    seconds, steps = seconds - steady.warm_up_seconds, sum(one.steps for one in everything)
    answer = estimate(name, problem, v2, power, diagnostics, seconds, steps, details)
    return answer if problem.netlist is None else dataclasses.replace(answer, effects=(*problem.effects, "netlist"))


def _missed(within: float, power: Value, steady: Steady) -> Diagnostic | None:
    """The warning that an error ``within`` was not reached."""
    if steady.unknown is not None:
        return warning("steady_within", within=within, error=None)
    if power.known_error95 <= within * abs(power.value):
        return None
    return warning("steady_within", within=within, error=power.known_error95 / abs(power.value))


def _motion(problem: Problem, steady: Steady) -> dict[str, float]:
    """The RMS displacement about its mean, with its error where that is known, and phases to the base in degrees."""
    moved = steady.value("displacement").scaled(problem.units.length)
    found = {DISPLACEMENT: moved.value} | ({} if moved.bias is None else {f"{DISPLACEMENT}_bias": moved.bias})
    phases = (phase_to_base(one, problem.equations, problem.physical) for one in steady.last.harmonics)
    return found | dict(zip(PHASES, phases, strict=True))
