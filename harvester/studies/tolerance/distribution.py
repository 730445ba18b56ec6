"""Quantiles of samples, and the share of them that meets limits, both with intervals.

Quasi-random samples scatter less than random ones, for which the intervals hold: for a quantile the
order statistics between which it lies with 95 % (binomial), of a share Wilson's.  The ``error`` of
each value moves all of them up or down together: the intervals hold both ends.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.studies.tolerance.device_limits import Limit
from harvester.uncertainty.value import half95

QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)


@dataclass(frozen=True)
class ShareInterval:
    """A number and the ends of its 95 % interval, in one unit.

    None if samples are too few for an end.
    """

    value: float
    low: float | None
    high: float | None


def quantile(values: Floats, share: float, error: float | Floats = 0.0) -> ShareInterval:
    """The value that a ``share`` of the samples, shape (n,), is below; all in one unit."""
    from scipy.stats import binom

    count = len(values)
    low, high = binom.ppf([0.025, 0.975], count, share)
    # with 95 % the quantile lies between the samples of these ranks, if there are such
    least, most = (
        float(np.sort(values + side * error)[rank]) if 0 <= rank < count else None
        for rank, side in ((int(low) - 1, -1.0), (int(high), 1.0))
    )
    return ShareInterval(float(np.quantile(values, share)), low=least, high=most)


def wilson(met: float, count: int) -> tuple[float, float]:
    """The ends of the 95 % interval of a share, of which ``met`` of ``count`` were found (Wilson, 1927)."""
    share = met / count
    z2 = half95(1.0) ** 2
    middle = share + 0.5 * z2 / count
    width = np.sqrt(share * (1.0 - share) * z2 / count + 0.25 * (z2 / count) ** 2)
    ends = (middle + np.array([-width, width])) / (1.0 + z2 / count)
    return (0.0 if met == 0 else float(ends[0])), (1.0 if met == count else float(ends[1]))


def share_met(
    limits: Sequence[Limit],
    samples: Mapping[str, Floats],
    errors: Mapping[str, float | Floats],
    failed: int = 0,
    failed_share: tuple[float, float] | None = None,
) -> ShareInterval:
    """The fraction of devices that meet all limits.

    ``failed`` more have no answer, and count as not meeting them.

    ``samples`` are the values of each quantity, shape (n,), ``errors`` those of all samples or one
    by one, in the same unit.  ``failed_share`` is the interval of the fraction of devices without
    an answer, if these are not counted among all but among a few.
    """
    served = len(next(iter(samples.values())))
    count = served + failed

    def met(side: int) -> int:
        shifts = {limit: side * limit.sign * errors.get(limit.quantity, 0.0) for limit in limits}
        return int(
            np.all(
                [limit.met(samples[limit.quantity] + shifts[limit]) for limit in limits], axis=0
            ).sum()
        )

    value = met(0) / count
    if failed_share is None:
        return ShareInterval(value, wilson(met(-1), count)[0], wilson(met(1), count)[1])
    low = wilson(met(-1), served)[0] * (1.0 - failed_share[1])
    high = wilson(met(1), served)[1] * (1.0 - failed_share[0])
    return ShareInterval(value, min(low, value), max(high, value))
