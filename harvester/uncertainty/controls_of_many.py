"""Controls and extrapolation to a step of 0 for many sets of entries at a time.

A set is a scene: n of them have m entries each, and means, weights and errors are those that each
set has alone.  Values have the shape (n, m, quantities), controls (n, m, columns), and at several
steps both have these one after the other in front.
"""

import math

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.controls import ENTRIES_A_COLUMN
from harvester.uncertainty.richardson import bias_weights

# of the sum of squares of a column, added to it: columns that say the same share their weight
RIDGE = 1e-10


def means_and_errors(values: Floats) -> tuple[Floats, Floats]:
    """Mean and standard error over the entries: shapes (n, quantities)."""
    return values.mean(axis=1), values.std(axis=1, ddof=1) / math.sqrt(values.shape[1])


def controlled_entries_of_many(values: Floats, controls: Floats) -> Floats:
    """``values`` less the part that their controls explain; as they are if that gains nothing."""
    rest = _cross_fitted(values, controls)
    gains = rest.std(axis=1, keepdims=True) < values.std(axis=1, keepdims=True)
    return np.where(gains, rest, values)


def step_biases(values: Floats, controls: Floats, order: Floats) -> tuple[Floats, Floats]:
    """The bias at the shortest step, and its standard error: shapes (n, quantities).

    ``order`` is that of the bias, shape (n,).
    """
    weights = np.array([bias_weights(len(values), float(p)) for p in order])  # (n, parts, steps)
    mean, error = means_and_errors(_combined(weights.sum(axis=1), values, controls))
    if weights.shape[1] == 1:
        return mean, error
    parts = [
        _combined(weights[:, part], values, controls).mean(axis=1)
        for part in range(weights.shape[1])
    ]
    size = np.abs(np.array(parts)).sum(axis=0)
    return np.copysign(size, parts[0]), error


def _combined(weights: Floats, values: Floats, controls: Floats) -> Floats:
    """Entries of the sum of weighted values at all steps, by the better use of their controls.

    ``weights`` has the shape (n, steps).
    """
    each_weight = weights.T[:, :, None, None]
    whole = controlled_entries_of_many(
        (each_weight * values).sum(axis=0), np.concatenate([*controls], axis=-1)
    )
    each = np.array(
        [
            controlled_entries_of_many(value, control)
            for value, control in zip(values, controls, strict=True)
        ]
    )
    each = (each_weight * each).sum(axis=0)
    better = whole.std(axis=1, keepdims=True) < each.std(axis=1, keepdims=True)
    return np.where(better, whole, each)


def _cross_fitted(values: Floats, controls: Floats) -> Floats:
    """As `harvester.uncertainty.controls.cross_fitted`."""
    count = values.shape[1]
    halves = np.arange(count) // 2 % 2
    entries_a_half = int(min(halves.sum(), count - halves.sum()))
    spread = controls.std(axis=1)
    present = spread > 0.0
    used = present & (np.cumsum(present, axis=1) <= entries_a_half // ENTRIES_A_COLUMN)
    last = np.flatnonzero(used.any(axis=0))
    if not len(last):
        return values
    kept = slice(0, last[-1] + 1)
    used, spread = used[:, kept], spread[:, kept]
    columns = controls[:, :, kept] * np.where(used, 1.0 / np.where(used, spread, 1.0), 0.0)[:, None]
    rest = np.empty_like(values)
    ridge = np.where(used, RIDGE * count, 1.0)[:, :, None] * np.eye(used.shape[1])
    for half in (0, 1):
        other = columns[:, halves != half]
        other = other - other.mean(axis=1, keepdims=True)
        aside = values[:, halves != half]
        aside = aside - aside.mean(axis=1, keepdims=True)
        turned = other.transpose(0, 2, 1)
        weights = np.linalg.solve(turned @ other + ridge, turned @ aside)
        mine = halves == half
        rest[:, mine] = values[:, mine] - columns[:, mine] @ weights
    mean = rest.mean(axis=1, keepdims=True)
    left = 1.0 - used.sum(axis=1) / entries_a_half
    return np.asarray(mean + (rest - mean) / np.sqrt(left)[:, None, None])
