"""How much the mean power changes with every key of the scene: elasticities, from the adjoint of the density."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from harvester.density.adjoint import gradient
from harvester.engines.density import Density
from harvester.engines.protocol import AnyScene, estimate, served
from harvester.equations.coefficients import Equations
from harvester.equations.from_scene import equations_at
from harvester.equations.problem import Problem
from harvester.equations.scales import scales
from harvester.errors import InputError, names_arguments
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.keys import key_kind, unit_of
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

USUAL = 1e-6  # the relative error of E[V^2] that is aimed at
STEP = 1e-4  # relative change of a key, by which the coefficients are seen to change


@names_arguments
@dataclass(frozen=True, repr=False, eq=False)
class Sensitivity(TableResult):
    """The mean power and its elasticity in each key of the scene: d ln P/d ln key, the largest first.

    An elasticity of 2 says that one percent more of a key gives two percent more power.  What keys of 0 and keys that
    are no quantity would do is not told.

    Attributes
    ----------
    engine
        the name of the engine that computed it.
    mean_power
        a `Value` (W).
    keys, values, units
        the scene keys, their values in SI units and these units.
    elasticities
        a `Value` without a unit for each key.
    seconds
        the time of computing, without compilation (s).
    physical
        whether its numbers are in SI units, rather than nondimensional.
    diagnostics
        warnings and notes, each with a code, numbers and a sentence (``str``).

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.sensitivity(scene, within=1e-3).table["key"][0]
    'nondimensional.D11'
    """

    DERIVED: ClassVar[tuple[str, ...]] = ("table",)
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset({"keys", "units", "values", "elasticities"})
    NOT_IN_JSON: ClassVar[frozenset[str]] = frozenset({"keys", "units", "values", "elasticities"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"table": "sensitivity"}

    engine: str
    mean_power: Value
    keys: tuple[str, ...]
    values: tuple[float, ...]
    units: tuple[str, ...]
    elasticities: tuple[Value, ...]
    seconds: float
    physical: bool
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def table(self) -> Table:
        """A row for each key: its value and the elasticity of the power in it."""
        units = ["" if unit == "1" else unit for unit in self.units]
        value = Column("value", self.values, units=units, label="value")
        return Table((Column("key", self.keys, label="key"), value, Column("elasticity", self.elasticities)))


@names_arguments
def sensitivity(
    scene: AnyScene,
    *,
    within: float | None = None,
    budget: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Sensitivity:
    """The elasticity of the mean power in every key of the scene that is a quantity other than 0.

    All come from one solution for the density and one of its adjoint equations, whatever the number of keys.

    Parameters
    ----------
    scene
        a `Scene` that engine `Density` serves, or the path of a scene file.
    within
        the relative error of the power that is aimed at, such as .01; None: 1e-6.
    budget
        seconds of computing.
    progress
        is called with the fraction done.

    Returns
    -------
    Sensitivity
        elasticities without a unit, the largest first.

    Raises
    ------
    InputError
        for a scene that engine `Density` does not serve, or whose load takes no power.
    SimulationError
        where the response grows without bound, or the density cannot be resolved.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01, restitution=0.9))
    >>> found = hv.sensitivity(scene, within=1e-4)
    >>> found.keys[0], round(found.elasticities[found.keys.index("nondimensional.D11")].value, 3)
    ('nondimensional.restitution', 1.0)
    """
    import time

    engine = Density(within=within, budget=budget)
    problem = served(Density, scene)
    eqs = problem.equations
    if not (eqs.beta and eqs.mu):
        raise InputError("the scene must have a coupling and a load resistance, or no power changes, but it has not")
    begin = time.perf_counter()
    exists, answer = engine.solve(problem, progress)
    unknown = exists.unknown
    fine, coarse = (gradient(eqs, found, answer.setting) for found in (answer.solution, answer.coarser))
    means = (float(answer.means[0]), float(answer.coarser.means[0]))
    rest = answer.parts["modes"] + answer.parts["box"]
    told = []
    for key in quantities(problem.scene):
        slopes = _slopes(problem, key)
        ours, other = (_elasticity(slopes, of, mean) for of, mean in zip((fine, coarse), means, strict=True))
        bias = abs(ours - other) + rest * (1.0 + abs(ours))
        value = float(getattr(getattr(problem.scene, key.partition(".")[0]), key.partition(".")[2]))
        told.append((key, value, unit_of(key), Value(ours, bias=bias, unknown=unknown)))
    told.sort(key=lambda row: -abs(row[3].value))
    seconds = time.perf_counter() - begin
    v2 = Value(means[0], bias=float(answer.error[0]), unknown=unknown)
    whole = estimate(Density.NAME, problem, v2, None, (), seconds)
    keys, values, units, elasticities = zip(*told, strict=True)
    notes = (note("elasticity_explained"),)
    return Sensitivity(
        Density.NAME, whole.mean_power, keys, values, units, elasticities, seconds, problem.physical, notes
    )


def quantities(scene: Scene) -> list[str]:
    """The keys of a scene that are quantities other than 0, whole."""
    return [
        f"{table}.{key}"
        for table, key, value in scene.values()
        if key_kind(table, key) is not None and isinstance(value, float | int) and value != 0.0
    ]


def _slopes(problem: Problem, key: str) -> dict[str, float]:
    """The derivatives with respect to ln(key) of every coefficient, and of "" the logarithm of P/E[V^2]."""
    table, _, name = key.partition(".")
    value = float(getattr(getattr(problem.scene, table), name))
    length = problem.scales.length

    def at(change: float) -> tuple[Equations, float]:
        scene = problem.scene.vary(key, value * (1.0 + change))
        units = scales(scene, length if problem.physical else None)
        eqs = equations_at(scene, units)
        watts = units.watts if problem.physical else 1.0
        return eqs, math.log(watts * (eqs.beta or 0.0) * (eqs.mu or 0.0))

    # A restitution of 1 may not become more: of one the coefficient itself is the key.
    if name in ("restitution", "opposite_restitution") or (table, name) == ("opposite_stop", "restitution"):
        coefficient = "opposite_restitution" if "opposite" in key else "restitution"
        return {coefficient: value}

    def differences(step: float) -> dict[str, float]:
        (more, log_more), (less, log_less) = at(step), at(-step)
        found = {
            field: (getattr(more, field) - getattr(less, field)) / (2.0 * step)
            for field, one in vars(problem.equations).items()
            if isinstance(one, float)
        }
        return found | {"": (log_more - log_less) / (2.0 * step)}

    wide, narrow = differences(STEP), differences(0.5 * STEP)
    return {field: (4.0 * narrow[field] - wide[field]) / 3.0 for field in wide}


def _elasticity(slopes: dict[str, float], of: dict[str, float], mean: float) -> float:
    """The elasticity d ln P/d ln key, from the changes of the coefficients and the gradient of E[V^2] in them."""
    return slopes.get("", 0.0) + math.fsum(slope * of[name] for name, slope in slopes.items() if name) / mean
