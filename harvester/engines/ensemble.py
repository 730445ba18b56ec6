"""Engine `ensemble`: Monte Carlo of the coupled equations."""

import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from harvester.engines.common import Progress, estimate, resistive, with_power
from harvester.engines.sampled import Sampled, balance
from harvester.estimate import Estimate, Value
from harvester.scaling import scales
from harvester.scene import Scene

TOLD = 0.5  # seconds of compilation that are worth a word


@dataclass(frozen=True, kw_only=True)
class Ensemble(Sampled):
    """Monte Carlo of the fully coupled equations (Eq. 2) with the exact RC update.

    Raises
    ------
    CannotServeError
        for a load other than a resistance.
    UnboundedResponseError
        where no stationary response exists.
    """

    NAME: ClassVar[str] = "ensemble"
    TRAJECTORIES: ClassVar[int] = 4096

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """Burn in until the start is forgotten, then average over time and trajectories."""
        from harvester.mechanics import ensemble as mc
        from harvester.mechanics.compiled import compilation

        eqs = resistive(scene, self.NAME)
        unit = scales(scene).frequency if scene.physical else 1.0
        seed = np.random.SeedSequence(self.seed)
        h = None if self.dt is None else self.dt * unit
        with compilation() as first:
            mc.Ensemble(eqs, 1, np.random.SeedSequence(0), 1e-3).run(0.01)
        begin = time.perf_counter()
        many = mc.Ensemble(eqs, self.trajectories or self.TRAJECTORIES, seed, h)
        warnings = many.settle()
        duration = many.time if self.duration is None else self.duration * unit
        pair = mc.StepPair(many, duration)
        while True:
            v2 = Value(*pair.fine.mean("V2"), pair.bias)
            if self._reached(with_power(v2, eqs), begin, warnings):
                break
            assert self.within is not None
            if pair.bias > 0.3 * self.within * v2.value and pair.bias > 2.0 * pair.bias_error:
                if h is not None:
                    warnings.append(f"--within {self.within:.3g} needs a step below --dt {self.dt:g}")
                    break
                pair = mc.StepPair(many.with_step(0.5 * pair.many.h), duration)
            else:
                pair.extend()
        many, moments = pair.many, pair.fine
        seconds = time.perf_counter() - begin
        if eqs.mu is None:
            warnings.append("open circuit: V keeps the offset that it started with, and takes no power")
        details = {"step": many.h / unit, "burn_in": pair.burn_in / unit, "duration": pair.duration / unit}
        details["trajectories"] = many.trajectories
        if first.seconds > TOLD:
            details["compilation_seconds"] = first.seconds
        details["power_balance"], details["power_balance_stderr"] = balance(moments, eqs)
        return estimate(self.NAME, scene, eqs, v2, None, seconds, pair.steps, "", tuple(warnings), details, moments.V2)
