"""The time-step bias, measured: trajectories paired with others of twice the step, on the same noise.

Near a stop of strong impacts, whose bias falls slowly with the step, there are others of four
times the step as well.

Long because trajectories of several steps, their bias and their stored energy are of one pair.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.equations.impact_order import STRONG, step_order
from harvester.errors import UnboundedResponseError
from harvester.machine.progress import listener, stage
from harvester.mechanics.ensemble.affordable_steps import FIRST_WINDOW
from harvester.mechanics.ensemble.burn_in import burn_in, surely_gained
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.moments import Moments
from harvester.uncertainty.richardson import extrapolated, step_bias
from harvester.uncertainty.value import Value, mean_and_error

SETTLING = 0.25  # fraction of a pair's time: its coarser trajectories burn in
FINE = 0.67  # fraction of the rest: the trajectories at the step itself
SETTLED = 0.3  # of a burn-in: what trajectories make from states that have settled at another step
# of the bias that is taken off: what of it may be left, of the order above, up to a step of `SHORT`
LEFT = 0.25
SPARED = 0.25  # share of the room for errors: a smaller bias is stated and not removed
SHORT = 0.4  # beyond it what is left of the bias grows as the step does
GROWN = 1e3  # times the fine step's E[x^2]: a coarse step that is unstable, though still finite


@dataclass(frozen=True)
class Look:
    """The ``time`` of trajectories, and the ``state`` of the first."""

    time: float
    state: Floats

    @classmethod
    def at(cls, trajectories: Trajectories) -> "Look":
        """The present of trajectories."""
        return cls(trajectories.time, trajectories.state[0, :, 0].copy())


class RichardsonPair:
    """Averages of trajectories after their burn-in, and the bias of their step h from others of the step 2 h.

    Both are on the same noise (`harvester.uncertainty.richardson`).  Trajectories that have not run
    yet are burnt in first, within ``budget`` seconds.  ``burn_in`` and ``duration`` are the
    nondimensional times before and of the averages, ``seconds_a_unit`` the cost of a unit of time
    from the last `extend` on.

    Trajectories that share a record of tabulated noise have soon seen all of it, and are one entry
    together: to continue, others begin on other records.

    A ``twin`` is a pair with a circuit of ideal elements in the place of a compiled one, at the
    same step: it has the bias for a thousandth of the time.  Both circuits meet the mass in the
    same way, once a step, and the compiled one takes parts of a step as short as its own error asks
    for, whatever the step is.

    Trajectories with a circuit's own kernel, whose steps are expensive, begin at other steps in
    states of these, and not from rest.  If the order holds their means are extrapolated to a step
    of 0 (`extrapolates`): to begin anew at half of the step needs longer than the sampling error
    that this adds.  The remaining bias is stated.
    """

    def __init__(
        self,
        trajectories: Trajectories,
        duration: float,
        budget: float | None = None,
        twin: "RichardsonPair | None" = None,
        settled_in: float = 0.0,
    ) -> None:
        if trajectories.time == 0.0:
            burn_in(trajectories, budget)
        self.trajectories = trajectories
        self.budget = budget
        self._twin = twin
        settled_in = max(trajectories.time, settled_in)
        self.duration = 0.0
        self.burn_in = max(settled_in, FIRST_WINDOW)
        self.order = step_order(trajectories.eqs)
        self._coarser = self._coarser_ones() if twin is None else []
        self._steps = 0 if twin is None else twin.steps  # of trajectories that were stopped
        self._time_of_both = 0.0
        self.seconds_a_unit = 0.0
        self._seconds_alone = 0.0  # the same at the step h
        self._moments: Moments | None = None
        self.looks: list[Look] = []  # in the last averages, if a circuit counts
        self._gained: Floats | float = 0.0  # energies in storage, since averages began
        # at the step h and at the longer ones, over the time of all
        self._moments_of_all: list[Moments] = []
        self._known: dict[tuple[str, str], Any] = {}  # what was fitted to the present moments
        with stage(0.0, SETTLING):
            self._burn_in_coarser(settled_in)
        with stage(SETTLING, 1.0):
            self._extend(duration)

    def _coarser_ones(self) -> list[Trajectories]:
        """Trajectories of twice the step, and of four times if two steps do not suffice."""
        coarser = [self.trajectories.coarser()]
        if self.order < STRONG and not self.trajectories.eqs.is_shaken_otherwise:
            coarser.append(coarser[0].coarser())
        return coarser

    @property
    def _goes_on_from_states(self) -> bool:
        """Whether trajectories of another step begin in states of these."""
        return self.trajectories.loaded.is_dear and not self.trajectories.eqs.is_shaken_otherwise

    def _burn_in_coarser(self, duration: float) -> None:
        if self._goes_on_from_states and self._coarser:
            duration *= SETTLED
            for coarse in self._coarser:
                coarse.state[:], coarse.words[:] = self.trajectories.state, self.trajectories.words
            self._average(duration)
        try:
            for coarse in self._coarser:
                coarse.run(duration)
        except UnboundedResponseError:  # a longer step is unstable: no estimate from it
            self.stop_coarse()

    def extend(self, duration: float) -> None:
        """Go on for a further ``duration``.

        On records of tabulated noise for about that, as long as at first each.
        """
        if self.trajectories.together == 1:
            return self._extend(duration)
        whole = self.duration / len(self.moments.V2) * self.trajectories.count
        for _ in range(max(1, round(duration / whole))):
            self._renew()
            self._extend(whole)
        return None

    def _renew(self) -> None:
        """Others in the place of the trajectories, on records of their own, with their start forgotten."""
        before = self.trajectories
        self.trajectories = before.with_step(before.h)
        self.trajectories.hopping = before.hopping
        self.trajectories.run(self.burn_in)
        self._steps += before.steps
        if self._coarser:
            self._steps += sum(coarse.steps for coarse in self._coarser)
            self._coarser = self._coarser_ones()
            self._burn_in_coarser(self.burn_in)

    def _average(self, duration: float) -> tuple[Moments, float]:
        """Continue at the step h, with averages: the moments, and the duration of whole samples."""
        begin = self.trajectories.time
        stored = self.trajectories.stored
        with stage(0.0, FINE if self._coarser else 1.0):
            now = self._run(duration)
        duration = self.trajectories.time - begin
        self._gained += self.trajectories.stored - stored
        self.duration += duration
        self._moments = (
            now
            if self._moments is None
            else self._with(self._moments, now, duration / self.duration)
        )
        return now, duration

    def _run(self, duration: float) -> Moments:
        """Let the trajectories of the step h continue; a circuit's counts are kept at first, half-way and last."""
        trajectories = self.trajectories
        if not trajectories.loaded.has_counts:
            return trajectories.run(duration, listener())
        begin = trajectories.time
        self.looks = [Look.at(trajectories)]
        halves = []
        for _ in range(2):
            halves.append(trajectories.run(0.5 * duration, listener()))
            self.looks.append(Look.at(trajectories))
        first, last = halves
        share = (trajectories.time - self.looks[1].time) / (trajectories.time - begin)
        return first.mixed(last, share)

    def _extend(self, duration: float) -> None:
        clock = time.perf_counter()
        self._known.clear()
        now, duration = self._average(duration)
        self._seconds_alone = (time.perf_counter() - clock) / duration
        if self._coarser:
            self._extend_coarser(now, duration)
        self.seconds_a_unit = (time.perf_counter() - clock) / duration

    def _extend_coarser(self, now: Moments, duration: float) -> None:
        """Let the coarser trajectories follow, and stop them if they grow without bound."""
        try:
            then = [coarse.run(duration) for coarse in self._coarser]
        except UnboundedResponseError:
            self.stop_coarse()
            return
        if not all(moments.x2.mean() < GROWN * now.x2.mean() for moments in then):
            self._moments_of_all = []
            self.stop_coarse()
            return
        self._time_of_both += duration
        share = duration / self._time_of_both
        new = [now, *then]
        before = self._moments_of_all
        self._moments_of_all = (
            [self._with(old, more, share) for old, more in zip(before, new, strict=True)]
            if before
            else new
        )

    def _with(self, before: Moments, now: Moments, share: float) -> Moments:
        """Moments with those of a later time, which is the ``share`` of all of it; or with those on other records."""
        return before.mixed(now, share) if self.trajectories.together == 1 else before + now

    def stop_coarse(self) -> None:
        """Leave the coarser trajectories where they are: the bias is known, or cannot be."""
        self._steps += sum(coarse.steps for coarse in self._coarser)
        self._coarser = []
        self._known.clear()
        self.seconds_a_unit = self._seconds_alone

    @property
    def coarse_is_stopped(self) -> bool:
        """Whether only the trajectories of the step h continue."""
        return not self._coarser

    def with_step(self, h: float) -> "RichardsonPair":
        """A fresh pair of the same scene, duration and budget at another step, on other noise."""
        fresh = self.trajectories.with_step(h)
        settled_in = 0.0
        if self._goes_on_from_states:
            settled_in = self.burn_in
            fresh.state[:] = self.trajectories.state
            fresh.run(SETTLED * settled_in)
        pair = RichardsonPair(fresh, self.duration, self.budget, None, settled_in)
        pair._steps += self.steps
        return pair

    @property
    def steps(self) -> int:
        """Trajectory-steps of all, and of those at other steps before."""
        return self._steps + sum(
            trajectories.steps for trajectories in (self.trajectories, *self._coarser)
        )

    @property
    def moments(self) -> Moments:
        """Moments at the step h over the whole duration, one entry a trajectory."""
        assert self._moments is not None, "extended at the beginning"
        return self._moments

    @property
    def charging(self) -> float:
        """The size of the mean power into storage in the averages, as `Moments.load`, beyond two standard errors.

        A stationary response has none: the load's mean power may be off by so much.
        """
        return surely_gained(np.asarray(self._gained)) / self.duration

    @property
    def extrapolates(self) -> bool:
        """Whether means are those of a step of 0, so that the coarser trajectories continue."""
        return bool(
            self._goes_on_from_states
            and self._moments_of_all
            and self._coarser
            and self.order >= STRONG
        )

    @property
    def averaged(self) -> float:
        """The duration that means are made of: if they are extrapolated, that of all steps."""
        return self._time_of_both if self.extrapolates else self.duration

    def mean(self, name: str) -> tuple[float, float]:
        """Mean of one moment at the step h, or 0, and its standard error."""
        return mean_and_error(self.entries(name))

    def entries(self, name: str) -> Floats:
        """One moment at the step h, or of 0, one entry a trajectory or record, less the explained part."""
        if ("mean", name) not in self._known:
            if self.extrapolates:
                self._known["mean", name] = extrapolated(*self._at_all_steps(name))
            else:
                self._known["mean", name] = self.moments.controlled(
                    name, self.trajectories.together
                )
        return np.asarray(self._known["mean", name])

    def bias(self, name: str) -> tuple[float, float]:
        """Bias of one moment's mean, and its standard error: at the step h, or the remainder after extrapolation.

        If twice the step is unstable nothing is known of it: the mean itself.
        """
        if self._twin is not None:
            size = abs(self.mean(name)[0])
            (bias, error) = self._twin.relative_bias(name)
            return size * bias, size * error
        if not self._moments_of_all:
            return self.mean(name)[0], 0.0
        bias, error = self._bias_at_step(name)
        return self._left * bias, self._left * error

    def _bias_at_step(self, name: str) -> tuple[float, float]:
        """Bias of one moment's mean at the step h, and its standard error."""
        if ("bias", name) not in self._known:
            self._known["bias", name] = step_bias(*self._at_all_steps(name))
        bias, error = self._known["bias", name]
        return bias, error

    @property
    def _left(self) -> float:
        """The part of the bias that extrapolation may leave."""
        return LEFT * max(self.trajectories.h / SHORT, 1.0) if self.extrapolates else 1.0

    def extrapolates_in_vain(self, name: str, room: float) -> bool:
        """Whether the bias at the step h is at most `SPARED` of the relative ``room`` at 95 %.

        The time of the longer steps, half of all, is worth more.
        """
        most = SPARED * room * abs(self.mean(name)[0])
        return self.extrapolates and Value(*self._bias_at_step(name)).largest95 < most

    def bias_of_sum(self, factors: dict[str, float]) -> float:
        """Bias of a sum of moments, each with its factor, measured as that of one moment."""
        if self._twin is not None or not self._moments_of_all:
            return sum(factor * self.bias(name)[0] for name, factor in factors.items())
        _, order, controls, together = self._at_all_steps("V2")
        sums = [
            np.sum([factor * getattr(moments, name) for name, factor in factors.items()], axis=0)
            for moments in self._moments_of_all
        ]
        return self._left * step_bias(sums, order, controls, together)[0]

    def largest_bias(self, name: str) -> float:
        """The size of the `bias` that is stated: if it falls slowly with the step, the largest at 95 %."""
        bias, error = self.bias(name)
        return abs(bias) + (Value(bias, error).sampling95 if self.order < STRONG else 0.0)

    def relative_bias(self, name: str) -> tuple[float, float]:
        """`bias` as a part of the mean; for a mean of zero, if nothing moves, as it is."""
        bias, error = self.bias(name)
        size = abs(self.mean(name)[0]) or 1.0
        return bias / size, error / size

    def extrapolated(self, name: str) -> tuple[float, float]:
        """Mean of one moment at a step of 0, and its standard error.

        Over the time that all steps ran.

        If twice the step is unstable, the mean at the step h.
        """
        return (
            mean_and_error(extrapolated(*self._at_all_steps(name)))
            if self._moments_of_all
            else self.mean(name)
        )

    def _at_all_steps(self, name: str) -> tuple[list[Floats], float, Floats | None, int]:
        """Arguments of `step_bias`: a moment at all steps, the order, and the controls of all steps side by side."""
        controls = [
            moments.controls for moments in self._moments_of_all if moments.controls is not None
        ]
        values = [getattr(moments, name) for moments in self._moments_of_all]
        return (
            values,
            self.order,
            np.hstack(controls) if controls else None,
            self.trajectories.together,
        )
