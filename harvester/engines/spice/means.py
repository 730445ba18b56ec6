"""Runs of ngspice that have ended, and their results: means with their total errors."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from harvester.arrays import Floats
from harvester.engines.spice.ledger import gives_power, ledger_remarks
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.impact_order import step_order
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.messages.unknown_parts import STEP, TOLERANCE
from harvester.uncertainty.control_variate import (
    Controlled,
    controlled,
    differing,
    explained_and_controlled,
)
from harvester.uncertainty.controls import controlled_entries, scaled_least_squares
from harvester.uncertainty.richardson import step_bias
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.cosimulation.runs import TrajectoryMeans
    from harvester.mechanics.kernels.moments import Moments

FEWEST = 8  # pairs of which each half weighs the other
TELLING = 4  # runs that tell the bias of the step, by Student's t of three degrees of freedom


@dataclass(kw_only=True)
class RunMeans:
    """Trajectories that ngspice has run.

    ``paired`` ones also know the cheap model's means on the same noise.

    ``coarse`` are the first of ``done`` again, at twice the step; a trajectory of more than one of the ``blocks`` has
    controls.  ``tolerance`` has the relative errors of moments by ngspice's tolerance, once they are measured, and
    ``probed_tolerance`` those of probes (`harvester.cosimulation.same_motion.sizes_of_probes`).
    """

    setup: SpiceSetup
    paired: bool
    blocks: int = 1
    done: "list[TrajectoryMeans]" = field(default_factory=list)
    coarse: "list[TrajectoryMeans]" = field(default_factory=list)
    tolerance: dict[str, float] | None = None
    probed_tolerance: Floats | float | None = None

    @property
    def followed(self) -> int:
        """Runs at twice the step; 0 if they are too few for the step bias."""
        return len(self.coarse) if len(self.coarse) >= TELLING else 0

    def mean_square_voltage(self) -> Controlled:
        """E[V^2], nondimensional."""
        return self._estimate("V2", np.concatenate([run.moments.V2 for run in self.done]), 1.0)

    def power(self) -> Controlled:
        """E[P], nondimensional: beta mu E[V^2] for a load resistor, for a netlist the power of Rload in ngspice."""
        device = self.setup.device
        beta, mu = device.eqs.beta or 0.0, device.eqs.mu or 0.0
        if self.setup.resistive:
            square = self.mean_square_voltage()
            size = beta * mu
            return dataclasses.replace(
                square, value=square.value.scaled(size), residual=square.residual * size**2
            )
        high = np.concatenate([run.load_power for run in self.done]) / device.scales.watts
        return self._estimate("load", high, beta)

    def _estimate(self, name: str, high: Floats, factor: float) -> Controlled:
        """The mean of ``high``, whose cheap model is ``factor`` times a moment."""
        pair = self.setup.pair
        (controls, explained) = self._controls(name)
        if not self.paired or pair is None:
            high = high if explained is None else high - factor * explained
            entries = controlled_entries(high, controls, self.blocks)
            mean = float(entries.mean())
            variance = float(entries.var(ddof=1))
            value = Value(
                mean,
                math.sqrt(variance / len(entries)),
                self._step_bias(name, mean),
                dof=len(entries) - 1.0,
            )
            return Controlled(self._with_tolerance(value, name), variance, 0.0, 0.0)
        low = factor * np.concatenate([getattr(run.control, name) for run in self.done])
        mean_of_low = Value(*pair.mean(name), pair.largest_bias(name)).scaled(factor)
        if self.setup.short:
            estimate = differing(high, low, mean_of_low, self.setup.difference[name])
        elif explained is None:
            estimate = controlled(high, low, mean_of_low, controls, self.blocks)
        else:
            estimate = explained_and_controlled(
                high, low, mean_of_low, factor * explained, self.blocks
            )
        return dataclasses.replace(estimate, value=self._with_tolerance(estimate.value, name))

    def _step_bias(self, name: str, mean: float) -> float | None:
        """The step bias of a mean, by the cheap model or by runs at twice the step.

        None if neither gives it.
        """
        if (relative := self.setup.relative_bias(name)) is not None:
            return abs(relative * mean)
        if not self.followed:
            return None
        order = step_order(self.setup.device.eqs)
        return largest_step_bias(
            name, self.done, self.coarse, self.setup.device.scales.watts, order
        )

    def _controls(self, name: str) -> tuple[Floats | None, Floats | None]:
        """The controls of the runs' blocks, shape (n, columns), if they have any, or their explained part, shape (n,).

        With a circuit of ideal elements, which has the same ones, that is their sum with the
        weights that explain that circuit's moment: its many trajectories know them better than the
        runs' few blocks.
        """
        known = [run.moments.controls for run in self.done if run.moments.controls is not None]
        if not known:
            return None, None
        controls = np.vstack(known)
        pair = self.setup.pair
        cheap = None if pair is None or self.setup.device.ideal is None else pair.moments.controls
        if pair is None or cheap is None:
            return controls, None
        return None, controls @ scaled_least_squares(getattr(pair.moments, name), cheap)

    def _with_tolerance(self, value: Value, name: str) -> Value:
        """A value with ngspice's part in its error, and the names of parts that are not known."""
        bias = value.bias
        if bias is not None and self.tolerance is not None:
            bias += abs(self.tolerance[name] * value.value)
        value = dataclasses.replace(value, bias=bias).with_unknown(STEP if bias is None else "")
        return value.with_unknown(TOLERANCE if self.tolerance is None else "")

    def moments(self) -> "Moments":
        """For all ngspice runs, one entry each."""
        first, *others = (run.moments for run in self.done)
        return sum(others, first).averaged(self.blocks)

    def details(self) -> dict[str, float]:
        """The effect of the pairing."""
        pair = self.setup.pair
        if not self.paired or pair is None:
            return {}
        power = self.power()
        return {
            "control_weight": power.weight,
            "control_correlation": power.correlation,
            "ensemble_trajectories": float(pair.trajectories.count),
            "ensemble_steps": float(pair.steps),
        }

    def remarks(self) -> list[Diagnostic]:
        """Warnings of a netlist that gives energy, or continues storing it.

        Raises SimulationError if the load gives power, beyond its error.
        """
        power = self.power().value
        if power.value + power.known_error95 < 0.0:
            raise gives_power(-power.value * self.setup.device.scales.watts)
        return ledger_remarks([run.ledger for run in self.done])


