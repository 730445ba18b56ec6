"""The ngspice runs of one estimate, alone or paired with a cheap model, and what is concluded from them."""

import dataclasses
import math
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import Progress
from harvester.engines.spice.effort import FEWEST, LOOSE, fewest_pairs
from harvester.engines.spice.ledger import gives_power, ledger_doubts, ledger_entries
from harvester.engines.spice.setup import SpiceSetup
from harvester.engines.spice.step_bias import largest_step_bias
from harvester.errors import CircuitError, OutOfTimeError, SimulationError
from harvester.uncertainty.control_variate import Controlled, controlled, explained_and_controlled, split
from harvester.uncertainty.controls import controlled_entries, scaled_least_squares
from harvester.uncertainty.target import further
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.cosimulation.runs import Start, TrajectoryMeans
    from harvester.mechanics.kernels.moments import Moments

TOLERANCE_TIME = 64.0  # nondimensional: ten periods or so


@dataclass
class Runs:
    """Trajectories of ``kicks`` steps each; ``paired`` ones also know the cheap model's means on the same noise.

    What has not ended at the ``deadline`` of `time.monotonic` is given up.
    """

    ready: SpiceSetup
    paired: bool
    kicks: int
    root: np.random.SeedSequence
    progress: Progress | None
    done: "list[TrajectoryMeans]" = field(default_factory=list)
    seconds: float = 0.0
    ngspice_seconds: float = 0.0
    deadline: float = math.inf
    blocks: int = 1  # of a trajectory: more than one have controls
    tolerance: dict[str, float] | None = None  # relative errors of moments by ngspice's tolerance, once measured
    probed_tolerance: Floats | float | None = None  # the same of probes, relative to `sizes_of_probes`
    coarse: "list[TrajectoryMeans]" = field(default_factory=list)  # the first of done again, at twice the step

    def more(self, count: int) -> None:
        """Run ``count`` more, or as many as end before the deadline, with a warning.

        Fewer than `fewest_pairs` are no longer paired.  Raises OutOfTimeError where they are fewer than two.
        """
        from harvester.cosimulation import runs as worker
        from harvester.mechanics.kernels.noise import child

        begin = time.perf_counter()
        seeds = [child(self.root, 0, len(self.done) + k) for k in range(count)]
        ready, before = self.ready, len(self.done)
        starts = ready.starts and [ready.starts[(before + k) % len(ready.starts)] for k in range(count)]
        given = ready.device, seeds, self.kicks, ready.burn_in, self.paired, self.deadline, self.blocks, starts
        try:
            for k, one in enumerate(worker.measure_in_workers(*given)):
                self.done.append(one)
                if self.progress is not None:
                    self.progress((k + 1) / count)
            self._follow_coarsely(seeds, starts)
        except OutOfTimeError as error:
            ended = len(self.done)
            said = f"{ended} of {before + count} ngspice runs had ended when the `budget` was spent"
            if ended < 2:
                error.args = (f"{error}; {said}, and 2 are needed",)
                raise
            if self.paired and ended < fewest_pairs(LOOSE, self.blocks):
                self.paired = False
                said += ", too few to pair them with a cheap model: give a shorter `duration` or a larger `budget`"
            ready.warnings.append(said)
        self.ngspice_seconds += time.perf_counter() - begin
        self.seconds += time.perf_counter() - begin

    def _follow_coarsely(self, seeds: list[np.random.SeedSequence], starts: "list[Start] | None") -> None:
        """The same runs at twice the step, same noise, where no cheap model tells the bias; of probes, a few runs."""
        from harvester.cosimulation import runs as worker

        ready = self.ready
        if len(self.coarse) + len(seeds) < len(self.done) or (ready.pair is not None and not ready.device.probes):
            return
        if ready.pair is not None:
            seeds, starts = seeds[:FEWEST], starts and starts[:FEWEST]
        given = ready.device.coarser(), seeds, self.kicks // 2, ready.burn_in, False, self.deadline, self.blocks, starts
        try:
            self.coarse.extend(worker.measure_in_workers(*given))
        except SimulationError as error:  # of a circuit that does not bear the step, or of time that is over
            ready.warnings.append(f"the bias of the step could not be measured: {error}")

    @property
    def followed(self) -> int:
        """Runs at twice the step; 0 where they are too few to tell the bias of the step."""
        return len(self.coarse) if len(self.coarse) >= FEWEST else 0

    def measure_tolerance(self) -> None:
        """Measure what ngspice's tolerance does to the moments, where it chooses its steps and time is left.

        On two motions of `TOLERANCE_TIME` after the burn-in: the larger of both counts.  It stays unknown, with a
        warning, where ngspice does not bear a tenth of its tolerance, or the time is spent before.
        """
        from harvester.cosimulation.tolerance import tolerance_in_workers
        from harvester.mechanics.kernels.noise import child

        ready, device, begin = self.ready, self.ready.device, time.perf_counter()
        if device.load.linear:
            self.tolerance, self.probed_tolerance = dict.fromkeys(("V2", "load"), 0.0), 0.0
            return
        if 3.0 * self.cost > self.deadline - time.monotonic():
            return
        seeds = [child(self.root, 4, k) for k in range(2)]
        places = [(x, 0.0, 0.0, 0.0) for x in device.eqs.resting_places]
        starts = [(ready.starts or places)[k % len(ready.starts or places)] for k in range(2)]
        kicks = min(ready.kicks(TOLERANCE_TIME), self.kicks)
        try:
            both = list(tolerance_in_workers(device, seeds, kicks, ready.burn_in, self.deadline, starts))
        except CircuitError as error:
            ready.warnings.append(f"what ngspice's tolerance does could not be measured: {error}")
        else:
            self.tolerance = {name: max(abs(one[name]) for one, _ in both) for name in both[0][0]}
            self.probed_tolerance = np.max([np.abs(one) for _, one in both], axis=0)
        self.seconds += time.perf_counter() - begin

    def extend(self, duration: float) -> None:
        """Go on with the long ensemble of the cheap model."""
        assert self.ready.pair is not None
        begin = time.perf_counter()
        self.ready.pair.extend(duration)
        self.seconds += time.perf_counter() - begin

    @property
    def cost(self) -> float:
        """Seconds that one more run costs."""
        return self.ngspice_seconds / len(self.done)

    @property
    def rate(self) -> float:
        """Seconds that a unit of the long ensemble's time costs."""
        return 0.0 if self.ready.pair is None else self.ready.pair.seconds_a_unit

    def mean_square_voltage(self) -> Controlled:
        """E[V^2], nondimensional."""
        return self._estimate("V2", np.concatenate([one.moments.V2 for one in self.done]), 1.0)

    def power(self) -> Controlled:
        """E[P], nondimensional: of the load resistor beta mu E[V^2], of a netlist what Rload takes in ngspice."""
        device = self.ready.device
        beta, mu = device.eqs.beta or 0.0, device.eqs.mu or 0.0
        if self.ready.resistive:
            found, size = self.mean_square_voltage(), beta * mu
            return dataclasses.replace(found, value=found.value.scaled(size), residual=found.residual * size**2)
        high = np.concatenate([one.load_power for one in self.done]) / device.scales.watts
        return self._estimate("load", high, beta)

    def _estimate(self, name: str, high: Floats, factor: float) -> Controlled:
        """The mean of ``high``, whose cheap model is ``factor`` times a moment."""
        pair, (controls, explained) = self.ready.pair, self._controls(name)
        if not self.paired or pair is None:
            high = high if explained is None else high - factor * explained
            entries = controlled_entries(high, controls, self.blocks)
            mean, variance = float(entries.mean()), float(entries.var(ddof=1))
            relative, error = self.ready.relative_bias(name), math.sqrt(variance / len(entries))
            bias = None if relative is None else abs(relative * mean)
            if self.followed and relative is None:
                bias = largest_step_bias(name, self.done, self.coarse, self.ready.device.scales.watts)
            value = Value(mean, error, bias, dof=len(entries) - 1.0)
            return Controlled(self._with_tolerance(value, name), variance, 0.0, 0.0)
        low = factor * np.concatenate([getattr(one.control, name) for one in self.done])
        mean_of_low = Value(*pair.mean(name), abs(pair.bias(name)[0])).scaled(factor)
        if explained is None:
            found = controlled(high, low, mean_of_low, controls, self.blocks)
        else:
            found = explained_and_controlled(high, low, mean_of_low, factor * explained, self.blocks)
        return dataclasses.replace(found, value=self._with_tolerance(found.value, name))

    def _controls(self, name: str) -> tuple[Floats | None, Floats | None]:
        """The controls of the runs' blocks, shape (n, columns), where they have any, or what they explain, shape (n,).

        With a circuit of ideal elements, which has the same ones, that is their sum with the weights that explain that
        circuit's moment: its many trajectories know them better than the runs' few blocks.
        """
        known = [one.moments.controls for one in self.done if one.moments.controls is not None]
        if not known:
            return None, None
        controls, pair = np.vstack(known), self.ready.pair
        cheap = None if pair is None or self.ready.device.ideal is None else pair.moments.controls
        if pair is None or cheap is None:
            return controls, None
        return None, controls @ scaled_least_squares(getattr(pair.moments, name), cheap)

    def _with_tolerance(self, value: Value, name: str) -> Value:
        """A value with ngspice's part in its error, and the names of parts that are not known."""
        unknown = ["the step"] * (value.bias is None) + ["ngspice's tolerance"] * (self.tolerance is None)
        bias = value.bias
        if bias is not None and self.tolerance is not None:
            bias += abs(self.tolerance[name] * value.value)
        return dataclasses.replace(value, bias=bias, unknown=" and ".join(unknown))

    def asked_for(self, found: Controlled, variance: float) -> tuple[float, float]:
        """(further runs, further time of the cheap model) for a variance of the power, as cheap as may be."""
        now, pair = float(len(self.done)), self.ready.pair
        if not self.paired or pair is None:
            return further(now, found.residual / variance), 0.0
        spread = max((found.value.stderr or 0.0) ** 2 - found.residual / now, 0.0) * pair.duration
        runs, duration = split(variance, found.residual, self.cost, spread, self.rate)
        dof = found.value.dof and min(max(runs, now), 1e6) - 2.0  # of more runs, whose quantile is smaller
        ratio = (found.value.quantile / dataclasses.replace(found.value, dof=dof).quantile) ** 2
        runs, duration = runs / ratio, duration / ratio
        more = further(now, runs) if runs > now else 0.0
        return more, further(pair.duration, duration) if duration > pair.duration or more == 0.0 else 0.0

    def moments(self) -> "Moments":
        """Of all ngspice runs, one entry each."""
        first, *others = (one.moments for one in self.done)
        return sum(others, first).averaged(self.blocks)

    def details(self) -> dict[str, float]:
        """What the pairing did."""
        pair = self.ready.pair
        if not self.paired or pair is None:
            return {}
        found = self.power()
        return {
            "control_weight": found.weight,
            "control_correlation": found.correlation,
            "ensemble_trajectories": float(pair.trajectories.count),
            "ensemble_steps": float(pair.steps),
        }

    def doubts(self) -> list[str]:
        """Warnings of a netlist that gives energy, or goes on storing it.

        Raises SimulationError where the load gives power, beyond its error.
        """
        power = self.power().value
        if power.value + power.known_error95 < 0.0:
            raise gives_power(-power.value * self.ready.device.scales.watts)
        return ledger_doubts([one.ledger for one in self.done])

    def ledger(self, watts: float) -> dict[str, float]:
        """Where the energy went, mean over the trajectories, in units of ``watts``; see `energy_ledger`."""
        return ledger_entries([one.ledger for one in self.done], watts)
