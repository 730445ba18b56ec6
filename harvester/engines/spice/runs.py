"""The ngspice runs of one estimate, alone or paired with a cheap model: batches of them, until a target is reached."""

import dataclasses
import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harvester.engines.protocol import Progress
from harvester.engines.spice.means import FEWEST, TELLING, RunMeans
from harvester.errors import CircuitError, ConvergenceError, OutOfTimeError, SimulationError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.uncertainty.control_variate import Controlled, split
from harvester.uncertainty.target import Target, added_effort
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.cosimulation.runs import Start

TOLERANCE_TIME = 64.0  # nondimensional: ten periods or so
LOOSE = 0.1  # a target from which on fewer pairs than `FEWEST` do
FEW = 4  # pairs for a loose target
RESERVED = 4.0  # times the cost of a run: what telling ngspice's tolerance takes
FEWEST_BLOCKS = 16  # of all these pairs together: with fewer, one half cannot weigh the other


def fewest_pairs(within: float | None, blocks: int) -> int:
    """Pairs with a cheap model from which on a mean has an honest error: `FEW` for a loose target, else `FEWEST`.

    ``within`` is the relative error asked for, None: none; a trajectory has so many ``blocks``.  The error of so few
    runs is stated by Student's t of two degrees of freedom: two to three times that of `FEWEST`, at half the cost.

    >>> fewest_pairs(0.2, blocks=5), fewest_pairs(0.2, blocks=1), fewest_pairs(0.01, blocks=5)
    (4, 8, 8)
    """
    return (
        FEW if within is not None and within >= LOOSE and FEW * blocks >= FEWEST_BLOCKS else FEWEST
    )


