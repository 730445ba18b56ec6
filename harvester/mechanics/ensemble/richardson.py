"""The bias of the step, measured: trajectories beside others of twice the step, on the same noise."""

import contextlib
import time
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import UnboundedResponseError
from harvester.mechanics.ensemble.burn_in import FIRST_WINDOW, burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.moments import Moments
from harvester.uncertainty.richardson import extrapolated, step_bias
from harvester.uncertainty.value import mean_and_error

GROWN = 1e3  # times the fine step's E[x^2]: a coarse step that is unstable, though still finite


def compile_pair(trajectories: Trajectories) -> None:
    """Compile all that a `RichardsonPair` of trajectories calls, by a few steps of a single block of them."""
    eqs = trajectories.eqs
    block = trajectories.block(1e-3 if eqs.shaking_period is None and eqs.density is None else None)  # else in records
    with contextlib.suppress(UnboundedResponseError):  # for a very stiff scene this step is too long
        block.run(0.01)
        block.snapshot()
        RichardsonPair(block, 0.01)


class RichardsonPair:
    """Averages of trajectories after their burn-in, and the bias of their step h from others of the step 2 h.

    Both are on the same noise (`harvester.uncertainty.richardson`).  Trajectories that have not run yet are burnt in
    first, within ``budget`` seconds.  ``burn_in`` and ``duration`` are the nondimensional times before and of the
    averages, ``seconds_a_unit`` what a unit of time took in the last `extend`.

    Trajectories that share a record of tabulated noise have soon seen all of it, and are one entry together: to go on,
    others begin on other records.
    """

    def __init__(self, trajectories: Trajectories, duration: float, budget: float | None = None) -> None:
        if trajectories.time == 0.0:
            burn_in(trajectories, budget)
        self.trajectories, self.budget = trajectories, budget
        self.duration, self.burn_in = 0.0, max(trajectories.time, FIRST_WINDOW)
        self._coarse: Trajectories | None = trajectories.coarser()
        self._steps = 0  # of trajectories that were stopped
        self._time_of_both = 0.0
        self.seconds_a_unit = 0.0
        self._moments: Moments | None = None
        self._moments_of_both: tuple[Moments, Moments] | None = None
        self._known: dict[tuple[str, str], Any] = {}  # what was fitted to the present moments
        self._burn_in_coarse(self._coarse, trajectories.time)
        self._extend(duration)

    def _burn_in_coarse(self, coarse: Trajectories, duration: float) -> None:
        try:
            coarse.run(duration)
        except UnboundedResponseError:  # twice the step is unstable: no estimate from it
            self.stop_coarse()

    def extend(self, duration: float) -> None:
        """Go on for a further ``duration``; on records of tabulated noise for about that, as long as at first each."""
        if self.trajectories.together == 1:
            return self._extend(duration)
        whole = self.duration / len(self.moments.V2) * self.trajectories.count
        for _ in range(max(1, round(duration / whole))):
            self._renew()
            self._extend(whole)
        return None

    def _renew(self) -> None:
        """Others in the place of the trajectories, on records of their own, with their start forgotten."""
        before, coarse = self.trajectories, self._coarse
        self.trajectories = before.with_step(before.h)
        self.trajectories.hopping = before.hopping
        self.trajectories.run(self.burn_in)
        self._steps += before.steps
        if coarse is not None:
            self._steps += coarse.steps
            self._coarse = self.trajectories.coarser()
            self._burn_in_coarse(self._coarse, self.burn_in)

    def _extend(self, duration: float) -> None:
        clock, begin = time.perf_counter(), self.trajectories.time
        self._known.clear()
        now = self.trajectories.run(duration)
        duration = self.trajectories.time - begin
        self.duration += duration
        self._moments = now if self._moments is None else self._with(self._moments, now, duration / self.duration)
        if self._coarse is not None:
            self._extend_coarse(self._coarse, now, duration)
        self.seconds_a_unit = (time.perf_counter() - clock) / duration

    def _extend_coarse(self, coarse: Trajectories, now: Moments, duration: float) -> None:
        """Let the coarse trajectories follow, and stop them where they grow without bound."""
        try:
            then = coarse.run(duration)
        except UnboundedResponseError:
            self.stop_coarse()
            return
        if not then.x2.mean() < GROWN * now.x2.mean():
            self._moments_of_both = None
            self.stop_coarse()
            return
        self._time_of_both += duration
        share = duration / self._time_of_both
        if self._moments_of_both is not None:
            fine, coarser = self._moments_of_both
            now, then = self._with(fine, now, share), self._with(coarser, then, share)
        self._moments_of_both = now, then

    def _with(self, before: Moments, now: Moments, share: float) -> Moments:
        """Moments with those of a later time, which is the ``share`` of all of it; or with those on other records."""
        return before.mixed(now, share) if self.trajectories.together == 1 else before + now

    def stop_coarse(self) -> None:
        """Leave the coarse trajectories where they are: the bias is known well enough, or cannot be known."""
        if self._coarse is not None:
            self._steps, self._coarse = self._steps + self._coarse.steps, None

    @property
    def coarse_is_stopped(self) -> bool:
        """Whether only the trajectories of the step h go on."""
        return self._coarse is None

    def with_step(self, h: float) -> "RichardsonPair":
        """A fresh pair of the same scene, duration and budget at another step, on other noise."""
        return RichardsonPair(self.trajectories.with_step(h), self.duration, self.budget)

    @property
    def steps(self) -> int:
        """Trajectory-steps of both."""
        return self._steps + self.trajectories.steps + (0 if self._coarse is None else self._coarse.steps)

    @property
    def moments(self) -> Moments:
        """Moments at the step h over the whole duration, one entry a trajectory."""
        assert self._moments is not None, "extended at the beginning"
        return self._moments

    def mean(self, name: str) -> tuple[float, float]:
        """Mean of one moment at the step h, and its standard error."""
        return mean_and_error(self.entries(name))

    def entries(self, name: str) -> Floats:
        """One moment at the step h, one entry a trajectory or record, less what the controls explain of it."""
        if ("mean", name) not in self._known:
            self._known["mean", name] = self.moments.controlled(name, self.trajectories.together)
        return np.asarray(self._known["mean", name])

    def bias(self, name: str) -> tuple[float, float]:
        """Bias of one moment's mean at the step h, and its standard error.

        Where twice the step is unstable nothing is known of it: the mean itself.
        """
        if self._moments_of_both is None:
            return self.mean(name)[0], 0.0
        if ("bias", name) not in self._known:
            fine, coarse = self._moments_of_both
            both, together = _side_by_side(fine, coarse), self.trajectories.together
            self._known["bias", name] = step_bias(getattr(fine, name), getattr(coarse, name), both, together)
        known: tuple[float, float] = self._known["bias", name]
        return known

    def relative_bias(self, name: str) -> tuple[float, float]:
        """`bias` as a part of the mean; of a mean of zero, where nothing moves, as it is."""
        bias, error = self.bias(name)
        size = abs(self.mean(name)[0]) or 1.0
        return bias / size, error / size

    def extrapolated(self, name: str) -> tuple[float, float]:
        """Mean of one moment at a step of 0, and its standard error; over the time that both ran.

        Where twice the step is unstable, the mean at the step h.
        """
        if self._moments_of_both is None:
            return self.mean(name)
        fine, coarse = self._moments_of_both
        both, together = _side_by_side(fine, coarse), self.trajectories.together
        return extrapolated(getattr(fine, name), getattr(coarse, name), both, together)


def _side_by_side(fine: Moments, coarse: Moments) -> Floats | None:
    """The controls of both steps, shape (n, 2 columns); None where they have none."""
    if fine.controls is None or coarse.controls is None:
        return None
    return np.hstack([fine.controls, coarse.controls])
