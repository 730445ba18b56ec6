"""The result of a search: peaks with intervals, or that the surface is flat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.presentation.diagnostic import Diagnostic
from harvester.studies.optimum.evaluations import Evaluation, served
from harvester.uncertainty.value import Value


@dataclass(frozen=True)
class Peak:
    """A place in the unit cube with a higher power than all places near it.

    ``low`` and ``high`` are the ends of its interval, None if absent, as ``why`` states;
    ``faces`` is of each key -1, 0 or 1: at the lower end of the range, inside, at the upper end;
    ``width`` the half-width of a box over which the power falls by a tenth or so, None if that is
    not known.
    """

    u: Floats
    power: Value
    faces: Floats
    low: Floats | None = None
    high: Floats | None = None
    width: Floats | None = None
    why: Diagnostic | None = None

    @classmethod
    def best_of(cls, points: Sequence[Evaluation], why: Diagnostic | None = None) -> "Peak":
        """The point of most power, on no face and without an interval.

        Raises the last error if all failed.
        """
        u, power, values = served(points)
        best = int(np.argmax(power))
        return cls(u[best], values[best], np.zeros(u.shape[1]), why=why)


@dataclass(frozen=True)
class SearchResult:
    """The peaks of a search, best first.

    ``flat`` states why no place is better than another, if that is so.

    ``scanned`` is False if the budget ended before the whole range was looked at: more power may
    lie anywhere.
    """

    peaks: tuple[Peak, ...]
    flat: Diagnostic | None = None
    warnings: tuple[Diagnostic, ...] = ()
    scanned: bool = True
