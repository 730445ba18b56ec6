"""Engine `ideal`: Monte Carlo with the netlist's circuit made of ideal diodes and switches."""

import dataclasses
import math
from typing import TYPE_CHECKING, Self

from harvester.answers.estimate import Estimate
from harvester.engines.ensemble import Ensemble
from harvester.engines.options import number
from harvester.engines.protocol import AnyScene, Progress, needs_circuit
from harvester.engines.sampling import Model
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import Diagnostic, note, refusal, warning
from harvester.presentation.engine_look import EngineLook
from harvester.presentation.messages.unknown_parts import IDEAL_ELEMENTS

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair

LOW = 4.0  # V rms of a SECE
LONG = 1000.0  # periods of the mass
# of half a period: a switching that is told; what it may change of the power, over that
SLOW, WORSE = 0.02, 4.0


class Ideal(Ensemble):
    """The coupled equations with a load circuit that is piecewise linear.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Ideal(within="2%", budget="1min").budget
    60.0

    Parameters
    ----------
    within, budget, seed, duration, trajectories, dt : float or str or int, optional
        the options of `run`.
    judged : bool, default True
        measure the error of the ideal elements against the compiled circuit; False: it stays
        unknown.

    Raises
    ------
    CannotServeError
        for a load resistance, a netlist of the user's own, whose switches are not known.
    UnboundedResponseError
        if no stationary response exists.
    """

    NAME = "ideal"
    LOOK = EngineLook(
        "ideal circuit (ensemble)",
        "#CC79A7",
        "D",
        (0, (1, 1)),
        width=3.0,
        order=2.5,
        paler=0.3,
        trust=2,
    )
    takes_netlists = True
    needs_netlist = True
    next_fidelity = "spice"
    MODEL_NOTE = "ideal_elements"
    BEYOND = "elements_beyond"
    UNKNOWN = IDEAL_ELEMENTS

    judged: bool = True

    @property
    def at_many_points(self) -> Self:
        """Without the reference of each point."""
        return dataclasses.replace(self, judged=False)

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the engine does not support a problem; None if it can."""
        from harvester.circuits.idealised import TOPOLOGIES, ideal_circuit

        if (without := needs_circuit(problem, cls.NAME)) is not None:
            return without
        if (
            problem.netlist not in TOPOLOGIES
            or ideal_circuit(problem.load_circuit, problem.scales) is None
        ):
            known = ", ".join(TOPOLOGIES)
            return refusal(
                "needs_ideal_circuit",
                cls.NAME,
                engine=cls.NAME,
                known=known,
                netlist=problem.netlist,
            )
        return None

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """As `Ensemble.run`; a start that is not forgotten in time is explained by the circuit's memory."""
        try:
            answer = super().run(scene, progress)
        except SimulationError as error:
            raise _with_cause(error, Problem.of(scene)) from None
        return self.remarked(answer, Problem.of(scene))

    @property
    def runs_together(self) -> bool:
        """Whether scenes may run side by side: without the reference of each, which compares trajectories."""
        return not self.judged

    def remarked(self, answer: Estimate, problem: Problem) -> Estimate:
        """The answer with warnings of its switches, low voltages and elements."""
        diagnostics = (
            *answer.diagnostics,
            *_slow_switching(problem),
            *_low_voltage(problem, answer),
        )
        return dataclasses.replace(
            answer, effects=(*answer.effects, "ideal_circuit"), diagnostics=diagnostics
        )

    def model(self, problem: Problem) -> Model:
        """The simulation for a problem that the engine supports."""
        from harvester.circuits.idealised import ideal_circuit

        circuit = ideal_circuit(problem.load_circuit, problem.scales)
        return Model(problem.equations, circuit, "load", problem.equations.beta or 0.0)

    def model_errors(
        self, problem: Problem, pair: "RichardsonPair", begin: float
    ) -> tuple[dict[str, float], str]:
        """How far the compiled circuit is on the same noise, if that can be measured in the rest of a budget."""
        from harvester.engines.ideal_difference import difference_from_compiled

        budget = number(self.budget)
        deadline = math.inf if budget is None else begin + budget
        difference = difference_from_compiled(problem, pair, deadline) if self.judged else {}
        return difference, "ideal_difference" if difference else self.MODEL_NOTE


def _slow_switching(problem: Problem) -> tuple[Diagnostic, ...]:
    """A warning if the inductor needs a good part of half a period for the inversion that ideal switches make at once.

    Under a sinusoid SSHI and SECE were off by up to 3 times that part of the power (`python
    benchmarks/products.py`).
    """
    from harvester.circuits.idealised import switching_time

    eqs = problem.equations
    frequency = problem.scales.frequency * max(eqs.drive_frequency or 1.0, eqs.highest_frequency)
    seconds = switching_time(problem.load_circuit, problem.scales)
    share = seconds * frequency / math.pi
    numbers = {"seconds": seconds, "share": share, "worse": WORSE}
    return (
        (warning("slow_switching", **numbers, physical=problem.physical),) if share > SLOW else ()
    )


def _low_voltage(problem: Problem, answer: Estimate) -> tuple[Diagnostic, ...]:
    """A warning if a SECE's voltage is low compared with the losses of its diodes and switch."""
    volts = math.sqrt(max(answer.mean_square_voltage.value, 0.0))
    low = (
        problem.physical
        and problem.load_circuit.topology == "sece"
        and problem.equations.is_random
        and volts < LOW
    )
    return (warning("low_voltage", volts=volts),) if low else ()


def _with_cause(error: SimulationError, problem: Problem) -> SimulationError:
    """The error, with the memory of a circuit that outlasts the mass's, if that is the cause."""
    storage = problem.load_circuit.storage
    w0 = problem.scales.frequency
    if storage is None or storage < LONG * 2.0 * math.pi / w0:
        return error
    numbers = (storage, w0) if problem.physical else (storage * w0, None)
    return type(error)(
        f"{error}; {note('slow_circuit', constant=numbers[0], frequency=numbers[1])}"
    )


def without_ngspice(problem: Problem) -> type[Ensemble] | None:
    """The engine that samples a problem without ngspice.

    None for a circuit without an ideal one.
    """
    return next((kind for kind in (Ensemble, Ideal) if kind.refusal(problem) is None), None)
