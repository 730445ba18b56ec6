"""Engine `spice` under a steady excitation: one periodic response, at several steps and tolerances; nothing is sampled.

The response is found once, from rest or from a neighbouring one, and followed to steps of a half
and a quarter and to a tenth of ngspice's tolerance; ngspice integrates by the trapezoidal rule, or
by Gear's if that does not converge. If neither does, each node has a capacitance to ground,
which is halved with the first tenth of the tolerance. The change by the step is extrapolated if
it falls by the order (`harvester.uncertainty.richardson`), that by the tolerance is
added; the remaining changes by both, and by further settling, are the error.

Long because the way to smaller steps and tolerances, and the error of its end, read the same
responses.
"""

import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from harvester.engines.protocol import Progress
from harvester.errors import CircuitError, ConvergenceError, OutOfTimeError
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.messages.unknown_parts import STEP_AND_TOLERANCE
from harvester.uncertainty.richardson import limit
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.cosimulation.periodic_responses import Neighbour, PeriodicResponse
    from harvester.cosimulation.poincare_sections import CoupledState, Origin
    from harvester.cosimulation.runs import CoupledDevice

WITHIN = 1e-3  # relative error that is worked towards where none is asked for
# of the first step at most, and the smallest tolerance
HALVINGS = 4
TIGHTEST = 0.9e-7
# of the error that is asked for: what the tolerance may make while the step is still halved
BORNE = 0.7
TENTH = 0.1  # of the tolerance, to see what it does
REMAINS = 0.5  # of that change, at a tenth of the tolerance: of an error as reltol^(2/3), doubled
RUNNING = 0.5  # of the budget, for the runs at least: their processes take some seconds to start
# of the error that is asked for: what settling may leave, relative to the response's size
SETTLED = 0.1
ROUGHEST, FINEST = 3e-4, 1e-6  # the same, of the response's size
FEWEST_STEPS = 64  # steps in a period, of the longest step
SAME_PHASE = 1e-9  # of the excitation's period
# of the error asked for: a tolerance's part that is measured at one of so many neighbours
LITTLE = 0.02
NEIGHBOURS = 8