def largest_step_bias(
    name: str,
    fine: "Sequence[TrajectoryMeans]",
    coarse: "Sequence[TrajectoryMeans]",
    watts: float,
    order: float = 2.0,
) -> float:
    """The largest bias of a mean at the step of ``fine`` that ``coarse``, of twice the step, leaves at 95 %.

    It is the difference of the means and the half-width of that one's 95 % together, over 2^order - 1
    (`harvester.uncertainty.richardson`).  Each coarse run is on the noise of the fine one of its index; their controls
    weigh side by side.  ``name`` is "V2" or "load", whose unit is ``watts``.
    """
    fine = fine[: len(coarse)]
    blocks = len(fine[0].load_power)
    rough, ours = (_entries(name, several, watts) for several in (coarse, fine))
    bias, error = step_bias([ours, rough], order, _side_by_side(fine, coarse), blocks)
    return Value(bias, error, dof=len(fine) - 1.0).largest95


def _entries(name: str, several: "Sequence[TrajectoryMeans]", watts: float) -> Floats:
    """One entry a block of every run, nondimensional."""
    if name == "load":
        return np.concatenate([run.load_power for run in several]) / watts
    return np.concatenate([run.moments.V2 for run in several])


def _side_by_side(*both: "Sequence[TrajectoryMeans]") -> Floats | None:
    """The controls of all, those of each member in columns of its own; None if absent."""
    columns = [
        [run.moments.controls for run in several if run.moments.controls is not None]
        for several in both
    ]
    return np.hstack([np.vstack(several) for several in columns]) if all(columns) else None
