"""What the engines that sample share: their options, when to stop, and the power balance."""

import math
from dataclasses import dataclass
from typing import Any

from harvester.engines.given import Given
from harvester.equations.scaling import Equations
from harvester.errors import invalid
from harvester.scene.units import fraction, seconds


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Options of the engines that sample.

    within
        relative total error of the mean power to reach (sampling at 95 % plus bias), such as .01 or "1%"; None: one
        round.
    budget
        seconds that reaching it may take, such as 30 or "30s", without compilation and burn-in.
    duration, dt
        of a trajectory after its burn-in, and the step: in second for a physical scene, else
        nondimensional; None: chosen from the scene.
    """

    within: Given = Given(fraction)  # noqa: RUF009, a descriptor: None unless it is set
    budget: Given = Given(seconds)  # noqa: RUF009
    seed: int = 0
    duration: float | None = None
    trajectories: int | None = None
    dt: float | None = None

    def __post_init__(self) -> None:
        for name in ("within", "budget", "duration", "dt"):
            value = getattr(self, name)
            if value is not None and not (value > 0.0 and math.isfinite(value)):
                raise invalid(f"`{name}`", "be above 0", value)
        if self.within is not None and not 1e-5 <= self.within < 1.0:
            raise invalid("`within`", "be between 0.001% and 100%", f"{self.within:.3g}")
        if self.trajectories is not None and not 2 <= self.trajectories <= 1_000_000:
            raise invalid("`trajectories`", "be between 2 and 1000000", self.trajectories)
        if self.seed < 0:
            raise invalid("`seed`", "be at least 0", self.seed)


def balance(moments: Any, eqs: Equations) -> tuple[float, float]:
    """Power in less power out over power in, and its standard error (see `harvester.mechanics.kernels.moments`)."""
    from harvester.mechanics.kernels.moments import mean_and_error
    from harvester.mechanics.kernels.shaking import is_random, is_shaken

    if not (is_shaken(eqs) or is_random(eqs)):
        return 0.0, 0.0
    return mean_and_error(moments.balance(eqs))
