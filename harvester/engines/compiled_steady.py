"""Engine `compiled` under a steady excitation: the periodic response at several steps, and ngspice's from there."""

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from harvester.answers.estimate import Estimate
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import Progress, estimate
from harvester.engines.spice.estimates import missed, motion_details
from harvester.engines.spice.steady import FINEST, ROUGHEST, SETTLED, WITHIN
from harvester.engines.spice.steady_response import steps_in_period, to_be_found
from harvester.equations.bounds import linear_growth
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, MissingProgramError, OutOfTimeError
from harvester.linear.record_doubts import join_beyond, record_doubts
from harvester.netlists.for_ngspice import RELTOL_OF_JUDGE
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.messages.unknown_parts import COMPILED_CIRCUIT
from harvester.uncertainty.richardson import limit
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.circuits.circuit_period import CircuitPeriod, CircuitStart
    from harvester.cosimulation.poincare_sections import Origin

# of a circuit's step: with the usual 0.03 switches act at a little other times each period
TOLERANCE = 2e-3
JUDGED = 0.5  # of a budget, that ngspice may take
# s, and times the time of the response: how long ngspice may take without a budget
PATIENCE, AGAIN = 30.0, 3.0


@dataclass
class CompiledPeriods:
    """A response at steps that are halved, ``responses``; ``differences`` are ngspice's, relative, by quantities."""

    responses: "list[CircuitPeriod]" = field(default_factory=list)
    differences: dict[str, float] = field(default_factory=dict)

    def value(self, name: str) -> Value:
        """The ``power`` (W), ``square`` (V^2) or ``displacement`` with its errors (step, settling) and model."""
        values = [float(getattr(response, name)) for response in self.responses]
        last = self.responses[-1]
        left = self.responses[-1].left[0 if name == "power" else 1]
        value, step = limit(values) if len(values) > 2 else (values[-1], None)
        bias = None if step is None else step + left * abs(last.power if name == "power" else value)
        if name not in self.differences:
            return Value(value, bias=bias, unknown=COMPILED_CIRCUIT)
        return Value(value, bias=bias, model=self.differences[name] * abs(value))


def steady_answer(
    options: MonteCarloOptions,
    name: str,
    problem: Problem,
    near: "CircuitStart | None" = None,
    judged: bool = True,
    progress: Progress | None = None,
) -> "tuple[Estimate | None, CircuitPeriod | None]":
    """The answer of a periodic response from rest, or ``near`` that of an excitation close by, and its place, or None.

    With ``judged``, ngspice continues from the response at the longest step to its own, and their
    difference is the model error.  Without a budget it has `PATIENCE`, or `AGAIN` times the time of
    the response.
    """
    from harvester.mechanics.kernels.compiled import compilation

    within = number(options.within)
    begin = time.perf_counter()
    budget = number(options.budget)
    with compilation() as compiling:
        periods = _periods(options, problem, near, within or WITHIN, progress)
    if periods is None:
        return None, None
    if judged:
        patience = (
            max(PATIENCE, AGAIN * (time.perf_counter() - begin))
            if budget is None
            else JUDGED * budget
        )
        periods.differences = _differences(
            options, problem, periods.responses[0], time.monotonic() + patience
        )
    last = periods.responses[-1]
    power = periods.value("power")
    details = {"step": last.path.h / problem.units.frequency, "response_periods": float(last.turns)}
    details |= motion_details(problem, periods.value, last)
    diagnostics = [
        note("comes_back", periods=last.turns, from_before=near is not None),
        note("steady_difference") if periods.differences else warning("compiled_circuit"),
        note("others_not_sought") if linear_growth(problem.equations) is None else None,
        None if within is None else missed(within, power),
        *record_doubts(problem.equations),
        join_beyond(problem.equations, within),
    ]
    v2 = periods.value("square").scaled(problem.scales.volts**-2)
    steps = sum(response.steps for response in periods.responses)
    seconds = time.perf_counter() - begin - compiling.seconds
    watts = power.scaled(1.0 / problem.scales.watts)
    return estimate(
        name,
        problem,
        v2=v2,
        power=watts,
        diagnostics=diagnostics,
        seconds=seconds,
        steps=steps,
        details=details,
    ), last


def _periods(
    options: MonteCarloOptions,
    problem: Problem,
    near: "CircuitStart | None",
    within: float,
    progress: Progress | None,
) -> CompiledPeriods | None:
    """The response at steps that are halved until their error is below the target; None if none comes back."""
    from harvester.circuits.circuit_period import periodic_response
    from harvester.circuits.compiled_circuit import compiled_circuit

    eqs = problem.equations
    circuit = compiled_circuit(problem.load_circuit, problem.scales, TOLERANCE)
    h, halvings = steps_in_period(eqs, options.step(problem.units.frequency))
    enough = min(max(SETTLED * within, FINEST), ROUGHEST)
    periods = CompiledPeriods()
    halvings = max(halvings, 2)
    for k in range(halvings + 1):
        if progress is not None:
            progress(k / (halvings + 2.0))
        if (response := periodic_response(circuit, eqs, h / 2**k, enough, near)) is None:
            return None
        periods.responses.append(response)
        near = response
        power = periods.value("power")
        if k >= 2 and (power.bias or 0.0) <= within * abs(power.value):
            break
    return periods


def _differences(
    options: MonteCarloOptions, problem: Problem, response: "CircuitPeriod", deadline: float
) -> dict[str, float]:
    """How far ngspice's response at the same step is from ``response``; empty if it gives none in time."""
    steady = to_be_found(options, problem, RELTOL_OF_JUDGE)
    steady.deadline = deadline
    try:
        if not steady.begin(None, _origin(problem, response)):
            return {}
    except (CircuitError, MissingProgramError, OutOfTimeError):
        return {}
    judge = steady.responses[0, 0]
    names = ("power", "square", "displacement", "peak_displacement", "peak_voltage")
    both = {name: (float(getattr(judge, name)), float(getattr(response, name))) for name in names}
    return {name: abs(high - low) / low for name, (high, low) in both.items() if low > 0.0}


def _origin(problem: Problem, response: "CircuitPeriod") -> "Origin":
    """The start of ngspice's way: the middle of the kick of the state that was found."""
    from harvester.circuits.compiled_circuit import compiled_circuit
    from harvester.cosimulation.poincare_sections import CoupledState, Origin, unkicked
    from harvester.cosimulation.runs import in_ngspice

    path = response.path
    voltages = compiled_circuit(problem.load_circuit, problem.scales).voltages(response.state)
    assert path.shaking is not None, "the drive is steady"
    middle = unkicked(problem.equations, path.last, path.h, float(path.shaking[-1]))
    section = CoupledState.of_motion(middle[:-1], in_ngspice(voltages))
    return Origin(section, 0.0, response.turns)
