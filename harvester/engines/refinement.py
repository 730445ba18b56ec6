"""A periodic response at several steps, and at several tolerances of its circuit, until its error is small enough.

The step is halved, and the tolerance divided by ten.  A mean E is then

    E = E_0 + D,   error = step + r |D| + (4 l_h + l_2h)/3

with the limit E_0 of the last three steps and its error (`harvester.uncertainty.richardson.limit`),
the change D to a tenth of the tolerance at the finest of them, of which r remains beyond it, and
the parts l of the means at the steps h and 2 h that settling further may change, with the limit's
weights.  A kind of load has a class that finds its responses (`Refinement.responses_at`), the fixed points
of its `harvester.mechanics.period_map.PeriodMap`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from operator import attrgetter, itemgetter
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from harvester.arrays import Floats
from harvester.errors import CircuitError, ConvergenceError, OutOfTimeError
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.uncertainty.richardson import limit

WITHIN = 1e-3  # relative error that is worked towards where none is asked for
# as a part of the asked error: the tolerance's largest while the step is still halved
BORNE = 0.7
TENTH = 0.1  # times the tolerance, to see its effect
# as a part of the asked error: the remainder of settling, relative to the response's size
SETTLED = 0.1
ROUGHEST, FINEST = 3e-4, 1e-6  # the same, of the response's size
FEWEST_STEPS = 64  # steps in a period, of the longest step

Setting = tuple[int, int]
"""How often the step was halved, and the tolerance divided by ten."""


class Settled(Protocol):
    """A response that has settled, with its means as attributes."""

    @property
    def power(self) -> float:
        """The mean power (W) of Rload."""

    @property
    def left(self) -> Floats | tuple[float, float]:
        """The parts of the power and of the mean square voltage that settling further may change."""


Response = TypeVar("Response", bound=Settled)


class ErrorParts(NamedTuple):
    """Three errors: by the step, by the circuit's tolerance and by settling."""

    step: float
    tolerance: float
    settling: float

    @property
    def total(self) -> float:
        """Their sum, for they may be of one sign."""
        return self.step + self.tolerance + self.settling


