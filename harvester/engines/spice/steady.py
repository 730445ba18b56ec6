"""Engine `spice` under a steady excitation: one periodic response, at several steps and tolerances.

Nothing is sampled.

The response is found once, from rest or from a neighbouring one, and followed to steps of a half
and a quarter and to a tenth of ngspice's tolerance (`harvester.engines.refinement`); ngspice
integrates by the trapezoidal rule, or by Gear's if that does not converge. If neither does, each
node has a capacitance to ground, which is halved with the first tenth of the tolerance.
"""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from harvester.engines.refinement import TENTH, Refinement, Setting
from harvester.errors import CircuitError, ConvergenceError, OutOfTimeError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.presentation.messages.unknown_parts import STEP_AND_TOLERANCE
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.cosimulation.periodic_responses import Neighbour, PeriodicResponse
    from harvester.cosimulation.poincare_sections import CoupledState, Origin
    from harvester.cosimulation.runs import CoupledDevice

# of the first step at most, and the smallest tolerance
HALVINGS = 4
TIGHTEST = 0.9e-7
REMAINS = 0.5  # of the tolerance's change at a tenth of it: an error as reltol^(2/3), doubled
RUNNING = 0.5  # of the budget, for the runs at least: their processes take some seconds to start
SAME_PHASE = 1e-9  # of the excitation's period
# of the error asked for: a tolerance's part that is measured at one of so many neighbours
LITTLE = 0.02
NEIGHBOURS = 8


@dataclass(kw_only=True)
class Steady(Refinement["PeriodicResponse"]):
    """A periodic response at several steps and tolerances of ngspice.

    ``first`` is the device of the longest step and of the largest tolerance; ``continued`` states
    that the response comes from that of a scene a little different, and not from rest: from
    ``before``, at the longest step.  For that scene ``near`` has the other steps, and ``reused`` is
    the relative tolerance error that was measured so many neighbours ago.
    """

    first: "CoupledDevice"
    deadline: float = math.inf
    continued: bool = False
    near: "Steady | None" = None
    before: "CoupledState | None" = None
    reused: tuple[float, int] | None = None
    warm_up_seconds: float = 0.0

    @property
    def tolerant(self) -> bool:
        """Whether the circuit is not linear: ngspice makes its steps by the tolerance."""
        return not self.first.load.linear

    @property
    def remains(self) -> float:
        """As of `Refinement`.

        Gear's damping falls more slowly, and of the effect of capacitances from each node to
        ground, half remains.
        """
        return REMAINS if self.first.trapezoidal and not self.first.shunt else 1.0

    @property
    def tolerance_error(self) -> float | None:
        """That of a neighbour (`reusable`)."""
        return None if self.reused is None else self.reused[0]

    def has_tolerance(self, tenths: int) -> bool:
        """As of `Refinement`."""
        return self.first.reltol * TENTH**tenths > TIGHTEST

    def begin(self, near: "Neighbour | None", origin: "Origin | None" = None) -> bool:
        """Find the response from ``origin`` (None: rest), or the one that ``near`` leads to.

        Whether one comes back.

        Raises OutOfTimeError at the deadline.
        """
        from harvester.cosimulation.coupled_period import periodic_response
        from harvester.cosimulation.poincare_sections import CoupledState, Origin
        from harvester.cosimulation.worker_pool import map_in_workers

        origin = origin or Origin(CoupledState(self.first.eqs.resting_places[0]))
        before = None if self.near is None else self.near.before
        ahead = near
        so_far = None
        if near is not None:
            if before is not None and before.nodes.keys() == near.section.nodes.keys():
                ahead = dataclasses.replace(near, section=near.section.moved(before, near.section))
            self.continued = True
            self.before = near.section
        for trapezoidal, start_near in ((True, ahead), (False, near)):
            self.first = dataclasses.replace(self.first, trapezoidal=trapezoidal)
            given = self.first, origin, self.deadline, self.enough, start_near
            try:
                response = next(map_in_workers(periodic_response, [given]))
            except OutOfTimeError as error:
                error.so_far = error.so_far or so_far
                raise
            except (
                CircuitError
            ) as error:  # it may be a state on the way that ngspice cannot begin with: a run tells
                so_far = error.so_far
                self.diverged = self.diverged or isinstance(error, ConvergenceError)
                continue
            if response is not None:
                self.responses[0, 0] = response
            return response is not None
        return False

    def responses_at(self, settings: list[Setting]) -> "Iterable[PeriodicResponse | None]":
        """As of `Refinement`, side by side."""
        from harvester.cosimulation.coupled_period import same_response
        from harvester.cosimulation.worker_pool import map_in_workers

        jobs = []
        for halvings, tenths in settings:
            h = self.first.h / 2**halvings
            reltol = self.first.reltol * TENTH**tenths
            device = dataclasses.replace(
                self.first, h=h, reltol=reltol, shunt=self.first.shunt / 2**tenths
            )
            jobs.append((device, self._guess((halvings, tenths)), self.deadline, self.enough))
        return map_in_workers(same_response, jobs)

    def _guess(self, setting: Setting) -> "PeriodicResponse":
        """The start of a search for a further response: the neighbour's, moved as those at the longest step are apart.

        Without such a neighbour it is the last one here.
        """
        there = None if self.near is None else self.near.responses.get(setting)
        if there is None or self.near is None:
            return self.last
        since = self.near.responses[0, 0]
        now = self.responses[0, 0]
        if (
            there.turns != now.turns
            or max(abs(near.phase - now.phase) for near in (there, since)) > SAME_PHASE
        ):
            return self.last
        if there.section.nodes.keys() != now.section.nodes.keys():
            return self.last
        section = there.section.moved(since.section, now.section)
        return dataclasses.replace(there, section=section, secants=now.secants)

    @property
    def shunted(self) -> Diagnostic | None:
        """The warning that each node has a capacitance to ground; None if it has none."""
        if not (shunt := self.first.shunt):
            return None
        return warning(
            "shunted_response", share=shunt, capacitance=shunt * self.first.scales.capacitance
        )

    def reusable(self) -> tuple[float, int] | None:
        """The value of a neighbour for the relative tolerance error.

        None if it must measure that.
        """
        if self.unknown or self.tenths or self.first.probes:
            return None
        if self.reused is not None:
            error, neighbours = self.reused
            return (error, neighbours + 1) if neighbours < NEIGHBOURS else None
        value, of_power = self.errors("power")
        least = LITTLE * self.within
        return (least, 1) if of_power.tolerance < 0.5 * least * abs(value) else None

    def value(self, name: str) -> Value:
        """A quantity of `errors` with its total error.

        As it was last found and without, if that is not known.
        """
        if self.unknown:
            return Value(float(getattr(self.last, name)), unknown=STEP_AND_TOLERANCE)
        value, error = self.errors(name)
        return Value(value, bias=error.total)

    def measure(self) -> None:
        """As of `Refinement`; if the tolerance made next to nothing in a neighbour, it is not measured again."""
        self.reused = None if self.near is None or not self.tolerant else self.near.reusable()
        super().measure()
