"""The load resistance of most mean power, by a formula: a coarse scan, then SciPy's bounded minimiser.

Both work on the logarithm of the resistance, of which the power is a smooth function.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.cheapest import formula
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

DECADES, EACH = 3, 6  # scanned to either side of the middle, points a decade
PRECISION = 2e-3  # of the resistance, relative: the power is flat there
NEAR = 0.95  # of the best power: the range of loads that is stated
NEARLY = 0.9  # of it: close enough to call a load near the best


@dataclass(frozen=True)
class BestLoad:
    """The best resistance (ohm) and its mean power (W).

    From ``low`` to ``high`` the power is at least `NEAR` of it.
    """

    resistance: float
    power: Value
    low: float
    high: float
    at_end: bool


def linear_best_load(problem: Problem) -> float:
    """The best resistance of a linear device under white noise, 1/(Cp w0 sqrt(1 + beta)) in ohm."""
    s = problem.scales
    return 1.0 / (s.capacitance * s.frequency * math.sqrt(1.0 + (problem.equations.beta or 0.0)))


def load_range(problem: Problem) -> tuple[float, float]:
    """The ends of a range of loads (ohm) that holds the best one, powers of ten."""
    decade = round(math.log10(linear_best_load(problem)))
    return 10.0 ** (decade - DECADES), 10.0 ** (decade + DECADES - 1.0)


def best_load(problem: Problem) -> BestLoad:
    """Search `DECADES` to either side of the best load of the linear device.

    Raises HarvesterError if the engine answers at no load, its first error.
    """
    step = math.log(10.0) / EACH
    scene = problem.scene
    middle = math.log(linear_best_load(problem))
    answers = _powers(
        scene, [middle + step * k for k in range(-DECADES * EACH, DECADES * EACH + 1)]
    )
    powers = {u: power for u, power in answers.items() if isinstance(power, Value)}
    if not powers:
        raise next(error for error in answers.values() if isinstance(error, HarvesterError))

    def loss(u: float) -> float:
        answer = _powers(scene, [u])[u]
        if isinstance(answer, Value):
            powers[u] = answer
        return -powers[u].value if u in powers else 0.0

    peak = max(powers, key=lambda u: powers[u].value)
    minimize_scalar(
        loss, bounds=(peak - step, peak + step), method="bounded", options={"xatol": PRECISION}
    )
    u = np.array(sorted(powers))
    share = np.array([powers[log_ohm].value for log_ohm in u])
    top = int(share.argmax())
    share /= share[top]
    low, high = (_crossing(u, share, top, way) for way in (-1, 1))
    return BestLoad(
        math.exp(u[top]), powers[u[top]], math.exp(low), math.exp(high), top in (0, len(u) - 1)
    )


def _crossing(u: Floats, share: Floats, top: int, way: int) -> float:
    """The point at which the fraction falls to `NEAR` on the way from the top, or the last point."""
    k = top
    while 0 <= k + way < len(u) and share[k + way] >= NEAR:
        k += way
    if not 0 <= k + way < len(u):
        return float(u[k])
    part = (share[k] - NEAR) / (share[k] - share[k + way])
    return float(u[k] + part * (u[k + way] - u[k]))


def _powers(scene: Scene, logarithms: Sequence[float]) -> dict[float, Value | HarvesterError]:
    """The mean power at each logarithm of a resistance, or the engine's error."""
    answers = formula(Problem(scene))().run_many([scene.with_load(math.exp(u)) for u in logarithms])
    return {
        float(u): answer.mean_power if isinstance(answer, Estimate) else answer
        for u, answer in zip(logarithms, answers, strict=True)
    }
