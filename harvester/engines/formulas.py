"""The engines that are formulas: the published averaging and ours."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.given import Given
from harvester.engines.protocol import Progress, estimate, refuse, resistive
from harvester.equations.scaling import Equations
from harvester.errors import HarvesterError
from harvester.scene.scene import Scene
from harvester.scene.units import fraction
from harvester.uncertainty.value import Value

SPRINGS = frozenset({"negative_stiffness", "quadratic_stiffness", "softening_stiffness"})  # that no theory here knows
STOPS = frozenset({"compliant_stop", "opposite_stop"})
SHAKING = frozenset(
    {"harmonic_drive", "coloured_noise", "band_pass_noise", "recorded_acceleration", "tabulated_noise"}
)  # but white noise
DOUBTFUL = 0.05  # estimated model error of `averaged` that brings a warning
STOP_WARNING = (
    "with a stop the published V, harmonic about zero, is wrong: the true V has no mean and only even harmonics, so "
    "E[V^2] and the power come out too high, about four times at the paper's parameters: use 'averaged', 'ensemble' "
    "or 'spice'"
)


@dataclass(frozen=True, kw_only=True)
class _Formula:
    """What both share: one scene is a grid of one.

    ``within`` is the relative error that is asked for, such as .01: a formula cannot work towards it, so it
    says where its own error is larger, or not known.
    """

    within: Given = Given(fraction)  # noqa: RUF009, a descriptor: None unless it is set

    NAME: ClassVar[str]
    UNSERVED: ClassVar[frozenset[str]]  # effects that the theory does not know

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene."""
        answer = self.run_many([scene])[0]
        if isinstance(answer, HarvesterError):
            raise answer
        return answer

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        """What says something of each of many scenes, or its error; loads what that needs."""
        raise NotImplementedError

    def _tell(self, scene: Scene, eqs: Equations, found: Any, seconds: float) -> Estimate:
        """What was found, as an answer."""
        raise NotImplementedError

    def run_many(self, scenes: Sequence[Scene]) -> list[Estimate | HarvesterError]:
        """`run` for many scenes, solved in one call, or the error that each raises; its share of the time each."""
        answers: list[Estimate | HarvesterError] = []
        served: list[tuple[int, Equations]] = []
        for place, scene in enumerate(scenes):
            answers.append(HarvesterError())
            try:
                eqs = resistive(scene, self.NAME)
                refuse(eqs, self.UNSERVED, f"engine {self.NAME!r}", "engine 'ensemble'")
                served.append((place, eqs))
            except HarvesterError as error:
                answers[place] = error
        solve = self._theory()
        begin = time.perf_counter()
        solved = solve([eqs for _, eqs in served])
        seconds = (time.perf_counter() - begin) / max(len(served), 1)
        for (place, eqs), one in zip(served, solved, strict=True):
            answers[place] = (
                one if isinstance(one, HarvesterError) else self._judged(self._tell(scenes[place], eqs, one, seconds))
            )
        return answers

    def _judged(self, answer: Estimate) -> Estimate:
        """The answer, with a word where it is not known to be ``within``."""
        if self.within is None:
            return answer
        error = answer.mean_power.model
        known = (
            "is not known" if error is None else f"is estimated at {error / abs(answer.mean_power.value or 1.0):.2g}"
        )
        if error is not None and error <= self.within * abs(answer.mean_power.value):
            return answer
        word = f"`within` {self.within:.3g} cannot be promised: the error of {self.NAME!r} {known}"
        return dataclasses.replace(answer, warnings=(*answer.warnings, word))


@dataclass(frozen=True, kw_only=True)
class Published(_Formula):
    """The paper's stochastic averaging, misprints corrected: E[V^2] of Eq. 30 and E[P] = beta mu E[V^2] of Eq. 31.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> f"{hv.Published().run(scene).mean_power.value:.5f}"
    '0.00331'

    Raises
    ------
    CannotServeError
        for a load other than a resistance, or a spring or stop that the theory does not know.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "published"
    UNSERVED: ClassVar[frozenset[str]] = SPRINGS | STOPS | SHAKING | {"gap"}

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.averaging.published.stationary import mean_square_voltages

        return mean_square_voltages

    def _tell(self, scene: Scene, eqs: Equations, found: float, seconds: float) -> Estimate:
        reason = "no sampling error: a formula; its model error is not known from within"
        warnings = (STOP_WARNING,) if eqs.restitution is not None else ()
        return estimate(self.NAME, scene, eqs, Value(found), None, seconds, 0, reason, warnings)


@dataclass(frozen=True, kw_only=True)
class Averaged(_Formula):
    """Impact-aware averaging (`harvester.averaging.two_scale.law`): E[V^2], E[P] = beta mu E[V^2], and its own error.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> f"{answer.mean_power.value:.5f} +- {answer.mean_power.error95:.5f}"
    '0.00323 +- 0.00002'

    Raises
    ------
    CannotServeError
        for a load other than a resistance, or a spring or stop that the theory does not know.
    SimulationError
        without external noise, or where the response grows without bound.
    """

    NAME: ClassVar[str] = "averaged"
    UNSERVED: ClassVar[frozenset[str]] = SPRINGS | STOPS | SHAKING

    def _theory(self) -> Callable[[list[Equations]], Sequence[Any]]:
        from harvester.averaging.two_scale.law import solve_many

        return solve_many

    def _tell(self, scene: Scene, eqs: Equations, found: Any, seconds: float) -> Estimate:
        v2 = Value(found.mean_square_voltage, model=found.bias * found.mean_square_voltage)
        warnings = []
        if found.bias > DOUBTFUL:
            strong = found.stored > found.impact_loss
            why = "coupling is strong" if strong else "impacts take much of the energy in one cycle"
            warnings.append(
                f"averaging is doubtful here (estimated error {found.bias:.0%}): {why}; check with 'ensemble'"
            )
        if eqs.restitution is not None and eqs.restitution < 0.5:
            warnings.append(f"no averaging is reliable for a restitution coefficient of {eqs.restitution:g}, below .5")
        details = {
            "exchange_per_cycle": found.exchange,
            "impact_loss_per_cycle": found.impact_loss,
            "slow_share": found.slow / found.mean_square_voltage,
        }
        reason = "no sampling error: a theory; the model's error is estimated from its small parameters"
        return estimate(self.NAME, scene, eqs, v2, None, seconds, 0, reason, tuple(warnings), details)
