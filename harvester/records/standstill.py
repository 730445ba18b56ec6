"""Stretches of exactly equal values, as of a sensor that died or stuck.

Neighbours are equal by chance with the share p that they are elsewhere, as a coarse resolution
makes them.  In n rows L equal ones in a row are then expected n p^(L - 1) times: a stretch is one
that chance makes in none of a million.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats

SHORTEST = 20  # samples: a crest that is clipped is shorter
CHANCE = 1e-6
LEAST_SHARE = 0.05  # of equal neighbours, at least, which few rows do not show
FEWEST = 16  # samples of a part that lives


class Standstill(NamedTuple):
    """Stretches of a constant sensor: rows ``begin`` to ``end``, behind the last, of each."""

    stretches: tuple[tuple[int, int], ...]
    rows: int

    @property
    def samples(self) -> int:
        """The number of constant samples."""
        return sum(end - begin for begin, end in self.stretches)

    @property
    def share(self) -> float:
        """Their share of all samples."""
        return self.samples / self.rows

    @property
    def longest(self) -> tuple[int, int]:
        """The longest stretch."""
        return max(self.stretches, key=lambda stretch: stretch[1] - stretch[0])

    @property
    def living(self) -> tuple[int, int] | None:
        """The rows of the longest part between stretches; None if it has too few samples."""
        ends = [0, *(row for stretch in self.stretches for row in stretch), self.rows]
        parts = list(zip(ends[::2], ends[1::2], strict=True))
        best = max(parts, key=lambda part: part[1] - part[0])
        return best if best[1] - best[0] >= FEWEST else None

    def mask(self) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """True for samples that change, shape (rows,)."""
        lives = np.ones(self.rows, bool)
        for begin, end in self.stretches:
            lives[begin:end] = False
        return lives


def standstill(values: Floats) -> Standstill | None:
    """The stretches of values, shape (n,), of a constant sensor, else None.

    A missing value ends a stretch.
    """
    if len(values) < SHORTEST:
        return None
    equal = np.diff(values) == 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], equal.astype(int), [0]))))
    begins = edges[::2]
    lengths = edges[1::2] - begins + 1  # of rows
    long = lengths >= SHORTEST
    if not long.any():
        return None
    elsewhere = len(equal) - int((lengths[long] - 1).sum())
    share = int((lengths[~long] - 1).sum()) / max(elsewhere, 1)
    share = min(max(share, LEAST_SHARE), 1.0 - 1e-6)
    limit = 1.0 + math.log(CHANCE / len(values)) / math.log(share)
    stood = [
        (int(b), int(b + n))
        for b, n in zip(begins, lengths, strict=True)
        if n >= max(limit, SHORTEST)
    ]
    return Standstill(tuple(stood), len(values)) if stood else None