@dataclass(kw_only=True)
class Runs(RunMeans):
    """Trajectories of ``n_steps`` each, of which more can be run.

    A run that has not ended at the ``deadline`` of `time.monotonic` is given up; ``step_is_fixed``
    states that the user gave the step.
    """

    n_steps: int
    seed: np.random.SeedSequence
    progress: Progress | None = None
    step_is_fixed: bool = False
    deadline: float = math.inf
    seconds: float = 0.0
    ngspice_seconds: float = 0.0
    warm_up_seconds: float = 0.0

    def run_first(self, count: int) -> None:
        """Run ``count``; if ngspice alone gives the step bias, a few with others of twice the step first.

        For a budget that ends early the others leave the time for measuring the tolerance: an error
        that is known whole is worth more than runs.  Raises as `run_batch`.
        """
        from harvester.cosimulation.worker_pool import worker_count

        few = max(TELLING, worker_count())
        if self.setup.pair is not None or math.isinf(self.deadline) or count <= few:
            return self.run_batch(count)
        self.run_batch(few)
        more = max(
            min(count - few, int((self.deadline - time.monotonic()) / self.cost - RESERVED)), 0
        )
        if more:
            self.run_batch(more)
        if len(self.done) == few + more < count:
            self.setup.diagnostics.append(
                warning("runs_ended", ended=len(self.done), requested=count, paired=False)
            )
        return None

    def run_batch(self, count: int) -> None:
        """Run ``count`` more, or as many as end before the deadline, with a warning.

        Fewer than `fewest_pairs` are no longer paired.  Raises OutOfTimeError if they are fewer
        than two.
        """
        from harvester.cosimulation import runs as worker
        from harvester.mechanics.kernels.noise import child

        begin = time.perf_counter()
        setup = self.setup
        before = len(self.done)
        seeds = [child(self.seed, 0, before + k) for k in range(count)]
        starts = setup.starts and [
            setup.starts[(before + k) % len(setup.starts)] for k in range(count)
        ]
        measured = worker.measure_in_workers(
            setup.device,
            seeds,
            self.n_steps,
            burn_in=setup.settling,
            with_control=self.paired,
            deadline=self.deadline,
            blocks=self.blocks,
            starts=starts,
        )
        try:
            for k, means in enumerate(measured):
                self.done.append(means)
                if self.progress is not None:
                    self.progress((k + 1) / count)
            self._run_coarse(seeds, starts)
        except OutOfTimeError as error:
            self._stop_early(before + count, error)
        self.ngspice_seconds += time.perf_counter() - begin
        self.seconds += time.perf_counter() - begin

    def _stop_early(self, requested: int, error: OutOfTimeError) -> None:
        """Use the runs that have ended, or raise the error if they are fewer than two."""
        ended = len(self.done)
        alone = self.paired and 2 <= ended < fewest_pairs(LOOSE, self.blocks)
        said = warning("runs_ended", ended=ended, requested=requested, paired=alone)
        if ended < 2:
            error.args = (f"{error}; {said}, and 2 are needed",)
            raise error
        self.paired = self.paired and not alone
        self.setup.diagnostics.append(said)

    def _run_coarse(
        self, seeds: list[np.random.SeedSequence], starts: "list[Start] | None"
    ) -> None:
        """The same runs at twice the step, same noise, if no cheap model gives the bias.

        For probes, a few runs.
        """
        from harvester.cosimulation import runs as worker

        setup = self.setup
        n_steps = self.n_steps // 2
        if len(self.coarse) + len(seeds) < len(self.done) or (
            setup.pair is not None and not setup.device.probes
        ):
            return
        if setup.pair is not None:
            seeds = seeds[:FEWEST]
            starts = starts and starts[:FEWEST]
        measured = worker.measure_in_workers(
            setup.device.coarser(),
            seeds,
            n_steps,
            burn_in=setup.settling,
            deadline=self.deadline,
            blocks=self.blocks,
            starts=starts,
        )
        try:
            self.coarse.extend(measured)
        # of a circuit that does not bear the step, or of time that is over
        except SimulationError as error:
            setup.diagnostics.append(warning("step_bias_not_measured", error=str(error)))

    def measure_tolerance(self, needed: bool = False) -> None:
        """Measure the effect of ngspice's tolerance on the moments, if it chooses its steps and time is left.

        On two motions of `TOLERANCE_TIME` after the burn-in: the larger of both counts.  It stays
        unknown, with a warning, if ngspice does not bear a tenth of its tolerance, or the time is
        spent before.

        Raises ConvergenceError in place of that warning if it is ``needed``.
        """
        from harvester.cosimulation.same_motion import tolerance_in_workers
        from harvester.mechanics.kernels.noise import child

        setup = self.setup
        device = self.setup.device
        begin = time.perf_counter()
        if device.load.linear:
            self.tolerance = dict.fromkeys(("V2", "load"), 0.0)
            self.probed_tolerance = 0.0
            return
        if 3.0 * self.cost > self.deadline - time.monotonic():
            return
        seeds = [child(self.seed, 4, k) for k in range(2)]
        starts = setup.starts or [(x, 0.0, 0.0, 0.0) for x in device.eqs.resting_places]
        starts = [starts[k % len(starts)] for k in range(2)]
        n_steps = min(setup.n_steps(TOLERANCE_TIME), self.n_steps)
        try:
            both = list(
                tolerance_in_workers(device, seeds, n_steps, setup.settling, self.deadline, starts)
            )
        except CircuitError as error:
            if needed and isinstance(error, ConvergenceError):
                raise
            setup.diagnostics.append(warning("tolerance_not_measured", error=str(error)))
        else:
            self.tolerance = {
                name: max(abs(difference[name]) for difference, _ in both) for name in both[0][0]
            }
            self.probed_tolerance = np.max([np.abs(difference) for _, difference in both], axis=0)
        self.seconds += time.perf_counter() - begin

    def extend(self, duration: float) -> None:
        """Continue with the long ensemble of the cheap model."""
        assert self.setup.pair is not None
        begin = time.perf_counter()
        self.setup.pair.extend(duration)
        self.seconds += time.perf_counter() - begin

    @property
    def cost(self) -> float:
        """Seconds that one more run costs."""
        return self.ngspice_seconds / len(self.done)

    @property
    def rate(self) -> float:
        """Seconds that a unit of the long ensemble's time costs."""
        return 0.0 if self.setup.pair is None else self.setup.pair.seconds_a_unit

    @property
    def sampling_seconds(self) -> float:
        """The seconds of all runs, and of the cheap model's long ensemble."""
        duration = 0.0 if self.setup.pair is None else self.setup.pair.duration
        return self.ngspice_seconds + self.rate * duration

    def power_so_far(self) -> Value:
        """E[P], nondimensional."""
        return self.power().value

    def improve(self, target: Target) -> Diagnostic | None:
        """More pairs and a longer ensemble, in the proportion that costs least; or state why the target is not reached.

        Less than a pair is asked for as one, if nothing else is.
        """
        power = self.power()
        variance = target.variance(power.value)
        if (
            variance == 0.0
        ):  # a larger ensemble knows the bias no better: it was asked for before the first run
            return self._too_large_a_bias(power.value, target)
        pairs, longer = self.effort(power, variance)
        share = min(target.seconds_left / (pairs * self.cost + longer * self.rate), 1.0)
        if share < 0.02:
            return warning("target_missed", **target.shortfall(power.value))
        if pairs >= 1.0 or longer <= 0.0:
            self.run_batch(max(2 * round(0.5 * share * pairs), 2))
        if longer > 0.0:
            self.extend(share * longer)
        return None

    def _too_large_a_bias(self, value: Value, target: Target) -> Diagnostic:
        """Why no more runs reach a target: ngspice's tolerance or the step alone is off by more."""
        error = (self.tolerance or {}).get(self.setup.quantity, 0.0)
        if 2.0 * error > target.within:
            reltol = 0.1 * self.setup.device.reltol
            return warning(
                "needs_smaller_tolerance", within=target.within, error=error, reltol=reltol
            )
        if self.step_is_fixed or target.budget is None:
            return warning("needs_smaller_dt", within=target.within)
        return warning("target_missed", **target.shortfall(value))

    def effort(self, power: Controlled, variance: float) -> tuple[float, float]:
        """(further runs, further time of the cheap model) for a variance of the power, as cheap as may be."""
        now = float(len(self.done))
        pair = self.setup.pair
        if not self.paired or pair is None:
            return added_effort(now, power.residual / variance), 0.0
        spread = max((power.value.stderr or 0.0) ** 2 - power.residual / now, 0.0) * pair.duration
        runs, duration = split(variance, power.residual, self.cost, spread, self.rate)
        # of more runs, whose quantile is smaller
        dof = power.value.dof and min(max(runs, now), 1e6) - 2.0
        ratio = (power.value.quantile / dataclasses.replace(power.value, dof=dof).quantile) ** 2
        runs, duration = runs / ratio, duration / ratio
        more = added_effort(now, runs) if runs > now else 0.0
        return more, added_effort(
            pair.duration, duration
        ) if duration > pair.duration or more == 0.0 else 0.0
