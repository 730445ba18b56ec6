"""How far the power balance of a sampled response closes, and what the step makes of that.

    N1 + N2 E[x^2] + 2 N12 E[x] + E[a x'] = E[f x'^2] + beta mu E[V^2] + what the stops took

(docs/theory.md), relative to the left-hand side.
"""

from typing import TYPE_CHECKING

import numpy as np

from harvester.equations.coefficients import Equations

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.richardson import RichardsonPair
    from harvester.mechanics.kernels.moments import Moments


def power_balance(moments: "Moments", eqs: Equations) -> tuple[float, float]:
    """Power in less power out over power in, and its standard error; zeros where nothing gives power."""
    from harvester.uncertainty.value import mean_and_error

    if not (eqs.is_shaken or eqs.is_random):
        return 0.0, 0.0
    with np.errstate(invalid="ignore", divide="ignore"):
        found = mean_and_error(moments.balance(eqs))
    return found if np.isfinite(found).all() else (0.0, 0.0)


def power_balance_bias(pair: "RichardsonPair", eqs: Equations) -> float:
    """Size of the step's part in the power balance: that of each of its terms, measured as those of the means, summed.

    Strong impacts make most of it, as a drift meets the stop at a speed that is off by order h^2.  No number of
    trajectories takes it away.  0 where nothing gives power.
    """
    if not (eqs.is_shaken or eqs.is_random):
        return 0.0
    n1, n2, n12 = eqs.n1 or 0.0, eqs.n2 or 0.0, eqs.n12 or 0.0
    gained = {"x2": n2, "x": 2.0 * n12, "driven": 1.0}
    lost = {"damped": 1.0, "V2": (eqs.beta or 0.0) * (eqs.mu or 0.0), "impact_loss": 1.0}
    power_in = n1 + sum(factor * pair.mean(name)[0] for name, factor in gained.items() if factor)
    terms = [*gained.items(), *((name, -factor) for name, factor in lost.items())]
    bias = sum(factor * pair.bias(name)[0] for name, factor in terms if factor)
    return abs(bias / power_in) if power_in else 0.0
