"""The answers of engine `spice`: from runs on noise, from a periodic response, or if its time was over before.

Means, with the known part of their errors, the power balance or the energy balance, and under a
steady excitation the motion.
"""

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

from harvester.answers.estimate import DISPLACEMENT, PEAKS, PHASES, Estimate
from harvester.engines.moment_existence import MomentExistence
from harvester.engines.not_periodic import slow_store
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import estimate
from harvester.engines.sampling import agreement, mean_with_errors, power_balance
from harvester.engines.spice.ledger import gives_power, ledger_entries, ledger_remarks
from harvester.engines.spice.probed_answer import Watch, with_sampled_probes
from harvester.engines.spice.runs import Runs
from harvester.engines.spice.setup import SpiceSetup, stand_in
from harvester.engines.spice.steady import Steady
from harvester.equations.problem import Problem
from harvester.errors import OutOfTimeError
from harvester.linear.record_doubts import join_beyond, record_doubts
from harvester.linear.transfer import phase_to_base
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.messages.unknown_parts import CUT_SHORT, WITHOUT_NGSPICE
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.circuits.circuit_period import CircuitPeriod
    from harvester.cosimulation.periodic_responses import PeriodicResponse


def sampled_estimate(
    name: str,
    problem: Problem,
    runs: Runs,
    exists: MomentExistence,
    watch: Watch,
    said: list[Diagnostic | None],
) -> Estimate:
    """The answer that runs give; ``said`` is the report of their sampling."""
    setup = runs.setup
    eqs = problem.equations
    unit = problem.units.frequency
    step = setup.device.h / unit
    burn_in = setup.settling / unit
    details = {"step": step, "burn_in": burn_in, "duration": runs.n_steps * step - burn_in}
    details |= (
        {"trajectories": len(runs.done)}
        | runs.details()
        | {"warm_up_seconds": runs.warm_up_seconds}
    )
    remarks, moments = runs.remarks(), runs.moments()
    if (
        setup.resistive and eqs.stop_stiffness is None and eqs.modes is None
    ):  # what the balance holds for
        details["power_balance"], details["power_balance_stderr"] = power_balance(moments, eqs)
    else:
        watts = problem.scales.watts / problem.units.watts
        load_bias = (runs.power().value.bias or 0.0) * problem.units.watts
        details |= ledger_entries([run.ledger for run in runs.done], watts, load_bias)
    agreed = agreement(moments) if eqs.is_steady else None
    exact = agreed is not None and agreed.severity == "note"
    v2, power = (
        dataclasses.replace(controlled.value, stderr=None)
        if exact
        else controlled.value.with_unknown(exists.unknown).with_unknown(setup.unknown)
        for controlled in (runs.mean_square_voltage(), runs.power())
    )
    known = setup.biases(runs.tolerance is not None, runs.followed)
    diagnostics = [
        *setup.diagnostics,
        *said,
        exists.warning,
        *remarks,
        known,
        agreed,
        stand_in(problem),
    ]
    seconds = setup.seconds + runs.seconds
    steps = sum(run.steps for run in (*runs.done, *runs.coarse))
    answer = estimate(
        name,
        problem,
        v2=v2,
        power=power,
        diagnostics=diagnostics,
        seconds=seconds,
        steps=steps,
        details=details,
        samples=moments.V2,
    )
    return with_sampled_probes(answer, problem, watch, runs) if watch.all else answer


def steady_estimate(
    options: MonteCarloOptions, name: str, problem: Problem, steady: Steady, seconds: float
) -> Estimate:
    """The answer that a periodic response gives, with its balance, after so many ``seconds`` with compilation."""
    units = problem.units
    last = steady.last
    within = number(options.within)
    watts = units.watts / problem.scales.watts
    everything = steady.responses.values()
    power, square = steady.value("power"), steady.value("square")
    if power.value + power.known_error95 < 0.0:
        raise gives_power(-power.value)
    details = {"step": steady.first.h / 2**steady.finest / units.frequency}
    details |= motion_details(problem, steady.value, steady.last) | {
        "response_periods": last.turns,
        "ngspice_periods": sum(response.periods for response in everything),
    }
    if steady.unknown is None:
        parts = ("step_error", "tolerance_error", "settling_error")
        details |= {
            part: error * watts
            for part, error in zip(parts, steady.errors("power")[1], strict=True)
        }
    details |= {"warm_up_seconds": steady.warm_up_seconds} | ledger_entries(
        [last.ledger],
        1.0 / watts,
        (power.known_error95 + abs(power.value - last.ledger.load)) * watts,
    )
    diagnostics = [
        *ledger_remarks(2 * [last.ledger]),
        *record_doubts(problem.equations),
        join_beyond(problem.equations, within),
        None if within is None else missed(within, power),
        note("comes_back", periods=last.turns, from_before=steady.continued),
        steady.unknown or note("steady_errors"),
        steady.shunted,
        note("tolerance_reused") if steady.unknown is None and steady.reused is not None else None,
        stand_in(problem),
    ]
    v2 = square.scaled(problem.scales.volts**-2)
    power = power.scaled(1.0 / problem.scales.watts)
    seconds = seconds - steady.warm_up_seconds
    steps = sum(response.steps for response in everything)
    return estimate(
        name,
        problem,
        v2=v2,
        power=power,
        diagnostics=diagnostics,
        seconds=seconds,
        steps=steps,
        details=details,
    )


