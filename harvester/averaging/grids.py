"""Parameter grids: many scenes at once, their coefficients as columns of one `Equations`.

The formulas of this package broadcast: an amplitude array of shape (m, n) and coefficients of
shape (m, 1) serve m scenes.  Scenes share a grid when the same effects are present in all.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.scaling import Equations


def given(coefficient: float | None) -> Floats:
    """A coefficient, or 0 where its effect is absent."""
    return np.asarray(0.0 if coefficient is None else coefficient, dtype=np.float64)


def deeper(coefficient: float | None) -> Floats:
    """A coefficient with one more axis at its end, for arrays over the points of each orbit; 0 where absent."""
    return given(coefficient)[..., None]


def stacked(scenes: Sequence[Equations]) -> Equations:
    """Scenes of the same effects as one, each coefficient a column of shape (m, 1)."""
    columns: dict[str, Any] = {}
    for field in dataclasses.fields(Equations):
        values = [getattr(scene, field.name) for scene in scenes]
        columns[field.name] = None if values[0] is None else np.array(values, dtype=np.float64)[:, None]
    return Equations(**columns)


def alike(scenes: Sequence[Equations], most: int) -> list[list[int]]:
    """Places of the scenes that have the same effects, in groups of at most ``most``."""
    groups: dict[tuple[bool, ...], list[list[int]]] = {}
    for place, scene in enumerate(scenes):
        pattern = tuple(value is None for value in vars(scene).values())
        mine = groups.setdefault(pattern, [[]])
        if len(mine[-1]) == most:
            mine.append([])
        mine[-1].append(place)
    return [group for mine in groups.values() for group in mine]
