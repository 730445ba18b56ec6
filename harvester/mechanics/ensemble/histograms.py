"""Probability densities of many trajectories, counted in compiled code, with their standard errors."""

from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.mechanics.kernels.compiled import kernel


@dataclass(frozen=True)
class HistogramDensity:
    """A probability density by its means over bins of equal width.

    ``edges`` has shape (n + 1,).  ``entries`` has shape (m, n): one density from each of m independent
    groups of trajectories.  A value outside the edges counts as probability, but in no bin.
    """

    edges: Floats
    entries: Floats

    @property
    def centres(self) -> Floats:
        """Centres of the bins, shape (n,)."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))

    @property
    def value(self) -> Floats:
        """Density in each bin, shape (n,)."""
        return np.asarray(self.entries.mean(axis=0))

    @property
    def stderr(self) -> Floats:
        """Standard error of `value`, shape (n,); infinite for one group."""
        groups = len(self.entries)
        if groups < 2:
            return np.full(self.entries.shape[1], np.inf)
        return np.asarray(self.entries.std(axis=0, ddof=1) / np.sqrt(groups))


@kernel
def _count(values, low, per_unit, counts):  # type: ignore[no-untyped-def]
    """Add the values of each row, shape (m, k), to that row's counts, shape (m, n)."""
    bins = counts.shape[1]
    for row in range(values.shape[0]):
        for value in values[row]:
            bin_of = (value - low) * per_unit
            if 0.0 <= bin_of < bins:
                counts[row, int(bin_of)] += 1.0


class Histogram:
    """Counts in bins of equal width between the first and the last of ``edges``, for m groups of trajectories.

    Groups are independent, so that the density's errors need no correlation time.
    """

    def __init__(self, edges: Floats, groups: int) -> None:
        self.edges = np.linspace(edges[0], edges[-1], len(edges))
        self.counts = np.zeros((groups, len(edges) - 1))
        self.values_a_group = 0

    def add(self, values: Floats) -> None:
        """Count values, shape (m k,): k of each group, the groups one after the other."""
        rows = np.ascontiguousarray(values.reshape(len(self.counts), -1))
        _count(
            rows,
            self.edges[0],
            self.counts.shape[1] / (self.edges[-1] - self.edges[0]),
            self.counts,
        )
        self.values_a_group += rows.shape[1]

    def density(self) -> HistogramDensity:
        """The density of all values so far: counts over the number of values and the bins' width."""
        return HistogramDensity(
            self.edges, self.counts / (self.values_a_group * (self.edges[1] - self.edges[0]))
        )
