"""The largest value over a long time, extrapolated from those of the short blocks of a trajectory."""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.value import Value, stderr_of95

RESAMPLED = 400
FEW = 60  # blocks with an impact, at least
SHAPE = 0.2  # of the size, for each e-fold beyond what was counted


@dataclass(frozen=True)
class RareTail:
    """The largest value over a long time of a quantity that many blocks lack, such as the speed of rare impacts.

    Clusters of impacts beyond a threshold are a Poisson process of ``rate`` in a block, and the
    squares of their speeds exceed it by an exponential variate of the mean ``size``, as energies
    beyond a high level of a narrow-band response do.  The largest square in n blocks has the
    distribution

        P(threshold + y) = exp(-n rate exp(-y/size)),   y >= 0,

    so that a block without an impact counts for the rate, not for the speeds.  Shapes as in `Tail`.
    """

    threshold: float
    rate: Floats
    size: Floats
    counted: int

    def largest(self, share: float, blocks: float) -> Value:
        """The level that ``blocks`` blocks stay below with the probability ``share``, with its errors.

        Beyond the energies that were counted the law may have another shape: for each further
        e-fold `SHAPE` of the size is the model error.
        """
        folds = np.maximum(np.log(self.rate * blocks / -math.log(share)), 0.0)
        levels = np.sqrt(self.threshold + self.size * folds)
        low, high = np.quantile(levels[1:], [0.025, 0.975])
        square_error = (
            max(float(folds[0]) - math.log(self.counted), 0.0) * SHAPE * float(self.size[0])
        )
        return Value(
            float(levels[0]),
            stderr=stderr_of95(0.5 * float(high - low)),
            model=0.5 * square_error / float(levels[0]),
        )


def rare(maxima: Floats, seed: int = 0) -> RareTail | None:
    """The tail of blocks of which many have 0, by maximum likelihood; None if fewer than `FEW` have another.

    The threshold is the median without zeros.  For a size the likeliest rate is (blocks beyond the
    threshold)/(sum of exp(-y/size) over all), with y = 0 below it.
    """
    from scipy.optimize import minimize_scalar

    squares = maxima**2
    if np.count_nonzero(squares) < FEW:
        return None
    threshold = float(np.median(squares[squares > 0.0]))
    rng = np.random.default_rng(seed)
    count = len(maxima)
    fits = []
    for drawn in (np.arange(count), *rng.integers(0, count, (RESAMPLED // 4, count))):
        y = np.maximum(squares[drawn] - threshold, 0.0)
        hit = int(np.count_nonzero(y))
        total = float(y.sum())
        if not hit:
            continue

        def misfit(log_size: float, y: Floats = y, hit: int = hit, total: float = total) -> float:
            size = math.exp(log_size)
            return float(hit * (log_size + math.log(np.exp(-y / size).sum())) + total / size)

        mean = math.log(total / hit)
        size = math.exp(float(minimize_scalar(misfit, (mean - 0.3, mean)).x))
        fits.append((hit / np.exp(-y / size).sum(), size))
    rates, sizes = np.array(fits).T
    return RareTail(threshold, rates, sizes, int(np.count_nonzero(squares > threshold)))


@dataclass(frozen=True)
class Tail:
    """The largest value over a long time, extrapolated from the largest values of many short blocks.

    The largest of a block of length B has the generalised extreme value distribution

        G(y) = exp(-(1 - k (y - m)/s)^(1/k)),

    fitted by L-moments (Hosking, Wallis and Wood, Technometrics 27, 1985); the largest of a time T
    = n B stays below y with the probability G(y)^n.  Squares are fitted, y = a^2: for a narrow-band
    response they are energies, whose largest values come to such a distribution soonest.  Blocks
    that are drawn anew give the sampling error: the parameters have the shape (draws,), of which
    the first is of all blocks, the others of redraws.
    """

    location: Floats
    scale: Floats
    shape: Floats

    def largest(self, share: float, blocks: float) -> Value:
        """The level that ``blocks`` blocks stay below with the probability ``share``, with its sampling error."""
        x = -math.log(share) / blocks
        k = np.where(np.abs(self.shape) < 1e-9, 1e-9, self.shape)
        squares = self.location - self.scale / k * np.expm1(k * math.log(x))
        levels = np.sqrt(np.maximum(squares, 0.0))
        low, high = np.quantile(levels[1:], [0.025, 0.975])
        return Value(float(levels[0]), stderr=stderr_of95(0.5 * float(high - low)))


def fit(maxima: Floats, seed: int = 0) -> Tail:
    """The tail of blocks whose largest values are ``maxima``, shape (blocks,)."""
    rng = np.random.default_rng(seed)
    count = len(maxima)
    y = np.sort(
        np.vstack([maxima, maxima[rng.integers(0, count, (RESAMPLED, count))]]) ** 2, axis=1
    )
    rank = np.arange(count)
    b0 = y.mean(axis=1)
    b1 = (y * rank / (count - 1)).mean(axis=1)
    b2 = (y * rank * (rank - 1) / ((count - 1) * (count - 2))).mean(axis=1)
    l2 = 2.0 * b1 - b0
    skewness = (6.0 * b2 - 6.0 * b1 + b0) / (2.0 * b1 - b0)
    c = 2.0 / (3.0 + skewness) - math.log(2.0) / math.log(3.0)
    k = 7.8590 * c + 2.9554 * c * c
    k = np.where(np.abs(k) < 1e-6, 1e-6, k)
    gamma = np.array([math.gamma(1.0 + shape) for shape in k])
    scale = l2 * k / ((1.0 - 2.0**-k) * gamma)
    return Tail(b0 - scale * (1.0 - gamma) / k, scale, k)
