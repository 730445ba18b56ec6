"""Parameter grids: many scenes at once, their coefficients as columns of one `Equations`.

The formulas of this package broadcast: an amplitude array of shape (m, n) and coefficients of
shape (m, 1) hold m scenes.  Scenes share a grid when the same effects are present in all.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError

T = TypeVar("T")
KEPT = 12.0, 18.0  # amplitudes less likely than e^-12, e^-18 of the likeliest are left out
SEARCH = (161, 41, 41, 41)  # points of the grids on which two-scale averaging looks for the others


def or_zero(coefficient: float | None) -> Floats:
    """A coefficient, or 0 if its effect is absent."""
    return np.asarray(0.0 if coefficient is None else coefficient, dtype=np.float64)


def or_zero_by_point(coefficient: float | None) -> Floats:
    """A coefficient with one more axis at its end, for arrays over the points of each orbit.

    0 if absent.
    """
    return or_zero(coefficient)[..., None]


def stacked(scenes: Sequence[Equations]) -> Equations:
    """Scenes of the same effects as one, each coefficient a column of shape (m, 1)."""
    columns: dict[str, Any] = {}
    for field in dataclasses.fields(Equations):
        values = [getattr(scene, field.name) for scene in scenes]
        columns[field.name] = (
            None if values[0] is None else np.array(values, dtype=np.float64)[:, None]
        )
    return Equations(**columns)


def groups_of_same_effects(scenes: Sequence[Equations], most: int) -> list[list[int]]:
    """Places of the scenes that have the same effects, in groups of at most ``most``."""
    groups: dict[tuple[bool, ...], list[list[int]]] = {}
    for index, scene in enumerate(scenes):
        pattern = tuple(value is None for value in vars(scene).values())
        mine = groups.setdefault(pattern, [[]])
        if len(mine[-1]) == most:
            mine.append([])
        mine[-1].append(index)
    return [group for mine in groups.values() for group in mine]


def noisy_stacks(
    scenes: Sequence[Equations],
    most: int,
    solve: Callable[[list[Equations]], list[T | SimulationError]],
    without_noise: str,
) -> list[T | SimulationError]:
    """Apply ``solve`` to groups of scenes of the same effects.

    The answers are in the order of the scenes.

    A scene without external noise has no stationary law: the error ``without_noise``.
    """
    answers: list[T | SimulationError] = [SimulationError(without_noise) for _ in scenes]
    noisy = [index for index, eqs in enumerate(scenes) if eqs.n1 is not None]
    for group in groups_of_same_effects([scenes[index] for index in noisy], most):
        members = [noisy[k] for k in group]
        with np.errstate(all="ignore"):  # amplitudes of no weight may overflow
            for index, answer in zip(
                members, solve([scenes[index] for index in members]), strict=True
            ):
                answers[index] = answer
    return answers


def where_the_mass_is(
    ends: tuple[Floats, Floats],
    counts: Sequence[int],
    log_mass: Callable[[Floats], Floats],
    kept: tuple[float, float],
) -> tuple[Floats, Floats, Any]:
    """Zoom in, from two ``ends`` of shape (scenes,), to the points with a law above e^-``kept`` of its peak.

    ``log_mass`` is the law's logarithm on a grid of shape (scenes, n), for each n of ``counts``.  Each end is one point
    further out; the third array names which scenes have no upper end.
    """
    (low, high) = ends
    rows = np.arange(len(ends[0]))
    unbounded = np.zeros(len(rows), dtype=bool)
    for count in counts:
        u = np.linspace(low, high, count, axis=-1)
        log_p = log_mass(u)
        log_p = np.where(np.isnan(log_p), -np.inf, log_p)
        depth = log_p.max(axis=-1, keepdims=True) - log_p
        top = count - 1
        first = (depth <= kept[0]).argmax(axis=-1)
        last = top - (depth <= kept[1])[:, ::-1].argmax(axis=-1)
        unbounded |= (last == top) & (high >= ends[1])
        low = u[rows, np.maximum(first - 1, 0)]
        high = u[rows, np.minimum(last + 1, top)]
    return low, high, unbounded
