"""The gradient of the mean power in the keys of a scene, from the adjoint of the density.

The coefficients c of the equations are functions of a key k, and the power is P = W(k) beta mu
E[V^2] with the unit W of power.  With the gradient of E[V^2] in the coefficients
(`harvester.density.adjoint`)

    d ln P/d ln k = d ln(W beta mu)/d ln k + sum_c (dE[V^2]/dc) (dc/d ln k)/E[V^2]

in which the derivatives of the coefficients are differences of their formulas.
"""

import math
from functools import cached_property

from harvester.density.adjoint import gradient
from harvester.density.refine import Answer, Solution
from harvester.equations.coefficients import Equations
from harvester.equations.from_scene import equations_at
from harvester.equations.problem import Problem
from harvester.equations.scales import scales
from harvester.errors import InputError
from harvester.scene.keys import key_kind, split_key
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

STEP = 1e-4  # relative change of a key, by which the coefficients are seen to change


class PowerSlopes:
    """The sensitivities of the power of a problem whose density is solved.

    Raises InputError if there is no power.

    The adjoint equations are solved when they are first needed, those of the coarser mesh only for
    errors.
    """

    def __init__(self, problem: Problem, answer: Answer, unknown: str) -> None:
        if not (problem.equations.beta and problem.equations.load):
            raise InputError(
                "the scene must have a coupling and a load resistance, or no power changes, but it has not"
            )
        self.problem = problem
        self.answer = answer
        self.unknown = unknown

    @cached_property
    def _fine(self) -> dict[str, float]:
        return self._gradient(self.answer.solution)

    @cached_property
    def _coarse(self) -> dict[str, float]:
        return self._gradient(self.answer.coarser)

    def _gradient(self, solution: Solution) -> dict[str, float]:
        """The derivatives of ln E[V^2] in all coefficients."""
        slopes = gradient(self.problem.equations, solution, self.answer.setting)
        return {name: slope / float(solution.means[0]) for name, slope in slopes.items()}

    def elasticity(self, key: str) -> float:
        """D ln P/d ln key at the key's value, which is not 0."""
        return _elasticity(_slopes(self.problem, key), self._fine)

    def with_error(self, key: str) -> Value:
        """`elasticity` with its error of mesh, modes and box."""
        slopes = _slopes(self.problem, key)
        parts = self.answer.parts
        ours, coarse = (_elasticity(slopes, of) for of in (self._fine, self._coarse))
        bias = abs(ours - coarse) + (parts["modes"] + parts["box"]) * (1.0 + abs(ours))
        return Value(ours, bias=bias, unknown=self.unknown)


def value_of(scene: Scene, key: str) -> float:
    """The value of a key that a scene has, in SI units."""
    values = {(table, name): value for table, name, value in scene.values()}
    return float(values[split_key(key)])


def quantities(scene: Scene) -> list[str]:
    """The keys of a scene that are quantities other than 0, whole."""
    return [
        f"{table}.{key}"
        for table, key, value in scene.values()
        if key_kind(table, key) is not None and isinstance(value, float | int) and value != 0.0
    ]


def _slopes(problem: Problem, key: str) -> dict[str, float]:
    """The derivatives with respect to ln(key) of every coefficient, and of "" the logarithm of P/E[V^2]."""
    value = value_of(problem.scene, key)
    length = problem.scales.length
    table, name = split_key(key)

    def at(change: float) -> tuple[Equations, float]:
        scene = problem.scene.vary(key, value * (1.0 + change))
        units = scales(scene, length if problem.physical else None)
        eqs = equations_at(scene, units)
        watts = units.watts if problem.physical else 1.0
        return eqs, math.log(watts * (eqs.beta or 0.0) * (eqs.load or 0.0))

    # A restitution of 1 may not become more: of one the coefficient itself is the key.
    if name in ("restitution", "opposite_restitution") or (table, name) == (
        "opposite_stop",
        "restitution",
    ):
        coefficient = "opposite_restitution" if "opposite" in key else "restitution"
        return {coefficient: value}

    def differences(step: float) -> dict[str, float]:
        (more, log_more) = at(step)
        (less, log_less) = at(-step)
        slopes = {
            field: (getattr(more, field) - getattr(less, field)) / (2.0 * step)
            for field, coefficient in vars(problem.equations).items()
            if isinstance(coefficient, float)
        }
        return slopes | {"": (log_more - log_less) / (2.0 * step)}

    wide = differences(STEP)
    narrow = differences(0.5 * STEP)
    return {field: (4.0 * narrow[field] - wide[field]) / 3.0 for field in wide}


def _elasticity(slopes: dict[str, float], of: dict[str, float]) -> float:
    return slopes.get("", 0.0) + math.fsum(
        slope * of[name] for name, slope in slopes.items() if name
    )
