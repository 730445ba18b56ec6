"""Which tolerance matters: the fractions of the variance that each key brings, alone and with all others (Sobol).

    first_i = Var(E[y | x_i]) / Var(y)      total_i = E[Var(y | all but x_i)] / Var(y)

by Saltelli's and Jansen's estimators of SALib on many places of the response surface.  The surface
leaves a share ``unexplained`` of the variance; as least squares leave the part orthogonal to it,
each index is wrong by at most about that share, which is added to SALib's own 95 % interval.

An index is the cosine squared of the angle between y and a space of functions, in the inner product
of the covariance.  An error of y whose standard deviation is eps times that of y turns y by at most
asin(eps), so that the index S = cos^2 a lies between cos^2(a + asin eps) and cos^2(a - asin eps).
The larger distance of both from S is added as well.

For keys that are correlated the shares do not add up to the variance, and are not given.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.studies.tolerance.spreads import PartSpread

BASE = 8192  # places of each of the two designs that SALib combines


@dataclass(frozen=True)
class VarianceShares:
    """The first-order and total index of a key, without unit, with the half-widths of their 95 % intervals."""

    first: float
    total: float
    first_error95: float
    total_error95: float


def indices(
    function: Callable[[Floats], Floats],
    spreads: Sequence[PartSpread],
    unexplained: float = 0.0,
    seed: int = 0,
    error_ratio: float = 0.0,
) -> dict[str, VarianceShares]:
    """The indices of a function of the keys' values, (n, keys) -> (n,), for independent keys with these spreads.

    ``unexplained`` is the fraction of the variance that the function lacks, as a surface does, and
    ``error_ratio`` the standard deviation of the function's error over that of the function.
    Nothing if the function does not change.  Source: Saltelli et al., Comput. Phys. Commun. 181,
    2010; SALib (Herman and Usher, 2017).
    """
    from SALib.analyze import sobol as analysis  # which loads pandas
    from SALib.sample import sobol as sampling

    names = [spread.key for spread in spreads]
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    # it takes a seed of 0 for none
    u = sampling.sample(problem, BASE, calc_second_order=False, seed=seed + 1)
    y = function(np.stack([spread.at(u[:, k]) for k, spread in enumerate(spreads)], axis=1))
    if not np.ptp(y) > 0.0:
        return {}
    result = analysis.analyze(problem, y, calc_second_order=False, seed=seed + 1)
    columns = (
        result["S1"],
        result["ST"],
        result["S1_conf"] + unexplained + turned(result["S1"], error_ratio),
        result["ST_conf"] + unexplained + turned(result["ST"], error_ratio),
    )
    return {
        name: VarianceShares(*(float(column[k]) for column in columns))
        for k, name in enumerate(names)
    }


def turned(indices: Floats, error_ratio: float) -> Floats:
    """The largest change of each index, any shape, by an error of the function.

    ``error_ratio`` is the error's standard deviation over that of the function: 1 and more allows
    any index.
    """
    angle = np.arccos(np.sqrt(np.clip(indices, 0.0, 1.0)))
    turn = math.asin(min(error_ratio, 1.0))
    ends = np.stack(
        [np.maximum(angle - turn, 0.0), np.minimum(angle + turn, 0.5 * math.pi)], axis=0
    )
    return np.asarray(np.abs(np.cos(ends) ** 2 - np.cos(angle) ** 2).max(axis=0))
