"""How the answers of a dearer engine compare with those of a cheap one at a few samples, in dependence of the keys.

The ratios r of K samples are represented by a plane over the keys if that predicts a sample that
is left out better than the mean of the others does, as a bias may grow along a key.
The relative error of a sample at 95 % is

    off = t s + (the dearer engine's own bias)

with s the root mean square of the errors of leaving a sample out, t
Student's quantile of K less the coefficients.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import Engine
from harvester.errors import InputError
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.studies.sweep.sweep_table import SweepTable

LEAST_SPARE = 2  # samples beyond the coefficients of a plane


def column(table: SweepTable, name: str) -> Floats:
    """A column of all rows as numbers, in the order of the points; nan if absent."""
    return np.array(
        [math.nan if cell is None else cell for cell in table.table.plain()[name]], dtype=np.float64
    )


@dataclass(frozen=True)
class Plane:
    """A ratio over the keys' values, c_0 + sum_j c_j z_j with z = (x - middle)/half; c_0 alone is a mean.

    ``scatter`` is the root mean square of the errors of leaving a sample out, ``share`` the variance
    of the coefficients' part, in that of a sample's ratio.
    """

    middle: Floats
    half: Floats
    coefficients: Floats
    scatter: float
    count: int

    def __call__(self, x: Floats) -> Floats:
        """The ratio at keys' values, shape (m, keys)."""
        scaled = (x - self.middle) / self.half
        rows = np.column_stack([np.ones(len(scaled)), scaled])
        return np.asarray(rows[:, : len(self.coefficients)] @ self.coefficients)

    @property
    def share(self) -> float:
        """Coefficients over samples."""
        return len(self.coefficients) / self.count

    @property
    def width95(self) -> float:
        """The half-width of a sample's difference, at 95 %."""
        from scipy.special import stdtrit

        return float(stdtrit(self.count - len(self.coefficients), 0.975)) * self.scatter


def plane(x: Floats, ratios: Floats) -> Plane:
    """The plane through ratios, shape (K,), at keys' values x, (K, keys), or their mean, whichever predicts better."""
    half = 0.5 * np.ptp(x, axis=0)
    half = np.where(half > 0.0, half, 1.0)
    middle = 0.5 * (x.max(axis=0) + x.min(axis=0))
    rows = np.column_stack([np.ones(len(x)), (x - middle) / half])
    best = _fitted(middle, half, rows[:, :1], ratios)
    if len(x) >= rows.shape[1] + LEAST_SPARE:
        tilted = _fitted(middle, half, rows, ratios)
        best = min(best, tilted, key=lambda fit: fit.width95)
    return best


def _fitted(middle: Floats, half: Floats, rows: Floats, ratios: Floats) -> Plane:
    """Least squares, and the errors of leaving one out."""
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    coefficients = (
        right.T @ ((left.T @ ratios) / sizes) if sizes[-1] > 0.0 else np.zeros(len(sizes))
    )
    leverage = np.minimum((left**2).sum(axis=1), 1.0 - 1e-9)
    errors = (ratios - rows @ coefficients) / (1.0 - leverage)
    return Plane(middle, half, coefficients, float(np.sqrt(np.mean(errors**2))), len(ratios))


@dataclass(frozen=True)
class Ratio:
    """How the answers of a dearer engine compare: ``planes`` and relative error ``off`` of each quantity."""

    planes: dict[str, Plane]
    off: dict[str, float]
    check: Diagnostic


def compared(
    x: Floats, cheap: SweepTable, dearer: SweepTable, names: Sequence[str], by: str, engine: Engine
) -> Ratio:
    """Compare rows at keys' values ``x``, (K, keys), of a cheap table by an ``engine`` with those of a ``dearer`` one.

    Raises InputError if fewer than two of them have an answer by both.
    """
    planes: dict[str, Plane] = {}
    off: dict[str, float] = {}
    bias = column(dearer, "mean_power_bias") / np.abs(column(dearer, "mean_power"))
    for name in names:
        ratios = column(dearer, name) / column(cheap, name)
        good = np.isfinite(ratios)
        if (count := int(good.sum())) < 2:
            raise InputError(
                f"`checks` must be more: {by!r} answered at {count} of {len(x)} samples"
            )
        planes[name] = plane(x[good], ratios[good])
        off[name] = planes[name].width95 + float(np.median(np.nan_to_num(bias)[good]))
    power = planes[names[0]]
    check = note(
        "checked_by_runs",
        runs=power.count,
        by=by,
        ratio=float(power.coefficients[0]),
        engine=engine.NAME,
    )
    return Ratio(planes, off, check)
