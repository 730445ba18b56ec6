"""The load resistance of most mean power, by engine `averaged`: a scan by ratio, then finer about its best point."""

import math
from dataclasses import dataclass

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines import Averaged
from harvester.errors import HarvesterError
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

DECADES, EACH, FINER, ROUNDS = 3, 6, 7, 3  # to either side of the middle, points of a decade, of a round
NEAR = 0.95  # of the best power: close enough to call it near


@dataclass(frozen=True)
class BestLoad:
    """Resistance (ohm) and mean power (W) of the best; between ``low`` and ``high`` at least `NEAR` of it is had."""

    resistance: float
    power: Value
    low: float
    high: float
    at_end: bool


def best_load(scene: Scene, middle: float) -> BestLoad:
    """About ``middle`` ohm; raises HarvesterError where the engine answers nowhere, its last error."""
    u = np.linspace(-DECADES, DECADES, 2 * DECADES * EACH + 1)
    found = _scan(scene, middle * 10.0**u)
    step = 1.0 / EACH
    for _ in range(ROUNDS):
        best = max(found, key=lambda r: found[r].value)
        found |= _scan(scene, best * 10.0 ** np.linspace(-step, step, FINER))
        step *= 2.0 / (FINER - 1)
    r = np.array(sorted(found))
    share = np.array([found[one].value for one in r])
    top = int(share.argmax())
    share /= share[top]
    low, high = (_crossing(np.log(r), share, top, way) for way in (-1, 1))
    return BestLoad(float(r[top]), found[r[top]], math.exp(low), math.exp(high), top in (0, len(r) - 1))


def _crossing(u: Floats, share: Floats, top: int, way: int) -> float:
    """Where the share falls to `NEAR` on the way from the top, or the last point."""
    k = top
    while 0 <= k + way < len(u) and share[k + way] >= NEAR:
        k += way
    if not 0 <= k + way < len(u):
        return float(u[k])
    part = (share[k] - NEAR) / (share[k] - share[k + way])
    return float(u[k] + part * (u[k + way] - u[k]))


def _scan(scene: Scene, resistances: Floats) -> dict[float, Value]:
    answers = Averaged().run_many([scene.with_load(float(one)) for one in resistances])
    found = {
        float(one): answer.mean_power
        for one, answer in zip(resistances, answers, strict=True)
        if isinstance(answer, Estimate)
    }
    if not found:
        raise next(answer for answer in answers if isinstance(answer, HarvesterError))
    return found
