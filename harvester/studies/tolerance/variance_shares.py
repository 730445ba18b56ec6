"""Which tolerance matters: the fractions of the variance that each key brings, alone and with all others (Sobol).

    first_i = Var(E[y | x_i]) / Var(y)      total_i = E[Var(y | all but x_i)] / Var(y)

by Saltelli's and Jansen's estimators of SALib on many places of the response surface.  The surface
leaves a share ``unexplained`` of the variance; as least squares leave the part orthogonal to it,
each index is wrong by at most about that share, which is added to SALib's own 95 % interval.  For
keys that are correlated the shares do not add up to the variance, and are not given.
"""

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
) -> dict[str, VarianceShares]:
    """The indices of a function of the keys' values, (n, keys) -> (n,), for independent keys with these spreads.

    ``unexplained`` is the fraction of the variance that the function lacks, as a surface does.
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
        result["S1_conf"] + unexplained,
        result["ST_conf"] + unexplained,
    )
    return {
        name: VarianceShares(*(float(column[k]) for column in columns))
        for k, name in enumerate(names)
    }
