"""Stability of a scene at rest: its top Lyapunov exponent three ways."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.engines.protocol import AnyScene, unknown_effects
from harvester.equations.effects import REST, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.scene.plausibility import unusual_values
from harvester.uncertainty.value import Value

EXACT = 1e-9  # relative: an estimated error below is that of the arithmetic


@names_arguments
@dataclass(frozen=True)
class Stability:
    """The exponent lambda of the growth e^(lambda t) near rest: in 1/s for a physical scene, else nondimensional.

    ``published`` is the paper's Eq. 38 (misprints corrected), ``averaged`` ours, with ``model`` its
    estimated error (None: unknown), ``ensemble`` by Monte Carlo, ``noiseless`` exact without noise
    (None: the mass leaves the stop for good).  Where there is a stop and no noise, the step's part in the error of
    ``ensemble`` is at least its distance from ``noiseless``.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=0.1, beta=0.05, mu=1.0))
    >>> hv.stability(scene, trajectories=64, duration=50.0).verdict
    'unstable'
    """

    physical: bool
    published: float
    averaged: float
    model: float | None
    ensemble: Value
    noiseless: float | None
    warnings: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """The verdict of the Monte Carlo: stable, unstable, or undecided within its error."""
        if abs(self.ensemble.value) <= self.ensemble.known_error95:
            return "undecided"
        return "stable" if self.ensemble.value < 0.0 else "unstable"

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        value = self.ensemble
        return {
            "published": self.published,
            "averaged": self.averaged,
            "ensemble": {
                "value": value.value,
                "stderr": value.stderr,
                "step_bias": value.bias,
                "error95": value.error95,
            },
            "averaged_model_bias": self.model,
            "noiseless": self.noiseless,
            "verdict": self.verdict,
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        unit = AnswerUnits.of(self.physical).rate
        lines = [
            f"top Lyapunov exponent: rest is {self.verdict}",
            f"  published  {Value(self.published).format(unit)}",
            f"  averaged   {self._averaged(unit)}",
            f"  ensemble   {self.ensemble.format(unit)}",
        ]
        if self.noiseless is not None:
            lines.append(f"  without noise, exact  {Value(self.noiseless).format(unit)}")
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings])

    def _averaged(self, unit: str) -> str:
        if self.model is not None and self.model <= EXACT * abs(self.averaged):
            return f"{Value(self.averaged).format(unit)} (exact for this scene)"
        return Value(self.averaged, model=self.model).format(unit)


def check_rest(problem: Problem) -> None:
    """Raise CannotServeError for a netlist, and unless the mass rests at x = 0, free or touching one rigid stop."""
    if problem.netlist is not None:
        raise CannotServeError(
            f"stability must have a load resistance, but the load is netlist {problem.netlist!r}: "
            "give load.resistance, the circuit's at small signals"
        )
    who = "stability, of rest at x = 0 with one rigid stop there or none,"
    if reason := unknown_effects(problem, unknown_to(REST), who, "engine 'ensemble'"):
        raise CannotServeError(reason)


@names_arguments
def stability(
    scene: AnyScene,
    seed: int = 0,
    trajectories: int = 4096,
    duration: float = 1000.0,
    tick: Callable[[float], None] | None = None,
) -> Stability:
    """Compute the top Lyapunov exponent of a scene's linearised equations without external noise.

    ``duration`` of the ``trajectories`` is in units of 1/w0.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.1, beta=0.05, mu=1.0))
    >>> found = hv.stability(scene, trajectories=64, duration=50.0)
    >>> found.verdict, f"{found.averaged:.4f}"
    ('stable', '-0.0632')

    Raises
    ------
    CannotServeError
        for a netlist load, and where the linearised motion about x = 0 says nothing of rest (`check_rest`).
    SimulationError
        where the linearised motion stops dead (restitution 0 without a voltage).
    """
    from harvester.averaging.stability import exponent as formula
    from harvester.averaging.stability.exact import noiseless
    from harvester.mechanics.ensemble import lyapunov

    problem = Problem.of(scene)
    check_rest(problem)
    eqs, unit = problem.equations, problem.units.frequency
    warnings = [str(one) for one in unusual_values(problem.scene)]
    if eqs.is_shaken:
        warnings.append("external shaking is left out: the exponent is that of rest, which it does not leave")
    if eqs.mu is not None and lyapunov.memory(eqs) > lyapunov.LONGEST:
        warnings.append(f"burn-in stopped at {lyapunov.LONGEST:g}/w0, before the load's memory 1/mu ended")
    growth = lyapunov.exponent(eqs, np.random.SeedSequence(seed), trajectories, duration, tick=tick)
    doubts, quiet = formula.doubts(eqs), noiseless(eqs)
    bias, unknown = growth.bias, ""
    if eqs.n2 is None and eqs.restitution is not None:
        # All trajectories can come to one path whose impacts lock to the grid: neither their scatter nor a run of twice
        # the step tells how far that is off.
        if quiet is None:
            unknown = "the step, as impacts can lock to its grid without noise"
        else:
            bias = max(bias, abs(growth.value - quiet))
            warnings.append(
                "without noise the Monte Carlo's impacts can lock to the grid of steps: trust the exact value"
            )
    return Stability(
        physical=problem.physical,
        published=float(formula.published(eqs)) * unit,
        averaged=float(formula.averaged(eqs)) * unit,
        model=None if doubts.error is None else doubts.error * unit,
        ensemble=Value(growth.value, growth.stderr, bias, unknown=unknown).scaled(unit),
        noiseless=None if quiet is None else quiet * unit,
        warnings=(*warnings, *map(str, doubts.diagnostics)),
    )
