"""Engine `compiled`: Monte Carlo with the netlist as a compiled circuit."""

import dataclasses
import math
import time
from typing import TYPE_CHECKING

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.engines.ensemble import Ensemble
from harvester.engines.moment_existence import existence
from harvester.engines.not_periodic import sampled_instead
from harvester.engines.options import number
from harvester.engines.protocol import (
    AnyScene,
    Progress,
    needs_circuit,
    needs_compiled_circuit,
    served,
)
from harvester.engines.sampling import Model
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.presentation.engine_look import EngineLook
from harvester.presentation.messages.unknown_parts import COMPILED_CIRCUIT, OWN_CLOCK, STORAGE

if TYPE_CHECKING:
    from harvester.circuits.circuit_period import CircuitStart
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories

# fewest periods of a circuit's slowest clock in averages; part of that, as a rate has an error
PERIODS = 4
WHOLE = 0.98
NEAR = 0.15  # of a target, below which half of these runs do
# s, of a response that never comes back, where no accuracy and no budget are given
LONGEST_SAMPLING = 120.0


class Compiled(Ensemble):
    """Simulate the netlist as a compiled circuit coupled to the mechanics, without ngspice.

    Parameters
    ----------
    within, budget, seed, duration, trajectories, dt : float or str or int, optional
        As in `run`.
    probe : tuple of str
        Circuit quantities to report, such as "store" or "v(a,b)".
    ledger : bool, default False
        Also report the mean power dissipated in each element.
    judged : bool, default True
        Measure the model error against ngspice; False: it stays unknown.

    Raises
    ------
    CannotServeError
        The load is a resistance, or the netlist has an unsupported element.
    UnboundedResponseError
        No stationary response exists.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Compiled(within="2%", budget="1min").budget
    60.0
    """

    probe: tuple[str, ...] = ()
    ledger: bool = False
    judged: bool = True

    NAME = "compiled"
    LOOK = EngineLook(
        "compiled circuit (ensemble)",
        "#E69F00",
        "h",
        (0, (3, 1, 1, 1)),
        width=2.5,
        order=2.6,
        paler=0.3,
        trust=3,
    )
    takes_netlists = True
    needs_netlist = True
    next_fidelity = "spice"
    MODEL_NOTE = "compiled_circuit"
    SEARCHES = False
    JUDGED_FIRST = True
    BEYOND = "compiled_beyond"
    follows_periods = True
    UNKNOWN = COMPILED_CIRCUIT

    @property
    def runs_together(self) -> bool:
        """Whether scenes run side by side: each circuit has a kernel of its own."""
        return False

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the engine does not support a problem; None if it can."""
        return needs_circuit(problem, cls.NAME) or needs_compiled_circuit(problem, cls.NAME)

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """As `Ensemble.run`; under steady excitation the periodic response, unless trajectories or a time are given."""
        return self.run_from(scene, None, progress, self.judged)[0]

    def run_from(
        self,
        scene: AnyScene,
        near: "CircuitStart | None",
        progress: Progress | None = None,
        judged: bool = True,
    ) -> "tuple[Estimate, CircuitStart | None]":
        """As `run`, and any periodic response: from rest, or from ``near``, that of an excitation close by.

        Without ``judged`` ngspice is not asked how far it is from that.
        """
        from harvester.circuits.compiled_circuit import compiled_circuit
        from harvester.engines.compiled_steady import TOLERANCE, steady_answer
        from harvester.engines.compiled_watch import check_watched, period_paths, with_watched

        problem = served(type(self), scene)
        self.check_times(problem.physical)
        if watches := bool(self.probe or self.ledger):
            circuit = compiled_circuit(problem.load_circuit, problem.scales, TOLERANCE)
            check_watched(problem, circuit, self.probe, self.ledger)
        is_sampled = not problem.equations.is_steady
        if is_sampled or (self.trajectories, self.duration) != (None, None):
            return super().run(problem, progress), None
        existence(problem)
        answer, response = steady_answer(self, self.NAME, problem, near, judged, progress)
        if answer is not None:
            if watches and response is not None:
                paths = period_paths(problem, response, circuit, self.ledger)
                answer = with_watched(answer, problem, circuit, paths, self.probe, self.ledger)
            return answer, response
        if near is not None:
            return self.run_from(problem, None, progress, judged)
        patient = (self.within, self.budget) != (None, None)
        bounded = self if patient else dataclasses.replace(self, budget=LONGEST_SAMPLING)
        sampling = super(Compiled, bounded).run
        return sampled_instead(problem, lambda: sampling(problem, progress)), None

    def pilot(self, problem: Problem, trajectories: "Trajectories") -> "Trajectories":
        """Those of the circuit made of ideal elements under white noise, if the netlist has them."""
        from harvester.circuits.idealised import ideal_circuit
        from harvester.mechanics.ensemble.compiled_pair import compile_pair
        from harvester.mechanics.ensemble.trajectories import Trajectories
        from harvester.mechanics.kernels.noise import child

        eqs = problem.equations
        ideal = ideal_circuit(problem.load_circuit, problem.scales)
        if ideal is None or not eqs.is_shaken_by_white_noise or eqs.has_unlike_wells:
            return trajectories
        seed = child(trajectories.seed, 4)
        pilot = Trajectories(
            eqs, trajectories.count, seed, self.step(problem.units.frequency), circuit=ideal
        )
        compile_pair(pilot, number(self.budget))
        return pilot

    def model_errors(
        self, problem: Problem, pair: "RichardsonPair", begin: float
    ) -> tuple[dict[str, float], str]:
        """The largest relative difference from ngspice, if that is asked and answers."""
        return self._difference(problem, pair)

    def late_model_errors(
        self, problem: Problem, pair: "RichardsonPair", left: float
    ) -> tuple[dict[str, float], str]:
        """The same within the time ``left`` (s), if that is more than the first attempt had."""
        from harvester.engines.spice.difference import SHARE

        if left <= SHARE * (number(self.budget) or math.inf):
            return {}, self.MODEL_NOTE
        return self._difference(problem, pair, left)

    def _difference(
        self, problem: Problem, pair: "RichardsonPair", seconds: float | None = None
    ) -> tuple[dict[str, float], str]:
        """The largest relative difference from ngspice within ``seconds``, and its note's code."""
        if not self.judged:
            return {}, self.MODEL_NOTE
        from harvester.engines.spice.cheap_model import settled_starts
        from harvester.engines.spice.difference import LONGEST, difference_from_ngspice

        trajectories = pair.trajectories
        settling, starts = settled_starts(pair, trajectories.loaded.memory, LONGEST, self.seed)
        enough = NEAR * (number(self.within) or 0.0)
        difference = difference_from_ngspice(
            problem, trajectories.h, starts, settling, self, enough, seconds=seconds
        )
        return difference, "difference_measured" if difference else self.MODEL_NOTE

    def cover(self, problem: Problem, pair: "RichardsonPair", begin: float) -> None:
        """Average over whole periods of the circuit's clocks, if that fits into the budget."""
        budget = number(self.budget)
        period = _clock(problem, pair) * problem.scales.frequency
        if not period or budget is None or self.duration is not None:
            return
        more = max(math.ceil(pair.duration / period), PERIODS) * period - pair.duration
        if pair.seconds_a_unit * more < begin + budget - time.perf_counter():
            pair.extend(more)

    def not_covered(
        self, problem: Problem, pair: "RichardsonPair"
    ) -> tuple[str, Diagnostic | None]:
        """Storage that still changes much, or a clock of which the averages have fewer than four periods."""
        from harvester.mechanics.ensemble.burn_in import CHARGED

        power = pair.mean("load")[0]
        if pair.charging > CHARGED * power:
            share = pair.charging / power if power > 0.0 else None
            return STORAGE, warning("storage_not_settled", share=share)
        period = _clock(problem, pair)
        if WHOLE * PERIODS * period * problem.scales.frequency > pair.duration:
            return OWN_CLOCK, warning("clock_not_covered", period=period)
        return "", None

    def looked_into(self, answer: Estimate, problem: Problem, pair: "RichardsonPair") -> Estimate:
        """The answer with the probes and elements that are asked for, along trajectories from settled states."""
        from harvester.circuits.compiled_circuit import CompiledCircuit
        from harvester.engines.compiled_watch import sampled_paths, with_watched

        circuit = pair.trajectories.circuit
        if not (self.probe or self.ledger) or not isinstance(circuit, CompiledCircuit):
            return answer
        paths = sampled_paths(problem, pair, circuit, self.seed, self.ledger)
        return with_watched(answer, problem, circuit, paths, self.probe, self.ledger)

    def pair_diagnostic(self, pair: "RichardsonPair") -> Diagnostic | None:
        """A warning if circuit steps did not converge, so that it was held for a while."""
        steps, failed = pair.trajectories.own_sums
        return warning("circuit_not_converged", share=float(failed / steps)) if failed else None

    def model(self, problem: Problem) -> Model:
        """The simulation for a problem that the engine supports."""
        from harvester.circuits.compiled_circuit import compiled_circuit

        circuit = compiled_circuit(problem.load_circuit, problem.scales)
        return Model(problem.equations, circuit, "load", problem.equations.beta or 0.0)


def _clock(problem: Problem, pair: "RichardsonPair") -> float:
    """The longest period (s) of a clock of the compiled circuit, by the last averages.

    0 without one.
    """
    from harvester.circuits.clocks import Clocks
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.kernels.trajectory_batch import MASS_ROWS

    circuit = pair.trajectories.circuit
    if not pair.looks or not isinstance(circuit, CompiledCircuit):
        return 0.0
    times = [look.time for look in pair.looks]
    states = np.array([look.state for look in pair.looks])
    seconds = np.diff(times)[:, None] / problem.scales.frequency
    return Clocks(circuit).slowest(states[:, MASS_ROWS : circuit.rows], seconds)
