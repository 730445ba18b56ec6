"""An expensive mean from few runs, with a cheap model of the same thing on the same noise as control variate.

    E[high] = E[high - a low] + a E[low]

The first mean comes from a few pairs that share their noise, the second from a long run of the
cheap model alone.  With a fixed weight a the sum has no bias, however poor the cheap model is;
its quality decides the variance.  (Peherstorfer, Willcox and Gunzburger, SIAM J. Sci. Comput.
38, A3163, 2016.)
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.uncertainty.controls import cross_fitted
from harvester.uncertainty.value import Value, mean_and_error

# times less variance must remain, for entries to weigh what weights from elsewhere explain
WORTH = 2.0
# runs go on until their spread is small enough: where they end, it is smaller than it should be
LUCK = 2.0


@dataclass(frozen=True)
class Controlled:
    """The estimate, and the numbers that decide how the effort is best split.

    ``residual`` is the variance of one pair's high - a low, ``weight`` the mean a, ``correlation``
    that of the pairs.
    """

    value: Value
    residual: float
    weight: float
    correlation: float

    def gain(self, cost_ratio: float) -> float:
        """How many times cheaper than high runs alone, at the same standard error, with the best split.

        1/(sqrt(1 - rho^2) + sqrt(rho^2 w))^2, w the cost of a low run over that of a high one.
        """
        unexplained = max(1.0 - self.correlation**2, 0.0)
        return 1.0 / (math.sqrt(unexplained) + math.sqrt((1.0 - unexplained) * cost_ratio)) ** 2


def controlled(
    high: Floats, low: Floats, mean: Value, controls: Floats | None = None, together: int = 1
) -> Controlled:
    """The estimate of E[high] from pairs, shape (n,) each, n >= 8, and an independent ``mean`` of low.

    Each half of the pairs uses the weight that the other half determines (least squares), so that
    it is independent of the entries it weighs: no bias.  ``controls`` of mean zero, shape (n,
    columns), are weighed next to low; ``together`` consecutive entries are of one trajectory
    (`harvester.uncertainty.controls`).
    """
    off = (low - mean.value)[:, None]
    rest, weights = cross_fitted(
        high, off if controls is None else np.hstack([off, controls]), together
    )
    rest = rest.reshape(-1, together).mean(axis=1)
    residual = float(rest.var(ddof=1))
    weight = float(weights[:, 0].mean())
    errors = np.array([math.sqrt(residual / len(rest)), abs(weight) * (mean.stderr or 0.0)])
    value = Value(
        float(rest.mean()),
        float(math.hypot(*errors)),
        mean.bias,
        dof=_degrees_of_freedom(errors, (len(rest) - 2.0, mean.dof or 1e6)),
    )
    both = low.std() > 0.0 and high.std() > 0.0
    return Controlled(value, residual, weight, float(np.corrcoef(high, low)[0, 1]) if both else 0.0)


def differing(high: Floats, low: Floats, mean: Value, missing: float) -> Controlled:
    """The ``mean`` of low and the mean of high - low, of pairs too short for the whole difference.

        E[high] = E[low] + E[high - low]

    They begin in the law of low.  The relative difference that they may be ``missing`` is a part of the bias.
    """
    off, stderr = mean_and_error(high - low)
    errors = np.array([stderr, mean.stderr or 0.0])
    dof = _degrees_of_freedom(errors, (len(high) - 1.0, mean.dof or 1e6))
    bias = None if mean.bias is None else mean.bias + missing * abs(mean.value)
    value = Value(mean.value + off, float(math.hypot(*errors)), bias, dof=dof)
    return Controlled(
        value, float((high - low).var(ddof=1)), 1.0, float(np.corrcoef(high, low)[0, 1])
    )


def explained_and_controlled(
    high: Floats, low: Floats, mean: Value, explained: Floats, together: int = 1
) -> Controlled:
    """As `controlled`, with controls of mean zero that explain ``high`` by weights from elsewhere, shape (n,).

        E[high] = E[high - explained - a low] + a E[low]

    It is subtracted unchanged: few entries cannot distinguish it from low, and would weigh both
    badly (eight runs of a bridge with a stop that doubles the variance).  It is weighed by the
    entries only if `WORTH` asks for it.  The variance is stated 1 + `LUCK`/trajectories times as large
    as these show it.
    """
    fitted = controlled(high, low, mean, explained[:, None], together)
    whole = controlled(high - explained, low, mean, None, together)
    whole = fitted if WORTH * fitted.residual < whole.residual else whole
    more = 1.0 + LUCK * together / len(high)
    value = replace(whole.value, stderr=(whole.value.stderr or 0.0) * math.sqrt(more))
    return Controlled(value, whole.residual * more, whole.weight, fitted.correlation)


def split(
    variance: float, residual: float, pair_cost: float, spread: float, time_cost: float
) -> tuple[float, float]:
    """(pairs n, time T of the cheap model) with residual/n + spread/T = ``variance`` at the least cost.

    n = sqrt(residual/pair_cost) q, T = sqrt(spread/time_cost) q,
    q = (sqrt(residual pair_cost) + sqrt(spread time_cost))/variance.
    """
    if variance <= 0.0:
        return math.inf, math.inf
    q = (math.sqrt(residual * pair_cost) + math.sqrt(spread * time_cost)) / variance
    return math.sqrt(residual / pair_cost) * q, math.sqrt(spread / time_cost) * q


def _degrees_of_freedom(errors: Floats, dofs: tuple[float, float]) -> float:
    """Degrees of freedom of a sum of independent errors (Welch and Satterthwaite)."""
    parts = sum(error**4 / dof for error, dof in zip(errors, dofs, strict=True))
    return float((errors**2).sum()) ** 2 / parts if parts > 0.0 else 1e6
