"""The same noise, another model: the difference of a mean, and the largest difference at 95 %.

    E[high] - E[low] = E[high - low],   each entry of one on the noise of the other's entry

An expensive model judges a cheap one by few entries, because those of both move together.  The
largest difference is its size and the half-width of its 95 % interval together
(`harvester.uncertainty.value.Value.largest95`): a reference that saw little does not acquit.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.value import Value, mean_and_error

Job = TypeVar("Job")
Row = TypeVar("Row")
Judgement = TypeVar("Judgement")
# independent pairs: with fewer the sampling error is known too badly to judge
FEWEST = 4
ONE_PAIR = "the sampling of one pair of runs"  # as `Value.unknown`


def difference95(
    high: Floats,
    low: Floats,
    controls: tuple[Floats | None, Floats | None] = (None, None),
    together: int = 1,
    random: bool = True,
) -> Value:
    """E[high] - E[low] with its sampling error, which is unknown of a single pair.

    Parameters
    ----------
    high, low
        Entries, shape (n,) each; if ``low`` has more, its first ones are the pairs.
    controls
        Control variates of both, shape (n, columns) each: they correct the difference, or each mean
        by itself, whichever leaves the smaller spread.
    together
        Number of consecutive entries on one record: their mean is one independent entry.
    random
        False for entries that are alike for all noise, so that one pair has the whole difference.

    Notes
    -----
    Degrees of freedom are those of the independent entries, n/together - 1.
    """
    low = low[: len(high)]
    ways = [controlled_entries(high - low, None, together)]
    of_high, of_low = controls
    if of_high is not None and of_low is not None:
        of_low = of_low[: len(high)]
        ways = [
            controlled_entries(high - low, of_high - of_low, together),
            controlled_entries(high, of_high, together) - controlled_entries(low, of_low, together),
        ]
    entries = min(ways, key=np.std)
    if len(entries) == 1:
        return Value(float(entries[0]), unknown=ONE_PAIR if random else "")
    return Value(*mean_and_error(entries), dof=len(entries) - 1.0)


def share95(difference: Value, size: float) -> float:
    """The largest difference at 95 % over a ``size`` above 0.

    Infinite if its error is not known.
    """
    return math.inf if difference.unknown else difference.largest95 / size


def enough_entries(count: int, together: int) -> int:
    """So many entries, and at least those of `FEWEST` records if consecutive ones share a record."""
    return count if together == 1 else max(count, FEWEST * together)


def half_if_enough(
    jobs: Sequence[Job],
    run: Callable[[Sequence[Job]], Iterable[Row]],
    judge: Callable[[list[Row]], Judgement],
    enough: Callable[[Judgement], bool],
) -> Judgement:
    """The judgement of half of the ``jobs`` if that is ``enough``, else of all of them."""
    half = (len(jobs) + 1) // 2
    rows = list(run(jobs[:half]))
    judgement = judge(rows)
    if half == len(jobs) or enough(judgement):
        return judgement
    return judge([*rows, *run(jobs[half:])])
