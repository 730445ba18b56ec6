"""Engine `compiled` under a steady excitation: the periodic response at several steps, and ngspice's from there."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from harvester.answers.estimate import Estimate
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import Progress, estimate
from harvester.engines.refinement import WITHIN, Refinement, Setting
from harvester.engines.spice.estimates import missed, motion_details
from harvester.engines.spice.steady_response import steps_in_period, to_be_found
from harvester.equations.bounds import linear_growth
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, MissingProgramError, OutOfTimeError
from harvester.linear.record_doubts import join_beyond, record_doubts
from harvester.netlists.for_ngspice import RELTOL_OF_JUDGE
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.messages.unknown_parts import COMPILED_CIRCUIT
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.circuits.circuit_period import CircuitPeriod, CircuitStart
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.cosimulation.poincare_sections import Origin

# of a circuit's step: with the usual 0.03 switches act at a little other times each period
TOLERANCE = 2e-3
JUDGED = 0.5  # of a budget, that ngspice may take
# s, and times the time of the response: how long ngspice may take without a budget
PATIENCE, AGAIN = 30.0, 3.0


@dataclass(kw_only=True)
class CompiledPeriods(Refinement["CircuitPeriod"]):
    """A response of a compiled ``circuit`` at steps that are halved, the longest ``h``.

    ``differences`` are ngspice's, relative, by quantities; ``progress`` has the part of the steps
    that may be needed.
    """

    circuit: "CompiledCircuit"
    eqs: Equations
    h: float
    progress: Progress | None = None
    differences: dict[str, float] = field(default_factory=dict)

    def begin(self, near: "CircuitStart | None") -> bool:
        """Find the response from rest, or near that of an excitation close by.

        Whether one comes back.
        """
        response = self._at(0, near)
        if response is not None:
            self.responses[0, 0] = response
        return response is not None

    def responses_at(self, settings: list[Setting]) -> "Iterator[CircuitPeriod | None]":
        """As of `Refinement`, each from the one before."""
        for halvings, _ in settings:
            yield self._at(halvings, self.last)

    def _at(self, halvings: int, near: "CircuitStart | None") -> "CircuitPeriod | None":
        """The response near another one, at the step that is halved so often."""
        from harvester.circuits.circuit_period import periodic_response

        if self.progress is not None:
            self.progress(halvings / (self.halvings + 2.0))
        return periodic_response(self.circuit, self.eqs, self.h / 2**halvings, self.enough, near)

    def value(self, name: str) -> Value:
        """A quantity of `errors` with its errors (step, settling) and model."""
        value, error = self.errors(name)
        if name not in self.differences:
            return Value(value, bias=error.total, unknown=COMPILED_CIRCUIT)
        return Value(value, bias=error.total, model=self.differences[name] * abs(value))


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
            options, problem, periods.responses[0, 0], time.monotonic() + patience
        )
    last = periods.last
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
    steps = sum(response.steps for response in periods.responses.values())
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
    """The response at three steps at least, until their error is below the target.

    None if none comes back.
    """
    from harvester.circuits.compiled_circuit import compiled_circuit

    eqs = problem.equations
    h, halvings = steps_in_period(eqs, options.step(problem.units.frequency))
    periods = CompiledPeriods(
        halvings=max(halvings, 2),
        within=within,
        circuit=compiled_circuit(problem.load_circuit, problem.scales, TOLERANCE),
        eqs=eqs,
        h=h,
        progress=progress,
    )
    if not periods.begin(near):
        return None
    periods.make_precise()
    return None if periods.unknown else periods


def _differences(
    options: MonteCarloOptions, problem: Problem, response: "CircuitPeriod", deadline: float
) -> dict[str, float]:
    """How far ngspice's response at the same step is from ``response``.

    Empty if it gives none in time.
    """
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
