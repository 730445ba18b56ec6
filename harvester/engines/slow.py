"""Engine `slow`: the mean power of a chip behind a rectifier, from the rectifier's mean current at a held voltage."""

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from harvester.answers.estimate import Estimate
from harvester.engines.compiled import Compiled
from harvester.engines.moment_existence import existence
from harvester.engines.options import Request, number
from harvester.engines.protocol import (
    AnyScene,
    Engine,
    Progress,
    estimate,
    needs_circuit,
    needs_compiled_circuit,
    served,
)
from harvester.engines.spice.estimates import missed
from harvester.equations.bounds import check_bounded
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, SimulationError, UnboundedResponseError
from harvester.machine.progress import listening
from harvester.presentation.diagnostic import Diagnostic, note, refusal, warning
from harvester.presentation.engine_look import EngineLook
from harvester.presentation.messages.unknown_parts import OWN_CLOCK
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.storage.checked_mean import SlowPower
    from harvester.storage.rectifier_cut import Cut

SETTLED = 0.02  # of the mean power: a change from part to part that is told
# of the time of the slow run: that of mass and circuit together, where the scales are not apart
TOGETHER = 0.25
LEAST_TOGETHER = 0.1  # of that, in a short budget
# of the rest of a budget, for its averages: burn-in, twice the step and ngspice have the rest
AVERAGING = 0.25


