"""The largest value over a long time, extrapolated from the largest values of many short blocks.

The largest of a block of length B has the generalised extreme value distribution

    G(y) = exp(-(1 - k (y - m)/s)^(1/k)),

fitted by L-moments (Hosking, Wallis and Wood, Technometrics 27, 1985); the largest of a time T = n B stays below y with
the probability G(y)^n.  What is fitted are squares, y = a^2: of a narrow-band response they are energies, whose largest
values come to such a distribution soonest.  Blocks that are drawn anew give the error of sampling.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.value import Value, stderr_of95

RESAMPLED = 400


@dataclass(frozen=True)
class Tail:
    """Parameters of G of the squares, each of shape (draws,); the first is of all blocks, the others of redraws."""

    place: Floats
    scale: Floats
    shape: Floats

    def largest(self, share: float, blocks: float) -> Value:
        """The level that ``blocks`` blocks stay below with the probability ``share``, with its error of sampling."""
        x = -math.log(share) / blocks
        k = np.where(np.abs(self.shape) < 1e-9, 1e-9, self.shape)
        squares = self.place - self.scale / k * np.expm1(k * math.log(x))
        levels = np.sqrt(np.maximum(squares, 0.0))
        low, high = np.quantile(levels[1:], [0.025, 0.975])
        return Value(float(levels[0]), stderr=stderr_of95(0.5 * float(high - low)))


def fit(maxima: Floats, seed: int = 0) -> Tail:
    """The tail of blocks whose largest values are ``maxima``, shape (blocks,)."""
    rng, count = np.random.default_rng(seed), len(maxima)
    drawn = rng.integers(0, count, (RESAMPLED, count))
    y = np.sort(np.vstack([maxima, maxima[drawn]]) ** 2, axis=1)
    rank = np.arange(count)
    b0 = y.mean(axis=1)
    b1 = (y * rank / (count - 1)).mean(axis=1)
    b2 = (y * rank * (rank - 1) / ((count - 1) * (count - 2))).mean(axis=1)
    l2, skewness = 2.0 * b1 - b0, (6.0 * b2 - 6.0 * b1 + b0) / (2.0 * b1 - b0)
    c = 2.0 / (3.0 + skewness) - math.log(2.0) / math.log(3.0)
    k = 7.8590 * c + 2.9554 * c * c
    k = np.where(np.abs(k) < 1e-6, 1e-6, k)
    gamma = np.array([math.gamma(1.0 + one) for one in k])
    scale = l2 * k / ((1.0 - 2.0**-k) * gamma)
    return Tail(b0 - scale * (1.0 - gamma) / k, scale, k)