@dataclass(kw_only=True)
class Refinement(ABC, Generic[Response]):
    """A periodic response at several steps and tolerances.

    ``responses`` has it by `Setting`.  The mean is that of the tolerance ``tenths``, at the last
    three steps there are for it; the finest of them is there for the next tolerance as well.  The
    step may be halved ``halvings`` times; ``within`` is the target for the power's relative error.
    ``unknown`` states why the error is not known, if it is not, and ``diverged`` that some circuit
    did not converge.
    """

    halvings: int
    within: float = WITHIN
    responses: dict[Setting, Response] = field(default_factory=dict)
    tenths: int = 0
    unknown: Diagnostic | None = None
    diverged: bool = False

    @abstractmethod
    def responses_at(self, settings: list[Setting]) -> Iterable[Response | None]:
        """The response at each of further settings, None for one at which it has disappeared.

        Raises OutOfTimeError at a deadline, and CircuitError if the circuit has no way on.
        """

    @property
    def tolerant(self) -> bool:
        """Whether the circuit has a tolerance that may make an error."""
        return False

    @property
    def remains(self) -> float:
        """For the change to a tenth of the tolerance, the remainder there."""
        return 1.0

    @property
    def tolerance_error(self) -> float | None:
        """The relative error by the tolerance if it is known without a tenth of it."""
        return None

    def has_tolerance(self, tenths: int) -> bool:
        """Whether the circuit may have a tolerance that was divided by ten so many times."""
        return tenths == 0

    @property
    def enough(self) -> float:
        """The remainder of the settling, relative to the response's size."""
        return min(max(SETTLED * self.within, FINEST), ROUGHEST)

    @property
    def finest(self) -> int:
        """How often the step was halved, at most, at the tolerance that counts."""
        return max(halvings for halvings, tenths in self.responses if tenths == self.tenths)

    @property
    def last(self) -> Response:
        """The response at the finest step."""
        return self.responses[self.finest, self.tenths]

    def errors(self, name: str) -> tuple[float, ErrorParts]:
        """The ``power``, or another attribute of the responses, and its errors.

        Except the power, everything settles as the mean square voltage does.
        """
        return self.errors_of(
            attrgetter(name), itemgetter(0 if name == "power" else 1), self.remains
        )

    def errors_of(
        self, mean: Callable[[Response], float], left: Callable[[Any], float], remains: float
    ) -> tuple[float, ErrorParts]:
        """A mean of the responses and its errors.

        ``left`` picks its part of `Settled.left`, and ``remains`` is that of the tolerance.
        """
        finest, tenths = self.finest, self.tenths
        three = [self.responses[k, tenths] for k in range(finest - 2, finest + 1)]
        values = [float(mean(response)) for response in three]
        value, step = limit(values)
        lefts = [
            float(left(response.left)) * abs(v) for response, v in zip(three, values, strict=True)
        ]
        settling = (4.0 * lefts[-1] + lefts[-2]) / 3.0  # as the limit weighs them
        tighter = self.responses.get((finest, tenths + 1))
        change = 0.0 if tighter is None else float(mean(tighter)) - values[-1]
        known = self.tolerance_error
        tolerance = remains * abs(change) if known is None else known * abs(value)
        return value + change, ErrorParts(step, tolerance, settling)

    def continue_to(self, settings: list[Setting]) -> None:
        """Find the response at further settings."""
        try:
            for setting, response in zip(settings, self.responses_at(settings), strict=True):
                if response is None:
                    self.unknown = _unknown("lost")
                    return
                self.responses[setting] = response
        except OutOfTimeError:
            self.unknown = _unknown("budget")
        except CircuitError as error:
            self.diverged = self.diverged or isinstance(error, ConvergenceError)
            self.unknown = _unknown("circuit", str(error))

    def measure(self) -> None:
        """Find the response at two smaller steps, and with a tolerance whose error is not known, at a tenth of it.

        If the tolerance alone makes too large an error, the steps are those of that tenth.
        """
        if not self.tolerant or self.tolerance_error is not None:
            return self.continue_to([(1, 0), (2, 0)])
        self.continue_to([(2, 0), (2, 1)])
        if self.unknown:
            return None
        power = attrgetter("power")
        rough, fine = (power(self.responses[2, tenths]) for tenths in (0, 1))
        if self.remains * abs(fine - rough) < BORNE * self.within * abs(
            fine
        ) or not self.has_tolerance(2):
            return self.continue_to([(1, 0)])
        self.tenths = 1
        return self.continue_to([(2, 2), (1, 1), (0, 1)])

    def improve(self) -> bool:
        """Halve the step, or continue with the next tolerance, by the larger error.

        Whether there is one.
        """
        _, error = self.errors("power")
        finest, tenths = self.finest, self.tenths
        before = dict(self.responses)
        finer = finest < self.halvings
        tighter = (finest, tenths + 1) in self.responses
        if (
            tighter
            and self.has_tolerance(tenths + 2)
            and (error.tolerance > error.step or not finer)
        ):
            top = min(finest + (error.step > 0.25 * error.tolerance), self.halvings)
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
        if self.unknown:  # the errors that were known are known all the same
            self.responses = before
            self.unknown = None
            return False
        self.tenths = tenths
        return True

    def make_precise(self, progress: Callable[[float], object] | None = None) -> None:
        """Go on to smaller steps and tolerances until the power error is known, and small enough."""
        if self.halvings < 2:
            self.unknown = _unknown("step")
            return
        self.measure()
        going = self.unknown is None
        while going:
            power, error = self.errors("power")
            share = error.total / abs(power) / self.within if power else 0.0
            if progress is not None:
                progress(1.0 / max(share, 1.0))
            going = share > 1.0 and self.improve()


def _unknown(why: str, error: str = "") -> Diagnostic:
    """The note that the error is not known, and why."""
    return note("precision_unknown", why=why, steps=4 * FEWEST_STEPS, error=error)