class Slow(Request, Engine):
    """The circuit behind the rectifier over minutes, fed by the rectifier's mean current (``harvester.storage``).

    Parameters
    ----------
    within, budget, seed : float or str or int, optional
        the options of `run`.
    judged : bool, default True
        False: the answer of `quick`, whose error is a few per cent.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.Slow().NAME
    'slow'

    Raises
    ------
    CannotServeError
        for a load without a bridge of diodes at the electrodes, elements that no compiled circuit
        has, and excitation that is neither harmonic nor white or coloured noise of a mass with one
        resting place.
    UnboundedResponseError
        if the response grows without bound.
    """

    judged: bool = True

    NAME = "slow"
    LOOK = EngineLook(
        "slow circuit, mean current of the rectifier",
        "#8C6D31",
        "p",
        (0, (5, 1)),
        order=2.5,
        trust=2,
    )
    takes_netlists = True
    needs_netlist = True
    by_mean_current = True
    next_fidelity = "spice"

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the engine does not support a problem; None if it does."""
        from harvester.storage.rectifier_cut import (
            cut_behind_rectifier,
            is_lossy_store,
            is_plain_store,
        )

        if (without := needs_circuit(problem, cls.NAME)) is not None:
            return without
        if not _serves_shaking(problem.equations):
            return refusal("needs_drive_or_noise", cls.NAME, engine=cls.NAME)
        if (other := needs_compiled_circuit(problem, cls.NAME)) is not None:
            return other
        plain = is_plain_store(problem.load_circuit) or is_lossy_store(problem.load_circuit)
        if plain or cut_behind_rectifier(problem.load_circuit) is None:
            return refusal("needs_chip", cls.NAME, engine=cls.NAME)
        return None

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """The mean power over the time of the slow run but for its first quarter, in which it settles."""
        from harvester.mechanics.kernels.compiled import compilation
        from harvester.storage import noisy_power, steady_power

        if not self.judged:
            return self.quick(scene)
        problem, cut = self._parted(scene)
        is_random = problem.equations.is_random
        power_of = noisy_power.noisy_power if is_random else steady_power.steady_power
        compile_direct = noisy_power.compile_direct if is_random else steady_power.compile_direct
        known = existence(problem)
        begin = time.perf_counter()
        budget = number(self.budget)
        with compilation(), listening(progress):
            if budget is not None:  # which does not include compilation
                self.quick(problem)
                compile_direct(problem, cut)
                begin = time.perf_counter()
            deadline = None if budget is None else begin + budget
            solution = power_of(problem, cut, self.seed, deadline)
        if solution is None:
            return self._in_short(problem, begin)
        together = not solution.scales_apart
        if together and is_random:
            direct = self._directly(problem, solution, progress, deadline)
            if direct is not None:
                return direct
            together = False
        scales = problem.scales
        power = solution.power.with_unknown(known.unknown)
        how = "run_directly" if together else "slow_circuit_alone"
        diagnostics = [
            note(how, direct=solution.direct, separation=solution.separation),
            known.warning,
        ]
        if not (together or solution.scales_apart):
            diagnostics.append(warning("scales_not_apart", separation=solution.separation))
        if not solution.has_whole_cycles:
            power = power.with_unknown(OWN_CLOCK)
            diagnostics.append(warning("clock_not_covered", period=solution.clock))
        if solution.changed > SETTLED:
            diagnostics.append(
                warning("slow_circuit_unsettled", seconds=solution.duration, share=solution.changed)
            )
        diagnostics.append(self._missed(power))
        return estimate(
            self.NAME,
            problem,
            v2=solution.square.scaled(scales.volts**-2),
            power=power.scaled(1.0 / scales.watts),
            diagnostics=diagnostics,
            seconds=time.perf_counter() - begin,
            steps=solution.steps,
            details={"duration": solution.duration, "step": solution.slow_step, **solution.load},
        )

    def _missed(self, power: Value) -> Diagnostic | None:
        """The warning that a power is not known ``within`` the target.

        None if it is, or there is none.
        """
        within = number(self.within)
        return None if within is None else missed(within, power)

    def _in_short(self, problem: Problem, begin: float) -> Estimate:
        """The quick answer, if the budget leaves no time for another; begun at ``begin``."""
        soon = self.quick(problem)
        short = warning("quick_in_budget", budget=number(self.budget))
        return replace(
            soon, diagnostics=(*soon.diagnostics, short), seconds=time.perf_counter() - begin
        )

    def _directly(
        self,
        problem: Problem,
        solution: "SlowPower",
        progress: Progress | None,
        deadline: float | None,
    ) -> Estimate | None:
        """Under noise the mean power of both together, over `TOGETHER` of the time of the slow run.

        A ``deadline`` of `time.perf_counter` makes it shorter; None if it would be less than
        `LEAST_TOGETHER` of that, or does not settle.
        """
        from harvester.mechanics.kernels.coefficients import BATCH

        seconds = TOGETHER * solution.duration
        if solution.clock:
            seconds = math.ceil(seconds / solution.clock) * solution.clock
        left = None
        if deadline is not None:
            left = max(deadline - time.perf_counter(), 0.0)
            share = AVERAGING * left / (BATCH * solution.pace * seconds)
            if share < LEAST_TOGETHER:
                return None
            seconds *= min(share, 1.0)
        engine = Compiled(
            seed=self.seed,
            duration=seconds * problem.scales.frequency / problem.units.frequency,
            trajectories=BATCH,
            budget=left,
        )
        try:
            direct = engine.run(problem, progress)
        except (UnboundedResponseError, CircuitError):
            raise
        except SimulationError:
            if left is None:
                raise
            return None
        duration = direct.details["duration"]
        how = note("run_directly", direct=duration, separation=solution.separation)
        remarks = [how, *direct.diagnostics, self._missed(direct.mean_power)]
        return replace(direct, engine=self.NAME, diagnostics=tuple(filter(None, remarks)))

    def quick(self, scene: AnyScene) -> Estimate:
        """The same in some hundredths of a second, off by a few per cent.

        Raises as `run`.
        """
        from harvester.storage.checked_mean import of_load
        from harvester.storage.quick_power import quick_power

        problem, cut = self._parted(scene)
        known = existence(problem)
        begin = time.perf_counter()
        power, square, path = quick_power(problem, cut)
        power, square = (value.with_unknown(known.unknown) for value in (power, square))
        v2 = square.scaled(problem.scales.volts**-2)
        power = power.scaled(1.0 / problem.scales.watts)
        return estimate(
            self.NAME,
            problem,
            v2=v2,
            power=power,
            diagnostics=[known.warning, self._missed(power)],
            seconds=time.perf_counter() - begin,
            steps=path.steps,
            details=of_load(path),
        )

    def _parted(self, scene: AnyScene) -> "tuple[Problem, Cut]":
        """The problem, and its circuit cut behind the rectifier; raises as `run`."""
        from harvester.storage.rectifier_cut import cut_behind_rectifier

        problem = served(type(self), scene)
        check_bounded(problem.equations, driven=True)
        cut = cut_behind_rectifier(problem.load_circuit)
        assert cut is not None, "refusal checks this"
        return problem, cut


def _serves_shaking(eqs: Equations) -> bool:
    """Whether it is a drive alone, or noise alone whose mean current does not wait for inter-well transitions."""
    if not eqs.is_random:
        return eqs.drive is not None
    known = eqs.drive is None and eqs.record is None and eqs.density is None
    return known and eqs.is_shaken and len(eqs.resting_places) == 1
