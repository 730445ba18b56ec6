"""The engines that are formulas: the published averaging and ours."""

import time
from dataclasses import dataclass
from typing import ClassVar

from harvester.engines.common import Progress, estimate, resistive
from harvester.estimate import Estimate, Value
from harvester.scene import Scene

DOUBTFUL = 0.05  # estimated model error of `averaged` that brings a warning
STOP_WARNING = (
    "with a stop the published V, harmonic about zero, is wrong: the true V has no mean and only even harmonics, so "
    "E[V^2] and the power come out too high, about four times at the paper's parameters: use 'averaged', 'ensemble' "
    "or 'spice'"
)


@dataclass(frozen=True)
class Published:
    """The paper's stochastic averaging, misprints corrected, V decoupled harmonically.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "published"

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """E[V^2] of the paper's Eq. 30 and E[P] = beta mu E[V^2] of Eq. 31, on any scene with noise."""
        from harvester.averaging.stationary import mean_square_voltage

        eqs = resistive(scene, self.NAME)
        begin = time.perf_counter()
        v2 = Value(mean_square_voltage(eqs))
        seconds = time.perf_counter() - begin
        reason = "no sampling error: a formula; its model error is not known from within"
        warnings = (STOP_WARNING,) if eqs.restitution is not None else ()
        return estimate(self.NAME, scene, eqs, v2, None, seconds, 0, reason, warnings)


@dataclass(frozen=True)
class Averaged:
    """Impact-aware two-scale averaging (`harvester.averaging.two_scale`), with an estimate of its own error.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "averaged"

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """E[V^2] of the two-scale theory and E[P] = beta mu E[V^2]."""
        from harvester.averaging.two_scale import solve

        eqs = resistive(scene, self.NAME)
        begin = time.perf_counter()
        law = solve(eqs)
        seconds = time.perf_counter() - begin
        v2 = Value(law.mean_square_voltage, model=law.bias * law.mean_square_voltage)
        warnings = []
        if law.bias > DOUBTFUL:
            why = (
                "noise and impacts change much of the energy in one cycle"
                if law.exchange > 0.3
                else "coupling is strong"
            )
            warnings.append(
                f"averaging is doubtful here (estimated error {law.bias:.0%}): {why}; check with 'ensemble'"
            )
        if eqs.restitution is not None and eqs.restitution < 0.5:
            warnings.append(f"no averaging is reliable for a restitution coefficient of {eqs.restitution:g}, below .5")
        details = {"exchange_per_cycle": law.exchange, "slow_share": law.slow / law.mean_square_voltage}
        reason = "no sampling error: a theory; the model's error is estimated from its small parameters"
        return estimate(self.NAME, scene, eqs, v2, None, seconds, 0, reason, tuple(warnings), details)
