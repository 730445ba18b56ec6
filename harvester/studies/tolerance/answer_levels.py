"""The level of judged answers over others, and the size and the origin of a law's error."""

from collections.abc import Sequence

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.studies.tolerance import curved_law
from harvester.studies.tolerance.curved_law import CurvedLaw
from harvester.studies.tolerance.first_order import error_of_sum
from harvester.uncertainty.value import one_more95


def size(law: CurvedLaw, x: Floats) -> float:
    """The value to which errors are relative: the middle's, or the mean of devices if that is 0."""
    return abs(law.value) or float(law(x).mean()) or 1.0


def code(law: CurvedLaw, n_sampled: int, is_checked: bool) -> str:
    """The code of the note on the law and on the origin of its error."""
    if not is_checked:
        return "curved_law_unchecked"
    if n_sampled < curved_law.FEWEST:
        return "curved_law_at_corners"
    return "curved_law" if law.rest is None else "curved_law_and_rest"


def values(answers: Sequence[Estimate], quantity: str) -> Floats:
    """A quantity of answers, shape (n,)."""
    return np.array([getattr(answer, quantity).value for answer in answers])


def law(ends: Floats, alone: Sequence[Estimate], quantity: str) -> CurvedLaw:
    """The law of a quantity through the answers of each key alone at its ``ends``."""
    errors = bend_errors(ends, alone, quantity)
    return curved_law.through_ends(ends, values(alone, quantity), errors)


def bend_errors(ends: Floats, alone: Sequence[Estimate], quantity: str) -> list[float]:
    """The standard errors of the curvatures of all keys."""
    pairs = zip(alone[1::2], alone[2::2], strict=True)
    return [
        error_of_sum((alone[0], *pair), curved_law.weights(ends, k), quantity)
        for k, pair in enumerate(pairs)
    ]


def level(pairs: Sequence[tuple[Estimate, Estimate]], quantity: str) -> tuple[float, float | None]:
    """The mean ratio of judged answers to the others, and its relative error (None: unknown)."""
    both = [(getattr(high, quantity), getattr(low, quantity)) for high, low in pairs]
    both = [(high, low) for high, low in both if low.value > 0.0 and high.value > 0.0]
    if not both:
        return 1.0, None
    ratios = np.array([high.value / low.value for high, low in both])
    errors = [None if high.error95 is None else high.error95 / high.value for high, _ in both]
    # another device differs by as much again, or by the error that the engine states for all
    model = both[0][1].model
    width = max((model or 0.0) / both[0][1].value, float(np.abs(ratios - 1.0).max()))
    if len(ratios) > 1:
        scatter = one_more95(ratios)
        width = scatter if model is None else min(scatter, width)
    known = [error for error in errors if error is not None]
    return float(ratios.mean()), None if not known else width + max(known)