@dataclass
class Steady:
    """A periodic response at several steps and tolerances of ngspice.

    ``responses`` has it by how often the step was halved and the tolerance divided by ten.  The
    mean is that of the tolerance ``tenths``, at the last three steps there are for it; the finest
    of them is there for the next tolerance as well.  ``first`` is the device of the longest step,
    which may be halved ``halvings`` times, and of the largest tolerance; ``within`` is the relative
    error to work towards; ``unknown`` states why the error is not known, if it is not;
    ``continued`` that it comes from that of a scene a little different, and not from rest: from
    ``before``, at the longest step.  For that scene ``near`` has the other steps, and ``reused`` is
    the relative tolerance error that was measured so many neighbours ago.  ``diverged`` states that
    some run did not converge.
    """

    first: "CoupledDevice"
    halvings: int
    deadline: float
    within: float = WITHIN
    responses: "dict[tuple[int, int], PeriodicResponse]" = field(default_factory=dict)
    tenths: int = 0
    unknown: Diagnostic | None = None
    continued: bool = False
    near: "Steady | None" = None
    before: "CoupledState | None" = None
    reused: tuple[float, int] | None = None
    warm_up_seconds: float = 0.0
    diverged: bool = False

    @property
    def enough(self) -> float:
        """The remainder of the settling, relative to the response's size."""
        return min(max(SETTLED * self.within, FINEST), ROUGHEST)

    @property
    def remains(self) -> float:
        """For the change to a tenth of the tolerance, the remainder there.

        Gear's damping falls more slowly, and of the effect of capacitances from each node to
        ground, half remains.
        """
        return REMAINS if self.first.trapezoidal and not self.first.shunt else 1.0

    @property
    def finest(self) -> int:
        """How often the step was halved, at most, at the tolerance that counts."""
        return max(halvings for halvings, tenths in self.responses if tenths == self.tenths)

    @property
    def last(self) -> "PeriodicResponse":
        """The response at the finest step."""
        return self.responses[self.finest, self.tenths]

    def begin(self, near: "Neighbour | None", origin: "Origin | None" = None) -> bool:
        """Find the response from ``origin`` (None: rest), or the one that ``near`` leads to; whether one comes back.

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

    def continue_to(self, settings: list[tuple[int, int]]) -> None:
        """Find the response at further (halvings, tenths), side by side."""
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
        try:
            for setting, response in zip(
                settings, map_in_workers(same_response, jobs), strict=True
            ):
                if response is None:
                    self.unknown = _unknown("lost")
                    return
                self.responses[setting] = response
        except OutOfTimeError:
            self.unknown = _unknown("budget")
        except CircuitError as error:
            self.diverged = self.diverged or isinstance(error, ConvergenceError)
            self.unknown = _unknown("circuit", str(error))

    def _guess(self, setting: tuple[int, int]) -> "PeriodicResponse":
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
        """The value of a neighbour for the relative tolerance error; None if it must measure that."""
        if self.unknown or self.tenths or self.first.probes:
            return None
        if self.reused is not None:
            error, neighbours = self.reused
            return (error, neighbours + 1) if neighbours < NEIGHBOURS else None
        value, (_, tolerance, _) = self.errors("power")
        least = LITTLE * self.within
        return (least, 1) if tolerance < 0.5 * least * abs(value) else None

    def errors(self, name: str) -> tuple[float, tuple[float, float, float]]:
        """The ``power``, ``square`` or ``displacement``, and its errors: by step, ngspice's tolerance and settling."""
        finest, tenths = self.finest, self.tenths
        three = [self.responses[k, tenths] for k in range(finest - 2, finest + 1)]
        values = [float(getattr(response, name)) for response in three]
        value, step = limit(values)
        which = 0 if name == "power" else 1
        lefts = [
            float(response.left[which]) * abs(v) for response, v in zip(three, values, strict=True)
        ]
        left = (4.0 * lefts[-1] + lefts[-2]) / 3.0  # as the limit weighs them
        tighter = self.responses.get((finest, tenths + 1))
        change = 0.0 if tighter is None else float(getattr(tighter, name)) - values[-1]
        tolerance = (
            self.remains * abs(change) if self.reused is None else self.reused[0] * abs(value)
        )
        return value + change, (step, tolerance, left)

    def value(self, name: str) -> Value:
        """A quantity of `errors` with its total error; as it was last found and without, if that is not known."""
        if self.unknown:
            return Value(float(getattr(self.last, name)), unknown=STEP_AND_TOLERANCE)
        value, parts = self.errors(name)
        return Value(value, bias=sum(parts))

    def measure(self, tolerant: bool) -> None:
        """Find the response at two smaller steps, and if ngspice is ``tolerant``, at a tenth of its tolerance.

        If the tolerance alone makes too large an error, the steps are those of that tenth.  If it
        made next to nothing in a neighbour, it is not measured again.
        """
        self.reused = None if self.near is None or not tolerant else self.near.reusable()
        if not tolerant or self.reused is not None:
            return self.continue_to([(1, 0), (2, 0)])
        self.continue_to([(2, 0), (2, 1)])
        if self.unknown:
            return None
        rough, fine = (self.responses[2, tenths].power for tenths in (0, 1))
        if (
            self.remains * abs(fine - rough) < BORNE * self.within * abs(fine)
            or self.first.reltol * TENTH**2 < TIGHTEST
        ):
            return self.continue_to([(1, 0)])
        self.tenths = 1
        return self.continue_to([(2, 2), (1, 1), (0, 1)])

    def improve(self) -> bool:
        """Halve the step, or continue with the next tolerance, by the larger error; whether there is one."""
        _, (step, tolerance, _) = self.errors("power")
        finest, tenths = self.finest, self.tenths
        before = dict(self.responses)
        finer = finest < self.halvings
        tighter = (finest, tenths + 1) in self.responses
        if (
            tighter
            and self.first.reltol * TENTH ** (tenths + 2) > TIGHTEST
            and (tolerance > step or not finer)
        ):
            top = min(finest + (step > 0.25 * tolerance), self.halvings)
            row = [
                (k, tenths + 1)
                for k in range(top - 2, top + 1)
                if (k, tenths + 1) not in self.responses
            ]
            self.continue_to([*row, (top, tenths + 2)])
            tenths += 1
        elif finer:
            self.continue_to(
                [(finest + 1, tenths), *([(finest + 1, tenths + 1)] if tighter else [])]
            )
        else:
            return False
        if self.unknown:  # what was known before is known all the same
            self.responses = before
            self.unknown = None
            return False
        self.tenths = tenths
        return True

    def make_precise(self, progress: Progress | None = None) -> None:
        """Go on to smaller steps and tolerances until the power error is known, and small enough."""
        if self.halvings < 2:
            self.unknown = _unknown("step")
            return
        self.measure(not self.first.load.linear)
        going = self.unknown is None
        while going:
            power = self.value("power")
            share = power.known_error95 / abs(power.value) / self.within if power.value else 0.0
            if progress is not None:
                progress(1.0 / max(share, 1.0))
            going = share > 1.0 and self.improve()


def _unknown(why: str, error: str = "") -> Diagnostic:
    """The note that the error is not known, and why."""
    return note("precision_unknown", why=why, steps=4 * FEWEST_STEPS, error=error)
