"""The time-step bias, by Richardson extrapolation over several steps of the cheap model.

The cheap model of a scene is the ensemble: with the exact update of its load resistor, or with the
ideal circuit of its netlist.  The two steps of a pair run on the same noise, so that their
difference is known better than either mean.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.arrays import Floats
from harvester.engines.sampling import Model
from harvester.errors import SimulationError, UnboundedResponseError
from harvester.studies.work_precision.bias import Bias
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.ensemble.trajectories import Trajectories

STEP_FACTORS = (0.5, 1.0, 2.0)  # of the default step: the finer one of each pair
MOST = 0.5  # relative difference of two steps beyond which an expansion in the step says nothing


@dataclass(frozen=True)
class RichardsonLadder:
    """Richardson extrapolation of the cheap model over several steps.

    It is the fit E_h = E_0 (1 + c2 h^2 + c4 h^4), with the nondimensional step h.
    ``mean`` is E_0 of the moment that its power is made of, with its standard error,
    nondimensional; ``coefficients`` are (c2, c4) or, from one pair of steps, (c2), with their
    ``covariance``.
    """

    mean: Value
    coefficients: Floats
    covariance: Floats

    def at(self, h: float) -> Bias:
        """The bias of a step, (E_h - E_0)/E_0."""
        powers = _powers(h)[: len(self.coefficients)]
        return Bias(float(powers @ self.coefficients), math.sqrt(powers @ self.covariance @ powers))


def _powers(h: Any) -> Floats:
    return np.stack([np.asarray(h) ** 2, np.asarray(h) ** 4], axis=-1)


def richardson_ladder(
    model: Model, h: float, trajectories: int, seed: int, seconds: float
) -> RichardsonLadder:
    """Extrapolate the cheap model to a step of zero from several pairs of steps.

    The scheme is of second order (Kloeden and Platen, section 14.2).  Each of the pairs (h/2, h),
    (h, 2h), (2h, 4h) runs on one noise, and the least squares of their differences, weighed with
    their errors, give c2 and c4; if the differences lie further from the fit than their errors
    allow, the covariance is made larger in proportion.  Steps that are unstable are left out.

    Raises UnboundedResponseError if even the finest pair is unstable.
    """
    from harvester.mechanics.ensemble.trajectories import Trajectories

    pairs: list[tuple[float, Value, tuple[float, float]]] = []
    for k, factor in enumerate(STEP_FACTORS):
        noise = np.random.SeedSequence([seed, k])
        ensemble = Trajectories(model.eqs, trajectories, noise, factor * h, circuit=model.circuit)
        try:
            pair = _long_pair(ensemble, seconds / len(STEP_FACTORS))
        except UnboundedResponseError:
            break
        with np.errstate(over="ignore", invalid="ignore"):
            average, stderr = pair.mean(model.name)
            mean = Value(average, stderr)
            third, error = pair.bias(model.name)
        if pair.coarse_is_stopped or not abs(3.0 * third) < MOST * abs(
            mean.value
        ):  # twice the step is unstable
            break
        pairs.append((ensemble.h, mean, (3.0 * third, 3.0 * error)))
    if not pairs:
        raise UnboundedResponseError(
            f"the response grows without bound at a step of {h:g}/w0 and below"
        )
    steps, means, differences = zip(*pairs, strict=True)
    return fit_ladder(np.array(steps), means, np.array(differences))


def fit_ladder(h: Floats, means: Sequence[Value], differences: Floats) -> RichardsonLadder:
    """Fit the ladder to the means at steps h, and the differences to twice the step with their errors, shape (n, 2)."""
    scale = abs(means[0].value)
    y, error = differences.T / scale
    terms = (_powers(2.0 * h) - _powers(h))[:, : min(len(h), 2)]
    normal = (terms / error[:, None] ** 2).T
    covariance = np.linalg.inv(normal @ terms)
    coefficients = covariance @ normal @ y
    if len(y) > len(coefficients):
        excess = (((y - terms @ coefficients) / error) ** 2).sum() / (len(y) - len(coefficients))
        covariance *= max(excess, 1.0)
    # relative to the mean at the finest step
    rough = RichardsonLadder(means[0], coefficients, covariance)
    zero = [_less(mean, rough.at(step), scale) for mean, step in zip(means, h, strict=True)]
    weights = np.array([1.0 / (value.stderr or 0.0) ** 2 for value in zero])
    mean = Value(
        float(weights @ [value.value for value in zero] / weights.sum()),
        float(weights.sum() ** -0.5),
    )
    ratio = scale / mean.value
    return RichardsonLadder(mean, ratio * coefficients, ratio**2 * covariance)


def _less(mean: Value, bias: Bias, scale: float) -> Value:
    """A mean less its bias, which is given in units of ``scale``."""
    return Value(
        mean.value - scale * bias.value, math.hypot(mean.stderr or 0.0, scale * bias.stderr)
    )


def _long_pair(ensemble: "Trajectories", seconds: float) -> "RichardsonPair":
    """A pair of steps over as long a time as ``seconds`` allow, and at least the burn-in's."""
    from harvester.mechanics.ensemble.burn_in import burn_in
    from harvester.mechanics.ensemble.richardson import RichardsonPair

    begin = time.perf_counter()
    burn_in(ensemble)
    if ensemble.hopping is not None:
        raise SimulationError(
            "transitions between the wells are too rare for a reference of `cost`: give more noise"
        )
    pair = RichardsonPair(ensemble, ensemble.time)
    spent = time.perf_counter() - begin  # on twice the burn-in at this step, and at twice the step
    if seconds > spent:
        pair.extend(pair.duration * 2.0 * (seconds / spent - 1.0))
    return pair
