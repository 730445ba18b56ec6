"""The bias of the step, measured: an ensemble beside one with twice the step, on the same noise."""

import contextlib
import time

import numpy as np

from harvester.arrays import Floats
from harvester.equations.scaling import Equations
from harvester.errors import UnboundedResponseError
from harvester.mechanics.ensemble.burn_in import FIRST_WINDOW
from harvester.mechanics.ensemble.trajectories import Ensemble
from harvester.mechanics.kernels.moments import Moments, mean_and_error
from harvester.mechanics.kernels.shaking import period
from harvester.mechanics.rectifiers.circuit import IdealCircuit

GROWN = 1e3  # times the fine step's E[x^2]: a coarse step that is unstable, though still finite


def warm_up(
    eqs: Equations, seed: np.random.SeedSequence, circuit: IdealCircuit | None = None, ruled: bool = False
) -> None:
    """Compile all that a pair calls, by a few steps of a single block."""
    one = Ensemble(eqs, 1, seed, 1e-3 if period(eqs) is None else None, circuit=circuit, ruled=ruled)
    with contextlib.suppress(UnboundedResponseError):  # for a very stiff scene this step is too long
        one.run(0.01)
        one.snapshot()
        StepPair(one, 0.01)


class StepPair:
    """Averages of a settled ensemble, and the bias of its step from one with twice that step.

    The scheme is of second order, so E_h - E_0 = (E_2h - E_h)/3 + O(h^4) (Richardson).  Both make the same noise, so
    that where the paths stay together the difference has a smaller error than either mean.
    """

    def __init__(self, many: Ensemble, duration: float) -> None:
        if many.time == 0.0:
            many.settle()
        self.many, self.duration, self.burn_in = many, 0.0, max(many.time, FIRST_WINDOW)
        self._coarse: Ensemble | None = many.coarser()
        self._spent = 0  # steps of a coarse ensemble that has ended
        self._together = 0.0  # time that both have run
        self.rate = 0.0  # seconds that a unit of time took, of late
        self._fine: Moments | None = None
        self._pair: tuple[Moments, Moments] | None = None
        try:
            self._coarse.run(many.time)
        except UnboundedResponseError:  # twice the step is unstable: no estimate from it
            self.rest()
        self.extend(duration)

    def extend(self, duration: float) -> None:
        """Go on for a further ``duration``."""
        clock, begin = time.perf_counter(), self.many.time
        now = self.many.run(duration)
        duration = self.many.time - begin
        self.duration += duration
        self._fine = now if self._fine is None else self._fine.mixed(now, duration / self.duration)
        if self._coarse is not None:
            self._extend_coarse(now, duration)
        self.rate = (time.perf_counter() - clock) / duration

    def _extend_coarse(self, now: Moments, duration: float) -> None:
        assert self._coarse is not None
        try:
            then = self._coarse.run(duration)
        except UnboundedResponseError:
            self.rest()
            return
        if not then.x2.mean() < GROWN * now.x2.mean():
            self._pair = None
            self.rest()
            return
        self._together += duration
        share = duration / self._together
        before = self._pair
        self._pair = (now, then) if before is None else (before[0].mixed(now, share), before[1].mixed(then, share))

    def rest(self) -> None:
        """Leave the coarse ensemble where it is: the bias is known well enough, or not to be had."""
        if self._coarse is not None:
            self._spent, self._coarse = self._coarse.steps, None

    @property
    def resting(self) -> bool:
        """Whether only the fine ensemble goes on."""
        return self._coarse is None

    @property
    def steps(self) -> int:
        """Trajectory-steps of both."""
        return self.many.steps + (self._spent if self._coarse is None else self._coarse.steps)

    @property
    def fine(self) -> Moments:
        """Of all the time at the fine step, one entry a trajectory."""
        assert self._fine is not None, "extended at the beginning"
        return self._fine

    def mean(self, name: str) -> tuple[float, float]:
        """Mean of one moment at the fine step, and its standard error."""
        return self.fine.mean(name)

    def bias(self, name: str) -> tuple[float, float]:
        """Bias of one moment's mean at the fine step, E_h - E_0, and its standard error.

        Where twice the step is unstable nothing is known: the mean itself.
        """
        if self._pair is None:
            return self.mean(name)[0], 0.0
        fine, coarse = self._pair
        difference: Floats = getattr(coarse, name) - getattr(fine, name)
        mean, error = mean_and_error(difference)
        return mean / 3.0, error / 3.0

    def extrapolated(self, name: str) -> tuple[float, float]:
        """Mean of one moment for a step of 0, (4 E_h - E_2h)/3, and its standard error; over the time that both ran.

        Where twice the step is unstable, the mean at the fine step.
        """
        if self._pair is None:
            return self.mean(name)
        fine, coarse = self._pair
        return mean_and_error((4.0 * getattr(fine, name) - getattr(coarse, name)) / 3.0)
