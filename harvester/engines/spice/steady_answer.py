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


def steady_estimate(
    options: MonteCarloOptions, name: str, problem: Problem, steady: Steady, seconds: float
) -> Estimate:
    """The answer that a periodic response gives, with its energy ledger, after so many ``seconds`` with compilation."""
    s, units, last, within = problem.scales, problem.units, steady.last, number(options.within)
    everything = steady.found.values()
    power, square = steady.value("power"), steady.value("square")
    if power.value + power.known_error95 < 0.0:
        raise gives_power(-power.value)
    warnings = ledger_doubts(2 * [last.ledger]) + record_doubts(problem.equations)
    if within is not None and (steady.unknown or power.known_error95 > within * abs(power.value)):
        relative = "is not known" if steady.unknown else f"is {power.known_error95 / abs(power.value):.2g}"
        warnings.append(f"`within` {within:.3g} was not reached: the error {relative}")
    whence = "from that of the point before" if steady.followed else "from rest"
    again = (
        "after each period of the drive" if last.turns == 1 else f"after {last.turns} periods of the drive: subharmonic"
    )
    reasons = [f"no sampling error: nothing is random, and the response {whence} comes back {again}"]
    details = {"step": steady.first.h / 2**steady.finest / units.frequency}
    details |= _motion(problem, steady) | {
        "response_periods": last.turns,
        "ngspice_periods": sum(one.periods for one in everything),
    }
    if steady.unknown:
        reasons.append(steady.unknown)
    else:
        parts = ("step_error", "tolerance_error", "settling_error")
        found = dict(zip(parts, steady.errors("power")[1], strict=True))
        details |= {part: error * units.watts / s.watts for part, error in found.items()}
        reasons.append("its error is that of the step, of ngspice's tolerance and of settling")
        if steady.reused is not None:
            reasons.append("that of the tolerance, which is next to nothing, was measured at a point before")
    if not problem.physical:
        reasons.append(stand_in(s))
    answer = estimate(
        name,
        problem,
        square.scaled(1.0 / s.volts**2),
        power.scaled(1.0 / s.watts),
        seconds - steady.warm_up_seconds,
        sum(one.steps for one in everything),
        "; ".join(reasons),
        tuple(warnings),
        details | {"warm_up_seconds": steady.warm_up_seconds} | ledger_entries([last.ledger], s.watts / units.watts),
    )
    return answer if problem.netlist is None else dataclasses.replace(answer, effects=(*problem.effects, "netlist"))


def _motion(problem: Problem, steady: Steady) -> dict[str, float]:
    """The RMS displacement about its mean, with its error where that is known, and phases to the base in degrees."""
    moved = steady.value("displacement").scaled(problem.units.length)
    found = {DISPLACEMENT: moved.value} | ({} if moved.bias is None else {f"{DISPLACEMENT}_bias": moved.bias})
    phases = (phase_to_base(one, problem.equations, problem.physical) for one in steady.last.harmonics)
    return found | dict(zip(PHASES, phases, strict=True))
