"""Engine `ideal`: Monte Carlo with the netlist's circuit made of ideal diodes and switches."""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.ensemble import Ensemble
from harvester.engines.model import Model
from harvester.engines.protocol import AnyScene, Progress
from harvester.equations.problem import Problem
from harvester.errors import SimulationError, names_arguments
from harvester.presentation.diagnostic import worded
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import amount

LONG = 1000.0  # periods of the mass
SLOW, WORSE = 0.02, 4.0  # of half a period: a switching that is told; what it may change of the power, over that


@names_arguments
@dataclass(frozen=True, kw_only=True)
class Ideal(Ensemble):
    """The coupled equations with a load circuit that is piecewise linear (`harvester.mechanics.rectifiers.circuit`).

    >>> import harvester as hv
    >>> hv.Ideal(within="2%", budget="1min").budget
    60.0

    Raises
    ------
    CannotServeError
        for a load resistance, a netlist of the user's own, whose switches are not known.
    UnboundedResponseError
        where no stationary response exists.
    """

    NAME: ClassVar[str] = "ideal"
    LOOK: ClassVar[EngineLook] = EngineLook(
        "ideal circuit (ensemble)", "#CC79A7", "D", (0, (1, 1)), width=3.0, order=2.5, paler=0.3, trust=2
    )
    takes_netlists: ClassVar[bool] = True
    needs_netlist: ClassVar[bool] = True
    next_fidelity: ClassVar[str | None] = "spice"
    REASON: ClassVar[str] = "the error of ideal diodes and switches is not known from within: compare with 'spice'"

    UNKNOWN: ClassVar[str] = "ideal diodes and switches"

    @classmethod
    def refusal(cls, problem: Problem) -> str:
        """Why the engine cannot serve a problem; empty where it can."""
        from harvester.cosimulation.idealised import TOPOLOGIES, ideal_circuit

        if problem.netlist is None:
            return "engine 'ideal' must have a netlist as load, but has none: use engine 'ensemble'"
        circuit = problem.circuit if problem.netlist in TOPOLOGIES else None
        if circuit is None or ideal_circuit(circuit, problem.scales) is None:
            return (
                f"engine 'ideal' must have one of the netlists {', '.join(TOPOLOGIES)}, but the load is "
                f"{problem.netlist!r}: use engine 'spice'"
            )
        return ""

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """As `Ensemble.run`; a start that is not forgotten in time is explained by the circuit's memory."""
        try:
            answer = super().run(scene, progress)
        except SimulationError as error:
            raise type(error)(f"{error}{_cause(Problem.of(scene))}") from None
        diagnostics = (*answer.diagnostics, *map(worded, _slow_switching(Problem.of(scene))))
        return dataclasses.replace(answer, effects=(*answer.effects, "ideal_circuit"), diagnostics=diagnostics)

    def model(self, problem: Problem) -> Model:
        """What is simulated for a problem that the engine serves."""
        from harvester.cosimulation.idealised import ideal_circuit

        assert problem.circuit is not None, "refusal checks this"
        circuit = ideal_circuit(problem.circuit, problem.scales)
        return Model(problem.equations, circuit, "load", problem.equations.beta or 0.0)


def _slow_switching(problem: Problem) -> list[str]:
    """A warning where the coil takes a good part of half a period for what ideal switches do at once.

    Under a sinusoid SSHI and SECE were off by up to 3 times that part of the power (`python benchmarks/products.py`).
    """
    from harvester.cosimulation.idealised import switching_time

    assert problem.circuit is not None, "the engine serves netlists only"
    frequency = problem.scales.frequency * max(problem.equations.drive_frequency or 1.0, 1.0)
    seconds = switching_time(problem.circuit, problem.scales)
    share = seconds * frequency / math.pi
    if share <= SLOW:
        return []
    told = (
        f"a switching takes the coil {amount(seconds, 's')}, {share:.2g} of half a period, "
        if problem.physical
        else f"a switching takes the coil {share:.2g} of half a period, "
    )
    return [
        f"{told}which ideal switches do at once: the power may be off by up to {WORSE:g} times that part of it; "
        "use engine 'spice', or a smaller L"
    ]


def _cause(problem: Problem) -> str:
    """What a circuit remembers for longer than the mass, in words that follow an error; empty where nothing is."""
    storage = None if problem.circuit is None else problem.circuit.storage
    period = 2.0 * math.pi / problem.scales.frequency
    if storage is None or storage < LONG * period:
        return ""
    s = problem.scales
    told = f"R C = {storage * s.frequency:.3g}/w0"
    if problem.physical:
        told = f"R C = {storage:.3g} s, where w0 is {s.frequency:.4g} rad/s,"
    return (
        f"; the cause is the time constant {told} of load and storage capacitor, which a mean must outlast: a smaller "
        "capacitor that still outlasts the mass's periods gives nearly the same mean power, sooner"
    )