def missed(within: float, power: Value) -> Diagnostic | None:
    """The warning that a power without a target of sampling is not known ``within`` an error.

    None if it is.
    """
    error = None if power.unknown or not power.value else power.known_error95 / abs(power.value)
    return (
        None
        if error is not None and error <= within
        else warning("steady_within", within=within, error=error)
    )


def motion_details(
    problem: Problem, value: Callable[[str], Value], last: "PeriodicResponse | CircuitPeriod"
) -> dict[str, float]:
    """RMS displacement about its mean and peaks of |x| and |V|, with errors if known.

    Phases to the base in degrees.

    ``value`` gives a quantity of the ``last`` of the responses at steps that are halved.
    """
    units = problem.units
    details = dict[str, float]()
    names = "displacement", "peak_displacement", "peak_voltage"
    scales = units.length, units.length, units.volts
    between = 0.0, *(peak for _, peak in last.peaks)
    for key, name, scale, more in zip((DISPLACEMENT, *PEAKS), names, scales, between, strict=True):
        mean = value(name)
        details[key] = mean.value * scale
        if mean.bias is not None and not mean.unknown:
            details[f"{key}_bias"] = (mean.bias + (mean.model or 0.0) + more) * scale
    phases = (
        phase_to_base(harmonic, problem.equations, problem.physical) for harmonic in last.harmonics
    )
    return details | dict(zip(PHASES, phases, strict=True))


def partial_answer(
    name: str,
    problem: Problem,
    error: OutOfTimeError,
    seconds: float,
    setup: SpiceSetup | None = None,
) -> Estimate:
    """The results of a ``setup``'s cheap model, or else the means of one run of ngspice until then.

    Either comes with a warning, and without a total error.  If there is neither, or if the run did
    not cover the slowest transient of the mechanics, the error is raised.
    """
    if setup is not None and setup.pair is not None:
        answer = _by_cheap_model(name, problem, error, seconds, setup)
    elif error.so_far is None or _is_at_its_start(problem, error.so_far):
        raise error
    else:
        watts, square, covered = error.so_far
        said = warning(
            "mean_while_settling",
            covered=covered,
            why=str(error),
            steady=problem.equations.is_steady,
            store=slow_store(problem),
            physical=problem.physical,
        )
        v2 = square / problem.scales.volts**2
        power = watts / problem.scales.watts
        answer = estimate(
            name,
            problem,
            Value(v2, unknown=CUT_SHORT),
            Value(power, unknown=CUT_SHORT),
            [said],
            seconds,
        )
    return answer


def _is_at_its_start(problem: Problem, so_far: tuple[float, float, float]) -> bool:
    """Whether the means of a run cover less than the slowest transient of the mechanics: no response is in them."""
    from harvester.mechanics.ensemble.burn_in import slowest_transient

    covered = so_far[2] * problem.scales.frequency
    return covered < slowest_transient(problem.equations)


def _by_cheap_model(
    name: str, problem: Problem, error: OutOfTimeError, seconds: float, setup: SpiceSetup
) -> Estimate:
    """The means of the long ensemble that the runs of ngspice were to be paired with."""
    pair = setup.pair
    eqs = problem.equations
    unit = problem.units.frequency
    assert pair is not None
    factor = (eqs.beta or 0.0) * ((eqs.mu or 0.0) if setup.resistive else 1.0)
    v2 = mean_with_errors(pair, "V2")
    power = mean_with_errors(pair, setup.quantity).scaled(factor)
    details = {
        "step": setup.device.h / unit,
        "burn_in": pair.burn_in / unit,
        "duration": pair.duration / unit,
    }
    details["trajectories"] = pair.trajectories.count
    said = warning("ngspice_left_out", resistive=setup.resistive, why=str(error))
    return estimate(
        name,
        problem,
        v2.with_unknown(WITHOUT_NGSPICE),
        power.with_unknown(WITHOUT_NGSPICE),
        [*setup.diagnostics, said],
        seconds,
        steps=pair.steps,
        details=details,
    )
