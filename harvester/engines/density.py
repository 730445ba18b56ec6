"""Engine `density`: the stationary density of mass, stop and resistor, solved directly, without sampling."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Self

from harvester.answers.estimate import Estimate
from harvester.engines.moment_existence import MomentExistence, existence
from harvester.engines.options import Request, number
from harvester.engines.protocol import (
    AnyScene,
    Engine,
    Progress,
    estimate,
    needs_known_effects,
    served,
)
from harvester.equations.bounds import check_bounded
from harvester.equations.effects import DENSITY, unknown_to
from harvester.equations.impact_order import accumulation
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import Diagnostic, note, refusal, warning
from harvester.presentation.engine_look import EngineLook
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.density.refine import Answer
    from harvester.engines.power_slopes import PowerSlopes

# The relative error that is aimed at where none is asked for, that of coloured noise, and that at
# many points.
WITHIN = 1e-5
COLOURED = 1e-3
SWEPT = 1e-2
LONGEST = 120.0  # seconds of a budget under coloured noise, where none is given
REFUSED = 0.02  # the relative error above which there is no answer


class Density(Request, Engine):
    """The stationary Fokker-Planck equation of the fully coupled motion.

    Examples
    --------
    >>> import harvester as hv
    >>> table = hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01, restitution=0.9)
    >>> answer = hv.Density(within="0.001%").run(hv.Scene(nondimensional=table))
    >>> answer.mean_power.known_error95 < 1e-5 * answer.mean_power.value
    True

    Parameters
    ----------
    within, budget, seed : float or str or int, optional
        the options of `run`.

    Raises
    ------
    CannotServeError
        for a netlist, without white or coloured noise of the base, with any other excitation, or
        for coloured noise near a rigid stop that dissipates energy.
    SimulationError
        if the response grows without bound, or the density cannot be resolved.
    """

    NAME = "density"
    LOOK = EngineLook(
        "density (no sampling)", "#661100", "v", (0, (6, 1, 1, 1)), order=3.2, trust=4
    )
    has_gradient = True
    is_resolved = True
    has_first_passages = True
    share_of_time = 0.3
    FINEST = 1e-9

    @property
    def at_many_points(self) -> Self:
        """With the error of its coarsest meshes, which is below 1 % as a rule, unless one is asked for."""
        return replace(self, within=SWEPT) if self.within is None and self.budget is None else self

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why there is no density to solve, and an engine that supports the problem.

        None if there is one.
        """
        eqs = problem.equations
        without = None
        if not (eqs.n1 or eqs.coloured):
            without = refusal("needs_noise", engine=cls.NAME)
        elif eqs.coloured and any(
            r is not None and r < 1.0 for r in (eqs.restitution, eqs.opposite_restitution)
        ):
            without = refusal("sticks_to_stop", engine=cls.NAME)
        return needs_known_effects(problem, cls, unknown_to(DENSITY)) or without

    def solve(
        self, problem: Problem, progress: Callable[[float], None] | None = None
    ) -> "tuple[MomentExistence, Answer]":
        """The means that exist, and the density of a problem, with its error.

        Raises UnboundedResponseError, InfiniteMeanError, and SimulationError for a density that is
        not resolved.
        """
        from harvester.density.refine import LIGHTEST, refined

        check_bounded(problem.equations)
        exists = existence(problem, is_sampled=False)
        tail = LIGHTEST if exists.tail is None else exists.tail.lowest
        tolerance, longest = (
            (WITHIN, None) if problem.equations.coloured is None else (COLOURED, LONGEST)
        )
        budget = number(self.budget) or longest
        answer = refined(
            problem.equations, number(self.within) or tolerance, budget, progress, tail
        )
        if not answer.share <= REFUSED:
            raise SimulationError(
                refusal("density_not_resolved", error=answer.share, **answer.parts)
            )
        return exists, answer

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene."""
        problem = served(type(self), scene)
        begin = time.perf_counter()
        exists, answer = self.solve(problem, progress)
        return self._estimate(problem, exists, answer, time.perf_counter() - begin)

    def run_with_slopes(
        self, scene: AnyScene, progress: Progress | None = None
    ) -> "tuple[Estimate, PowerSlopes]":
        """`run`, and the gradient of the mean power in the keys.

        Raises InputError if there is no power as well.
        """
        from harvester.engines.power_slopes import PowerSlopes

        problem = served(type(self), scene)
        begin = time.perf_counter()
        exists, answer = self.solve(problem, progress)
        slopes = PowerSlopes(problem, answer, exists.unknown)
        return self._estimate(problem, exists, answer, time.perf_counter() - begin), slopes

    def _estimate(
        self, problem: Problem, exists: MomentExistence, answer: "Answer", seconds: float
    ) -> Estimate:
        from harvester.density.functionals import NAMES

        eqs = problem.equations
        within = number(self.within)
        share, parts = answer.share, answer.parts
        uncounted = accumulation(eqs)
        diagnostics = [exists.warning, note("density_solved"), uncounted]
        if eqs.load is None:
            diagnostics.append(warning("open_circuit"))
        if within is not None and share > within:
            diagnostics.append(warning("density_not_reached", within=within, error=share, **parts))
        v2 = Value(float(answer.means[0]), bias=float(answer.error[0]), unknown=exists.unknown)
        details = {f"{name}_error": part for name, part in parts.items()}
        for name, mean, error in zip(NAMES[1:], answer.means[1:], answer.error[1:], strict=True):
            if mean and (uncounted is None or not name.endswith("impact_rate")):
                unit = _unit(name, problem)
                details |= {name: float(mean) * unit, f"{name}_bias": float(error) * unit}
        return estimate(self.NAME, problem, v2, None, diagnostics, seconds, details=details)


def _unit(name: str, problem: Problem) -> float:
    """The size of one nondimensional unit of a mean in the scene's own units."""
    u = problem.units
    speed = u.length * u.frequency
    return {
        "displacement": u.length,
        "displacement_squared": u.length**2,
        "velocity_squared": speed**2,
        "displacement_voltage": u.length * u.volts,
        "velocity_voltage": speed * u.volts,
        "impact_rate": u.frequency,
        "opposite_impact_rate": u.frequency,
        "impact_loss": u.watts,
    }[name]
